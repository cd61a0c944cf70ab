"""A fixture: the copies of the checkout in which the tests run pages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import pytest

from tests.documentation.virtual_environments import Home


@pytest.fixture(scope="module")
def homes() -> Iterator[dict[str, Home]]:
    """A copy of the checkout for every group, with a separate environment. The copy is deleted at the end of the tests."""
    made: dict[str, Home] = {}
    yield made
    for home in made.values():
        shutil.rmtree(home.path, ignore_errors=True)
