"""``hold``: whether friction holds a scene at its start. With ``bounds``, the answer covers all admissible states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from typing import Any, Literal, overload

from trunnion.analysis.static_bounds.bounds_results import HoldBounds, PairBounds
from trunnion.analysis.static_bounds.elementary_motions import Motion, motions
from trunnion.analysis.static_bounds.equilibrium_equations import Statics, statics
from trunnion.analysis.static_bounds.equilibrium_space import space
from trunnion.analysis.static_bounds.pair_and_load_bounds import (
    NEVER,
    AdmissibleStates,
    admissible_states,
    find_onsets,
    is_pushed,
    load_bounds,
    pair_bounds,
    without_guarantee,
)
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.analysis.static_bounds.slip_onset_and_self_stress import Stress
from trunnion.analysis.static_bounds.start_pose_statics import HoldReport
from trunnion.analysis.static_bounds.start_pose_statics import hold as one_answer
from trunnion.basics.errors import Problem, raise_problems
from trunnion.basics.interrupts import held
from trunnion.elements.contact.static_friction_capacity import Pair
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.queries.unilateral_joints import unilateral_problems
from trunnion.system.structure.loop_joints import USUAL

FEW, CELLS, FEWER = 4, 1000, 100
"""Largest number of cells of a search: CELLS with up to FEW open directions, otherwise FEWER. A search takes seconds."""


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
    """Whether friction holds a scene at rest at its start, and the margin of each pair.

    Args:
        scene: as for ``simulate``.
        overrides: changes of the scene, {path: value}.
        bounds: whether to examine all admissible states (equilibrium with friction within its limits).
        self_stress: largest contact force, N, that opposed joints cause without loads. If neither this limit nor ``misfit`` is
            given, intervals may be infinite.
        misfit: the same limit, given as a misalignment, m. Each contact force is at most the joint's ``stiffness`` times the
            misalignment.
        cells: largest number of cells of each search.
        budget: time for all searches, s. Each search has a share of this time. Certified values are returned even if the time or
            Ctrl-C ends a search early.

    Returns:
        A ``HoldReport``, or with ``bounds`` a ``HoldBounds``. A ``HoldBounds`` has ranges of normal force, friction and margin of
        every joint. For every load, input and drive it has the amount that is certainly held and the amount beyond which no
        state holds.

    Raises:
        SceneError: for wrong input.
        SimulationError: if the pose cannot be assembled or the statics have no solution.
    """
    loaded = scene_given(scene, overrides)
    if not bounds:
        return one_answer(loaded)
    problems = unilateral_problems(loaded, "bounds: admissible states may differ in their contacts")
    checks = (
        (not 0.0 <= (self_stress or 0.0) < inf, "self_stress", f"{self_stress} is not a valid force", "give newtons, 0 or more"),
        (not 0.0 <= (misfit or 0.0) < inf, "misfit", f"{misfit} is not a valid length", "give metres, 0 or more"),
        (None not in (misfit, self_stress), "misfit", "both misfit and self_stress limit the self-stress", "give one of them"),
        (budget is not None and not budget > 0.0, "budget", f"{budget} s is not a positive time", "give seconds above 0"),
        (cells is not None and cells < 1, "cells", f"{cells} is below 1",
         f"default: {CELLS}, {FEWER} beyond {FEW} open directions"),
    )  # fmt: skip
    raise_problems(problems + [Problem(where, what, hint) for is_wrong, where, what, hint in checks if is_wrong])
    answer, st = one_answer(loaded), statics(loaded)
    pairs = tuple(st.pairs())
    with held() as interrupt:
        limits = SearchBudget(cells or (CELLS if space(st, pairs).undetermined <= FEW else FEWER), budget, lambda: interrupt.asked)
        stress = self_stress if misfit is None else {n: misfit * (j.stiffness or USUAL) for n, j in loaded.joints.items()}
        return replace(_bounds(answer, st, pairs, stress, limits), self_stress=self_stress, misfit=misfit)


def _bounds(
    answer: HoldReport, st: Statics, pairs: tuple[Pair, ...], self_stress: Stress | None, limits: SearchBudget
) -> HoldBounds:
    found, unheld, all_found = motions(st, pairs)
    limits.searches = planned = _searches(st, pairs, len(found))
    a = admissible_states(st, pairs, self_stress, limits)
    balanced, there = a.space.misses <= NEVER, a.there
    begin = find_onsets(a, found) if there else []
    if begin and not a.space.open:  # with a single state, the kernel's laws decide whether the state holds
        there, begin = answer.holds, []
    unheld += sum(not is_pushed(a, m) for m in found) if there else 0
    holds = "no" if there is False else "possible" if begin or there is None else "certain"
    each = tuple(pair_bounds(a, i) for i in range(len(pairs))) if there is not False else ()
    loads = [load_bounds(st, pairs, self_stress, limits, k, True) for k in range(len(st.drives))]
    loads += [load_bounds(st, pairs, self_stress, limits, k, False) for k in range(len(st.loads))]
    if not there and not a.space.open:
        loads = [load if load.now is None else without_guarantee(load) for load in loads]
    notes = (*st.notes, *_notes(a, there, unheld, all_found, balanced), *_budget_notes(limits, planned))
    first = _first(answer, pairs, begin, each)
    return HoldBounds(holds, first, a.space.undetermined, None, each, tuple(loads), answer, notes, limits.ended)


def _searches(st: Statics, pairs: tuple[Pair, ...], ways: int) -> int:
    """Expected number of searches: two for each interval of joints and loads, and one for each motion and sense."""
    own = sum(2 + 4 * len(p.capacities) for p in pairs)
    return 2 + 2 * ways + own + len(st.drives) * (4 + 2 * ways) + len(st.loads) * (4 + 4 * ways)


def _budget_notes(limits: SearchBudget, planned: int) -> list[str]:
    if limits.ended == "done":
        return []
    why = "Ctrl-C" if limits.ended == "cancelled" else "the time budget"
    return [f"{why} ended {limits.short} of up to {planned} searches early: the bounds are the values certified so far"]


def _first(
    answer: HoldReport, pairs: tuple[Pair, ...], begin: list[tuple[Motion, bool | None]], each: tuple[PairBounds, ...]
) -> tuple[str, ...]:
    """The joints of the motion that can begin. If no motion can begin, the joint nearest to its limit."""
    if begin:
        return tuple(dict.fromkeys(pairs[i].joint for i in begin[0][0].moving))
    if not each:
        return (answer.first,) if answer.first else ()
    return (max(each, key=lambda p: p.share.largest.certified).joint,)


def _notes(a: AdmissibleStates, there: bool | None, unheld: int, all_found: bool, balanced: bool) -> list[str]:
    inexact = any(not c.exact for p in a.space.pairs for c in p.capacities)
    notes = (
        (not balanced, "a freedom without friction is not in balance: the mechanism moves"),
        (there is None, "the search did not decide whether friction can hold the mechanism: raise cells or budget"),
        (unheld and balanced,
         f"{unheld} freedoms without friction and without load are in balance only while nothing disturbs them"),
        (not all_found, "not all motions were examined: guaranteed loads are valid only for the examined motions"),
        (inexact, "for shafts, only bounds of the friction capacity are known, so the intervals of shafts may be too wide"),
    )  # fmt: skip
    return [note for applies, note in notes if applies]
