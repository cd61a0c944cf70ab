"""Other programs and Trunnion compute the same motion of a mechanism that is built from the same numbers."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel, make_benchmark_model
from trunnion.analysis.work_precision.benchmark_study import measure_work_precision
from trunnion.analysis.work_precision.error_measure import make_error_measure
from trunnion.analysis.work_precision.measurement_points import FrictionVariant
from trunnion.analysis.work_precision.reference_solvers.exudyn import Exudyn
from trunnion.analysis.work_precision.reference_solvers.mujoco import Mujoco, repair_inertia
from trunnion.analysis.work_precision.reference_solvers.pinocchio import Pinocchio
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import take_snapshot
from trunnion.analysis.work_precision.reference_solvers.scipy import ScipyOnClosedForm, ScipyOnEngine
from trunnion.analysis.work_precision.reference_solvers.solver_interface import ReferenceSolver, SceneNotSupported, Setting
from trunnion.analysis.work_precision.reference_solvers.sundials import Sundials
from trunnion.analysis.work_precision.request_and_results import WorkPrecisionRequest
from trunnion.importers.pose_matrices import of_quaternion, to_quaternion
from trunnion.scene import load_scene, scene_from_dict
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.runtime_interface.simulation_block import Settings

SPATIAL = {
    "schema": 1, "name": "spatial", "gravity": [0, 0, -9.81],
    "bodies": {
        "a": {"box": [1, 0.2, 0.1], "density": 1000, "center": [0.5, 0, 0], "points": {"end": [1, 0, 0]}},
        "b": {"box": [0.2, 0.6, 0.1], "density": 1000, "center": [0.1, 0.3, 0], "points": {"end": [0, 0.6, 0]}},
        "c": {"box": [0.3, 0.3, 0.5], "density": 1000, "center": [0, 0, -0.25]},
    },
    "joints": {
        "first": {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": "a", "start": {"q": 0.3, "qd": 1.0}},
        "second": {"type": "universal", "axis": "x", "reference": "y", "inboard": "a.end", "outboard": "b",
                   "start": {"q": [0.4, -0.3], "qd": [1, -2]}},
        "third": {"type": "spherical", "inboard": "b.end", "outboard": "c", "start": {"qd": [0.5, 1, -1]}},
    },
    "simulation": {"until": 1},
}  # fmt: skip
"""An open chain with turns about all axes: revolute, universal, ball."""


@pytest.fixture(scope="module")
def spatial() -> Scene:
    return scene_from_dict(SPATIAL)


def ready(scene: Scene, law: FrictionVariant, until: float, samples: int = 20) -> BenchmarkModel:
    return make_benchmark_model(scene, law, make_error_measure(scene), until, samples)


def truth(r: BenchmarkModel) -> np.ndarray:
    result, outcome = r.once(Settings(rtol=1e-11, method="rk8"))
    assert result is not None
    assert outcome == "done"
    return r.samples(result)


def off(
    kind: type[ReferenceSolver], scene: Scene, setting: Setting, until: float = 1.0, law: FrictionVariant | None = None
) -> float:
    """Relative distance of another program's run from ours."""
    r = ready(scene, law or FrictionVariant(), until)
    data, seconds = kind(r, take_snapshot(r)).run(setting)
    assert seconds > 0
    return r.measure.error(data, truth(r))


def test_scipy_on_our_equations_is_our_motion(spatial: Scene) -> None:
    assert off(ScipyOnEngine, spatial, Setting("DOP853", 1e-10)) < 1e-7  # the chain amplifies integration errors


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", ["spherical_pendulum", "crank_slider_free", "n_four_bar", "simple_pendulum"])
def test_closed_forms_are_our_motion(name: str) -> None:
    """The run of 0.6 s ends before the first reversal of 8.1. After the reversal, kinks that SciPy does not locate reduce
    precision."""
    law = FrictionVariant("regularized", 1e-2) if name == "spherical_pendulum" else FrictionVariant()
    assert off(ScipyOnClosedForm, load_scene(name), Setting("DOP853", 1e-11), 0.6, law) < 1e-8


@pytest.mark.parametrize("name", ["crank_slider_free", "spherical_pendulum"])
def test_sundials_solves_our_equations(name: str) -> None:
    law = FrictionVariant("regularized", 1e-2) if name == "spherical_pendulum" else FrictionVariant()
    assert off(Sundials, load_scene(name), Setting("IDAS", 1e-9), 0.6, law) < 1e-5  # errors of BDF are 100 to 1000 tolerances


def test_pinocchio_moves_an_open_chain_and_a_loop_as_we_do(spatial: Scene, needs: Callable[[str], None]) -> None:
    needs("pinocchio")
    assert off(Pinocchio, spatial, Setting("DOP853", 1e-10)) < 1e-7
    assert off(Pinocchio, load_scene("crank_slider_free"), Setting("DOP853", 1e-10), 0.5) < 1e-7


def test_mujoco_moves_an_open_chain_as_we_do_and_a_loop_nearly(
    spatial: Scene, needs: Callable[[str], None], tmp_path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs("mujoco")
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log into the current folder
    assert off(Mujoco, spatial, Setting("RK4", step=1e-3)) < 1e-6  # a method of order 4 has this error in a thousand steps
    assert off(Mujoco, load_scene("crank_slider_free"), Setting("RK4", step=5e-4), 0.5) < 1e-3  # MuJoCo's constraints are soft
    assert os.listdir(tmp_path) == []


def test_exudyn_moves_chain_and_loop_as_we_do(spatial: Scene, needs: Callable[[str], None]) -> None:
    needs("exudyn")
    assert off(Exudyn, spatial, Setting("trapezoidal, index 2", step=1e-3)) < 1e-3  # the method is of order 2
    assert off(Exudyn, load_scene("crank_slider_free"), Setting("trapezoidal, index 2", step=1e-3), 0.5) < 1e-2


def test_a_solver_that_cannot_run_gives_the_reason(spatial: Scene, needs: Callable[[str], None]) -> None:
    needs("pinocchio")
    driven = load_scene("crank_slider")
    r = ready(driven, FrictionVariant("regularized", 1e-4), 0.1)
    for kind, word in ((Pinocchio, "drive"), (ScipyOnClosedForm, "no closed-form")):
        with pytest.raises(SceneNotSupported, match=word):
            kind(r, take_snapshot(r))


def test_every_reference_solver_is_listed_with_its_omissions() -> None:
    scene = load_scene("simple_pendulum")
    study = measure_work_precision(
        scene, WorkPrecisionRequest(methods=("rk8",), rtols=(1e-6,), repeats=1, samples=5, until=0.2, fixed=False)
    )
    named = {name for name, _, _ in study.solvers}
    assert {
        "scipy on our equations",
        "scipy on the closed form",
        "sundials (casadi)",
        "mujoco",
        "pinocchio",
        "exudyn",
    } == named
    assert all(text for _, _, text in study.solvers)
    assert all(p.leaves_out for p in study.solver_points())


def test_a_point_mass_is_refused_by_those_who_need_inertia(needs: Callable[[str], None]) -> None:
    needs("mujoco")
    r = ready(load_scene("simple_pendulum"), FrictionVariant(), 0.1)
    scene = take_snapshot(r)
    points = replace(scene, parts=tuple(replace(p, inertia=np.zeros((3, 3))) for p in scene.parts))
    with pytest.raises(SceneNotSupported, match="point mass"):
        Mujoco(r, points)


def test_inertia_is_only_added_where_no_body_could_have_it() -> None:
    solid = np.diag([1.0, 2.0, 2.5])
    assert np.array_equal(repair_inertia(solid), solid)
    rod = repair_inertia(np.diag([1 / 12, 0.0, 1 / 12]))
    assert rod[2, 2] == pytest.approx(1 / 12, rel=1e-8)
    assert np.linalg.eigvalsh(rod).min() > 0


def test_quaternions_turn_back() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = rng.normal(size=4)
        q /= np.linalg.norm(q) * np.sign(q[0])
        assert np.allclose(to_quaternion(of_quaternion(q)), q, atol=1e-14)
