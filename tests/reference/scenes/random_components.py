"""Random pieces of scenes: bodies, joint sides, frictional contacts, devices, drives, loads."""

from __future__ import annotations

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import GROUND
from tests.reference.mechanics.joint_constraints import of
from tests.reference.mechanics.rotation import random_rotation
from tests.reference.mechanics.time_signals import drive_motion
from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm

AXIS_NAMES = ("x", "y", "z", "-x", "-y", "-z")
APART = ("screw", "point_on_plane")
"""Types whose friction is tested in ``test_screw_thread_friction`` and ``test_bodies_on_feet``: random scenes do not change."""
RUBBING_TYPES = tuple(k.name for k in REGISTRY.values() if k.friction and not k.bodiless and k.name not in APART)
SIZED = ("journal", "shaft", "sleeve", "ball", "cross")
"""Contact elements whose sizes are chosen below so that the equations have one root. All other elements have small sizes."""


def numbers(rng, n: int, size: float = 1.0) -> tuple[float, ...]:
    """n uniform numbers in +-size."""
    return tuple(float(x) for x in rng.uniform(-size, size, n))


def unit(rng) -> tuple[float, ...]:
    """A random direction, not normalised."""
    return tuple(float(x) for x in rng.normal(size=3))


def body(rng) -> sm.Body:
    """A body of any shape or with explicit inertia, off-centre. Joints may be at the points a and b, springs at s."""
    points = {name: numbers(rng, 3, 0.4) for name in ("a", "b", "s")}
    common = {"center": numbers(rng, 3, 0.3), "points": points}
    size = [float(x) for x in rng.uniform(0.15, 0.6, 3)]
    shape = rng.integers(5)
    weight = {"density": float(rng.uniform(100, 900))} if rng.random() < 0.5 else {"mass": float(rng.uniform(0.5, 5))}
    if shape == 0:
        return sm.Body(box=tuple(size), **weight, **common)
    if shape == 1:
        solid = sm.Cylinder(radius=size[0], length=size[1], axis=str(rng.choice(AXIS_NAMES)))
        return sm.Body(cylinder=solid, **weight, **common)
    if shape == 2:
        return sm.Body(sphere=size[0], **weight, **common)
    mass = float(rng.uniform(0.5, 5))
    axes = random_rotation(rng) if shape == 3 else np.eye(3)
    squares = np.square(size)
    inertia = mass / 3 * axes @ np.diag(np.sum(squares) - squares) @ axes.T
    xy = [inertia[0, 1], inertia[0, 2], inertia[1, 2]] if shape == 3 else []
    return sm.Body(mass=mass, inertia=tuple(float(x) for x in [*np.diag(inertia), *xy]), **common)


def sides(rng, kind: str, inboard: str, outboard: str, plain: bool = False) -> dict:
    """Both sides of a joint and their axes. The notation is one of those that a scene file allows."""
    way, needs_axis = rng.integers(4), REGISTRY[kind].needs_axis
    if way == 0:  # A general frame for each side.
        both = [sm.Side(b, numbers(rng, 3, 0.4), axis=unit(rng), reference=unit(rng)) for b in (inboard, outboard)]
        return {"inboard": both[0], "outboard": both[1]}
    ends = {"inboard": _end(rng, inboard), "outboard": _end(rng, outboard)}
    if not needs_axis and rng.random() < 0.6:
        return ends
    if way == 1:  # One named axis for both sides, with the default reference.
        return {**ends, "axis": str(rng.choice(AXIS_NAMES))}
    if way == 2:  # one general axis for both sides, with the default reference or a given reference
        return {**ends, "axis": unit(rng), "reference": unit(rng) if rng.random() < 0.5 else None}
    side = sm.Side(inboard, "a", axis=unit(rng))  # a separate axis for one side; the other side has the axis of the joint
    return {"inboard": side, "outboard": ends["outboard"], "axis": str(rng.choice(AXIS_NAMES))}


def _end(rng, part: str) -> str:
    return f"{part}.{rng.choice(['a', 'b'])}" if rng.random() < 0.7 else part


def friction(rng, kind: str, laws=("regularized", "viscous"), adams: float = 0.2) -> sm.Friction:
    """Friction small enough for one root: mu r and mu e / c are well below the arms of the masses."""
    law = str(rng.choice(laws))
    element = REGISTRY[kind].friction
    sliding = element in ("sleeve", "shaft")

    def some(low, high):
        return float(rng.uniform(low, high))

    entries = {"mu": some(0.05, 0.15) if sliding else some(0.1, 0.6), "law": law, "v_eps": some(1e-3, 1e-2)}
    if law == "viscous":
        entries["viscosity"] = some(0.01, 0.1) if sliding else some(0.05, 0.5)
    elif law in ("stribeck", "lugre"):
        entries |= {"mu_static": entries["mu"] * some(1.0, 1.5), "v_stribeck": some(0.01, 0.1), "viscosity": some(0.01, 0.1)}
        if law == "lugre":
            entries |= {"bristle_stiffness": some(200.0, 2000.0), "bristle_damping": some(0.0, 0.5)}
    elif rng.random() < 0.3:
        entries["v_eps"] = some(0.1, 0.5)  # Some pairs slide inside the linear part of (104).
    for n in LAWS[law].numbers:
        if n.needed and n.default is None and n.name not in entries:
            entries[n.name] = entries.get(n.not_below, 0.0) + some(0.05, 0.3)
    if element not in SIZED:
        entries |= {s.name: some(0.005, 0.03) for s in CONTACTS[element].sizes if s.needed}
    elif element == "cross" and rng.random() < 0.5:
        entries |= {"radius": (some(0.005, 0.03), some(0.005, 0.03)), "half_length": (some(0.05, 0.2), some(0.05, 0.2))}
    elif element == "sleeve":
        entries |= {"half_width": some(0.02, 0.1), "half_height": some(0.02, 0.1), "half_length": some(0.5, 0.9)}
    else:
        entries |= {"radius": some(0.005, 0.03)}
        if element != "ball":
            entries |= {"half_length": some(0.5, 0.9) if sliding else some(0.05, 0.3)}
    if element == "journal" and rng.random() < 0.4:
        entries["thrust_radius"] = some(0.002, 0.02)
    if rng.random() < adams:
        entries["normal_force"] = "adams"
    return sm.Friction(**entries)


def load(rng, size: float):
    """A number, a signal or the input "push"."""
    way = rng.integers(5)
    if way == 0:
        return sm.FromInput("push")
    if way == 1:
        return sm.Signal(harmonic=sm.Harmonic(size, float(rng.uniform(0.2, 2)), float(rng.uniform(-2, 2)), size / 3))
    if way == 2:
        return sm.Signal(ramp=sm.Ramp(*numbers(rng, 2, size), duration=float(rng.uniform(0.2, 1))))
    return float(rng.uniform(-size, size))


def applied(rng, parts: list[str]) -> dict:
    """Zero to three forces, torques and spring-dampers."""
    out = {}
    for i in range(rng.integers(0, 4)):
        on, frame = str(rng.choice([p for p in parts if p != GROUND])), str(rng.choice(["world", "body"]))
        way = rng.integers(3)
        if way == 0:
            on = f"{on}.a" if rng.random() < 0.5 else on
            out[f"f{i}"] = sm.Force("force", on, tuple(load(rng, 5.0) for _ in range(3)), frame)
        elif way == 1:
            out[f"f{i}"] = sm.Torque("torque", on, tuple(load(rng, 1.0) for _ in range(3)), frame)
        elif len(parts) > 1:
            other = str(rng.choice([p for p in parts if p != on]))
            ends = (f"{on}.s", other if rng.random() < 0.3 else f"{other}.s")
            stiffness, damping, length = (float(x) for x in rng.uniform([5, 0.1, 0.1], [50, 3, 1]))
            out[f"f{i}"] = sm.SpringDamper("spring_damper", ends, stiffness, damping, length)
    return out


def devices(rng, kind: str, q) -> dict:
    """Springs, damping, stops and efforts of a joint, each on a random subset of its freedoms."""
    n, scalar = len(of(kind).free), of(kind).scalars

    def some(make, upto, chance=0.4):
        entries = tuple(make(k) if k < upto and rng.random() < chance else None for k in range(n))
        if not any(e is not None for e in entries):
            return None
        return entries[0] if n == 1 else entries

    def stops(k):
        gap, hard = rng.uniform(-0.3, 0.3, 2), float(rng.uniform(10, 100))
        lower, upper = float(q[k] - 0.2 + gap[0]), float(q[k] + 0.4 + gap[1])
        return sm.EndStops(hard, lower, upper if rng.random() < 0.7 else None, float(rng.uniform(0, 0.6)))

    return {
        "spring": some(lambda k: sm.Spring(float(rng.uniform(1, 20)), float(rng.uniform(-1, 1))), scalar),
        "damping": some(lambda k: float(rng.uniform(0.05, 1)), n),
        "end_stops": some(stops, scalar, 0.3),
        "effort": some(lambda k: load(rng, 2.0), n, 0.3),
    }


def drive(rng, t: float) -> tuple[sm.Drive, float, float]:
    """A drive of any kind and its position and rate at time t."""
    way = rng.integers(4)
    if way == 0:
        out = sm.Drive(constant=sm.Constant(*numbers(rng, 2, 2.0)))
    elif way == 1:
        begin, duration = float(rng.uniform(0, 0.5)), float(rng.uniform(0.2, 1))
        out = sm.Drive(ramp=sm.Ramp(*numbers(rng, 2, 2.0), duration, begin, origin=float(rng.uniform(-1, 1))))
    elif way == 2:
        out = sm.Drive(harmonic=sm.Harmonic(*(float(x) for x in rng.uniform([0.1, 0.2, -2, -1], [0.6, 1, 2, 1]))))
    else:
        times = np.cumsum(rng.uniform(0.2, 0.6, 5)) - 0.2
        # the kind of spline is not drawn at random, so that the rest of the scene stays the same
        way = ("natural", "clamped", "monotone")[int(1e6 * times[0]) % 3]
        out = sm.Drive(table=sm.Table(tuple(float(x) for x in times), numbers(rng, 5, 1.0), interpolation=way))
    q, qd, _ = drive_motion(out, t)
    return out, q, qd


def coordinates(rng, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Random q and rates of a joint type."""
    free = of(kind).free
    size = np.array([0.4 if d < 3 else 3.0 for d in free])
    q = size * rng.uniform(-1, 1, len(free))
    if of(kind).ball:
        ball = rng.normal(size=4)
        q = np.r_[q[: of(kind).scalars], ball / np.linalg.norm(ball)]
    return q, rng.uniform(-2, 2, len(free))
