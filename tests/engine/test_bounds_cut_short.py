"""Bounds at rest under a budget or Ctrl-C: what is certified by then, no more."""

from __future__ import annotations

import signal
from typing import Any

import pytest

import engine
from engine.bounds import asking
from engine.bounds.api import CELLS
from engine.bounds.asking import asked, load_bounds, pair_bounds
from engine.bounds.effort import Effort
from engine.bounds.relaxed import Relaxation
from engine.bounds.statics import statics
from engine.scene.overrides import scene_given
from tests.engine import bounds_scenes as scenes

CLOSED = 1e-8
"""Relative; searches close to 1e-9 of the loads."""


class Interrupted(Effort):
    """An effort that is over after so many looks at it, for good."""

    def __init__(self, looks: int) -> None:
        super().__init__(CELLS)
        self.looks = looks

    def over(self) -> bool:
        self.looks -= 1
        return self.looks < 0


@pytest.mark.parametrize("looks", [0, 2, 12, 40, 80])
def test_a_search_that_is_cut_short_certifies_no_more_than_a_whole_one(looks: int) -> None:
    st = statics(scene_given(scenes.four_bar()))
    pairs = tuple(st.pairs())

    def ends(effort: Effort) -> list[float]:
        a, load = asked(st, pairs, None, effort), load_bounds(st, pairs, None, effort, 1, False)
        found = [pair_bounds(a, i) for i in range(len(pairs))]
        spans = [(i.least.certified, i.largest.certified) for p in found for i in (p.normal_force, p.friction, p.share)]
        return [x for low, high in spans for x in (low, -high)] + [
            -load.less.guaranteed.certified, load.more.guaranteed.certified,
            load.less.possible.certified, -load.more.possible.certified,
        ]  # fmt: skip

    whole, short = ends(Effort(CELLS)), ends(cut := Interrupted(looks))
    assert all(s <= w + CLOSED * max(1.0, abs(w)) for s, w in zip(short, whole, strict=True))
    assert cut.short > 0


def test_once_it_is_over_hardly_a_linear_program_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever that comes, in the midst of the first cones too: no more than those of one vector and one of the next question."""
    st, solve = statics(scene_given(scenes.four_bar(cross=True))), Relaxation._linear

    class Until(Effort):
        """An effort that is over after so many linear programs."""

        solved, most = 0, 0

        def over(self) -> bool:
            return Until.solved >= Until.most

    def counted(*args: Any) -> Any:
        Until.solved += 1
        return solve(*args)

    monkeypatch.setattr(Relaxation, "_linear", counted)
    for most in range(1, 80, 6):
        Until.solved, Until.most = 0, most
        for load in (None, 0):
            asked(st, tuple(st.pairs()), None, Until(CELLS), load)
        assert most <= Until.solved <= most + 5


def test_a_spent_budget_says_what_is_certain_and_what_it_left() -> None:
    b = engine.hold(scenes.four_bar(), bounds=True, budget=1e-9)
    assert (b.ended, b.holds) == ("budget", "possible")
    assert b["a"].normal_force.least.certified == 0.0
    assert b["a"].normal_force.largest.value is None
    assert any("the budget of time ended" in note for note in b.notes)


@pytest.mark.parametrize("after", [1, 5, 20])
def test_ctrl_c_keeps_the_ends_that_were_found(after: int, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = engine.hold(scenes.four_bar(), bounds=True)
    calls = 0
    search = asking.least

    def pressed(*args: Any, **more: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == after:
            signal.raise_signal(signal.SIGINT)
        return search(*args, **more)

    monkeypatch.setattr(asking, "least", pressed)
    b = engine.hold(scenes.four_bar(), bounds=True)
    assert b.ended == "stopped"
    assert any(note.startswith("Ctrl-C ended") for note in b.notes)
    kept = sum(p.normal_force == q.normal_force for p, q in zip(b.pairs, whole.pairs, strict=True))
    assert kept == (2 if after == 20 else 0)
