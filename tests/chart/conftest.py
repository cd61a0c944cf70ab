"""Outside programs these tests need: skipped with a reason, unless TRUNNION_REQUIRE names them (then they fail)."""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib.util import find_spec

import pytest


@pytest.fixture
def needs() -> Callable[[str], None]:
    """A function that skips or fails the test when the package it is given is not installed."""

    def check(package: str) -> None:
        if find_spec(package) is not None:
            return
        wanted = os.environ.get("TRUNNION_REQUIRE", "").replace(",", " ").split()
        if package in wanted:
            pytest.fail(f"{package} is required and not installed")
        pytest.skip(f"{package} is not installed")

    return check
