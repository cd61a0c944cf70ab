"""Every program and every command of the cookbook runs as printed, in the cells of the page's notebook."""

from __future__ import annotations

import contextlib
import io
import shlex
from pathlib import Path

import nbformat
import pytest

from tests.models.cookbook_notebooks import FOLDER, PAGES, notebook
from trunnion.cli import main

SLOW = {"system_engineer", "data_scientist"}
"""Pages that take five seconds and more. The tests of pages also run all of them, as printed and in the environment where they are
installed."""


@pytest.mark.parametrize("page", [pytest.param(p, id=p.stem, marks=[pytest.mark.slow] * (p.stem in SLOW)) for p in PAGES])
def test_the_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    found = [c["source"] for c in notebook(page)["cells"] if c["cell_type"] == "code"]
    assert found
    for text in found:
        if not text.startswith("!"):
            with contextlib.redirect_stdout(io.StringIO()) as said:
                exec(compile(text, page.name, "exec"), names)
            assert "nan" not in said.getvalue()
            continue
        for line in text.splitlines():
            words = shlex.split(line[1:])
            assert words[0] == "trunnion"
            assert main(words[1:]) == 0, line


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_a_notebook_is_valid_and_lacks_nothing_of_its_page(page: Path) -> None:
    made = notebook(page)
    nbformat.validate(made)
    words = {w.removeprefix("!") for c in made["cells"] for w in c["source"].split()}
    assert set(page.read_text(encoding="utf-8").split()) - words <= {"```python", "```bash", "```"}


def test_every_page_is_in_the_list() -> None:
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert all(f"({p.name})" in text for p in PAGES)
