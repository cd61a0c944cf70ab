"""Rows of the gallery about a self-tightening brake, whose ball turns about its contact or slides."""

from __future__ import annotations

import math

import numpy as np

from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import ran
from trunnion.scene.data_classes import scene as sm

MU, RADIUS, ARM, PRESS, SPIN = 0.4, 0.1, 0.08, 100.0, 20.0
"""Friction coefficient and radius (m) of the ball, arm of the lever, m, force along the shaft, N, speed of the shaft, rad/s."""
REACH = RADIUS * MU / math.hypot(1, MU)
V_EPS, UNTIL = 1e-4, 0.01
LEAVES = ARM * MU * PRESS
"""The torque on the lever, N m, at which the ball leaves its cone."""
GRIPS = MU * PRESS * math.sqrt(ARM**2 - REACH**2)
"""The least torque, N m, at which the ball can slide."""


def at_kink() -> float:
    """The torque (N m) at which the sliding of the ball reaches v_eps: K s = μ with K = RADIUS/V_EPS·μ (theory, "Ball")."""
    k = MU * RADIUS * SPIN / V_EPS
    side = MU * PRESS * math.sqrt((1 + k * k) / (k * k - MU * MU))
    rubbing = RADIUS * k * side**2 / math.sqrt((1 + k * k) * (side**2 + PRESS**2 * (1 + k * k)))
    return ARM * side - rubbing


def brake(torque: float, start: float, law: str) -> sm.Scene:
    """A shaft spins in a guide. A force presses the shaft along the guide, so that its ball is pressed into the seat of a lever. A
    pin that can slide along the lever holds the lever. A torque (N m), which changes from ``start`` to ``torque``, turns the lever.
    The pin carries no load along the lever. The ball's force has the components PRESS along the axis and y across it: ARM y =
    torque + REACH √(y² − μ² PRESS²), where the last term acts only while the ball slides. The equation has three roots between
    GRIPS and LEAVES, otherwise one root."""
    rub = sm.Friction(mu=MU, radius=RADIUS, law=law, v_eps=V_EPS if law == "regularized" else None)
    turned = sm.Signal(table=sm.Table((0.0, UNTIL), (start, torque)))
    joints = {
        "guide": sm.Joint("cylindrical", "ground", "shaft", axis="z", reference="x", start=sm.Start((0.0, 0.0), (0.0, SPIN))),
        "rail": sm.Joint("prismatic", "ground", "slide", axis="x", start=sm.Start(-ARM, 0.0)),
        "pin": sm.Joint("revolute", "slide", "lever", axis="z", start=sm.Start(0.0, 0.0), effort=turned),
        "ball": sm.Joint("spherical", "lever.seat", "shaft", friction=rub),
    }
    bodies = {
        "shaft": sm.Body(mass=2.0, inertia=(0.05, 0.05, 0.02)),
        "lever": sm.Body(mass=1.0, inertia=(0.01, 0.01, 0.01), points={"seat": (ARM, 0.0, 0.0)}),
        "slide": sm.Body(mass=0.5, inertia=(0.01, 0.01, 0.01)),
    }
    forces = {"press": sm.Force("force", "shaft", (0.0, 0.0, -PRESS))}
    return sm.Scene(bodies, joints, "fold", gravity=(0.0, 0.0, 0.0), forces=forces, simulation=sm.Simulation(until=UNTIL))


def tightened(beyond: float, law: str = "coulomb") -> sm.Scene:
    """The torque grows to 1 + beyond times the limit above which the ball cannot turn about its contact."""
    most = LEAVES if law == "coulomb" else at_kink()
    return brake((1 + beyond) * most, 0.5 * most, law)


def loosened(beyond: float, law: str = "coulomb") -> sm.Scene:
    """The torque falls to 1 − beyond times the limit below which the ball cannot slide."""
    return brake((1 - beyond) * GRIPS, 1.2 * LEAVES, law)


def folds(scene: sm.Scene) -> str:
    """The mode of the ball at the end, and the number of folds. The component of friction along the ball's turning shows the
    mode."""
    r = ran(scene, rtol=1e-9)
    if not r.outcome.ok or any(e.kind != "fold" for e in r.events):
        return f"{r.outcome.name}, {[e.kind for e in r.events]}"
    force, torque, rate = (
        np.array([r[f"ball.{x}[{k}]"][-1] for k in (1, 2, 3)]) for x in ("reaction.force", "friction.torque", "qd")
    )
    rub = scene.joints["ball"].friction
    assert rub is not None
    share = abs(torque @ rate) / (np.linalg.norm(rate) * np.linalg.norm(force) * REACH * rub.radius / RADIUS)
    does = "rubs" if share > 0.1 else "turns freely" if share < 1e-3 else f"rubs with {share:.1e}"
    return f"fold, {does}" if len(r.events) == 1 else f"{len(r.events)} folds, {does}" if r.events else does


ROWS = (
    Row(23, "fold", "a root ends at a fold", (
        Edge("torque at which the ball leaves its cone", tightened, folds, "turns freely", "fold, rubs"),
        Edge("least torque at which the ball can slide", loosened, folds, "rubs", "fold, turns freely"),
        Edge("the first, regularised", lambda b: tightened(b, "regularized"), folds, "turns freely", "fold, rubs"),
        Edge("the second, regularised", lambda b: loosened(b, "regularized"), folds, "rubs", "fold, turns freely"),),
        "no root, or a jump that nobody is told of"),
)  # fmt: skip
