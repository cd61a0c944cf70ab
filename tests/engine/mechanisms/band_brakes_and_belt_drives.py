"""Band brakes and belt drives under constant torques. Their motion consists of parts with constant acceleration."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_dict


@dataclass(frozen=True)
class Band:
    """The data of a band. The given tension acts at one end, or is the mean of the tensions at both ends. The angle of wrap is
    negative if forward motion tightens the end with the given tension."""

    mu: float
    wrap: float
    tension: float | None = None
    pretension: float | None = None

    def friction(self, sense: float) -> float:
        """Difference of the tensions while the band slides. sense: sense of the motion against which friction acts."""
        ratio = math.exp(self.mu * abs(self.wrap))
        if self.pretension is not None:
            return sense * 2 * self.pretension * (ratio - 1) / (ratio + 1)
        assert self.tension is not None
        return sense * self.tension * (ratio - 1 if sense * self.wrap > 0 else 1 - 1 / ratio)

    def tensions(self, friction: float) -> tuple[float, float]:
        """Tensions of the end with the given tension and of the other end. If the mean is given, the order of the ends is the
        same."""
        more = math.copysign(friction, friction * self.wrap)
        if self.pretension is not None:
            return self.pretension - more / 2, self.pretension + more / 2
        assert self.tension is not None
        return self.tension, self.tension + more

    @property
    def keys(self) -> dict[str, Any]:
        """The keys of the friction in a scene, without its geometry."""
        given = {"tension": self.tension} if self.pretension is None else {"pretension": self.pretension}
        return {"mu": self.mu, **given}


def motion(times: np.ndarray, speed: float, accelerate: Callable[[float], float], needed: float, least: float,
           most: float) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """(sliding, friction) at each time. accelerate: acceleration of sliding as a function of friction. needed: friction that holds.
    least, most: limits of this friction."""
    slid, held = np.empty(len(times)), np.empty(len(times))
    x, t = 0.0, 0.0
    while True:
        rests = speed == 0.0 and least <= needed <= most
        f = needed if rests else most if speed > 0 or (speed == 0.0 and needed > most) else least
        a = 0.0 if rests else accelerate(f)
        now = times >= t
        dt = times[now] - t
        slid[now], held[now] = x + speed * dt + 0.5 * a * dt**2, f
        if speed * a >= 0:
            return slid, held
        span = -speed / a
        x, speed, t = x + 0.5 * speed * span, 0.0, t + span


@dataclass(frozen=True)
class Brake:
    """A band brake on a drum. The drum begins to turn at ``rate``, under a constant torque."""

    band: Band
    radius: float
    inertia: float
    torque: float
    rate: float = 0.0

    def scene(self, **more: Any) -> sm.Scene:
        """The scene of the brake. more: further keys of the friction."""
        rubs = self.band.keys | {"wrap_angle": self.band.wrap, "drum_radius": self.radius} | more
        bearing = {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": "drum", "effort": self.torque,
                   "start": {"qd": self.rate}, "friction": rubs}  # fmt: skip
        bodies = {"drum": {"mass": 1.0, "inertia": [self.inertia] * 3}}
        data = {"schema": 1, "gravity": [0, 0, 0], "bodies": bodies, "joints": {"brake": bearing}}
        return scene_from_dict(data | {"simulation": {"until": 1.0, "every": 0.05}})

    def limit(self, sense: float) -> float:
        """Torque at which the drum begins to turn."""
        return self.radius * self.band.friction(sense)

    def angles(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angle of the drum, and friction at its surface."""
        R, J = self.radius, self.inertia
        least, most = self.band.friction(-1), self.band.friction(1)
        return motion(times, self.rate, lambda f: (self.torque - R * f) / J, self.torque / R, least, most)


@dataclass(frozen=True)
class Drive:
    """A belt on two pulleys under constant torques. way: sense of the belt joint's axis. If the wrap angle is 0, the geometry gives
    the angle."""

    band: Band
    radii: tuple[float, float]
    apart: float
    inertias: tuple[float, float]
    torques: tuple[float, float]
    rates: tuple[float, float] = (0.0, 0.0)
    crossed: bool = False
    way: int = 1

    @property
    def wrap(self) -> float:
        """Angle of wrap about the smaller pulley."""
        (r1, r2), straight = self.radii, self.apart
        gap = r1 + r2 if self.crossed else -abs(r1 - r2)
        return 2 * math.acos(-gap / straight)

    @property
    def wrapped(self) -> Band:
        """The band with the angle of wrap that the belt uses."""
        return self.band if self.band.wrap else Band(self.band.mu, self.wrap, self.band.tension, self.band.pretension)

    def scene(self, **more: Any) -> sm.Scene:
        """The scene of the drive. more: further keys of the friction."""
        rubs = self.band.keys | ({"wrap_angle": self.band.wrap} if self.band.wrap else {}) | more
        bodies = {n: {"mass": 1.0, "inertia": [J] * 3, "position": [0, y, 0]}
                  for n, J, y in zip("ab", self.inertias, (0.0, self.apart), strict=True)}  # fmt: skip
        joints: dict[str, Any] = {
            f"on_{n}": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": n, "effort": M, "start": {"qd": w}}
            for n, M, w in zip("ab", self.torques, self.rates, strict=True)
        }
        joints["belt"] = {"type": "friction_belt", "axis": "x" if self.way > 0 else "-x", "inboard": "a", "outboard": "b",
                          "radii": list(self.radii), "crossed": self.crossed, "friction": rubs}  # fmt: skip
        data = {"schema": 1, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints}
        return scene_from_dict(data | {"simulation": {"until": 1.0, "every": 0.05}})

    @property
    def arms(self) -> tuple[float, float]:
        """Sliding per angle of each pulley, in the sense of the belt joint's axis."""
        r1, r2 = self.radii
        return self.way * r1, self.way * (r2 if self.crossed else -r2)

    def states(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles of both pulleys, and friction in the belt."""
        (b1, b2), (J1, J2), (M1, M2), (w1, w2) = self.arms, self.inertias, self.torques, self.rates
        soft = b1**2 / J1 + b2**2 / J2
        push = b1 * M1 / J1 + b2 * M2 / J2
        least, most = self.wrapped.friction(-1), self.wrapped.friction(1)
        slid, f = motion(times, b1 * w1 + b2 * w2, lambda f: push - soft * f, push / soft, least, most)
        # b1 (J1 w1) and b2 (J2 w2) change by opposite impulses of friction. Only the torques change J1 w1/b1 − J2 w2/b2.
        kept = (J1 * w1 / b1 - J2 * w2 / b2) * times + 0.5 * (M1 / b1 - M2 / b2) * times**2
        q1 = (slid * J2 / b2**2 + kept) / (b1 * J2 / b2**2 + J1 / b1)
        return q1, (slid - b1 * q1) / b2, f


def random_band(rng: np.random.Generator, wraps: tuple[float, float] = (1.0, 9.0)) -> Band:
    """A band for which the tension of one end or the mean of both tensions is given."""
    wrap = float(rng.choice([-1, 1]) * rng.uniform(*wraps))
    size = float(rng.uniform(20, 400))
    return Band(float(rng.uniform(0.05, 0.5)), wrap, *((size, None) if rng.random() < 0.6 else (None, size)))


def random_brake(seed: int) -> Brake:
    """A brake whose torque is near its limits."""
    rng = np.random.default_rng([5, seed])
    made = Brake(random_band(rng), float(rng.uniform(0.03, 0.3)), float(rng.uniform(0.02, 2)), 0.0)
    sense = float(rng.choice([-1, 1]))
    return Brake(made.band, made.radius, made.inertia * abs(made.limit(sense)), made.limit(sense) * rng.uniform(-0.5, 1.5),
                 float(rng.choice([0.0, rng.uniform(-3, 3)])))  # fmt: skip


def random_drive(seed: int) -> Drive:
    """A drive whose torques are near the limits of its belt."""
    rng = np.random.default_rng([6, seed])
    r1, r2 = (float(x) for x in rng.uniform(0.03, 0.2, 2))
    band = random_band(rng, (1.5, 4.0))
    if rng.random() < 0.6:
        band = Band(band.mu, 0.0, band.tension, band.pretension)
    crossed, way = bool(rng.random() < 0.4), int(rng.choice([-1, 1]))
    made = Drive(band, (r1, r2), float((r1 + r2) * rng.uniform(1.1, 4)), (1.0, 1.0), (0.0, 0.0), crossed=crossed, way=way)
    size = abs(made.wrapped.friction(float(rng.choice([-1, 1]))))
    inertias = (float(size * r1**2 * rng.uniform(0.3, 2)), float(size * r2**2 * rng.uniform(0.3, 2)))
    torques = (float(size * r1 * rng.uniform(-2.5, 2.5)), float(size * r2 * rng.uniform(-2.5, 2.5)))
    rates = (float(rng.uniform(-1, 1) / r1), float(rng.uniform(-1, 1) / r2)) if rng.random() < 0.6 else (0.0, 0.0)
    return Drive(band, (r1, r2), made.apart, inertias, torques, rates, crossed, way)
