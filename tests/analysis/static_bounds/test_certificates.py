"""A result reported as certain is based on a state that exists. A load reported as open can change a force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.default_case_selection import sampled
from trunnion import hold, scene_from_dict
from trunnion.analysis.static_bounds.branch_and_bound import Search
from trunnion.analysis.static_bounds.hold_check import CELLS
from trunnion.analysis.static_bounds.linear_relaxation import Answer, Cell
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.analysis.static_bounds.sum_of_norms_program import Program, Row


def pushed_ball(rng: np.random.Generator) -> dict[str, Any]:
    """A body hangs on a ball with friction. A force pushes the body aside, and has a torque about the normal of the contact."""
    center, point = rng.uniform(0.001, 0.02, 3) * (1, 1, -1), rng.uniform(0.001, 0.02, 3)
    body = {"mass": 2, "inertia": [0.02] * 3, "center": center.tolist(), "points": {"p": (center + point).tolist()}}
    joint = {"type": "spherical", "inboard": "ground", "outboard": "b", "friction": {"mu": 0.5, "radius": 0.1}}
    push = {"type": "force", "on": "b.p", "force": [{"input": "u"}, 0, 0]}
    return {"schema": 1, "gravity": [0, 0, -10], "inputs": {"u": {"start": 0, "unit": "N"}}, "bodies": {"b": body},
            "joints": {"j": joint}, "forces": {"f": push}}  # fmt: skip


@pytest.mark.parametrize("seed", sampled(range(8), 1))
def test_a_ball_certainly_holds_no_push_that_turns_it_about_its_contact(seed: int) -> None:
    """A state is accepted if its forces are wrong by at most 1e-9 of the load of 20 N. The radius is up to 100 times the lever arm
    of the force."""
    load = hold(scene_from_dict(pushed_ball(np.random.default_rng(seed))), bounds=True, cells=3).load("inputs.u")
    assert max(abs(load.less.guaranteed.certified), abs(load.more.guaranteed.certified)) <= 100 * 1e-9 * 20


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(20))
def test_bounds_of_a_thread_are_its_statics(seed: int) -> None:
    """A nut alone on a vertical thread holds if cos β tan λ < μ. With and without bounds, ``hold`` gives the share of friction
    relative to the largest friction at this load."""
    rng = np.random.default_rng(seed)
    mu, pitch, lean, handed = rng.uniform(0.05, 0.4), rng.uniform(0.001, 0.02), rng.uniform(0.0, 0.6), rng.choice([-1, 1])
    thread = {"type": "screw", "axis": "z", "pitch": handed * pitch, "inboard": "ground", "outboard": "nut",
              "friction": {"mu": mu, "radius": 0.005, "flank_angle": lean}}  # fmt: skip
    nut = {"mass": 2, "inertia": [1e-3] * 3}
    scene = scene_from_dict({"schema": 1, "gravity": [0, 0, -10], "bodies": {"nut": nut}, "joints": {"thread": thread}})
    angle = np.arctan(pitch / (2 * np.pi * 0.005))
    share = np.cos(lean) * np.tan(angle) / mu
    one, all_states = hold(scene), hold(scene, bounds=True)
    assert one.holds == (share < 1.0)
    assert all_states.holds == ("certain" if share < 1.0 else "no")
    at_limit = np.sin(angle) * (np.cos(lean) * np.cos(angle) + mu * np.sin(angle)) / mu
    assert one.pairs[0].share == pytest.approx(at_limit, rel=1e-9)
    for p in all_states.pairs:
        assert p.share.least.certified == pytest.approx(at_limit, rel=1e-6)
        assert p.share.largest.certified == pytest.approx(at_limit, rel=1e-6)
        assert p.normal_force.largest.certified == pytest.approx(one.pairs[0].capacity / mu, rel=1e-6)


def nut_on_rail(pitch: float, mu: float, cut: str) -> dict[str, Any]:
    """A nut of 2 kg on a rail without friction. The nut is also on a thread with friction, whose spindle turns freely."""
    spindle, nut = ({"mass": m, "inertia": [1e-3] * 3} for m in (1, 2))
    joints = {
        "turn": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "spindle"},
        "rail": {"type": "prismatic", "axis": "z", "inboard": "ground", "outboard": "nut"},
        "thread": {"type": "screw", "axis": "z", "pitch": pitch, "inboard": "spindle", "outboard": "nut",
                   "friction": {"mu": mu, "radius": 0.005, "flank_angle": 0}},
    }  # fmt: skip
    joints[cut]["cut"] = True
    return {"schema": 1, "gravity": [0, 0, -10], "bodies": {"spindle": spindle, "nut": nut}, "joints": joints}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("cut", ["turn", "rail"])
@pytest.mark.parametrize("pitch", [0.002, 0.008, 0.08])
@pytest.mark.parametrize("mu", [0.05, 0.5])
def test_equilibrium_leaves_nothing_open_in_a_thread_that_carries_a_weight(pitch: float, mu: float, cut: str) -> None:
    """With flanks that are not inclined, the nut holds if tan λ < μ."""
    found = hold(scene_from_dict(nut_on_rail(pitch, mu, cut)), bounds=True)
    assert found.open == 0
    assert found.holds == ("certain" if pitch / (2 * np.pi * 0.005) < mu else "no")


@pytest.mark.parametrize(("components", "again"), [(1, False), (2, True)])
def test_a_cell_is_examined_again_only_for_cuts_that_it_lacks(components: int, again: bool) -> None:
    """The linear program may miss the norm of one component by its tolerance. No cut changes this error."""
    V, X, cell = np.eye(components, 3), np.array([3.0, 2.0, 1.0]), Cell()
    search = Search(Program((V,), (), Row(np.array([1.0, 0.0, 0.0]))), SearchBudget(CELLS))
    norms = np.array([np.linalg.norm(V @ X)])
    assert search._parts(cell, Answer(3.0, X, norms)) == []
    assert search._parts(cell, Answer(3.0, X, norms - 1e-6)) == ([cell] if again else [])
