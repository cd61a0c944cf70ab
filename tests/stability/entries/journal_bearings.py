"""Rows of the gallery about pins in journals: wheels, bars and cross joints that press on their bearings."""

from __future__ import annotations

import math

import numpy as np

from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import accepted, holding, ran, settled
from trunnion.scene.data_classes import scene as sm

STEEL, G = 7800.0, 9.81
TORQUE = 0.2 * 40.0 * 0.015


def rotor(
    push: float, until: float, rate: float = 20.0, thrust: float = 0.0, thrust_radius: float | None = None, torque: float = 0.0
):
    """A wheel that turns about a level journal. Its weight, a push upward that grows from 0 to ``push`` weights, and an axial
    thrust act on the wheel."""
    mass = 3.0
    wheel = sm.Body(cylinder=sm.Cylinder(0.1, 0.05, "y"), mass=mass)
    rub = sm.Friction(mu=0.2, radius=0.01, half_length=0.02, thrust_radius=thrust_radius)
    joint = sm.Joint("revolute", "ground", "wheel", axis="y", friction=rub, start=sm.Start(0.0, rate))
    forces: dict[str, sm.Applied] = {}
    if push:
        up = sm.Signal(table=sm.Table((0.0, until), (0.0, push * mass * G)))
        forces["push"] = sm.Force("force", "wheel", (0.0, 0.0, up))
    if thrust:
        forces["thrust"] = sm.Force("force", "wheel", (0.0, thrust, 0.0))
        forces["torque"] = sm.Torque("torque", "wheel", (0.0, torque, 0.0))
    gravity = (0.0, 0.0, -G) if push else (0.0, 0.0, 0.0)
    return sm.Scene(
        {"wheel": wheel}, {"axle": joint}, "rotor", gravity=gravity, forces=forces, simulation=sm.Simulation(until=until)
    )


def normal_turn(scene: sm.Scene) -> str:
    """Verdict on whether the contact's normal turns by π while the wheel continues to turn, with finite numbers only."""
    r = ran(scene, rows=101)
    n = np.array([r[f"axle.contact[1].normal[{k}]"] for k in (1, 2, 3)])
    turned = float(n[:, 1] @ n[:, -1]) < 0.0
    wild = not np.isfinite(r["axle.friction.torque[1]"]).all()
    return "not finite" if wild or not r.outcome.ok else "separates" if turned else "stays"


def crossed(angle: float) -> sm.Scene:
    """A universal joint whose second axis is inclined to the first axis. At angle 0 the axes would be parallel."""
    rub = sm.Friction(mu=0.3, radius=0.01, half_length=0.03)
    arm = sm.Body(box=(1.0, 0.1, 0.1), density=STEEL, center=(0.5, 0.0, 0.0))
    joint = sm.Joint("universal", "ground", "arm", axis="y", reference=(0.0, math.cos(angle), math.sin(angle)), friction=rub)
    return sm.Scene({"arm": arm}, {"cross": joint}, "crossed", simulation=sm.Simulation(until=0.2))


def overhung(half_length: float) -> sm.Scene:
    """A bar on a level journal. The journal also carries the bar's bending moment: its ends press with m/(2c)."""
    bar = sm.Body(box=(0.5, 0.05, 0.05), density=STEEL, center=(0.25, 0.2, 0.0))
    rub = sm.Friction(mu=0.1, radius=0.02, half_length=half_length)
    joint = sm.Joint("revolute", "ground", "bar", axis="y", friction=rub, start=sm.Start(0.0, 0.0))
    return sm.Scene({"bar": bar}, {"pin": joint}, "overhung", simulation=sm.Simulation(until=0.2))


GRIP = 0.1 / math.hypot(1, 0.1) * 0.02 * 0.2 / 0.25
"""Half length of the overhung bar's journal at which friction is its weight's torque: μ/√(1+μ²) r M/(2c) · 2 = W a."""

ROWS = (
    Row(3, "no_reaction", "reaction → 0", (
        Edge("push up to the weight", lambda b: rotor(1 + b, 0.2), normal_turn, "stays", "separates"),),
        "contact normal undefined: 0/0"),
    Row(5, "parallel_cross", "universal cross axes nearly parallel", (
        Edge("axes 1e-6 rad apart", lambda b: crossed(1e-6 * (1 + b)), accepted, "refused", "right"),),
        "a singular Jacobian in the middle of a run"),
    Row(6, "short_journal", "half length c → 0", (
        Edge("c at which the bending moment makes the pin hold", lambda b: overhung(GRIP * (1 + b)), holding, "holds", "slips"),
        Edge("c = 0 ∓ 1 µm", overhung, settled, "refused", "holds"),), "division by c"),
    Row(17, "axial_thrust", "axial thrust on a journal", (
        Edge("torque μ F R on the end face", lambda b: rotor(0.0, 0.01, 0.0, 40.0, 0.015, TORQUE * (1 + b)), holding,
        "holds", "slips"),), "an end face has no arm"),
)  # fmt: skip
