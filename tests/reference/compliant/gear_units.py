"""Gear units, worms and loaded joints: couplings with losses that depend on the transmitted torque. Like other couplings, gear
units and worms are springs along their rows. Friction is the law's ratio at the speed times the loss at the transmitted torque,
which follows from the springs."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from tests.reference.compliant.couplings import follower_stiffness
from tests.reference.compliant.devices import Devices, Freedoms
from tests.reference.compliant.friction_laws import Laws, NotJudged, Signals
from tests.reference.compliant.joint_springs_and_friction import Level
from tests.reference.compliant.loads_by_speed_and_position import MotionLoads
from tests.reference.compliant.positions_and_rates import Forces, Frames, Motion, cross, dot

LOCKED = 1e-9
"""Least value of 1 - ratio x loss of a unit that its output drives. A locked unit moves below its speed of rest."""
STIFFER = 30.0
"""Stiffness of a unit relative to the stiffness of a joint's drive. It is large because fast shafts turn through large angles, and
errors are measured in these angles."""
REPEATED = 40
"""Iterations for an efficiency that depends on the torque, which in turn depends on the efficiency."""


def transmitted(e, ratio, forward, backward, constant):
    """Torque that the driven part receives from the torque e: e minus friction, where friction is ratio x (c |T| + constant). c is
    ``forward`` if power flows to this part, else ``backward``."""
    sense, share = np.where(ratio < 0, -1.0, 1.0), np.abs(ratio)
    left = sense * e - share * constant
    drives = left / (1 + share * forward)
    return sense * np.where(left > 0, drives, left / np.maximum(1 - share * backward, LOCKED))


def curve(at, value):
    """A curve of efficiencies: monotone cubic pieces, flat at both ends and beyond."""
    at, value = np.array(at, float), np.array(value, float)
    slopes = PchipInterpolator(at, value).derivative()(at) if len(at) > 2 else np.zeros(2)
    slopes[0] = slopes[-1] = 0.0
    inside = CubicHermiteSpline(at, value, slopes)
    return lambda x: inside(np.clip(x, at[0], at[-1]))


class Efficiency:
    """An efficiency: a number, or a curve over the torque or the speed of the output shaft."""

    def __init__(self, given):
        self.over = "torque" if getattr(given, "torque", None) is not None else "speed"
        table = given is not None and not isinstance(given, (int, float))
        self.curve = curve(getattr(given, self.over), given.value) if table else None
        self.number = given

    def __call__(self, torque, speed):
        """The efficiency at magnitudes of the torque and the speed."""
        if self.curve is None:
            return self.number
        return self.curve(torque if self.over == "torque" else speed)


class Losses:
    """Coefficients of a gear unit."""

    def __init__(self, friction):
        self.both = [Efficiency(getattr(friction, key, None)) for key in ("efficiency", "efficiency_backward")]
        self.free = friction is None
        static = getattr(friction, "mu_static", None) or 1.0
        if not self.free and static > 1 and static * self.coefficients(0.0, 0.0)[1] >= 1:
            raise NotJudged("a unit that locks itself with more friction at rest")

    def coefficients(self, torque, speed):
        """(forward, backward)."""
        if self.free:
            return 0.0, 0.0
        forward = 1 / self.both[0](torque, speed) - 1
        back = self.both[1](torque, speed)
        return forward, np.minimum(forward, 1.0) if back is None else 1 - back

    def output(self, e, ratio, speed, constant):
        """Torque of the output shaft."""
        out = e
        again = REPEATED if any(x.curve is not None and x.over == "torque" for x in self.both) else 1
        for _ in range(again):
            out = transmitted(e, ratio, *self.coefficients(np.abs(out), speed), constant)
        return out


def _body(side) -> str:
    return side.partition(".")[0] if isinstance(side, str) else side.body


class Units:
    """Gearboxes between two shafts. The input shaft's torque is the push along the row."""

    def __init__(self, scene, frames: Frames, free: Freedoms, level: Level, names: list[str]):
        self.names, self.free, self.level = names, free, level
        joints = [scene.joints[n] for n in names]
        on = {_body(scene.joints[n].outboard): n for n, k in free.labels if scene.joints[n].type == "revolute"}
        both = [(on[_body(j.inboard)], on[_body(j.outboard)]) for j in joints]
        self.one, self.two = (np.array([free.at(pair[k]) for pair in both]) for k in (0, 1))
        self.ratio = np.array([j.ratio for j in joints], float)
        self.k = STIFFER * np.array([follower_stiffness(frames, level, n, True) for n, _ in both])
        self.rubs = np.array([k for k, j in enumerate(joints) if j.friction is not None], int)
        frictions = [joints[k].friction for k in self.rubs]
        self.losses = [Losses(f) for f in frictions]
        self.idle = Signals(scene, [f.no_load_torque or 0.0 for f in frictions])
        self.law = Laws(scene, frictions, np.full(len(frictions), level.rate), given=True)

    def rate(self, m: Motion) -> np.ndarray:
        """The rates of the rows."""
        qd = self.free.coordinates(m)[1]
        return self.ratio * qd[:, self.two] - qd[:, self.one]

    def act(self, m: Motion, rolled: np.ndarray, out: Forces) -> np.ndarray:
        """Add the forces. Returns the rates of the rows."""
        _, qd, axes, at = self.free.coordinates(m)
        rate = self.ratio * qd[:, self.two] - qd[:, self.one]
        push = -self.k * (rolled + self.level.delay * rate)
        given, effort = self.ratio * push, np.zeros_like(qd)
        received = given.copy()
        if len(self.rubs):
            v = qd[:, self.two[self.rubs]]
            ratio, idle = self.law.slope(m.t, np.abs(v)) * v, self.idle(m.t) * np.abs(self.ratio[self.rubs])
            for i, (k, losses) in enumerate(zip(self.rubs, self.losses, strict=True)):
                received[:, k] = losses.output(given[:, k], ratio[:, i], np.abs(v[:, i]), idle[:, i])
            out.taken += ((given - received)[:, self.rubs] * v).sum(-1)
        for i, (a, b) in enumerate(zip(self.one, self.two, strict=True)):
            effort[:, a] -= push[:, i]
            effort[:, b] += received[:, i]
        self.free.act(effort, axes, at, out)
        return rate


class Loaded:
    """Joints whose friction grows with the transmitted load. The load is the sum of the devices' efforts less this friction."""

    def __init__(self, scene, devices: Devices, curves: MotionLoads, level: Level, names: list[str]):
        self.devices, self.curves, self.at = devices, curves, np.array([devices.free.at(n) for n in names], int)
        f = [scene.joints[n].friction for n in names]
        key = ["torque" if x.torque is not None else "force" for x in f]
        first = [getattr(x, k) for x, k in zip(f, key, strict=True)]
        back = [getattr(x, f"back_{k}") for x, k in zip(f, key, strict=True)]
        self.constant = Signals(scene, first)
        self.back = Signals(scene, [a if b is None else b for a, b in zip(first, back, strict=True)])
        self.forward = np.array([x.load_friction for x in f], float)
        backward = [x.load_friction if x.load_friction_backward is None else x.load_friction_backward for x in f]
        self.backward = np.array(backward, float)
        self.law = Laws(scene, f, np.array([level.rate if k == "torque" else level.speed for k in key]), given=True)

    def act(self, m: Motion, out: Forces) -> None:
        """Add the friction."""
        effort, q, qd, axes, at = self.devices.total_efforts(m)
        effort = effort + self.curves.efforts(q, qd)[0]
        e, v = effort[:, self.at], qd[:, self.at]
        ratio = self.law.slope(m.t, np.abs(v)) * v
        constant = np.where(ratio < 0, self.back(m.t), self.constant(m.t))
        rub = transmitted(e, ratio, self.forward, self.backward, constant) - e
        more = np.zeros_like(effort)
        more[:, self.at] = rub
        self.devices.free.act(more, axes, at, out)
        out.taken -= (rub * v).sum(-1)


class Worms:
    """Worms in their wheels. The friction of the flanks is along the thread. Their normal force also pushes the axes apart."""

    def __init__(self, scene, frames: Frames, level: Level, names: list[str]):
        self.level, self.names, self.sides = level, names, frames.sides(names)
        joints = [scene.joints[n] for n in names]
        self.lead = np.array([j.lead_angle for j in joints], float)
        self.r1 = np.array([j.module * j.teeth[0] / (2 * np.tan(abs(j.lead_angle))) for j in joints])
        self.r2 = np.array([j.module * j.teeth[1] / 2 for j in joints])
        self.k = 2 * level.stiffness * np.array([(j.stiffness or 1e8) / 1e8 for j in joints])
        self.at = np.array([k for k, j in enumerate(joints) if j.friction is not None], int)
        f = [joints[k].friction for k in self.at]
        self.angle = np.zeros(len(names))
        self.angle[self.at] = [x.pressure_angle for x in f]
        # while springs yield, the worm turns faster than its wheel by the ratio of the teeth
        faster = np.array([j.teeth[1] / j.teeth[0] for j in joints])
        self.law = Laws(scene, f, (self.r1 * faster)[self.at] * level.rate)

    def _touch(self, m: Motion) -> tuple[np.ndarray, ...]:
        """(normal of the flanks, thread, direction to the wheel, point on the worm, point on the wheel, velocity of the point on
        the wheel relative to the worm)."""
        s = self.sides.pairs(m)
        a, b, across = s.A[..., 0], s.B[..., 0], s.q - s.p
        u = cross(a, b)
        u = u / np.sqrt(dot(u, u))[..., None]
        u = u * np.where(dot(across, u) < 0, -1.0, 1.0)[..., None]
        around, sn, cs = cross(a, u), np.sin(self.lead)[:, None], np.cos(self.lead)[:, None]
        inner = s.p + dot(across, a)[..., None] * a + self.r1[:, None] * u
        outer = s.q - dot(across, b)[..., None] * b - self.r2[:, None] * u
        one, two = self.sides.one, self.sides.two
        v1 = m.v[:, one] + cross(m.w[:, one], inner - m.c[:, one])
        v2 = m.v[:, two] + cross(m.w[:, two], outer - m.c[:, two])
        return cs * a - sn * around, sn * a + cs * around, u, inner, outer, v2 - v1

    def rate(self, m: Motion) -> np.ndarray:
        """The rates of the rows."""
        k, *_, v = self._touch(m)
        return dot(k, v)

    def act(self, m: Motion, rolled: np.ndarray, out: Forces) -> np.ndarray:
        """Add the forces. Returns the rates of the rows."""
        k, d, u, inner, outer, v = self._touch(m)
        rate = dot(k, v)
        push = -self.k * (rolled + self.level.delay * rate)
        force = push[..., None] * k + (np.abs(push) * np.tan(self.angle))[..., None] * u
        if len(self.at):
            slide = dot(d, v)[:, self.at]
            rub = self.law.slope(m.t, np.abs(slide)) * slide * np.abs(push[:, self.at]) / np.cos(self.angle[self.at])
            force[:, self.at] -= rub[..., None] * d[:, self.at]
            out.taken += (rub * slide).sum(-1)
        out.push(self.sides.two, outer, force)
        out.push(self.sides.one, inner, -force)
        return rate
