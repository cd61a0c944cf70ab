"""A budget or Ctrl-C ends the search for bounds at rest. The bounds then contain only what the search has certified."""

from __future__ import annotations

import signal
from typing import Any

import pytest

import trunnion
from tests.analysis.static_bounds import hand_calculation_scenes as scenes
from trunnion.analysis.static_bounds import pair_and_load_bounds
from trunnion.analysis.static_bounds.equilibrium_equations import statics
from trunnion.analysis.static_bounds.hold_check import CELLS
from trunnion.analysis.static_bounds.linear_relaxation import Relaxation
from trunnion.analysis.static_bounds.pair_and_load_bounds import admissible_states, load_bounds, pair_bounds
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.scene.overrides import scene_given

CLOSED = 1e-8
"""Relative gap of closed bounds; searches close to 1e-9 of the loads."""


class Interrupted(SearchBudget):
    """A budget that is spent after this number of checks and stays spent."""

    def __init__(self, looks: int) -> None:
        super().__init__(CELLS)
        self.looks = looks

    def is_over(self) -> bool:
        self.looks -= 1
        return self.looks < 0


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("looks", [0, 2, 12, 40, 80])
def test_a_search_that_is_cut_short_certifies_no_more_than_a_whole_one(looks: int) -> None:
    st = statics(scene_given(scenes.four_bar()))
    pairs = tuple(st.pairs())

    def ends(budget: SearchBudget) -> list[float]:
        a, load = admissible_states(st, pairs, None, budget), load_bounds(st, pairs, None, budget, 1, False)
        found = [pair_bounds(a, i) for i in range(len(pairs))]
        spans = [(i.least.certified, i.largest.certified) for p in found for i in (p.normal_force, p.friction, p.share)]
        return [x for low, high in spans for x in (low, -high)] + [
            -load.less.guaranteed.certified, load.more.guaranteed.certified,
            load.less.possible.certified, -load.more.possible.certified,
        ]  # fmt: skip

    whole, short = ends(SearchBudget(CELLS)), ends(cut := Interrupted(looks))
    assert all(s <= w + CLOSED * max(1.0, abs(w)) for s, w in zip(short, whole, strict=True))
    assert cut.short > 0


@pytest.mark.slow
def test_hardly_a_linear_program_is_solved_once_the_budget_is_spent(monkeypatch: pytest.MonkeyPatch) -> None:
    """The budget may end at any check, even while the search computes the first cones. After the end, the search solves at most the
    programs of one vector and one program of the next question."""
    st, solve = statics(scene_given(scenes.four_bar(cross=True))), Relaxation._solve

    class Until(SearchBudget):
        """A budget that ends after this number of linear programs."""

        solved, most = 0, 0

        def is_over(self) -> bool:
            return Until.solved >= Until.most

    def counted(*args: Any) -> Any:
        Until.solved += 1
        return solve(*args)

    monkeypatch.setattr(Relaxation, "_solve", counted)
    for most in range(1, 80, 6):
        Until.solved, Until.most = 0, most
        for load in (None, 0):
            admissible_states(st, tuple(st.pairs()), None, Until(CELLS), load)
        assert most <= Until.solved <= most + 5


def test_a_spent_budget_leaves_certain_bounds_and_a_note() -> None:
    b = trunnion.hold(scenes.four_bar(), bounds=True, budget=1e-9)
    assert (b.ended, b.holds) == ("budget", "possible")
    assert b["a"].normal_force.least.certified == 0.0
    assert b["a"].normal_force.largest.value is None
    assert any("the time budget ended" in note for note in b.notes)


@pytest.fixture(scope="module")
def whole() -> trunnion.HoldBounds:
    """The result of a search that is not interrupted."""
    return trunnion.hold(scenes.four_bar(), bounds=True)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("after", [1, 5, 20])
def test_ctrl_c_keeps_the_ends_that_were_found(after: int, whole: trunnion.HoldBounds, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = 0
    search = pair_and_load_bounds.minimise

    def pressed(*args: Any, **more: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == after:
            signal.raise_signal(signal.SIGINT)
        return search(*args, **more)

    monkeypatch.setattr(pair_and_load_bounds, "minimise", pressed)
    b = trunnion.hold(scenes.four_bar(), bounds=True)
    assert b.ended == "cancelled"
    assert any(note.startswith("Ctrl-C ended") for note in b.notes)
    kept = sum(p.normal_force == q.normal_force for p, q in zip(b.pairs, whole.pairs, strict=True))
    assert kept == (2 if after == 20 else 0)
