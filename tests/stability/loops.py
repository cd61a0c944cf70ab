"""Rows about closed loops."""

from __future__ import annotations

from dataclasses import replace

from engine.scene import model as sm
from tests.engine.plane_loops import FOUR_BAR
from tests.stability.row import Row
from tests.stability.verdicts import bundled, holding, honest


def four_bar(beyond: float) -> sm.Scene:
    """Four rubbing joints in a loop, torque at the most that plane statics allows."""
    scene = FOUR_BAR.scene((1 + beyond) * FOUR_BAR.most(1.0))
    return replace(scene, simulation=sm.Simulation(until=0.01))


ROWS = (
    Row(10, "loop_drift", "loop drift", lambda b: bundled("crank_slider_free", 100.0)(b), honest, "right", "right",
        "closure drifts, or is only held softly"),
    Row(11, "bifurcation", "dead centre and bifurcation", lambda b: bundled("n_four_bar", 2.0)(b), honest, "right", "right",
        "singular matrix at the dead centre"),
    Row(12, "redundant", "redundant loops", lambda b: bundled("bricard", 2.0)(b), honest, "right", "right",
        "singular constraint matrix from the start"),
    Row(14, "sticking_loop", "several joints sticking in one loop", four_bar, holding, "holds", "slips",
        "minimum norm lets go at 71 % of the true band"),
)  # fmt: skip
