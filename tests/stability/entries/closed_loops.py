"""Rows of the gallery about closed loops: their scenes and verdicts."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from tests.engine.mechanisms.planar_friction_loops import FOUR_BAR
from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import bundled, holding, honest, ran
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm


def four_bar(beyond: float) -> sm.Scene:
    """Four joints with friction in a loop. The additional torque is 1 + beyond times the largest torque that the joints hold by
    plane statics."""
    scene = FOUR_BAR.scene((1 + beyond) * FOUR_BAR.most(1.0))
    return replace(scene, simulation=sm.Simulation(until=0.01))


def reaching(beyond: float) -> sm.Scene:
    """A crank-slider whose guide is so high that crank and rod must stand upright. Crank and rod are 1 + beyond times as long as
    needed."""
    scene = load_scene("crank_slider_free")
    height, joints = 1.5 / (1 + beyond), dict(scene.joints)
    joints["guide"] = replace(joints["guide"], inboard=sm.Side("ground", (0.0, height, 0.0)), start=sm.Start(0.0, 0.0))
    joints["crank_pivot"] = replace(joints["crank_pivot"], start=sm.Start(math.pi / 2 - 0.1, 0.0))
    joints["slider_pin"] = replace(joints["slider_pin"], start=sm.Start(math.pi / 2 + 0.05, 0.0))
    return replace(scene, joints=joints, simulation=sm.Simulation(until=0.3), outputs=("*",))


def hanging(energy: float, until: float) -> sm.Scene:
    """The two-four-bar with its cranks down. Its energy is ``energy`` times the energy that lifts it until the cranks lie flat (2:
    over the top)."""
    scene, rate = load_scene("n_four_bar"), math.sqrt(7 * 9.81 / 3 * energy)
    joints = dict(scene.joints)
    for name, joint in scene.joints.items():
        if joint.start is not None:
            turn = 1.0 if name.startswith("pivot") else -1.0
            joints[name] = replace(joint, start=sm.Start(turn * math.pi, turn * rate))
    return replace(scene, joints=joints, simulation=sm.Simulation(until=until), outputs=("*",))


def lifted(scene: sm.Scene, to: float, word: str, rows: int) -> str:
    """Verdict on whether the cranks turn beyond an angle, in a correct run. The mean of the cranks counts, because flat cranks can
    move independently."""
    r = ran(scene, 1e-10, rows)
    most = float(np.mean([r[f"pivot{k}.q[1]"] for k in range(3)], axis=0).max())
    lost = np.abs(r["energy.residual"]).max() / r["energy.kinetic"].max()
    return f"{r.outcome.name}, energy {lost:.1e}" if not r.outcome.ok or lost > 1e-6 else word if most > to else "turns back"


def bricard(beyond: float) -> sm.Scene:
    """Bricard's mechanism. Below the threshold, its last pivot is 1e-6 of a bar's length away from its place."""
    scene = load_scene("bricard")
    ground = sm.Ground({"p0": (0.0, 0.0, 0.0), "p5": (max(-beyond, 0.0), 0.0, 1.0)})
    return replace(scene, ground=ground, simulation=sm.Simulation(until=1.0), outputs=("*",))


def closing(scene: sm.Scene) -> str:
    """Verdict on whether the mechanism closes and its run is right. For a right run, also the number of joints whose reactions are
    reported as not unique."""
    word = honest(scene)
    return f"{word}, {len(ran(scene).certificate.not_unique)} joints' reactions not unique" if word == "right" else word


ROWS = (
    Row(10, "loop_drift", "loop drift", (
        Edge("100 s", bundled("crank_slider_free", 100.0), honest, "right"),
        Edge("links just long enough to close the loop", reaching, honest, "open_loop", "right"),),
        "closure drifts, or is only held softly"),
    Row(11, "bifurcation", "dead centre and bifurcation", (
        Edge("energy to reach the top, through the flat position", lambda b: hanging(2 * (1 + b), 4.0),
             partial(lifted, to=2 * math.pi, word="goes over", rows=100), "turns back", "goes over"),
        Edge("energy to reach the flat position", lambda b: hanging(1 + b, 1.0),
             partial(lifted, to=1.5 * math.pi, word="passes", rows=10_000), "turns back", "passes"),),
        "singular matrix at the dead centre"),
    Row(12, "redundant", "redundant loops", (
        Edge("last pivot out of line / in line", bricard, closing, "open_loop", "right, 6 joints' reactions not unique"),),
        "singular constraint matrix from the start"),
    Row(14, "sticking_loop", "several joints sticking in one loop", (
        Edge("the largest torque that plane statics allows", four_bar, holding, "holds", "slips"),),
        "friction of least norm slips too early"),
)  # fmt: skip
