"""Contacts that begin and end, as springs that only push: points on curves and planes, cams with followers, and pins in slots.

An open contact has a gap and no force. Where the gap is negative, the contact presses with stiffness times the penetration, and a
delay of the penetration's rate, but never pulls. The delay is the same at all levels, and is long compared to the period of any
body on the spring. Impacts have therefore no rebound in the limit. In an impact with a rebound, the contact is a damper that brings
the rate of the gap to the rate of the rebound. All functions take many states and contacts at once."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from tests.reference.compliant.friction_laws import Laws, NotJudged
from tests.reference.compliant.joint_springs_and_friction import USUAL, Level, is_given
from tests.reference.compliant.positions_and_rates import Forces, Frames, Motion, cross, dot

TYPES = ("point_on_curve", "point_on_plane", "cam", "pin_in_slot")
DELAY = 1e-3
"""Delay of the springs, s."""
SOFTER = 1e-3
"""Stiffness of these contacts relative to the stiffness of joints. With equal stiffness, an impact would be over before the pins
react, and friction within it would depend on this. Rigid joints react at once."""
SLOWEST = 300.0
"""Rate v of a rebound below which the contact stays closed, in time constants of the damper, m/s². The flights that are left out
are at most v²/(2a) high. Flights after slower impacts would gain the way that the damper makes against a load."""
BEYOND = 0.01
"""The damper pulls towards the rate of the rebound and this part of the rate. It reaches the rebound in a few of its time
constants, and contacts that press at the same time are nearly at rest by then."""
LATEST = 12.0
"""Time constants of the damper after which the damper ends, if loads keep the contact from the rate of the rebound."""
PLACES, NEWTON, FOUND = 200, 8, 1e-12
"""Places on a curve from which the search for the nearest place starts; most steps of this search, and the step that ends it. The
error after that step is its square."""
AT_LEAST = 1e-30
"""Least distance from a slot's centre line for which it has a direction, m."""
OUTSIDE = 1.0
"""Gap of a pin that is not in a slot, m."""


class Path:
    """A curve in the plane of the inboard e2 and e3, as complex numbers over a parameter. Open curves continue straight. ``play``:
    largest distance from the curve in a slot; None, where the free side is the right side of the curve."""

    def __init__(self, joint):
        slot = joint.slot
        self.play = slot.play if slot else None
        self.repeated = slot.repeated if slot else 1
        mouths = {"both": (True, True), "start": (True, False), "end": (False, True)}.get(slot.mouth if slot else None)
        self.open = mouths or (False, False)
        if joint.profile is not None:
            u, radius = np.array(joint.profile.angle, float), np.array(joint.profile.radius, float)
            if not np.isclose(u[-1] - u[0], 2 * np.pi):
                raise NotJudged("a cam whose profile is not a full turn")
            self.radius, self.closed = CubicSpline(u, radius, bc_type="periodic"), True
        else:
            p = np.array(joint.curve.points, float) @ [1, 1j]
            self.closed, self.radius = bool(joint.curve.closed), None
            p = np.append(p, p[0]) if self.closed else p
            u = np.append(0.0, np.cumsum(np.abs(np.diff(p))))
            ends = "periodic" if self.closed else "natural"
            self.spline = CubicSpline(u, np.stack([p.real, p.imag], axis=-1), bc_type=ends)
        self.first, self.last = float(u[0]), float(u[-1])
        self.tries = np.linspace(self.first, self.last, PLACES)
        self.near = self.at(self.tries)[0]

    def at(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The curve at parameters, and its first two derivatives."""
        if self.radius is not None:
            r, dr, ddr = (self.radius(u, k) for k in range(3))
            way = np.exp(1j * u)
            return r * way, (dr + 1j * r) * way, (ddr + 2j * dr - r) * way
        if self.closed:
            return tuple(self.spline(u, k) @ [1, 1j] for k in range(3))
        end = np.clip(u, self.first, self.last)
        p, d, dd = (self.spline(end, k) @ [1, 1j] for k in range(3))
        return p + (u - end) * d, d, np.where(u == end, dd, 0.0)

    def gap(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The gaps of points, and the directions of the free side, as complex numbers."""
        turns = np.exp(2j * np.pi * np.arange(self.repeated) / self.repeated)
        u, way = np.array([self._foot(p / turn) for turn in turns]).transpose(1, 0, 2)
        slot, all_ = np.abs(way).argmin(axis=0), np.arange(len(p))
        u, way, turn = u[slot, all_].real, way[slot, all_], turns[slot]
        if self.play is None:
            d = self.at(u)[1]
            n = -1j * d / np.abs(d)
            return (way * n.conj()).real, n
        far = np.maximum(np.abs(way), AT_LEAST)
        outside = (self.open[0] & (u < self.first)) | (self.open[1] & (u > self.last))
        return np.where(outside, OUTSIDE, self.play - far), -way / far * turn

    def _foot(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The parameters of the places nearest to points, and the ways from there to the points. The wall of a slot ends in a half
        circle around an end of its curve."""
        u = self.tries[np.abs(p[:, None] - self.near).argmin(axis=1)]
        for _ in range(NEWTON):
            c, d, dd = self.at(u)
            away = (p - c) * d.conj()
            bend = np.abs(d) ** 2 - ((p - c) * dd.conj()).real
            step = away.real / np.where(bend > 0, bend, np.abs(d) ** 2)
            u = u + step
            if np.abs(step).max() < FOUND:
                break
        if self.play is not None and not self.closed:
            u = np.where(self.open[0], u, np.maximum(u, self.first))
            u = np.where(self.open[1], u, np.minimum(u, self.last))
        return u, p - self.at(u)[0]


class Contacts:
    """The contacts of a scene. inside: contacts that press, or may press. rebound: for contacts in an impact with a rebound, the
    rate of the gap after the impact; else 0."""

    def __init__(self, scene, frames: Frames, level: Level, names: list[str]):
        self.names, joints = names, [scene.joints[n] for n in names]
        for name, j in zip(names, joints, strict=True):
            if j.unilateral is None:
                raise NotJudged(f"{name}: a {j.type} that also pulls")
            if j.unilateral.restitution and j.unilateral.impact_law != "newton":
                raise NotJudged(f"{name}: restitution by impulses")
            if is_given(j.friction):
                raise NotJudged(f"{name}: friction of a given size")
        self.sides, self.flat = frames.sides(names), np.array([j.type == "point_on_plane" for j in joints], bool)
        self.paths = [None if j.type == "point_on_plane" else Path(j) for j in joints]
        self.roller = np.array([0.0 if j.type == "point_on_plane" else float(j.roller or 0.0) for j in joints])
        self.k = SOFTER * level.stiffness * np.array([(j.stiffness or USUAL) / USUAL for j in joints])
        self.closed = np.array([j.unilateral.starts != "open" for j in joints], bool)
        self.inside, self.rebound = self.closed.copy(), np.zeros(len(names))
        self.restitution = np.array([j.unilateral.restitution for j in joints], float)
        self.constant = max(frames.mass, default=1.0) / DELAY / np.maximum(self.k, AT_LEAST)
        self.rubs = np.flatnonzero([j.friction is not None for j in joints])
        rubbing = [joints[i].friction for i in self.rubs]
        self.law = Laws(scene, rubbing, np.full(len(rubbing), level.speed))

    def __bool__(self) -> bool:
        return bool(self.names)

    def relative_motion(self, m: Motion) -> tuple[np.ndarray, ...]:
        """Gaps and their rates (n x contacts); contact points, normals and velocities of sliding (n x contacts x 3)."""
        s = self.sides.pairs(m)
        x = s.q - s.p
        flat = dot(x, s.A[..., 1]) + 1j * dot(x, s.A[..., 2])
        gap, n = dot(x, s.A[..., 0]).astype(float), np.zeros(flat.shape, complex)
        for k, path in enumerate(self.paths):
            if path is not None:
                gap[:, k], n[:, k] = path.gap(flat[:, k])
        normal = n.real[..., None] * s.A[..., 1] + n.imag[..., None] * s.A[..., 2]
        normal = np.where(self.flat[:, None], s.A[..., 0], normal)
        along = cross(s.A[..., 0], normal)
        rim = -self.roller[:, None] * normal
        slide = s.slide + cross(s.turn, rim)
        rate = dot(slide, normal)
        slip = np.where(self.flat[:, None], slide - rate[..., None] * normal, dot(slide, along)[..., None] * along)
        return gap, rate, s.q + rim, normal, slip

    def gaps(self, m: Motion) -> np.ndarray:
        """Functions that become negative where ``inside`` has to change: n x contacts."""
        gap, rate = self.relative_motion(m)[:2]
        damped = np.minimum(self.rebound - rate, LATEST * self.constant - gap / np.where(self.rebound > 0, self.rebound, 1.0))
        return np.where(self.inside, np.where(self.rebound > 0, damped, -gap), np.maximum(gap, DELAY * rate))

    def switch(self, k: int, m: Motion) -> None:
        """Change the state of contact k."""
        self.inside[k] = not self.inside[k]
        speed = -self.restitution[k] * self.relative_motion(m)[1][0, k]
        self.rebound[k] = speed if self.inside[k] and speed > SLOWEST * self.constant[k] else 0.0

    def act(self, m: Motion, out: Forces) -> None:
        """Add the forces."""
        gap, rate, at, normal, slip = self.relative_motion(m)
        wanted = np.where(self.rebound > 0, -DELAY * (1 + BEYOND) * self.rebound, gap)
        push = np.where(self.inside, np.maximum(-self.k * (wanted + DELAY * rate), 0.0), 0.0)
        rub, speed = np.zeros_like(push), np.sqrt(dot(slip, slip))
        rub[:, self.rubs] = self.law.slope(m.t, speed[:, self.rubs]) * push[:, self.rubs]
        out.between(self.sides.one, self.sides.two, at, push[..., None] * normal - rub[..., None] * slip)
        out.taken += (rub * speed**2).sum(-1)
