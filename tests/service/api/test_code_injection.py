"""Scenes contain no code, generated C contains no text of the user, and a wheel holds all files that the service needs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.service.http_servers import ROOT
from trunnion.basics.problems import SceneError
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


def test_the_wheel_holds_the_page_and_the_migrations(tmp_path: Path) -> None:
    build_wheel = "import sys; from setuptools.build_meta import build_wheel; print(build_wheel(sys.argv[1]))"
    env = dict(os.environ, TRUNNION_PREBUILD="0")
    ask = [sys.executable, "-c", build_wheel, str(tmp_path)]
    done = subprocess.run(ask, cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    names = zipfile.ZipFile(tmp_path / done.stdout.split()[-1]).namelist()
    for folder in ("page", "store/migrations", "store/migrations/versions"):
        here = [f for f in (ROOT / "service" / folder).iterdir() if f.is_file() and f.suffix != ".mako"]
        assert {f"trunnion/service/{folder}/{f.name}" for f in here} <= set(names)
    assert "trunnion/runtime/hosts/batch.c" in names
