"""Packages with a slow import are imported only where they are used. A missing package is reported before the work begins."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from trunnion.basics.optional_packages import Later, Missing


def test_a_module_is_imported_at_the_first_use_of_a_name() -> None:
    assert Later("json.decoder", "analysis", "a test").JSONDecodeError is json.JSONDecodeError


def test_a_missing_package_is_reported_at_once_with_what_needs_it_and_its_remedy() -> None:
    with pytest.raises(Missing, match=r"a test needs the package no_such_package.*pip install 'trunnion\[analysis\]'"):
        Later("no_such_package.part", "analysis", "a test")


def test_processes_that_check_requests_start_without_scipy() -> None:
    code = "import sys, trunnion.service.request_workers.rerun_and_extend_plans; print('scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_bounds_at_rest_need_no_scipy() -> None:
    code = "import sys, trunnion; trunnion.hold('friction_identification', bounds=True); print('scipy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
