"""A fit requested as one document equals the fit of the Python functions to the last bit, for any division into pieces. All
mistakes in the document are reported at once."""

from __future__ import annotations

import json
import tracemalloc
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.analysis.fits.closed_form_motions import FORCE, GLIDER, QD, SLIDER, TIME, Q, X, noisy
from trunnion.analysis.fits.fits_as_batch_cases import FitPlan, FitRunner, combine_rows, make_fit_plan
from trunnion.analysis.fits.fits_from_plain_data import read_comparison, read_fit, read_ranking
from trunnion.analysis.fits.identifiability import slope_spectrum
from trunnion.analysis.fits.request_and_answer import FitRequest, request_problems
from trunnion.basics.interrupts import watched
from trunnion.basics.json_values import finite
from trunnion.cli.output.fit_report import evidence_lines, lines, proposal_lines
from trunnion.scene.scene_loader import scene_from_dict

DRAG = "joints.rail.damping"
SCENE = scene_from_dict(GLIDER)
RUNS = (
    trunnion.MeasuredRun(TIME, {X: noisy(1)}, {}, 0.02, "first"),
    trunnion.MeasuredRun(TIME, {X: noisy(2, q=-0.2)}, {Q: -0.1}, 0.02, "second"),
)
LAWS = {"free": trunnion.Candidate(), "drag": trunnion.Candidate((DRAG,), overrides={DRAG: 0.05})}
TRIALS = {"longer": trunnion.Experiment({}, until=4.0), "fast": trunnion.Experiment({QD: 2.0})}
WHOLE = FitRequest((QD,), RUNS, (Q,), priors={QD: "normal(0.5, 0.2)"}, candidates=LAWS, trials=TRIALS)


def plain(data: Any) -> Any:
    """Data in JSON form."""
    return json.loads(json.dumps(finite(data)))


def answer(q: FitRequest, scene: trunnion.Scene = SCENE) -> dict[str, Any]:
    """The result of a request."""
    plan = make_fit_plan(scene, q)
    return combine_rows(plan, FitRunner(plan).chunk(0, plan.cases.count).to_pylist())


@pytest.fixture(scope="module")
def whole() -> FitPlan:
    return make_fit_plan(SCENE, WHOLE)


@pytest.fixture(scope="module")
def rows(whole: FitPlan) -> list[dict[str, Any]]:
    """Results of the fits of two laws, as rows."""
    return list(FitRunner(whole).chunk(0, 2).to_pylist())


@pytest.fixture(scope="module")
def evidence() -> trunnion.ModelComparison:
    """The comparison of two laws, computed by ``trunnion.compare``."""
    given: dict[str, Any] = {"runs": RUNS, "own": (Q,), "priors": {QD: "normal(0.5, 0.2)"}}
    return trunnion.compare(GLIDER, LAWS, (QD,), **given)


def test_a_request_finds_the_results_of_the_functions(
    whole: FitPlan, rows: list[dict[str, Any]], evidence: trunnion.ModelComparison
) -> None:
    found = combine_rows(whole, rows)
    assert evidence.best.fit is not None
    assert found["compared"] == plain(evidence.document())
    assert found["fit"] == plain(evidence.best.fit.document())
    assert found["experiments"] == plain([p.document() for p in trunnion.propose(evidence.best.fit, TRIALS)])
    alone = answer(FitRequest((QD, Q), RUNS[:1], level=0.9))
    assert alone["fit"] == plain(trunnion.fit(GLIDER, (QD, Q), runs=RUNS[:1], level=0.9).document())
    assert (alone["compared"], alone["experiments"], alone["why"]) == (None, [], "")


@pytest.mark.slow
def test_fits_are_the_same_to_the_bit_whenever_they_are_made_again(whole: FitPlan, rows: list[dict[str, Any]]) -> None:
    again = FitRunner(whole)
    assert [again.chunk(i, i + 1).to_pylist()[0] for i in (1, 0)] == rows[::-1]


def test_an_unfinished_comparison_reports_its_finished_candidates(whole: FitPlan, rows: list[dict[str, Any]]) -> None:
    first = combine_rows(whole, rows[:1])
    assert [c["name"] for c in first["compared"]["candidates"]] == ["free"]
    assert first["compared"]["candidates"][0]["weight"] == 1.0
    assert first["fit"] == json.loads(rows[0]["answer"])["fit"]


def test_a_document_is_described_like_its_fit(evidence: trunnion.ModelComparison) -> None:
    best = evidence.best.fit
    assert best is not None
    ranked, known = trunnion.propose(best, TRIALS), read_comparison(plain(evidence.document()))
    back = read_fit(plain(best.document()))
    assert lines("glider", back, known) == lines("glider", best, evidence)
    assert evidence_lines(known) == evidence_lines(evidence)
    assert proposal_lines(read_ranking(plain([p.document() for p in ranked])), back) == proposal_lines(ranked, best)
    open_ = trunnion.fit(SLIDER | {"bodies": GLIDER["bodies"]}, [FORCE, "bodies.cart.density"], TIME, {X: noisy(1)}, noise=0.02)
    assert open_.inseparable
    assert lines("slider", read_fit(plain(open_.document())), None) == lines("slider", open_, None)
    assert plain(read_fit(plain(open_.document())).document()) == plain(open_.document())


def test_a_fit_that_cannot_be_made_gives_the_reason_and_leaves_the_others_alone() -> None:
    still = trunnion.Candidate(("gravity[2]",))
    told = answer(FitRequest((QD,), RUNS[:1], candidates={"free": trunnion.Candidate(), "still": still}))
    assert [(c["name"], c["fit"] is None) for c in told["compared"]["candidates"]] == [("free", False), ("still", True)]
    assert "gravity[2] is zero in the scene" in told["compared"]["candidates"][1]["why"]
    assert told["fit"] == told["compared"]["candidates"][0]["fit"]
    none = answer(FitRequest(("gravity[2]",), RUNS[:1]))
    assert none["fit"] is None
    assert "gravity[2] is zero in the scene" in none["why"]


def test_every_mistake_is_reported_at_once_with_its_place() -> None:
    runs = (RUNS[0], trunnion.MeasuredRun(TIME[:3], {X: TIME[:4], "rail.plaice": TIME[:3]}, {Q: "1 kg"}, -1.0))
    laws = {"a": trunnion.Candidate((Q,), "kulomb"), "b": trunnion.Candidate(("gravity[7]", QD))}
    q = FitRequest((QD,), runs, level=2.0, candidates=laws, trials={"t": trunnion.Experiment({"q": 1}, until="1 kg")})
    told = request_problems(SCENE, q)
    assert {p.where for p in told} == {
        "level", "run 2, measured", "run 2, noise", f"candidate b, run 2, {Q}", "candidate a, law", "candidate b, parameters",
        "trial t, q", "trial t, until",
    }  # fmt: skip
    assert any(p.what == f"{QD} is given twice" for p in told)
    wrong = FitRequest((QD,), RUNS, (Q,), bounds={QD: ("2 m/s", None), "x": (0, 1)}, priors={QD: "gauss(1, 2)"})
    assert {p.where for p in request_problems(SCENE, wrong)} == {"bounds", f"priors, {QD}"}
    late = FitRequest((QD,), RUNS, (Q,), bounds={QD: ("2 m/s", None)}, trials={"t": trunnion.Experiment(noise={X: -1.0})})
    assert {p.where for p in request_problems(SCENE, late)} == {"bounds"}
    silent = FitRequest((QD,), RUNS, (Q,), trials={"t": trunnion.Experiment(outputs="rail.qd[1]")})
    assert {p.where for p in request_problems(SCENE, silent)} == {"trial t, noise"}
    assert request_problems(SCENE, WHOLE) == []


def test_a_fit_whose_end_is_wanted_ends(whole: FitPlan) -> None:
    class Enough(Exception):
        pass

    looked = 0

    def look() -> None:
        nonlocal looked
        looked += 1
        if looked > 20:
            raise Enough

    with watched(look), pytest.raises(Enough):
        FitRunner(whole).chunk(0, 2)


def test_memory_of_a_slope_spectrum_grows_with_the_number_of_values_not_its_square() -> None:
    slopes = np.column_stack([np.ones(50_000), np.linspace(0.0, 1.0, 50_000)])
    tracemalloc.start()
    try:
        found = slope_spectrum(slopes, len(slopes), 2.0, True)
        assert tracemalloc.get_traced_memory()[1] < 20 * slopes.nbytes
    finally:
        tracemalloc.stop()
    assert found.covariance == pytest.approx(np.linalg.inv(slopes.T @ slopes))
