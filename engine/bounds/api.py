"""``hold``: does a scene hold where it starts? One answer, or with ``bounds`` all of what statics leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal, overload

from engine.basics.interrupts import held
from engine.basics.problems import Problem, SceneError
from engine.bounds.asking import NEVER, Asked, asked, begins, load_bounds, pair_bounds
from engine.bounds.effort import Effort
from engine.bounds.limits import Stress
from engine.bounds.motions import Motion, motions
from engine.bounds.report import HoldBounds, PairBounds
from engine.bounds.space import space
from engine.bounds.statics import Statics, statics
from engine.contact.resting import Pair
from engine.scene.overrides import Given, scene_given
from engine.simulation.hold import HoldReport
from engine.simulation.hold import hold as one_answer
from engine.system.loops import USUAL

FEW, CELLS, FEWER = 4, 1000, 100
"""Up to FEW open directions a search may look at CELLS cells, beyond at FEWER, before it stops with a gap: seconds for each end."""


@overload
def hold(scene: Given, overrides: Mapping[str, Any] | None = None, bounds: Literal[False] = False) -> HoldReport: ...
@overload
def hold(
    scene: Given, overrides: Mapping[str, Any] | None = None, *, bounds: Literal[True], self_stress: float | None = None,
    misfit: float | None = None, cells: int | None = None, budget: float | None = None,
) -> HoldBounds: ...  # fmt: skip
def hold(
    scene: Given, overrides: Mapping[str, Any] | None = None, bounds: bool = False, self_stress: float | None = None,
    misfit: float | None = None, cells: int | None = None, budget: float | None = None,
) -> HoldReport | HoldBounds:  # fmt: skip
    """Whether a scene stays where it starts, at rest, and by what margin: a ``HoldReport``.

    bounds: a ``HoldBounds`` instead: over all states in equilibrium with friction within its limits the least and largest normal
    force, friction and margin of every joint, and for every load, input and drive up to where it is certain to be held and beyond
    where nothing holds it. self_stress: the most, N, that what opposed joints do to each other loads any contact with; misfit: the
    same by how far, m, they are from fitting: each contact then has at most that times its joint's ``stiffness``; without either
    intervals may have no end. cells: how much each search may look at before it leaves a gap. budget: s
    for all searches; each has its share of what is left, and what it has certified by then is given. Ctrl-C ends them too.
    """
    loaded = scene_given(scene, overrides)
    if not bounds:
        return one_answer(loaded)
    problems = []
    if self_stress is not None and not 0.0 <= self_stress < float("inf"):
        problems.append(Problem("self_stress", f"{self_stress} is no bound on a force", "a number of newtons, 0 or more"))
    if misfit is not None and not 0.0 <= misfit < float("inf"):
        problems.append(Problem("misfit", f"{misfit} is no bound on a length", "a number of metres, 0 or more"))
    if misfit is not None and self_stress is not None:
        problems.append(Problem("misfit", "self-stress has two bounds, misfit and self_stress", "give one of them"))
    if budget is not None and not budget > 0.0:
        problems.append(Problem("budget", f"{budget} s is no time to search in", "a number of seconds above 0"))
    if cells is not None and cells < 1:
        problems.append(
            Problem("cells", f"{cells} cells are none", f"1 or more; without it {CELLS}, {FEWER} beyond {FEW} open directions")
        )
    if problems:
        raise SceneError(problems)
    answer, st = one_answer(loaded), statics(loaded)
    pairs = tuple(st.pairs())
    with held() as interrupt:
        effort = Effort(cells or (CELLS if space(st, pairs).open <= FEW else FEWER), budget, lambda: interrupt.asked)
        stress = self_stress if misfit is None else {n: misfit * (j.stiffness or USUAL) for n, j in loaded.joints.items()}
        return replace(_bounds(answer, st, pairs, stress, effort), self_stress=self_stress, misfit=misfit)


def _bounds(answer: HoldReport, st: Statics, pairs: tuple[Pair, ...], self_stress: Stress | None, effort: Effort) -> HoldBounds:
    found, unheld, all_found = motions(st, pairs)
    effort.searches = planned = _searches(st, pairs, len(found))
    a = asked(st, pairs, self_stress, effort)
    balanced, there = a.space.misses <= NEVER, a.there
    begin = begins(a, found) if there else []
    holds = "no" if there is False else "possible" if begin or there is None else "certain"
    each = tuple(pair_bounds(a, i) for i in range(len(pairs))) if there is not False else ()
    loads = [load_bounds(st, pairs, self_stress, effort, k, True) for k in range(len(st.drives))]
    loads += [load_bounds(st, pairs, self_stress, effort, k, False) for k in range(len(st.loads))]
    notes = (*st.notes, *_words(a, there, unheld, all_found, balanced), *_ended(effort, planned))
    first = _first(answer, pairs, begin, each)
    return HoldBounds(holds, first, a.space.open, None, each, tuple(loads), answer, notes, effort.ended)


def _searches(st: Statics, pairs: tuple[Pair, ...], ways: int) -> int:
    """How many searches there will be: two for each end of what joints do and of what loads may be, and one for each motion."""
    own = sum(2 + 4 * len(p.capacities) for p in pairs)
    return 2 + 2 * ways + own + len(st.drives) * (4 + 2 * ways) + len(st.loads) * (4 + 4 * ways)


def _ended(effort: Effort, planned: int) -> list[str]:
    if effort.ended == "done":
        return []
    why = "Ctrl-C" if effort.ended == "stopped" else "the budget of time"
    return [f"{why} ended {effort.short} of up to {planned} searches early: their ends are what was certified by then"]


def _first(
    answer: HoldReport, pairs: tuple[Pair, ...], begin: list[tuple[Motion, bool | None]], each: tuple[PairBounds, ...]
) -> tuple[str, ...]:
    """The joints of the motion that can begin; else the one nearest to its limit."""
    if begin:
        return tuple(dict.fromkeys(pairs[i].joint for i in begin[0][0].moving))
    if not each:
        return (answer.first,) if answer.first else ()
    return (max(each, key=lambda p: p.share.largest.certified).joint,)


def _words(a: Asked, there: bool | None, unheld: int, all_found: bool, balanced: bool) -> list[str]:
    out = []
    if not balanced:
        out.append("a freedom that nothing rubs against is not in balance: whatever friction does, it moves")
    if there is None:
        out.append("whether any state holds was not found out within the cells and the time; more of them may")
    if unheld and balanced:
        out.append(f"{unheld} freedoms that nothing rubs against are in balance, which friction does not keep")
    if not all_found:
        out.append("there are more motions than were looked at: guaranteed loads are those of the ones that were")
    if any(not c.exact for p in a.space.pairs for c in p.capacities):
        out.append("what shafts hold is bounded from above: their intervals may be wider than they are")
    return out
