"""Every block of every page runs as printed. Run with ``python -m pytest -m pages -n 2 --dist loadgroup``."""

from __future__ import annotations

import pytest

from tests.pages.environments import Home
from tests.pages.groups import GROUPS, ROOT, begins, cases, read_through
from tests.pages.reading import pages, steps


def test_every_page_with_something_to_run_is_run() -> None:
    found = {p.relative_to(ROOT).as_posix() for p in pages(ROOT)}
    assert found == {page for group in GROUPS.values() for page in group if steps(ROOT / page)}


def test_every_page_begins_with_what_it_installs() -> None:
    """A page that names a command without saying where it comes from leaves its reader to guess."""
    for page in (page for group in GROUPS.values() for page in group if steps(ROOT / page)):
        first = begins(page)[0].text
        assert "pip install" in first, f"{page} begins with {first.splitlines()[0]!r}"
    assert "[README](../README.md)" in (ROOT / "models" / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(("group", "page"), cases())
def test_the_page_runs_as_printed(group: str, page: str, homes: dict[str, Home], tmp_path_factory: pytest.TempPathFactory) -> None:
    read_through(group, page, homes, tmp_path_factory)
