"""Scenes that users send. Their text does not reach generated C, a name selects only bundled models, and the size of scenes is
limited."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from trunnion.basics.errors import SceneError
from trunnion.kernel.c_sources import jacobian_source, kernel_source
from trunnion.kernel.interface.output_columns import columns, needs_quadratures
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.library.model_folders import model_names
from trunnion.scene.scene_loader import load_scene, scene_from_dict
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import SceneSource, scene_of
from trunnion.system.construction.system_builder import build


def test_generated_c_holds_no_text_of_the_user() -> None:
    text = json.dumps(scene_to_dict(load_scene("spherical_pendulum")))
    for word in ("pendulum", "ball", "tip"):
        text = text.replace(word, f"zqx{word}")
    built = build(scene_from_dict(json.loads(text)))
    every = columns(built.system)
    arguments = (built.system, len(built.parameters.values))
    units = kernel_source(*arguments, every, needs_quadratures(every), False).units
    assert all("zqx" not in c for c in [*units.values(), jacobian_source(*arguments, False)])


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../models/spherical_pendulum", "file:///etc/passwd", "s3://x/y", ".", "", "scene.yaml"]
)
def test_a_name_in_a_request_is_a_bundled_models_or_nothing(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.yaml").write_text("schema: 1")
    with pytest.raises(SceneError, match="no bundled model"):
        scene_of(SceneSource(scene=name), Limits())


def test_a_file_where_the_server_runs_does_not_stand_in_for_a_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spherical_pendulum").write_text("schema: 1")
    assert "spherical_pendulum" in model_names()
    assert scene_of(SceneSource(scene="spherical_pendulum"), Limits()).bodies


def test_a_scene_of_too_many_bodies_is_refused() -> None:
    with pytest.raises(SceneError, match="more than the 0 allowed"):
        scene_of(SceneSource(scene="spherical_pendulum"), Limits(bodies=0))
