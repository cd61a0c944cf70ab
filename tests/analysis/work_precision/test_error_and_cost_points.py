"""Charts plot true errors, show failures as points, and store the measured values in files."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from trunnion.analysis.work_precision import benchmark_study
from trunnion.analysis.work_precision.benchmark_model import friction_variants, make_benchmark_model, time_repeats, with_law
from trunnion.analysis.work_precision.benchmark_study import measure_work_precision
from trunnion.analysis.work_precision.error_cost_curves import group_into_curves
from trunnion.analysis.work_precision.error_measure import ErrorMeasure, make_error_measure
from trunnion.analysis.work_precision.measurement_points import FrictionVariant, Measurement, pareto_front
from trunnion.analysis.work_precision.output_files import write_work_precision
from trunnion.analysis.work_precision.reference_solution import find_reference
from trunnion.analysis.work_precision.request_and_results import WorkPrecision, WorkPrecisionRequest
from trunnion.elements.friction import REGISTRY
from trunnion.scene import load_scene
from trunnion.scene.overrides import apply
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.simulation_block import Settings

QUICK = WorkPrecisionRequest(methods=("rk5", "rk8"), rtols=(1e-4, 1e-7, 1e-10), repeats=1, samples=20, solvers=False)
PERIOD = 2.36784194757623745
"""Period of benchmark A01's pendulum, s, by elliptic functions."""


@pytest.fixture(scope="module")
def swing() -> WorkPrecision:
    """The study of a simple pendulum over one second."""
    return measure_work_precision(load_scene("simple_pendulum"), WorkPrecisionRequest(**(QUICK.__dict__ | {"until": 1.0})))


@pytest.fixture(scope="module")
def rubbing() -> WorkPrecision:
    """The study of example 8.1 with the regularised law at two values of v_eps."""
    scene = load_scene("spherical_pendulum")
    return measure_work_precision(
        scene, WorkPrecisionRequest(**(QUICK.__dict__ | {"laws": ("regularized",), "v_eps": (1e-2, 1e-3), "until": 2.0}))
    )


def test_the_reference_names_the_two_methods_that_made_it_and_they_differ(swing: WorkPrecision) -> None:
    own = swing.references[FrictionVariant()]
    first, second = own.made_by.split(", ")
    assert first.split()[0] != second.split()[0]
    assert 0 <= own.error < 1e-10  # both methods run at 1e-12 or tighter, over less than half a period


def test_the_error_that_a_run_states_of_itself_is_the_true_one(swing: WorkPrecision) -> None:
    own = swing.references[FrictionVariant()].error
    ratios = [p.predicted / p.error for p in swing.engine_points() if p.ok and 100 * own < p.error < 0.1]
    assert len(ratios) > 10
    assert all(0.5 < r < 5 for r in ratios)


def test_the_reference_is_the_closed_form() -> None:
    """After one period the pendulum is back at (−1, 0)."""
    scene = load_scene("simple_pendulum")
    study = measure_work_precision(
        scene, WorkPrecisionRequest(rtols=(1e-6,), methods=("rk8",), until=PERIOD, samples=1, repeats=1, fixed=False, solvers=False)
    )
    body = next(iter(scene.bodies))
    at = [study.measure.names.index(f"{body}.position[{k}]") for k in (1, 2)]
    end = study.references[FrictionVariant()].data[-1][at]
    assert np.abs(end - [-1.0, 0.0]).max() < 1e-10  # the period is known to 17 digits, the reference to about 1e-12


def test_the_reference_asks_a_method_of_first_order_only_where_it_must(monkeypatch: pytest.MonkeyPatch) -> None:
    """At tight tolerance, time stepping takes millions of steps for few correct digits."""
    scene = load_scene("spherical_pendulum")
    ready = make_benchmark_model(scene, FrictionVariant("coulomb"), make_error_measure(scene), 0.1, 5)
    once, asked = ready.once, []

    def watched(settings: Settings) -> tuple[Result | None, str]:
        asked.append(settings.method)
        quick = replace(settings, rtol=1e-3) if settings.method == "moreau" else settings  # a loose tolerance saves time
        return (None, "failed") if settings.method in failing else once(quick)

    monkeypatch.setattr(ready, "once", watched)
    failing: tuple[str, ...] = ()
    first = find_reference(ready)
    assert "moreau" not in asked
    failing = ("rk8", "rosenbrock")
    second = find_reference(ready)
    assert first is not None
    assert second is not None
    assert "moreau" in second.made_by
    assert first.error < 1e-3 * second.error


def test_tighter_tolerances_give_smaller_errors_until_the_references_own(swing: WorkPrecision) -> None:
    for c in group_into_curves(swing.points):
        errors = [p.error for p in c.points]
        assert all(p.ok for p in c.points)
        if not c.fixed:
            assert errors == sorted(errors, reverse=True)
            assert errors[0] > 100 * errors[-1]


def test_a_fixed_step_halved_divides_the_error_by_the_order(swing: WorkPrecision) -> None:
    """Half the step divides the error of a method of order 5 by 32, if steps are small and the error is larger than round-off."""
    steps = next(c for c in group_into_curves(swing.points) if c.fixed and c.method == "rk5").points
    ratios = [a.error / b.error for a, b in pairwise(steps) if 1e-11 < b.error < 1e-5]
    assert ratios
    assert max(ratios) > 24
    assert min(ratios) < 100


def test_the_regularised_law_has_an_error_of_its_own_that_no_tolerance_removes(rubbing: WorkPrecision) -> None:
    """The error is of first order in v_eps. The error of the law with v_eps 1e-2 is the same at the tolerances 1e-7 and 1e-10."""
    rough = [p for p in rubbing.points if p.v_eps == 1e-2 and not p.fixed and p.rtol <= 1e-7]
    assert all(p.error < 1e-5 for p in rough)
    floor = {round(p.model_error, 6) for p in rough}
    assert len(floor) == 1
    assert floor.pop() > 1e-5


def test_a_run_that_fails_is_a_point_with_its_reason() -> None:
    """A run without enough steps and a run of a guide that jams from the start raise no exception. Their error is NaN."""
    jammed = apply(load_scene("double_pendulum"), {"joints.guide.friction.half_length": 0.15, "friction.law": "regularized"})
    study = measure_work_precision(
        jammed,
        WorkPrecisionRequest(**(QUICK.__dict__ | {"laws": ("regularized",), "v_eps": (1e-4,), "rtols": (1e-6,), "until": 0.5})),
    )
    assert study.points
    for p in study.points:
        assert not p.ok
        assert p.outcome != "done"
        assert math.isnan(p.error)
    assert any("no two methods" in n for n in study.notes)


@pytest.mark.parametrize(("named", "measured"), [((), 1), ((1e-3, 1e-6), 2)])
def test_settings_beyond_a_slow_run_are_left_out_with_a_note_unless_the_user_named_them(
    monkeypatch: pytest.MonkeyPatch, named: tuple[float, ...], measured: int
) -> None:
    monkeypatch.setattr(benchmark_study, "SLOW_RUN", 0.0)
    monkeypatch.setattr(benchmark_study, "SLOW_RATIO", 0.0)
    wanted = WorkPrecisionRequest(methods=("rk8",), rtols=named, until=0.2, samples=2, repeats=1, fixed=False, solvers=False)
    study = measure_work_precision(load_scene("simple_pendulum"), wanted)
    assert len(study.points) == measured
    assert [n.split(",")[0] for n in study.notes] == ([] if named else ["rk8: tighter settings than rtol 1e-02"])


def test_a_methods_points_are_shown_before_the_next_method_and_the_next_law_begin() -> None:
    seen: list[str] = []
    few = {"laws": ("regularized", "coulomb"), "v_eps": (1e-2,), "until": 0.2, "fixed": False}
    wanted = WorkPrecisionRequest(**(QUICK.__dict__ | few))
    study = measure_work_precision(
        load_scene("spherical_pendulum"), wanted, lambda what, *_: seen.append(what),
        lambda points: seen.append(f"{len(points)} points of {points[0].variant} {points[0].method}"),
    )  # fmt: skip
    assert seen[:5] == ["reference coulomb", "coulomb rk5", "3 points of coulomb rk5", "coulomb rk8", "3 points of coulomb rk8"]
    assert seen[5:7] == ["reference regularized, v_eps 0.01", "regularized, v_eps 0.01 rk5"]
    assert len(study.points) == 12
    assert all(math.isfinite(p.model_error) for p in study.points)


def test_a_long_first_run_counts_as_a_repeat() -> None:
    assert time_repeats(lambda: 2.0, 3, [1.0]) == (1.0, 2.0, 3)
    assert time_repeats(lambda: 2.0, 1, [1.0]) == (1.0, 1.0, 1)
    assert time_repeats(lambda: 2.0, 1) == (2.0, 2.0, 1)


def test_laws_appear_by_themselves_and_laws_without_numbers_give_the_reason() -> None:
    found, notes = friction_variants(load_scene("spherical_pendulum"))
    left_out = {law for law in REGISTRY if any(n.startswith(f"law {law} left out") for n in notes)}
    assert {v.law for v in found} | left_out == set(REGISTRY)
    assert {"coulomb", "regularized"} <= {v.law for v in found}
    assert any("viscous" in n and "viscosity" in n for n in notes)
    assert friction_variants(load_scene("simple_pendulum")) == ([FrictionVariant()], [])


def test_a_method_is_measured_only_with_laws_that_it_integrates() -> None:
    few = {"methods": (), "rtols": (1e-3,), "laws": ("coulomb", "regularized"), "v_eps": (1e-3,), "until": 0.2}
    study = measure_work_precision(load_scene("spherical_pendulum"), WorkPrecisionRequest(**(QUICK.__dict__ | few)))
    found = {law: {p.method for p in study.points if p.law == law} for law in ("coulomb", "regularized")}
    assert found["coulomb"] - found["regularized"] == {"moreau"}
    assert found["regularized"] > {"auto", "rk5"}
    assert "law regularized: method moreau left out, since it cannot integrate this law" in study.notes


def test_a_law_reaches_joints_that_name_their_own() -> None:
    scene = apply(load_scene("spherical_pendulum"), {"joints.ball.friction.law": "regularized", "joints.ball.friction.v_eps": 1e-3})
    changed = with_law(scene, FrictionVariant("regularized", 1e-5))
    friction = changed.joints["ball"].friction
    assert friction is not None
    assert friction.v_eps == 1e-5


def test_errors_are_relative_to_the_quantity_and_a_vector_is_one_quantity() -> None:
    m = ErrorMeasure(("a[1]", "a[2]", "b"), ((0, 1), (2,)), ("m", "N"))
    ref = np.array([[3.0, 4.0, 100.0], [0.0, 1.0, -200.0]])
    data = ref + np.array([[0.0, 0.5, 0.0], [0.0, 0.0, 2.0]])
    assert m.each(data, ref).tolist() == pytest.approx([0.1, 0.01])
    assert m.error(data, ref) == pytest.approx(0.1)
    assert math.isnan(m.error(data[:1], ref))


def test_coordinates_are_quantities_of_their_own_and_vectors_are_not() -> None:
    m = make_error_measure(load_scene("double_pendulum"), ("guide.q[*", "upper.position[*"))
    assert m.groups == ((0, 1, 2), (3,), (4,))


def test_the_pareto_front_keeps_the_points_that_no_other_point_beats() -> None:
    def at(error: float, seconds: float) -> Measurement:
        return Measurement("trunnion", "m", 1e-6, 0, "", 0, error, error, seconds, seconds, 1)

    best = pareto_front([at(1e-3, 1.0), at(1e-4, 3.0), at(1e-2, 0.5), at(1e-3, 2.0), at(1e-5, 2.5)])
    assert [(p.error, p.median) for p in best] == [(1e-2, 0.5), (1e-3, 1.0), (1e-5, 2.5)]


def test_the_files_hold_every_point_and_the_page_needs_nothing_else(rubbing: WorkPrecision, tmp_path: Path) -> None:
    files = write_work_precision(rubbing, tmp_path / "new")
    assert sorted(f.name for f in files) == ["chart.csv", "chart.html", "chart.png", "chart.svg"]
    lines = [x for x in (tmp_path / "new" / "chart.csv").read_text().splitlines() if not x.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert len(rows) == len(rubbing.points)
    assert float(rows[0]["median [s]"]) > 0
    text = (tmp_path / "new" / "chart.html").read_text()
    assert "https:" not in text
    assert "http:" not in text.replace("http://www.w3.org/2000/svg", "")
    assert text.count('"setting"') == len(rubbing.points)
