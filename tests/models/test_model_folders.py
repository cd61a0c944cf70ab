"""Every bundled model is a folder with its own evidence: scene, README with its command and pictures, reference numbers."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import pytest

from tests.models.reference_file_reader import expected
from tests.pictures.model_pictures import CHOICES, CURVES, MECHANISM, draw
from trunnion.cli import main
from trunnion.cli.commands import simulate
from trunnion.scene.library.model_folders import model_names, models_dir

LINK = re.compile(r'!?\[[^\]]*\]\(([^)\s]+)\)|<img\s[^>]*src="([^"]+)"')
COMMAND = re.compile(r"^    trunnion simulate ([^#\n]+)", re.MULTILINE)
MOST_BYTES = 150_000
"""Largest picture of a README in bytes: larger ones make the checkout and the page slow."""
READMES = sorted(models_dir().glob("**/README.md"))


def readme(name: str) -> str:
    return (models_dir() / name / "README.md").read_text(encoding="utf-8")


def links(file: Path) -> list[str]:
    found = [a or b for a, b in LINK.findall(file.read_text(encoding="utf-8"))]
    return [x.split("#")[0] for x in found if not re.match(r"[a-z]+:", x) and not x.startswith("#")]


def commands(name: str) -> list[list[str]]:
    return [c.split() for c in COMMAND.findall(readme(name))]


@pytest.mark.parametrize("name", model_names())
def test_a_model_has_its_four_parts(name: str) -> None:
    folder = models_dir() / name
    assert (folder / "scene.yaml").is_file()
    assert (folder / "README.md").is_file()
    assert expected(name), "reference.yaml has no number"
    assert {p.name for p in folder.glob("*.png")} == {MECHANISM, CURVES}


@pytest.mark.parametrize("name", model_names())
def test_the_readme_of_a_model_shows_both_pictures_and_a_command_that_runs_it(name: str) -> None:
    shown = links(models_dir() / name / "README.md")
    assert {MECHANISM, CURVES} <= set(shown)
    assert any(words[0] == name for words in commands(name))
    assert "## Reference numbers" in readme(name)


@pytest.mark.default_cases(10)
@pytest.mark.parametrize("name", model_names())
def test_the_commands_of_the_readme_of_a_model_are_understood(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulate, "run_and_report", lambda request, as_json: 0)
    for words in commands(name):
        assert main(["simulate", *words]) == 0


@pytest.mark.parametrize("file", READMES, ids=lambda f: f.parent.name)
def test_every_relative_link_leads_somewhere(file: Path) -> None:
    missing = [x for x in links(file) if not (file.parent / x).exists()]
    assert not missing


def test_the_table_of_models_has_them_all() -> None:
    table = links(models_dir() / "README.md")
    assert {f"{n}/README.md" for n in model_names()} <= set(table)
    assert {f"{n}/{MECHANISM}" for n in model_names()} <= set(table)


def test_the_gallery_draws_every_model() -> None:
    assert set(CHOICES) == set(model_names())


@pytest.mark.parametrize("name", model_names())
def test_pictures_are_small_files_and_large_enough_to_read(name: str) -> None:
    for file in (MECHANISM, CURVES):
        data = (models_dir() / name / file).read_bytes()
        width, height = struct.unpack(">II", data[16:24])
        assert len(data) < MOST_BYTES
        assert width >= 800
        assert height >= 250


@pytest.mark.slow
def test_the_gallery_draws_the_same_bytes_twice(tmp_path: Path) -> None:
    first, second = ({p.name: p.read_bytes() for p in draw("spatial_slider_crank", _made(tmp_path / n))} for n in "ab")
    assert first == second
    assert set(first) == {MECHANISM, CURVES}


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder
