"""A whole scene, with every device, in a turned world, in a mirror, or in other units."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import part
from tests.reference.scenes.frame_changes import scaled_load, triple
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_poses_and_joint_sides import turns, vector
from trunnion.scene.queries.numbers_by_path import unit_of

POWERS = {"kg": (0, 1, 0), "m": (1, 0, 0), "s": (0, 0, 1), "N": (1, 1, -2), "J": (2, 1, -2), "W": (2, 1, -3), "Hz": (0, 0, -1)}
"""Powers of length, mass and time of each unit. The powers of all other units (rad, 1) are zero."""


def directions(axis: sm.Direction | None, reference: sm.Direction | None) -> tuple[np.ndarray, np.ndarray]:
    """Axis and reference of a joint or bushing, with the defaults that SCENE.md names."""
    e = np.eye(3)
    if axis is None:
        return e[0], e[1]
    a = np.array(vector(axis))
    return a, e[(int(np.argmax(np.abs(a))) + 1) % 3] if reference is None else np.array(vector(reference))


def image(scene: sm.Scene, Q: np.ndarray) -> sm.Scene:
    """The scene whose points and directions, also of bodies, are all mapped by an orthogonal matrix Q. If det Q = -1,
    the map is a reflection.

    Angles and the travels of prismatic joints keep their numbers; other travels change their sign in a mirror."""
    sense = float(np.sign(np.linalg.det(Q)))
    joints = {n: _joint(scene, j, Q, sense) for n, j in scene.joints.items()}
    forces: dict[str, Any] = {}
    for n, f in scene.forces.items():
        forces |= _load(scene, n, f, Q, sense)
    ground = sm.Ground({n: triple(Q @ p) for n, p in scene.ground.points.items()})
    bodies = {n: _body(b, Q, sense) for n, b in scene.bodies.items()}
    return replace(scene, bodies=bodies, joints=joints, forces=forces, ground=ground, gravity=triple(Q @ scene.gravity))


def _body(b: sm.Body, Q: np.ndarray, sense: float) -> sm.Body:
    p = part(b)
    J = Q @ p.inertia @ Q.T

    def turned(t: sm.Turn) -> sm.Turn:
        axis = Q @ vector(t.axis)
        return sm.Turn(triple(axis), towards=triple(Q @ t.towards)) if t.towards else sm.Turn(triple(sense * axis), t.angle)

    return sm.Body(
        mass=p.mass, inertia=triple(np.diag(J)) + triple((J[0, 1], J[0, 2], J[1, 2])), center=triple(Q @ p.center),
        points={n: triple(Q @ x) for n, x in b.points.items()}, position=triple(Q @ b.position) if b.position else None,
        orientation=tuple(map(turned, turns(b))) or None,
    )  # fmt: skip


def _joint(scene: sm.Scene, j: sm.Joint, Q: np.ndarray, sense: float) -> sm.Joint:
    kind = REGISTRY[j.type]
    M = Q if kind.name == "prismatic" else sense * Q

    def side(x: str | sm.Side) -> str | sm.Side:
        if isinstance(x, str):
            return x
        a, r = directions(x.axis or j.axis, x.reference or j.reference)
        own = {"axis": triple(M @ a), "reference": triple(M @ r)} if x.axis or x.reference else {}
        return replace(x, point=x.point if isinstance(x.point, str) else triple(Q @ x.point), **own)

    a, r = directions(j.axis, j.reference)
    at = triple(Q @ j.at) if isinstance(j.at, tuple) else j.at
    new = replace(j, inboard=side(j.inboard), outboard=side(j.outboard), axis=triple(M @ a), reference=triple(M @ r), at=at)
    if sense > 0.0:
        return new
    if kind.pitched and j.pitch is not None:
        new = replace(new, pitch=-j.pitch)
    if j.curve is not None:
        new = replace(new, curve=replace(j.curve, points=tuple((-x, -y) for x, y in j.curve.points)))
    if j.profile is not None:
        new = replace(new, profile=replace(j.profile, angle=tuple(x + math.pi for x in j.profile.angle)))
    slides = [k for k in range(kind.nv) if not kind.turns(k) and kind.name != "prismatic"]
    return _other_sense(scene, new, slides, kind.nv) if slides else new


def _other_sense(scene: sm.Scene, j: sm.Joint, which: list[int], n: int) -> sm.Joint:
    """The joint, in which all numbers along these freedoms (of its n freedoms) change sign. ValueError for devices without a rule
    for this."""
    if j.latch is not None or j.motor is not None or j.drive is not None:
        raise ValueError("no image of drives, motors and latches of joints that slide and turn")

    def each(value: Any, change: Callable[[Any], Any]) -> Any:
        if value is None or n == 1:
            return value if value is None else change(value)
        entries = value if isinstance(value, tuple) else (value,) * n
        return tuple(change(x) if k in which and x is not None else x for k, x in enumerate(entries))

    def stops(x: sm.EndStops) -> sm.EndStops:
        lower, upper = (None if e is None else -e for e in (x.upper, x.lower))
        return replace(x, lower=lower, upper=upper)

    start = j.start and sm.Start(each(j.start.q, lambda x: -x), each(j.start.qd, lambda x: -x))
    return replace(
        j, start=start, spring=each(j.spring, lambda x: replace(x, rest=-x.rest)), end_stops=each(j.end_stops, stops),
        effort=each(j.effort, lambda x: scaled_load(scene, x, -1.0)),
    )  # fmt: skip


def _load(scene: sm.Scene, name: str, f: Any, Q: np.ndarray, sense: float) -> dict[str, Any]:
    """The image of a load. A varying force becomes one load for each component, because signals cannot be added."""
    if f.type == "spring_damper":
        return {name: f}
    if f.type == "bushing":
        a, r = directions(f.axis, f.reference)
        return {name: replace(f, axis=triple(Q @ a), reference=triple(Q @ r))}
    M, values = Q if f.type == "force" else sense * Q, getattr(f, f.type)
    if all(isinstance(x, int | float) for x in values):
        return {name: replace(f, **{f.type: triple(M @ values)})}
    return {
        f"{name}_{k}": replace(f, **{f.type: tuple(scaled_load(scene, x, float(M[i, k])) for i in range(3))})
        for k, x in enumerate(values)
    }


def powers(unit: str) -> np.ndarray:
    """Powers of length, mass and time of a unit such as kg*m^2 or N*m/rad."""
    out = np.zeros(3)
    for place, group in enumerate(unit.split("/")):
        for factor in group.split("*"):
            name, _, power = factor.partition("^")
            out += (-1.0 if place else 1.0) * float(power or 1) * np.array(POWERS.get(name, (0, 0, 0)))
    return out


def factor(unit: str, length: float, mass: float, time: float) -> float:
    """The factor of a number with this unit, for given factors of lengths, masses and times."""
    a, b, c = powers(unit)
    return length**a * mass**b * time**c


def scaled(scene: sm.Scene, length: float, mass: float, time: float) -> sm.Scene:
    """The scene with every length, mass and time multiplied by these factors. Every other number is multiplied according to its
    dimension."""

    def walk(value: Any, path: tuple[str | int, ...]) -> Any:
        if isinstance(value, float):
            return value * factor(unit_of(scene, path), length, mass, time)
        if isinstance(value, dict):
            return {k: walk(x, (*path, k)) for k, x in value.items()}
        if isinstance(value, tuple):
            return tuple(walk(x, (*path, k)) for k, x in enumerate(value))
        if is_dataclass(value):
            return replace(value, **{f.name: walk(getattr(value, f.name), (*path, f.name)) for f in fields(value)})
        return value

    return walk(scene, ())
