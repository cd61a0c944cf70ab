"""Closed-form equations of motion of bundled models with one degree of freedom, for other integrators."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from trunnion.analysis.work_precision.measurement_points import FrictionVariant
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.mass_properties import mass_properties


class ClosedFormEquation:
    """The equation of motion of a mechanism with one degree of freedom. start: y = [coordinate (rad or m), rate (per s)] at t =
    0."""

    about = "one equation of motion for one freedom, no reactions"
    start: list[float]

    def rate(self, y: Sequence[float]) -> list[float]:
        """ẏ = [rate, acceleration] at y."""
        raise NotImplementedError

    def positions(self, y: Sequence[float]) -> dict[str, list[float]]:
        """World positions of the mass centres at state y, {name of body: position, m}."""
        raise NotImplementedError


class BallPendulum(ClosedFormEquation):
    """Example 8.1 in its plane x–z: I α + m g l sin θ = −R|f|, equation (104), with θ measured from the downward vertical.

    The equation is quadratic in the angular acceleration α, because the contact force f depends on α.
    """

    def __init__(self, scene: sm.Scene, variant: FrictionVariant):
        body = scene.bodies["pendulum"]
        self.m, center, inertia = mass_properties(body)
        self.l, self.g = float(center[0]), -float(scene.gravity[2])
        self.inertia = inertia[1][1] + self.m * self.l**2
        friction = next(iter(scene.joints.values())).friction
        assert friction is not None
        self.mu, self.r = float(friction.mu or 0.0), float(friction.radius)  # type: ignore[arg-type]
        self.limit = variant.v_eps / self.r
        self.start = [math.pi / 2, 0.0]

    def rate(self, y: Sequence[float]) -> list[float]:
        theta, omega = y
        s = self.mu * max(-1.0, min(1.0, omega / self.limit))
        q = self.r * self.m * s / math.sqrt(1 + s * s)
        sin, cos = math.sin(theta), math.cos(theta)
        torque, along, radial = self.m * self.g * self.l * sin, self.g * sin, self.l * omega * omega + self.g * cos
        a, e = self.inertia**2 - q * q * self.l**2, self.inertia * along - self.l * torque
        return [omega, (q * q * self.l * along - self.inertia * torque - q * math.sqrt(e * e + a * radial * radial)) / a]

    def positions(self, y: Sequence[float]) -> dict[str, list[float]]:
        return {"pendulum": [self.l * math.sin(y[0]), 0.0, -self.l * math.cos(y[0])]}


class CrankSlider(ClosedFormEquation):
    """The mechanism of example 8.2, undriven and without friction: J(θ) θ̈ + ½ J'(θ) θ̇² + V'(θ) = 0."""

    def __init__(self, scene: sm.Scene, variant: FrictionVariant):
        (self.m1, _, i1), (self.m2, _, i2), (self.m3, _, _) = (mass_properties(scene.bodies[n]) for n in ("crank", "rod", "slider"))
        self.r, self.l = float(scene.bodies["crank"].points["pin"][0]), float(scene.bodies["rod"].points["end"][0])
        self.i1, self.i2, self.g = i1[2][2], i2[2][2], -float(scene.gravity[1])
        self.start = [0.0, 10.0]

    def rate(self, y: Sequence[float]) -> list[float]:
        theta, omega = y
        r, length, k = self.r, self.l, self.r / self.l
        s, c = math.sin(theta), math.cos(theta)
        sp = k * s
        cp = math.sqrt(1 - sp * sp)
        f1 = k * c / cp
        f2 = (-k * s + sp * f1 * f1) / cp
        x1, x2 = -r * s - length * sp * f1, -r * c - length * (cp * f1 * f1 + sp * f2)
        u1, u2 = -r * s - length / 2 * sp * f1, -r * c - length / 2 * (cp * f1 * f1 + sp * f2)
        w1, w2 = r * c / 2, -r * s / 2
        inertia = self.i1 + self.m1 * r * r / 4 + self.m2 * (u1 * u1 + w1 * w1) + self.i2 * f1 * f1 + self.m3 * x1 * x1
        slope = 2 * (self.m2 * (u1 * u2 + w1 * w2) + self.i2 * f1 * f2 + self.m3 * x1 * x2)
        return [omega, -(0.5 * slope * omega * omega + self.g * (self.m1 * r / 2 * c + self.m2 * w1)) / inertia]

    def positions(self, y: Sequence[float]) -> dict[str, list[float]]:
        s, c = math.sin(y[0]), math.cos(y[0])
        sp = self.r / self.l * s
        cp = math.sqrt(1 - sp * sp)
        crank = [self.r / 2 * c, self.r / 2 * s, 0.0]
        rod = [self.r * c + self.l / 2 * cp, self.r / 2 * s, 0.0]
        slider = [self.r * c + self.l * cp, 0.0, 0.0]
        return {"crank": crank, "rod": rod, "slider": slider}


class FourBars(ClosedFormEquation):
    """Benchmark A02: in exact arithmetic all cranks stay parallel, so one equation describes all four-bars."""

    about = "one equation, valid only while all cranks stay parallel; it omits the second possible motion"

    def __init__(self, scene: sm.Scene, variant: FrictionVariant):
        self.n = sum(name.startswith("coupler") for name in scene.bodies)
        n, g = self.n, -float(scene.gravity[1])
        self.factor = -((n + 1) / 2 + n) / ((n + 1) / 3 + n) * g
        self.start = [math.pi / 2, -1.0]

    def rate(self, y: Sequence[float]) -> list[float]:
        return [y[1], self.factor * math.cos(y[0])]

    def positions(self, y: Sequence[float]) -> dict[str, list[float]]:
        c, s = math.cos(y[0]), math.sin(y[0])
        cranks = {f"crank{i}": [i + c / 2, s / 2, 0.0] for i in range(self.n + 1)}
        return cranks | {f"coupler{i}": [i - 0.5 + c, s, 0.0] for i in range(1, self.n + 1)}


class Pendulum(ClosedFormEquation):
    """Benchmark A01: θ̈ = −(g/l) sin θ for a point mass 1 m from its pivot."""

    def __init__(self, scene: sm.Scene, variant: FrictionVariant):
        self.g, self.body = -float(scene.gravity[1]), next(iter(scene.bodies))
        self.start = [-math.pi / 2, 0.0]

    def rate(self, y: Sequence[float]) -> list[float]:
        return [y[1], -self.g * math.sin(y[0])]

    def positions(self, y: Sequence[float]) -> dict[str, list[float]]:
        return {self.body: [math.sin(y[0]), -math.cos(y[0]), 0.0]}


EQUATIONS: dict[str, Callable[[sm.Scene, FrictionVariant], ClosedFormEquation]] = {
    "spherical_pendulum": BallPendulum, "crank_slider_free": CrankSlider, "n_four_bar": FourBars, "simple_pendulum": Pendulum,
}
"""Closed-form equations by scene name. An equation is used only if its start positions agree with those of the scene."""
