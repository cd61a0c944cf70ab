"""Random pairs of wheels on a carrier in free flight, and the balance of every part from the reported forces of its joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.reference.mechanics.rotation import cross, matrix_from_quaternion, skew
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result

PAIRS = ("gear", "internal", "bevel_gear", "rack", "belt", "crossed")


@dataclass(frozen=True)
class Pair:
    """A pair in the carrier's axes: points p1, p2 of both wheels' axes on the carrier, unit axes a1, a2 (for a rack: along the
    rack), radii (positive for outside teeth, 0 for a rack)."""

    what: str
    p1: np.ndarray
    p2: np.ndarray
    a1: np.ndarray
    a2: np.ndarray
    r1: float
    r2: float


@dataclass(frozen=True)
class Flying:
    """A scene and its pairs; ``w0``, ``w1``, … are wheels, ``m0``, … the pairs."""

    scene: sm.Scene
    pairs: tuple[Pair, ...]
    inertia: dict[str, tuple[float, np.ndarray, np.ndarray]]
    """Mass, centre in the body's frame and inertia about this centre, of each body."""


def unit(v) -> np.ndarray:
    """The direction of a vector."""
    return np.asarray(v, float) / np.linalg.norm(v)


def flying(seed: int, names: tuple[str, ...] = PAIRS, teeth: sm.Friction | None = None) -> Flying:
    """A carrier in free flight with one pair of each kind. The wheels are out of balance and have random inertia. ``teeth`` is the
    friction of the teeth."""
    rng = np.random.default_rng([77, seed])
    bodies: dict[str, sm.Body] = {}
    inertia = {}
    joints: dict[str, sm.Joint] = {}

    def part(name: str) -> None:
        shape = rng.normal(size=(3, 3))
        tensor = 0.02 * (shape @ shape.T + 2 * np.eye(3))
        tensor = np.trace(tensor) * np.eye(3) - tensor
        mass, centre = float(rng.uniform(0.5, 3)), 0.05 * rng.normal(size=3)
        six = tuple(float(tensor[i, k]) for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        bodies[name] = sm.Body(mass=mass, center=tuple(map(float, centre)), inertia=six)
        inertia[name] = (mass, centre, tensor)

    def put(name: str, point: np.ndarray, axis: np.ndarray, kind: str, qd: float | None) -> None:
        part(name)
        side = sm.Side("carrier", point=tuple(map(float, point)))
        start = sm.Start(qd=qd) if qd is not None else None
        joints[f"on_{name}"] = sm.Joint(kind, side, sm.Side(name), axis=tuple(map(float, axis)), start=start)

    part("carrier")
    spin = (*rng.normal(size=3), *rng.normal(size=3))
    joints["fly"] = sm.Joint("free", sm.Side("ground"), sm.Side("carrier"), start=sm.Start(qd=tuple(map(float, spin))))
    pairs = []
    for k, what in enumerate(names):
        one = _pair(what, rng)
        pairs.append(one)
        put(f"w{2 * k}", one.p1, one.a1, "revolute", float(rng.normal()))
        put(f"w{2 * k + 1}", one.p2, one.a2, "prismatic" if what == "rack" else "revolute", None)
        joints[f"m{k}"] = replace(_joint(what, one, k), friction=teeth)
    simulation = sm.Simulation(until=0.2, every=0.1)
    return Flying(sm.Scene(bodies=bodies, joints=joints, gravity=(0.3, -2.0, -9.0), simulation=simulation), tuple(pairs), inertia)


def _pair(what: str, rng: np.random.Generator) -> Pair:
    a, p1 = unit(rng.normal(size=3)), 0.3 * rng.normal(size=3)
    u = unit(np.cross(a, rng.normal(size=3)))
    module, z1, z2 = 0.004, int(rng.integers(12, 30)), int(rng.integers(31, 60))
    r1, r2 = 0.5 * module * z1, 0.5 * module * z2
    if what == "bevel_gear":
        angle = float(rng.uniform(0.6, 2.0))
        return Pair(what, p1, p1, a, np.cos(angle) * a + np.sin(angle) * u, r1, r2)
    if what == "rack":
        b = unit(np.cross(a, u))
        return Pair(what, p1, p1 + r1 * u + 0.1 * b + 0.02 * a, a, b, r1, 0.0)
    opposite = a * (-1.0 if rng.random() < 0.5 else 1.0)
    if what == "belt":
        r2 = -r2
    elif what == "internal":
        r2 = -r2
        return Pair(what, p1, p1 + (abs(r2) - r1) * u + 0.01 * a, a, opposite, r1, r2)
    gap = r1 + r2 if what == "gear" else 1.3 * (r1 + abs(r2))
    return Pair(what, p1, p1 + gap * u + 0.01 * a, a, opposite, r1, r2)


def _joint(what: str, one: Pair, k: int) -> sm.Joint:
    sides = [sm.Side(f"w{2 * k + i}", axis=tuple(map(float, (one.a1, one.a2)[i]))) for i in (0, 1)]
    if what in ("belt", "crossed"):
        teeth = (round(one.r1 / 0.002), round(abs(one.r2) / 0.002))
        return sm.Joint("belt", *sides, teeth=teeth, pitch=0.004 * np.pi, crossed=what == "crossed")
    if what == "rack":
        return sm.Joint("rack", *sides, teeth=(round(one.r1 / 0.002),), module=0.004)
    teeth = (round(one.r1 / 0.002), round(abs(one.r2) / 0.002))
    kind = "bevel_gear" if what == "bevel_gear" else "gear"
    return sm.Joint(kind, *sides, teeth=teeth, module=0.004, internal=what == "internal")


class Row:
    """One row of a run: motions of bodies and of points of wheels, and reported forces of joints."""

    def __init__(self, f: Flying, r: Result, i: int):
        self.f, self.r, self.i = f, r, i

    def __call__(self, name: str, count: int = 3) -> np.ndarray:
        """Components [1..count] of a column."""
        return np.array([self.r[f"{name}[{k + 1}]"][self.i] for k in range(count)])

    def turned(self, body: str) -> np.ndarray:
        """The body's axes, in the world."""
        return matrix_from_quaternion(self(f"{body}.orientation", 4))

    def velocity(self, body: str, point: np.ndarray) -> np.ndarray:
        """Velocity of a material point, in the world."""
        return self(f"{body}.velocity") + cross(self(f"{body}.angular_velocity"), point - self(f"{body}.position"))

    def spin_rate(self, body: str) -> np.ndarray:
        """Angular acceleration. The carrier has the angular acceleration of its free joint; a wheel adds the angular acceleration
        about its axle."""
        carrier = self("fly.qdd", 6)[3:]
        if body == "carrier":
            return carrier
        k = int(body[1:])
        one = self.f.pairs[k // 2]
        if one.what == "rack" and k % 2:
            return carrier
        axis = self.turned("carrier") @ (one.a1, one.a2)[k % 2]
        rate, more = (float(self.r[f"on_{body}.{c}[1]"][self.i]) for c in ("qd", "qdd"))
        return carrier + more * axis + rate * cross(self("carrier.angular_velocity"), axis)

    def reported(self, joint: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Force and torque that a joint exerts on its inboard part, and their point of action, in the world."""
        j = self.f.scene.joints[joint]
        assert isinstance(j.inboard, sm.Side)
        R = self.turned(j.inboard.body)
        centre = self.f.inertia[j.inboard.body][1]
        place = self(f"{j.inboard.body}.position") + R @ (np.array(j.inboard.point) - centre)
        E = R @ _frame(np.array(j.inboard.axis or j.axis))
        return E @ self(f"{joint}.reaction.force"), E @ self(f"{joint}.reaction.torque"), place

    def balance(self, body: str) -> tuple[np.ndarray, np.ndarray]:
        """Residual of Newton's and Euler's equations of a body."""
        mass, _, tensor = self.f.inertia[body]
        R, omega = self.turned(body), self(f"{body}.angular_velocity")
        J, at = R @ tensor @ R.T, self(f"{body}.position")
        force = mass * (self(f"{body}.acceleration") - np.array(self.f.scene.gravity))
        torque = J @ self.spin_rate(body) + cross(omega, J @ omega)
        for name, j in self.f.scene.joints.items():
            assert isinstance(j.inboard, sm.Side)
            assert isinstance(j.outboard, sm.Side)
            sign = {j.inboard.body: 1.0, j.outboard.body: -1.0}.get(body, 0.0)
            if sign and name != "fly":
                F, T, p = self.reported(name)
                force, torque = force - sign * F, torque - sign * (T + cross(p - at, F))
        return force, torque

    def touch(self, one: Pair) -> tuple[np.ndarray, np.ndarray]:
        """The point at which two wheels touch, and the direction in which their surfaces move at this point, in the world."""
        R, at = self.turned("carrier"), self("carrier.position")
        base = at - R @ self.f.inertia["carrier"][1]
        p1, p2, a1, a2 = base + R @ one.p1, base + R @ one.p2, R @ one.a1, R @ one.a2
        if one.what == "rack":
            away = (p2 - p1) - a2 * ((p2 - p1) @ a2) - a1 * ((p2 - p1) @ a1)
            return p1 + one.r1 * unit(away), a2
        if one.what == "bevel_gear":
            sine = np.linalg.norm(np.cross(a1, a2))
            return p1 + (one.r2 * a1 + one.r1 * a2) / sine, unit(np.cross(a1, a2))
        u = unit((p2 - p1) - a1 * ((p2 - p1) @ a1))
        inside = one.r1 + one.r2 < 0
        return p1 + one.r1 * (-u if inside else u), skew(a1) @ u


def _frame(e1: np.ndarray) -> np.ndarray:
    """The joint frame of an axis without a reference (notation, "Joints and frames")."""
    e1 = unit(e1)
    ref = np.eye(3)[(int(np.argmax(np.abs(e1))) + 1) % 3]
    e2 = unit(ref - (ref @ e1) * e1)
    return np.column_stack([e1, e2, np.cross(e1, e2)])
