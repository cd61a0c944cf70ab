"""A fixture: the copies of the checkout in which the tests run pages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import pytest

from tests.documentation.virtual_environments import Home


@pytest.fixture(scope="module")
def homes() -> Iterator[dict[str, Home]]:
    """A copy of the checkout for every group, with an environment of its own; it is deleted afterwards."""
    made: dict[str, Home] = {}
    yield made
    for home in made.values():
        shutil.rmtree(home.path, ignore_errors=True)
