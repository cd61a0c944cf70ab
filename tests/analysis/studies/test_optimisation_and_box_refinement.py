"""Studies of functions that replace mechanisms. The studies find the optimum and jumps, and choose their cases from results
alone."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any

import numpy as np
import pytest

from trunnion.analysis.studies.box_refinement import BoxRefinement
from trunnion.analysis.studies.evolution_strategy import Optimisation
from trunnion.analysis.studies.study_rounds import CaseResults, Study, StudyProgress

Of = Callable[[np.ndarray], dict[str, np.ndarray]]
Fails = Callable[[np.ndarray], np.ndarray]


def seen(x: np.ndarray, of: Of, fails: Fails | None = None) -> CaseResults:
    bad = np.zeros(len(x), bool) if fails is None else fails(x)
    outcomes = tuple("jammed" if b else "done" for b in bad)
    return CaseResults(outcomes, {n: np.where(bad, np.nan, v) for n, v in of(x).items()})


def followed(study: Study, of: Of, fails: Fails | None = None) -> StudyProgress:
    follow = StudyProgress(study)
    while not follow.is_over:
        follow.report(seen(follow.rows(follow.finished, follow.requested), of, fails))
    return follow


def best(
    goal: str = "minimise", d: int = 2, target: float = 0.0, within: Any = (), most: int = 600, **more: Any
) -> Optimisation:
    names, ends = tuple("abcdef"[:d]), [(x,) * d for x in (-2.0, 2.0, 0.5)]
    return Optimisation(names, ("1",) * d, *ends, goal, "f", target, tuple(within), most=most, **more)


def found(follow: StudyProgress) -> np.ndarray:
    return np.array([n["value"] for n in follow.answer["numbers"]])


PLACES: dict[str, tuple[Optimisation, Of, list[float]]] = {
    "a bowl": (best(d=3, most=1500), lambda x: {"f": ((x - [0.3, -1.0, 1.4]) ** 2 * [1.0, 10.0, 100.0]).sum(1)}, [0.3, -1.0, 1.4]),
    "a bent valley": (best(most=3000), lambda x: {"f": 100 * (x[:, 1] - x[:, 0] ** 2) ** 2 + (1 - x[:, 0]) ** 2}, [1.0, 1.0]),
    "a peak": (best("maximise", most=1000), lambda x: {"f": -np.abs(x - [0.7, -0.2]).sum(1)}, [0.7, -0.2]),
    "an edge of the bounds": (best(most=1000), lambda x: {"f": x[:, 0] + (x[:, 1] - 0.5) ** 2}, [-2.0, 0.5]),
    "a constraint": (
        best(within=[("g", -inf, 1.0)], most=1500),
        lambda x: {"f": -x.sum(1), "g": (x**2).sum(1)},
        [np.sqrt(0.5), np.sqrt(0.5)],
    ),
    "a value": (best("reach", 1, 0.3, most=1000), lambda x: {"f": x[:, 0] ** 3}, [0.3 ** (1 / 3)]),
    "one of many hollows": (
        best(most=3000),
        lambda x: {"f": 10 - 5 * np.cos(2 * np.pi * (x - 0.4)).sum(1) + 5 * ((x - 0.4) ** 2).sum(1)},
        [0.4, 0.4],
    ),
}


@pytest.mark.parametrize("name", PLACES)
def test_the_best_is_found_to_the_tolerance(name: str) -> None:
    """The ranges are 4 wide. The found point is within twice the tolerance of a range, or within ten times the tolerance along a
    flat valley."""
    study, of, true = PLACES[name]
    follow = followed(study, of)
    assert follow.answer["feasible"]
    assert found(follow) == pytest.approx(true, abs=4.0 * study.tolerance * (10.0 if "valley" in name else 2.0))
    assert follow.answer["cases"] == follow.requested <= study.most
    assert follow.values[follow.answer["case"]] == pytest.approx(found(follow), abs=0.0)


def test_cases_that_fail_rank_last_and_are_counted() -> None:
    follow = followed(best(most=1000), lambda x: {"f": np.abs(x).sum(1)}, lambda x: x[:, 0] < 0.3)
    assert found(follow) == pytest.approx([0.3, 0.0], abs=0.01)
    assert follow.answer["failed"] == int((follow.values[:, 0] < 0.3).sum()) > 0
    none = followed(best(most=60), lambda x: {"f": x[:, 0]}, lambda x: x[:, 0] < 9.0)
    assert (none.answer["feasible"], none.answer["constraints_missed"], none.answer["results"]) == (False, None, {})


def test_an_infeasible_constraint_is_reported_with_the_nearest_point() -> None:
    follow = followed(best(within=[("g", 9.0, inf)], most=600), lambda x: {"f": x[:, 0], "g": x.sum(1)})
    assert (follow.answer["feasible"], follow.answer["constraints_missed"] > 0.0) == (False, True)
    assert follow.answer["within"] == [{"of": "g", "low": 9.0, "high": None}]
    assert found(follow) == pytest.approx([2.0, 2.0], abs=0.01)


def test_a_search_starts_at_the_scenes_numbers_and_obeys_bounds_and_number_of_cases() -> None:
    follow = followed(best(most=37), lambda x: {"f": x[:, 0]})
    assert follow.values[0] == pytest.approx([0.5, 0.5], abs=1e-15)
    assert follow.requested == 37
    assert follow.answer["why"] == "the allowed number of cases is used up"
    assert (np.abs(follow.values) <= 2.0).all()


CURVES: dict[str, tuple[int, Of]] = {
    "a straight line": (1, lambda x: {"f": 3.0 * x[:, 0]}),
    "a steep curve": (1, lambda x: {"f": np.expm1(6.0 * x[:, 0])}),
    "a sum": (2, lambda x: {"f": x[:, 0] ** 3 + np.sin(x[:, 1])}),
    "a wave in four numbers": (4, lambda x: {"f": np.sin(3.0 * x.sum(1)) + x[:, 0]}),
}


@pytest.mark.parametrize("name", CURVES)
def test_a_target_within_reach_is_reached_by_sixty_cases(name: str) -> None:
    d, of = CURVES[name]
    follow = followed(best("reach", d, 0.7, most=60), of)
    assert (follow.answer["why"], follow.answer["feasible"]) == ("the target is reached", True)
    assert abs(follow.answer["off_target"]) < 1e-6
    assert of(found(follow)[None, :])["f"][0] - 0.7 == pytest.approx(follow.answer["off_target"], abs=1e-12)


def test_a_jump_across_the_target_is_not_taken_for_the_target() -> None:
    jump: Of = lambda x: {"f": np.where(x[:, 0] < 0.3, -1.0, 2.0) + 0.1 * x[:, 0]}  # noqa: E731
    follow = followed(best("reach", 1, 0.0, most=300), jump)
    assert follow.answer["why"] != "the target is reached"
    assert follow.answer["off_target"] == pytest.approx(-0.97, abs=1e-3)
    assert found(follow) == pytest.approx([0.3], abs=0.01)


def test_a_target_and_a_constraint_are_missed_apart() -> None:
    out = followed(best("reach", 1, 9.0, [("g", -inf, 3.0)], most=40), lambda x: {"f": x[:, 0], "g": x[:, 0]})
    assert (out.answer["constraints_missed"], out.answer["off_target"]) == (0.0, pytest.approx(-7.0, abs=0.01))
    none = followed(best("reach", 1, 1.0, [("g", 3.0, inf)], most=40), lambda x: {"f": x[:, 0], "g": x[:, 0]})
    assert none.answer["constraints_missed"] > 0.0
    assert none.answer["off_target"] == pytest.approx(1.0, abs=0.01)
    assert followed(best(most=40), lambda x: {"f": x[:, 0]}).answer["off_target"] is None


def test_a_stored_study_continues_by_the_rules_of_its_own_revision() -> None:
    of = CURVES["a sum"][1]
    early, now = (followed(best("reach", 2, 0.7, most=60, revision=r), of) for r in (1, 2))
    assert early.requested == 60
    assert early.values[: now.requested].tobytes() != now.values.tobytes()
    wave: Of = lambda x: {"f": np.sin(60.0 * x[:, 0] ** 2)}  # noqa: E731
    assert [followed(line(most=40, revision=r), wave).requested for r in (1, 2)] == [33, 40]


STUDIES: dict[str, tuple[Study, Of, Fails]] = {
    "optimise": (best(most=200, within=[("g", -inf, 1.0)]), lambda x: {"f": x[:, 0], "g": x[:, 1]}, lambda x: x[:, 0] < -1.9),
    "refine": (
        BoxRefinement(("a", "b"), ("1", "1"), (0.0, 0.0), (1.0, 1.0), "f", most=200, tolerance=0.01),
        lambda x: {"f": np.sin(9 * x[:, 0]) + (x[:, 1] > 0.4)},
        lambda x: (x**2).sum(1) > 1.1,
    ),
}


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kind", STUDIES)
def test_the_cases_follow_from_seed_and_results_bit_for_bit_wherever_it_was_left(kind: str) -> None:
    study, of, fails = STUDIES[kind]
    whole = followed(study, of, fails)
    ends = [0]
    other = StudyProgress(study)
    while not other.is_over:
        ends.append(other.requested)
        other.report(seen(other.rows(other.finished, other.requested), of, fails))
    for left in ends[1::3]:
        again = StudyProgress(study)
        while again.requested < left:
            again.report(seen(whole.values[again.finished : again.requested], of, fails))
        assert again.values.tobytes() == whole.values[: again.requested].tobytes()
        while not again.is_over:
            again.report(seen(again.rows(again.finished, again.requested), of, fails))
        assert (again.values.tobytes(), again.answer) == (whole.values.tobytes(), whole.answer)


# -- refining ---------------------------------------------------------------------------------------------------------------


def line(of: str = "f", most: int = 200, **more: Any) -> BoxRefinement:
    return BoxRefinement(("a",), ("1",), (0.0,), (1.0,), of, most=most, **more)


def test_jumps_and_changes_of_outcome_are_found_as_narrow_as_asked() -> None:
    of: Of = lambda x: {"f": (x[:, 0] > 0.37123) + 0.5 * np.abs(x[:, 0] - 0.7)}  # noqa: E731
    follow = followed(line(tolerance=1e-4), of, lambda x: x[:, 0] > 0.9)
    jump, end = follow.answer["boundaries"]
    for box, true in ((jump, 0.37123), (end, 0.9)):
        assert box["low"][0] <= true <= box["high"][0] <= box["low"][0] + 1e-4
        assert box["narrow"]
    assert jump["change"] == pytest.approx(1.0, abs=1e-3)
    assert (end["outcomes"], end["change"]) == (["done", "jammed"], None)
    assert follow.requested < 80  # an even grid would need 10,000 cases for the same width


def test_cases_are_added_where_a_result_bends_until_lines_between_them_are_good() -> None:
    """The function has a narrow peak. Linear interpolation between the cases is accurate everywhere. Its error is less than a fifth
    of the error of an even grid with as many cases."""

    def hill(x: np.ndarray) -> np.ndarray:
        return np.exp(-(((x - 0.31) / 0.02) ** 2))

    follow = followed(line(most=400), lambda x: {"f": hill(x[:, 0])})
    x = np.sort(follow.values[:, 0])
    fine = np.linspace(0.0, 1.0, 20_001)
    off = np.abs(np.interp(fine, x, hill(x)) - hill(fine)).max()
    even = np.linspace(0.0, 1.0, follow.requested)
    assert off < 0.004
    assert off < 0.2 * np.abs(np.interp(fine, even, hill(even)) - hill(fine)).max()
    assert follow.answer["boundaries"] == []


def test_a_boundary_in_two_numbers_is_covered_by_its_boxes() -> None:
    """The boundary is a quarter of a circle. Each point of the boundary lies in a reported box."""
    study = BoxRefinement(("a", "b"), ("1", "1"), (0.0, 0.0), (1.0, 1.0), "outcome", most=2000, tolerance=0.02)
    follow = followed(study, lambda x: {}, lambda x: (x**2).sum(1) > 0.5)
    boxes = follow.answer["boundaries"]
    assert all(b["narrow"] for b in boxes)
    for angle in np.linspace(0.01, 1.56, 100):
        p = np.sqrt(0.5) * np.array([np.cos(angle), np.sin(angle)])
        assert any((np.array(b["low"]) <= p + 1e-12).all() and (p <= np.array(b["high"]) + 1e-12).all() for b in boxes), angle
    assert follow.requested < 1000


def test_a_straight_result_takes_no_more_than_the_first_look_and_one_halving() -> None:
    follow = followed(line(), lambda x: {"f": 3.0 * x[:, 0]})
    assert follow.requested <= 17
    assert (follow.answer["boundaries"], "nearly linear" in follow.answer["why"]) == ([], True)
