"""The copies of the checkout in which pages are read."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def homes() -> Iterator[dict[str, Path]]:
    """A copy of the checkout for every group, with an environment of its own; gone afterwards."""
    made: dict[str, Path] = {}
    yield made
    for home in made.values():
        shutil.rmtree(home, ignore_errors=True)
