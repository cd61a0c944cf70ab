"""Every block of every page runs as printed: the pages that start a server at the port they print."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pages.groups import cases, read_through


@pytest.mark.parametrize(("group", "page"), cases(serving=True))
def test_the_page_runs_as_printed(group: str, page: str, homes: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> None:
    read_through(group, page, homes, tmp_path_factory)
