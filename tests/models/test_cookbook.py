"""Every program and every command of the cookbook runs as printed there."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest

from trunnion.cli import main
from trunnion.scene.library.model_folders import models_dir

FOLDER = models_dir() / "cookbook"
PAGES = sorted(p for p in FOLDER.glob("*.md") if p.name != "README.md")
BLOCK = re.compile(r"^```(python|bash)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page: Path) -> list[tuple[str, str]]:
    return BLOCK.findall(page.read_text(encoding="utf-8"))


SLOW = {"system", "data"}
"""Pages that take ten seconds and more. The tests of pages also run all of them, as printed and in the environment where they are
installed."""


@pytest.mark.parametrize("page", [pytest.param(p, id=p.stem, marks=[pytest.mark.slow] * (p.stem in SLOW)) for p in PAGES])
def test_the_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    found = blocks(page)
    assert found
    for kind, text in found:
        if kind == "python":
            with contextlib.redirect_stdout(io.StringIO()) as said:
                exec(compile(text, page.name, "exec"), names)
            assert "nan" not in said.getvalue()
            continue
        for line in text.splitlines():
            words = shlex.split(line)
            if "install" in words:
                continue  # everything is installed here; the tests of pages run the printed installation
            assert words[0] == "trunnion"
            assert main(words[1:]) == 0, line


def test_every_page_is_in_the_list() -> None:
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert all(f"({p.name})" in text for p in PAGES)
