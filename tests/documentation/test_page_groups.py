"""Every page runs, and first states how to install the packages that it uses. ``test_model_pages`` and ``test_other_pages`` run the
pages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.documentation.code_blocks import pages, steps
from tests.documentation.page_groups import GROUPS, INSTALLED, ROOT, alone, begins
from tests.documentation.shell_session import Reader
from tests.documentation.virtual_environments import Home

COMMAND = re.compile(r"((\.venv/bin/)?(trunnion|python3?|pip|fmpy|curl|cc|git|cd|for|done|export|kill))(?=\s|$)|[#\s]|[A-Z_]+=")
"""The beginning of a line of a shell block: a command, a comment, an indented continuation, or a variable."""


def test_every_page_with_something_to_run_is_run() -> None:
    found = {p.relative_to(ROOT).as_posix() for p in pages(ROOT)}
    assert found == {page for group in GROUPS.values() for page in group if steps(ROOT / page)}


def test_every_page_begins_with_its_installation() -> None:
    """A page must say how to install a command before it uses the command."""
    for page in (page for group in GROUPS.values() for page in group if steps(ROOT / page)):
        first = begins(page)[0].text
        assert "pip install" in first, f"{page} begins with {first.splitlines()[0]!r}"
    assert "[README](../README.md)" in (ROOT / "models" / "README.md").read_text(encoding="utf-8")


def test_every_line_of_a_shell_block_is_a_command() -> None:
    """Every line must be a command: a formatter that fills paragraphs would join the lines of blocks."""
    shell = [(page, line) for page in pages(ROOT) for step in steps(page) if step.kind == "bash" for line in step.text.splitlines()]
    assert [x for x in shell if x[1].strip() and not COMMAND.match(x[1])] == []


def test_a_second_process_that_runs_pages_of_one_kind_is_refused(tmp_path: Path) -> None:
    """The servers of all pages use one port. (``--dist loadgroup`` did not separate the pages: pytest 9.2 ignores the names of the
    groups.)"""
    alone(tmp_path, about_models=True)
    alone(tmp_path, about_models=False)
    alone(tmp_path, about_models=False)
    (tmp_path / "others.process").write_text("another")
    with pytest.raises(AssertionError, match="--dist loadfile"):
        alone(tmp_path, about_models=False)


@pytest.mark.parametrize(
    ("printed", "typed"),
    [
        (INSTALLED, "python3 -m venv .venv && . .venv/bin/activate && pip install -q trunnion"),
        ("pip install -q '.[tables]' && trunnion models", "pip install -q 'trunnion[tables]' && trunnion models"),
        ('.venv/bin/pip install -q -e ".[test]"', '.venv/bin/pip install -q -e ".[test]"'),
        ("pip install ./other", "pip install ./other"),
    ],
)
def test_only_an_environment_that_holds_the_project_is_spared_its_build(
    printed: str, typed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first environment is installed as its page says. With TRUNNION_PAGES=all, every environment is installed as its page
    says."""
    monkeypatch.delenv("TRUNNION_PAGES", raising=False)
    empty, begun = Reader(Home(tmp_path, tmp_path)), Reader(Home(tmp_path, tmp_path, copied=True))
    assert (empty.cheaper(printed), begun.cheaper(printed)) == (printed, typed)
    monkeypatch.setenv("TRUNNION_PAGES", "all")
    assert begun.cheaper(printed) == printed
