"""Every Python function accepts a scene, a time or patterns in every form, and reports any other argument as a problem."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion.basics.errors import SceneError
from trunnion.fmu.scene_export import export
from trunnion.scene import load_scene, scene_to_dict
from trunnion.scene.data_classes.scene import Body, Joint, Scene
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.scene.library.model_folders import model_file

NAME = "simple_pendulum"
SHORT = {"until": "20 ms", "every": "10 ms"}


@pytest.fixture
def forms(tmp_path: Path) -> list:
    """One scene in every accepted form."""
    scene = load_scene(NAME)
    file = tmp_path / "swing" / "scene.yaml"
    file.parent.mkdir()
    file.write_text(scene_to_yaml(scene))
    return [scene, NAME, file, str(file), file.parent, scene_to_dict(scene), model_file(NAME)]


def test_a_run_takes_a_scene_in_every_form_and_times_with_units(forms: list) -> None:
    wanted = trunnion.simulate(forms[0], until=0.02, every=0.01, outputs=["pivot.q[1]"])
    for scene in forms:
        r = trunnion.simulate(scene, **SHORT, rtol="1e-6", outputs="pivot.q[*")
        assert [c.name for c in r.columns] == ["pivot.q[1]"]
        assert np.array_equal(r["pivot.q[1]"], wanted["pivot.q[1]"])


def test_a_sweep_takes_a_scene_in_every_form_and_times_with_units(forms: list) -> None:
    path = "bodies.bob.mass"
    tables = [
        trunnion.sweep(s, vary={path: values}, reductions="max:pivot.q[1]", **SHORT).table.column("max:pivot.q[1]").to_pylist()
        for s in forms
        for values in (["1 kg", "2 kg"], np.array([1.0, 2.0]), (np.float32(1.0), 2))
    ]
    assert all(t == tables[0] and len(t) == 2 for t in tables)


def test_derivatives_take_a_scene_in_every_form_and_times_with_units(forms: list) -> None:
    found = [trunnion.sensitivity(s, "gravity[2]", "pivot.q[1]", until="20 ms", every="10 ms", rtol="1e-9") for s in forms]
    assert all(f.names == ("pivot.q[1]",) and np.array_equal(f.derivatives, found[0].derivatives) for f in found)


def test_the_linear_system_takes_a_scene_in_every_form_and_times_with_units(forms: list) -> None:
    found = [trunnion.linearize(s, at="10 ms", outputs="pivot.q[1]") for s in forms]
    assert all(f.time == found[0].time and np.array_equal(f.A, found[0].A) for f in found)


def test_an_fmu_takes_a_scene_in_every_form_and_times_with_units(forms: list, tmp_path: Path) -> None:
    found = [export(s, tmp_path / "a.fmu", step="1 ms", outputs="pivot.q[1]").guid for s in forms]
    assert len({g for g, s in zip(found, forms, strict=True)}) <= 2  # one scene has another name: the name of the file's folder


@pytest.mark.parametrize("scene", [3, None, ["simple_pendulum"], b"simple_pendulum", {"bodies": 3}, Path("no.yaml")])
def test_an_argument_that_is_not_a_scene_is_a_problem(scene: object, tmp_path: Path) -> None:
    for ask in (
        lambda: trunnion.simulate(scene),
        lambda: trunnion.sweep(scene, vary={"gravity[2]": [1]}),
        lambda: trunnion.sensitivity(scene, ["gravity[2]"], ["pivot.q[1]"]),
        lambda: trunnion.linearize(scene),
        lambda: export(scene, tmp_path / "a.fmu"),
    ):
        with pytest.raises(SceneError):
            ask()


def test_a_scene_made_in_python_is_checked_before_it_runs() -> None:
    scene = Scene(bodies={"a": Body(box=(1, 1, 1), density=1)}, joints={"j": Joint("revolute", "ground", "b", axis="z")})
    with pytest.raises(SceneError, match="no body"):
        trunnion.simulate(scene)


def test_times_that_are_none_are_reported_together(tmp_path: Path) -> None:
    with pytest.raises(SceneError) as e:
        trunnion.simulate(NAME, until="10 m", every="soon", rtol=[1], step="1 kg")
    assert [p.where for p in e.value.problems] == ["until", "every", "rtol", "step"]
    with pytest.raises(SceneError, match="until"):
        trunnion.sweep(NAME, vary={"gravity[2]": [1]}, until="10 m")
    with pytest.raises(SceneError, match="step"):
        export(NAME, tmp_path / "a.fmu", step="1 kg")
