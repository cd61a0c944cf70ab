"""All other pages run as printed. One process runs them, because some of them have servers at the same port: ``python -m pytest -m
pages -n 2 --dist loadfile``."""

from __future__ import annotations

import pytest

from tests.documentation.page_groups import cases, read_through
from tests.documentation.virtual_environments import Home


@pytest.mark.pages
@pytest.mark.parametrize(("group", "page"), cases(about_models=False))
def test_the_page_runs_as_printed(group: str, page: str, homes: dict[str, Home], tmp_path_factory: pytest.TempPathFactory) -> None:
    read_through(group, page, homes, tmp_path_factory)
