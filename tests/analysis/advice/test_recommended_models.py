"""The advice recommends the simplest model that is accurate enough for the requested outputs. The written scene has the promised
error."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

import trunnion
from tests.engine.unilateral.unilateral_scenes import box
from trunnion.analysis.advice.model_advice import Advice, _Ladder, advise
from trunnion.analysis.advice.simplified_models import apply_form, friction_forms, frictional_joints, keep_friction, make_planar
from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel, methods
from trunnion.analysis.work_precision.error_measure import ErrorMeasure
from trunnion.analysis.work_precision.reference_solution import Reference
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.scene import load_scene
from trunnion.simulation.results.result import Result
from trunnion.simulation.runtime_interface.simulation_block import Settings

WANTED = 1e-4
QUICK = {"repeats": 1, "samples": 50, "until": 0.65}


@pytest.fixture(scope="module")
def torque() -> Advice:
    """Advice on example 8.2 for the drive's torque over one turn of the crank."""
    return advise(load_scene("crank_slider"), WANTED, ("crank_pivot.drive.effort[1]",), **QUICK)  # type: ignore[arg-type]


@pytest.mark.slow
def test_friction_of_the_slider_pin_does_not_matter_to_the_sliders_motion() -> None:
    """A drive prescribes the motion of example 8.2. Therefore the motion does not depend on forces."""
    a = advise(load_scene("crank_slider"), WANTED, ("slider.position[1]", "slider.velocity[1]"), **QUICK)  # type: ignore[arg-type]
    assert a.chosen is not None
    assert a.chosen.joints == ()
    assert a.scene is not None
    assert frictional_joints(a.scene) == []
    assert a.influences[0].predicted < 1e-10


@pytest.mark.slow
def test_friction_of_the_slider_pin_matters_to_the_drive_torque(torque: Advice) -> None:
    assert torque.chosen is not None
    assert torque.chosen.joints == ("slider_pin",)
    assert torque.chosen.setting is not None
    assert torque.chosen.setting.error <= WANTED


@pytest.mark.slow
def test_the_integration_error_is_part_of_the_error_and_falls_with_the_requested_error() -> None:
    parts = []
    for wanted in (1e-3, 1e-6):
        a = advise(load_scene("spherical_pendulum"), wanted, ("pendulum.position[1]",), **QUICK)  # type: ignore[arg-type]
        assert a.chosen is not None
        setting = a.chosen.setting
        assert setting is not None
        assert 0.0 < setting.integration < 2.0 * wanted  # the stated error includes a factor of safety
        parts.append(setting.integration)
    assert parts[1] < 0.1 * parts[0]


def test_the_prediction_by_sensitivities_is_the_change_measured(torque: Advice) -> None:
    """The prediction is of first order in friction, but friction also changes the normal force. The test allows 10 % for this
    effect."""
    ideal = next(r for r in torque.rungs if not r.joints)
    assert not ideal.predicted
    assert ideal.setting is None
    assert torque.influences[0].predicted == pytest.approx(ideal.model_error, rel=0.1)


def test_the_ladder_goes_from_the_coarsest_form_to_the_scenes_own(torque: Advice) -> None:
    own = [r for r in torque.rungs if r.joints and not r.flat]
    assert [r.form for r in own] == friction_forms(load_scene("crank_slider"))
    assert own[-1].model_error < 1e-12  # the last model of the ladder is the scene itself


@pytest.mark.slow
def test_a_model_that_the_requested_error_excludes_is_not_run() -> None:
    """Without friction, the model of 8.1 has a large error. The sensitivities predict this error, so the advice does not run the
    model."""
    a = advise(load_scene("spherical_pendulum"), 1e-3, ("pendulum.position[1]",), 2.0, repeats=1, samples=40)
    assert a.rungs[0].predicted
    assert a.rungs[0].model_error > 30 * 1e-3
    assert a.chosen is not None
    assert a.chosen.joints == ("ball",)


def test_a_method_far_slower_than_the_best_is_not_tightened_further() -> None:
    """The test replaces the runs by invented results. Each run takes 10 ms, but time stepping takes ten times longer at each
    tighter tolerance. The automatic choice meets the error at the first tolerance, the other methods only at the tightest
    tolerance."""
    asked: list[tuple[str, float]] = []

    def once(settings: Settings) -> tuple[Result, str]:
        asked.append((settings.method, settings.rtol))
        good = settings.method == "auto" or settings.rtol < 1e-11
        stats = SimpleNamespace(wall_time=1e-4 / settings.rtol if settings.method == "moreau" else 0.01)
        return cast(Result, SimpleNamespace(good=good, stats=stats)), "done"

    ladder = object.__new__(_Ladder)
    ladder.what = cast(ErrorMeasure, SimpleNamespace(error=lambda good, _: 0.0 if good else 1.0))
    ladder.error, ladder.repeats, ladder.reference = WANTED, 1, cast(Reference, SimpleNamespace(data=None))
    runs = {"once": once, "seconds": lambda s: once(s)[0].stats.wall_time, "samples": lambda r: r.good}
    ready = cast(BenchmarkModel, SimpleNamespace(scene=load_scene("simple_pendulum"), **runs))
    best = ladder._find_cheapest(ready)
    assert best is not None
    assert best.method == "auto"
    assert [r for m, r in asked if m == "moreau"] == pytest.approx([1e-2, 1e-3, 1e-4])
    assert min(r for m, r in asked if m == "rk8") < 1e-11


@pytest.mark.slow
def test_a_column_the_lesser_model_does_not_have_counts_as_zero() -> None:
    a = advise(load_scene("crank_slider"), 1e-2, ("slider_pin.friction.torque[1]",), **QUICK)  # type: ignore[arg-type]
    assert a.rungs[0].model_error > 0.1
    assert a.chosen is not None
    assert a.chosen.joints == ("slider_pin",)


@pytest.mark.slow
def test_the_written_scene_meets_the_error_by_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "reduced.yaml"
    words = ["advise", "crank_slider", "--error", "1e-4", "--outputs", "crank_pivot.drive.effort[1]", "--until", "0.65"]
    assert main([*words, "--repeat", "1", "-o", str(file)]) == 0
    assert "advice: friction in slider_pin" in capsys.readouterr().out
    mine = trunnion.simulate(str(file), 0.65, 0.013)
    full = trunnion.simulate("crank_slider", 0.65, 0.013, rtol=1e-10)
    name = "crank_pivot.drive.effort[1]"
    off = np.sqrt(((mine[name] - full[name]) ** 2).mean()) / np.abs(full[name]).max()
    assert off < 2e-4  # the sample times of this run differ from the sample times of the advice


def test_planar_mechanisms_are_found_and_spatial_ones_are_not() -> None:
    changed, flat = make_planar(keep_friction(load_scene("crank_slider"), ()), 0.3)
    assert flat == ["crank_pin"]
    assert changed.joints["crank_pin"].type == "revolute"
    a = trunnion.simulate("crank_slider", 0.3, 0.01, outputs=["slider.position[1]"])
    b = trunnion.simulate(changed, 0.3, 0.01, outputs=["slider.position[1]"])
    assert np.abs(a.data - b.data).max() < 1e-10
    assert make_planar(load_scene("spatial_slider_crank"), 0.1)[1] == []


def test_forms_reach_joints_that_name_their_own() -> None:
    from trunnion.scene.overrides import apply

    scene = apply(load_scene("spherical_pendulum"), {"joints.ball.friction.normal_force": "adams"})
    own = apply_form(scene, friction_forms(scene)[-1])
    friction = own.joints["ball"].friction
    assert friction is not None
    assert friction.normal_force == "exact"


def test_every_mistake_is_reported_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["advise", "crank_slider", "--error", "2", "--norm", "least", "-o", "x.txt"]) == 2
    err = capsys.readouterr().err
    for word in ("--error", "least", "-o", "--outputs"):
        assert word in err
    with pytest.raises(SceneError) as e:
        advise(load_scene("crank_slider"), 0.0, ())
    assert len(e.value.problems) == 2


def test_the_json_output_has_the_ladder_and_the_scene(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["advise", "crank_slider", "--error", "1e-3", "--outputs", "slider.position[1]", "--until", "0.2"]
    assert main([*words, "--repeat", "1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    model = document["rungs"][document["chosen"]]["model"]
    assert model.startswith("all joints ideal")  # the advice may choose planar joints for speed
    assert document["scene"]["name"] == "crank_slider"


def test_forms_of_friction_and_methods_that_a_scene_refuses_are_left_out() -> None:
    """The regularised law has no impacts with friction, and time stepping does not locate impacts."""
    falls = box(0.3, 0.05, 0.1, 1.0, 0.01, (0.15, 0.0, 0.0), (0.0, 1.0, 0.0))
    ladder = _Ladder(falls, 1e-3, cast(ErrorMeasure, None), 0.1, 1, 10, lambda *_: None)
    assert {form.law for form in ladder.forms} == {"coulomb"}
    assert any(n.startswith("not tried: regularized") for n in ladder.notes)
    assert "moreau" not in methods(falls)
