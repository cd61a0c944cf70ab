"""Data of a run that are not in the parameter table: start values, tables, times of kinks of signals, scales."""

from __future__ import annotations

import math

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import poses_of, sides_of
from trunnion.scene.queries.loads_and_signals import signals
from trunnion.scene.queries.mass_properties import mass_properties
from trunnion.scene.signals.declaration import Corner
from trunnion.scene.signals.registry import corners
from trunnion.scene.signals.table import Table
from trunnion.system.construction.device_builder import Builder
from trunnion.system.construction.joint_frames import direction
from trunnion.system.construction.spanning_tree import has_force_by_angle
from trunnion.system.signals.signal_tables import ExternalInput, SignalCurve, curve
from trunnion.system.structure.bodies_and_joints import System, state_coordinates

GIVEN = {"guess": 0.0, "rounded": 1.0, "exact": 2.0}
"""Level of ``Numbers.q_given`` for a start value, by the key ``use`` of a joint's start."""


@dataclass(frozen=True)
class Numbers:
    """Start values, tables and scales of a run.

    q, v               start values (nq, nv); without a value in the scene, 0 or the unit quaternion.
    q_given, v_given   2 where the scene gives an exact start value, 1 where it gives a rounded one, else 0.
    tables             records of the external inputs, then of table signals.
    breaks             times at which a signal has a corner or jumps (``breaks``).
    length, rate       scales for tolerances, m and 1/s.
    inputs             start values of the external inputs."""

    q: np.ndarray
    v: np.ndarray
    q_given: np.ndarray
    v_given: np.ndarray
    tables: tuple[SignalCurve | ExternalInput, ...]
    breaks: tuple[Corner, ...]
    length: float
    rate: float
    energy: float
    """Energy scale, J: mass of all bodies × (length × rate)²."""
    inputs: np.ndarray
    ignored: tuple[str, ...]
    """Notes about start values and ``cut`` keys of the scene that are not used, with the reason."""
    q_given_by_rate: np.ndarray
    """For each rate (nv): the level of ``q_given`` of the joint to which the rate belongs."""

    def break_records(self) -> np.ndarray:
        """The breaks as the runtime reads them (``tr_break``). Breaks that occur once are in the order of their times."""
        return np.array(sorted(self.breaks, key=lambda c: (c.period > 0.0, c.time)), float).reshape(-1)

    def break_times(self, until: float) -> list[float]:
        """All occurrences of breaks before ``until``, s, in order and without repetition."""
        found = {c.time for c in self.breaks if not c.period}
        for c in self.breaks:
            count = max(0, math.ceil((until - c.time) / c.period)) if c.period else 0
            found.update(c.time + k * c.period for k in range(count))
        return sorted(t for t in found if t < until)


def numbers_of(scene: sm.Scene, system: System, devices: Builder) -> Numbers:
    """The start values, tables and scales of a run of this scene."""
    q, v = np.zeros(system.nq), np.zeros(system.nv)
    q_given, v_given, by_rate = np.zeros(system.nq), np.zeros(system.nv), np.zeros(system.nv)
    for j in system.tree:
        kind, start = j.kind, scene.joints[j.name].start
        values = np.zeros(kind.nq)
        if kind.quaternion >= 0:
            values[kind.quaternion] = 1.0
        level = GIVEN[start.use] if start is not None else 0.0
        given = level if start is not None and start.q is not None else 0.0
        if start is not None and start.q is not None:
            values = coordinates(start.q, kind.nq, kind.quaternion)
        states = state_coordinates(j)
        q[j.q0 : j.q0 + len(states)] = values[list(states)]
        q_given[j.q0 : j.q0 + len(states)] = given
        by_rate[j.v0 : j.v0 + len(j.free)] = given
        if start is not None and start.qd is not None:
            rates = np.atleast_1d(np.array(start.qd, float))
            v[j.v0 : j.v0 + len(j.free)] = rates[list(j.free)]
            v_given[j.v0 : j.v0 + len(j.free)] = level
    tables = tuple(_table(use, t) for use, t in devices.tables)
    length = length_scale(scene)
    inputs = np.array([float(i.start) for i in scene.inputs.values()])
    rate = rate_scale(scene, v / np.where(turning(system), 1.0, length), length)
    speed = length * rate
    energy = sum(mass_properties(b)[0] for b in scene.bodies.values()) * (speed * speed)  # ``speed**2`` could raise OverflowError
    return Numbers(q, v, q_given, v_given, tables, breaks(scene), length, rate, energy, inputs, notes_of(scene, system), by_rate)


def notes_of(scene: sm.Scene, system: System) -> tuple[str, ...]:
    """Notes about values that are not used, and about cut joints whose forces depend on their angles."""
    given = [(j, scene.joints[j.name]) for j in system.joints]
    elsewhere = "not used, because forces at this joint depend on its angle; the loop is cut elsewhere"
    beyond = "its forces by angle are wrong beyond half a turn, and no other joint of the loop can be cut"
    unused = [(j, scene.joints[j.name]) for j in system.tree if j.driven and not j.free]
    return (
        *(f"cut of {j.name}: {elsewhere}" for j, own in given if own.cut and not j.cut),
        *(f"loop cut at {j.name}: {beyond} without such a force" for j, own in given if j.cut and has_force_by_angle(own)),
        *(f"start of {j.name}: not used, because its motion is prescribed" for j, own in unused if own.start is not None),
    )


def _table(use: str, t: Table | sm.Input) -> SignalCurve | ExternalInput:
    if isinstance(t, sm.Input):
        return ExternalInput(use == "tracked", float(t.start), float(t.bandwidth), -math.inf if t.begin is None else float(t.begin))
    return curve(t, use == "drive")


def coordinates(q: sm.Coordinates, nq: int, quaternion: int) -> np.ndarray:
    """Start coordinates as an array (nq). A rotation given by axis and angle becomes a unit quaternion."""
    if isinstance(q, sm.AxisAngle):
        a = 0.5 * float(q.angle)
        e = np.concatenate([[math.cos(a)], math.sin(a) * direction(q.axis)])
        return np.concatenate([np.zeros(nq - 4), e])
    out = np.atleast_1d(np.array(q, float))
    if quaternion >= 0:
        out[quaternion : quaternion + 4] /= np.linalg.norm(out[quaternion : quaternion + 4])
    return out


def breaks(scene: sm.Scene) -> tuple[Corner, ...]:
    """Times at which a signal has a corner or jumps, signal by signal. Steps end at these times."""
    late = (i.begin for i in scene.inputs.values() if i.begin is not None)
    return (*(c for _, s in signals(scene) for c in corners(s)), *(Corner(t) for t in late))


def length_scale(scene: sm.Scene) -> float:
    """Length scale, m: the largest size of any body, or the largest distance between two of a body's points, joint points and mass
    centre. If all these lengths are zero, the scale is the largest radius of gyration in mechanisms with wheels, otherwise 1."""
    sizes = [0.0]
    for b in scene.bodies.values():
        pts = [np.array(b.center, float), *(np.array(p, float) for p in b.points.values())]
        sizes += [float(np.linalg.norm(p - r)) for p in pts for r in pts]
        if b.box is not None:
            sizes.append(max(float(x) for x in b.box))
        if b.cylinder is not None:
            sizes.append(max(float(b.cylinder.length), 2 * float(b.cylinder.radius)))
        if b.sphere is not None:
            sizes.append(2 * float(b.sphere))
    for j in scene.joints.values():
        for side in (j.inboard, j.outboard):
            if isinstance(side, sm.Side) and not isinstance(side.point, str) and side.body != "ground":
                b = scene.bodies[side.body]
                sizes.append(float(np.linalg.norm(np.array(side.point, float) - np.array(b.center, float))))
        for found in sides_of(scene, j) if poses_of(scene, j) is not None else ():
            if found.body != "ground":
                sizes.append(math.dist(found.point, scene.bodies[found.body].center))
    wheels = any(j.module or j.radii for j in scene.joints.values())
    return max(sizes) or (max(map(gyration, scene.bodies.values()), default=0.0) if wheels else 0.0) or 1.0


def gyration(body: sm.Body) -> float:
    """Largest radius of gyration of a body, m; 0 if its mass is 0."""
    mass, _, inertia = mass_properties(body)
    return math.sqrt(max(0.0, float(np.linalg.eigvalsh(inertia)[-1])) / mass) if mass > 0.0 else 0.0


def turning(system: System) -> np.ndarray:
    """For each rate of the state (nv): whether it is an angular velocity, rad/s, and not a velocity, m/s."""
    return np.array([j.kind.turns(k) for j in system.tree for k in j.free], bool)


def rate_scale(scene: sm.Scene, v: np.ndarray, length: float) -> float:
    """Rate scale, 1/s: √(g/length), or 1 without gravity, but at least the largest start rate. v: start rates, 1/s; translational
    velocities are divided by the length scale."""
    g = float(np.linalg.norm(np.array(scene.gravity, float)))
    base = math.sqrt(g / length) if g else 1.0
    return max([base, *np.abs(v).tolist()])
