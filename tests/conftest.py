"""Settings that all tests share. Linear algebra uses one thread, and kernels are compiled without optimisation. Python programs
that tests start store their compiled modules for later programs. Hypothesis has no time limit for an example."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.default_case_selection import keep_default_cases

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
"""Linear algebra in one thread, also in programs that tests start; numpy reads this setting at its import. With several threads on
busy processors, small matrices take up to ten times as long."""

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


COMPILE = """
from trunnion.kernel.shared_libraries import compiled_runtime
from trunnion.parts.primitives.primitive_cache import compiled_interpreter
from trunnion.fmu.binaries.platform_builds import chosen, prepare
compiled_runtime()
compiled_interpreter()
prepare(chosen(("host",), "2.0"), {})
"""


def pytest_configure(config: pytest.Config) -> None:
    """Make Ctrl-C act as at a terminal; a shell that starts the tests in the background lets them ignore it.

    Kernels are compiled without optimisation, unless TRUNNION_QUICK_BUILD is 0, because the compiler would otherwise take more than
    a third of the tests' time.

    Tests and their programs may write compiled modules beside the sources, even if an environment variable forbids writing.
    Otherwise each of some two hundred programs would compile Trunnion's modules again (0.2 to 0.5 s)."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ.setdefault("TRUNNION_QUICK_BUILD", "1")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    gc.disable()  # collecting ten thousand tests makes few reference cycles; the search for cycles takes a seventh of the time
    if not hasattr(config, "workerinput") and config.getoption("dist", "no") != "no" and not config.getoption("collectonly"):
        # The runtime is compiled while test processes collect tests. Otherwise each process would compile it at its first run.
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.Popen([sys.executable, "-c", COMPILE], start_new_session=True, **quiet)
        if not Path(__file__).with_name("stability").joinpath("__pycache__").exists():
            # In the first run of a clone, one process compiles the Python modules. Otherwise every test process would compile them.
            subprocess.run([sys.executable, "-m", "pytest", "--collect-only", "-n", "0"], check=False, **quiet)


def pytest_collection_finish() -> None:
    """After collection, garbage collection runs again. It does not search the collected tests."""
    gc.freeze()
    gc.enable()


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Two more processes than processors, because tests of the service spend a third of their time waiting for servers, workers and
    browsers. With only one more process, two processors would be idle for a sixth of the time."""
    return (os.cpu_count() or 1) + 2


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark cases beyond the default cases as slow before pytest selects tests by their marks."""
    keep_default_cases(items)


@pytest.fixture
def needs() -> Callable[[str], None]:
    """A function that skips or fails the test if the given package is not installed."""

    def check(package: str) -> None:
        if find_spec(package) is not None:
            return
        wanted = os.environ.get("TRUNNION_REQUIRE", "").replace(",", " ").split()
        if package in wanted:
            pytest.fail(f"{package} is required and not installed")
        pytest.skip(f"{package} is not installed")

    return check
