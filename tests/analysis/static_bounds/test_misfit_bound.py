"""The misfit of opposed joints bounds their self-stress, so the torque that self-stress can hold is finite."""

from __future__ import annotations

from typing import Any

import pytest

import trunnion
from tests.analysis.static_bounds import hand_calculation_scenes as scenes
from trunnion.analysis.static_bounds.branch_and_bound import minimise
from trunnion.analysis.static_bounds.equilibrium_equations import statics
from trunnion.analysis.static_bounds.pair_and_load_bounds import admissible_states
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.analysis.static_bounds.slip_onset_and_self_stress import Stress
from trunnion.analysis.static_bounds.sum_of_norms_program import Row
from trunnion.scene.overrides import scene_given

MISFIT = 2e-6
"""Misfit, m."""


def weightless() -> dict[str, Any]:
    """The door without weight. Its two hinges press only against each other."""
    return scenes.door() | {"gravity": [0, 0, 0]}


def torque(stress: Stress, cells: int) -> tuple[float, float]:
    """The largest torque on the weightless door that some state holds: (attained, certified)."""
    st = statics(scene_given(weightless()))
    a = admissible_states(st, tuple(st.pairs()), stress, SearchBudget(cells), 0)
    amount = a.space.amount(len(a.space.origin) - 1)
    found = minimise(a.program.with_objective(Row(-amount)), a.budget, root=a.root)
    return -found.value * a.space.scale, -found.bound * a.space.scale


def test_a_weightless_door_holds_at_most_the_friction_of_its_misfit_loads() -> None:
    """Opposed couples at both hinges: the forces L, −L, −L, L at heights ±s/2 ± c balance. Two faces that press with L against each
    other also balance."""
    most = 30.0
    held = scenes.RADIUS * scenes.MU / (1.0 + scenes.MU**2) ** 0.5 * 4.0 * most + scenes.THRUST * scenes.MU * 2.0 * most
    assert torque(most, 8) == pytest.approx((held, held), rel=1e-8)


@pytest.mark.slow
def test_a_hinge_with_one_softer_joint_has_a_bound_between_those_of_equal_joints() -> None:
    """The bounds lie between the bounds with the softer stiffness in both joints and the bounds with the stiffer stiffness in both
    joints. The faces press no more than with the softer stiffness."""
    soft, stiff, both = (torque(s, 1)[1] for s in (10.0, 30.0, {"low": 10.0, "high": 30.0}))
    assert soft < both < stiff
    assert both <= stiff - scenes.THRUST * scenes.MU * 2.0 * (30.0 - 10.0) + 1e-9


@pytest.mark.slow
def test_misfit_is_self_stress_over_stiffness() -> None:
    scene = scenes.walls()
    for joint in scene["joints"].values():
        joint["stiffness"] = 5e6
    by_force = trunnion.hold(scene, bounds=True, self_stress=MISFIT * 5e6, cells=1)
    by_length = trunnion.hold(scene, bounds=True, misfit=MISFIT, cells=1)
    assert (by_length.pairs, by_length.loads) == (by_force.pairs, by_force.loads)
    assert (by_length.misfit, by_length.self_stress) == (MISFIT, None)


def test_two_bounds_or_a_negative_one_are_refused() -> None:
    with pytest.raises(trunnion.SceneError, match=r"(?s)misfit.*not a valid length.*both misfit and self_stress"):
        trunnion.hold(scenes.guide(0.1), bounds=True, misfit=-1.0, self_stress=1.0)
