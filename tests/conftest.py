"""What all tests share: Python programs that tests start keep their compiled modules for the next one, and drawing examples has no
time limit."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


def pytest_configure(config: pytest.Config) -> None:
    """Where the environment forbids compiled modules beside the sources, each of some two hundred programs that tests start would
    compile ours anew (0.2 to 0.5 s): they go to pytest's own folder."""
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
        os.environ.setdefault("PYTHONPYCACHEPREFIX", str(config.rootpath / ".pytest_cache" / "compiled"))
