"""Rows of the gallery about joints that share a load: a door on its hinges. One row concerns a marginal event."""

from __future__ import annotations

import math

import numpy as np

from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import holding, ran
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

G = 9.81
DOOR, REACH, SPACING = 30.0, 0.45, 1.5
"""Data of the door: mass, kg; distance from the hinges to the mass centre, m; distance between the hinges, m."""
MU, RADIUS, HALF, THRUST = 0.15, 0.006, 0.03, 0.008
"""Data of a hinge: friction coefficient; radius and half length of the pin and radius of the end face, m."""
BLOCK, MU_TABLE, SPRING = 2.0, 0.3, 500.0
"""Data of the block: mass, kg; friction coefficient; stiffness of its spring, N/m."""


def friction_of_door(spacing: float) -> float:
    """Friction torque of the door, N m. The weight's couple W a loads four equal contacts in line, at z = ±s/2 ± c, in proportion
    to z: Σ|F| = W a 2s/(s² + 4c²) for c ≤ s/2. The end faces carry W. For one journal of half length c (s = 0), Σ|F| = W a/c."""
    weight = DOOR * G
    pressed = REACH * weight * (2 * spacing / (spacing**2 + 4 * HALF**2) if spacing else 2 / SPACING)
    return MU / math.hypot(1, MU) * RADIUS * pressed + MU * weight * THRUST


def door(beyond: float, rate: float = 0.0, spacing: float = SPACING) -> sm.Scene:
    """A door on two hinges with a torque of 1 + beyond times its friction. With spacing 0, the door has one hinge as long as the
    distance of the two hinges."""
    rub = sm.Friction(mu=MU, radius=RADIUS, half_length=HALF if spacing else SPACING / 2, thrust_radius=THRUST)
    points = {"low": (0.0, 0.0, -spacing / 2)} | ({"high": (0.0, 0.0, spacing / 2)} if spacing else {})
    body = sm.Body(mass=DOOR, inertia=(10.0, 12.0, 2.0), center=(REACH, 0.0, 0.0), points=points)
    push = {"low": (1 + beyond) * friction_of_door(spacing)}
    joints = {
        n: sm.Joint("revolute", f"ground.{n}", f"door.{n}", axis="z", friction=rub, start=sm.Start(0.0, rate), effort=push.get(n))
        for n in points
    }
    until = sm.Simulation(until=0.01)
    return sm.Scene({"door": body}, joints, "door", gravity=(0.0, 0.0, -G), ground=sm.Ground(points), simulation=until)


def turning(beyond: float) -> sm.Scene:
    """The door, which turns so slowly that its centrifugal force is 1e-12 of its weight."""
    return door(beyond, 1e-6)


def going(scene: sm.Scene) -> str:
    """Verdict on whether the door slows down or speeds up."""
    r = ran(scene)
    return r.outcome.name if not r.outcome.ok else "speeds up" if r["low.qdd[1]"][0] * r["low.qd[1]"][0] > 0 else "slows down"


def settling(beyond: float) -> sm.Scene:
    """A block on a rough table, released at (3 + 3 beyond) μ m g/k from the relaxed spring. Half a period later it is at rest,
    and the spring pulls with (1 + 3 beyond) μ m g."""
    most = MU_TABLE * BLOCK * G / SPRING
    rub = sm.Friction(mu=MU_TABLE, half_width=0.01, half_height=0.01, half_length=0.5)
    slide = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub, spring=sm.Spring(SPRING),
                     start=sm.Start(3 * (1 + beyond) * most, 0.0))  # fmt: skip
    until = sm.Simulation(until=1.2 * math.pi * math.sqrt(BLOCK / SPRING))
    body = sm.Body(mass=BLOCK, inertia=(0.1, 0.1, 0.1))
    return sm.Scene({"block": body}, {"slide": slide}, "marginal", gravity=(0.0, 0.0, -G), simulation=until)


def settles(scene: sm.Scene) -> str:
    """Words for the motion after the block comes to rest, by every method at three tolerances."""
    until, words = float(scene.simulation.until), set()
    for method in ("auto", "rk5", "rk8", "rosenbrock"):
        for rtol in (1e-7, 1e-8, 1e-9):
            r = simulate(scene, until=until, every=until, rtol=rtol, method=method)
            words.add(", ".join(e.kind for e in r.events) if r.outcome.ok else r.outcome.name)
    return words.pop() if len(words) == 1 else f"by method and tolerance: {sorted(words)}"


def crooked() -> float:
    """Friction of the door by least-norm reactions, relative to the correct friction. numpy's least squares gives the force and the
    couple on each hinge. As in a pseudo-inverse, N and N m have equal weights."""
    couple = REACH * DOOR * G
    force, inside = np.linalg.lstsq(np.array([[SPACING / 2, 1.0]]), [couple / 2], rcond=None)[0]
    pressed = 2 * sum(abs(force / 2 + side * inside / (2 * HALF)) for side in (-1, 1))
    right = friction_of_door(SPACING) - MU * DOOR * G * THRUST
    return MU / math.hypot(1, MU) * RADIUS * pressed / right


ROWS = (
    Row(24, "door", "loads that two hinges share", (
        Edge("friction of its four contacts at rest", door, holding, "holds", "slips"),
        Edge("the same while it turns", turning, going, "slows down", "speeds up"),
        Edge("as one journal as long as both are apart", lambda b: door(b, 0.0, 0.0), holding, "holds", "slips"),),
        "reactions of least norm press couples into the pins"),
    Row(25, "marginal", "a marginal event", (
        Edge("stop where the spring pulls with μ N", settling, settles, "stick", "reversal"),), "decided by the tolerance"),
)  # fmt: skip
