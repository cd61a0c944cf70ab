"""FMUs and the C library in a host with an unusual floating-point environment: it traps exceptions, rounds upward, and flushes
subnormal numbers to zero."""

from __future__ import annotations

import json
import math
import platform
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
from fmpy import read_model_description

from tests.default_case_selection import sampled
from tests.fmu.hosts.host_table import FORMS
from trunnion.fmu.binaries.platform_builds import entries, headers
from trunnion.fmu.scene_export import export
from trunnion.scene.library.model_folders import bundled_names

HOST = Path(__file__).with_name("unusual_environment_host.py")
PLAIN, UNUSUAL = 0x1F80, 0xD840
"""MXCSR of usual hosts; and with traps of invalid operations, divisions by zero and overflows, rounding upward, flush to zero."""
HERE = pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="sets a register of x86-64")
DEFAULT = [("spherical_pendulum", form) for form in ("cs2", "python2", "me3")]
CASES = sampled([(model, form) for model in bundled_names() for form in FORMS], DEFAULT)


def bits_in(run: dict[str, Any], environment: int) -> str:
    """The bits of outputs after a run in a host with this floating-point environment."""
    words = [sys.executable, "-S", HOST, json.dumps(run | {"environment": environment})]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (environment, done.returncode, done.stderr)
    return done.stdout


def run_of(file: Path, folder: Path) -> dict[str, Any]:
    """Description of a run of an FMU for the host. The function unpacks the FMU into the folder."""
    with zipfile.ZipFile(file) as z:
        z.extractall(folder)
    told = read_model_description(file)
    three, exchange = told.fmiVersion.startswith("3"), told.coSimulation is None
    identifier = (told.modelExchange if exchange else told.coSimulation).modelIdentifier
    library = folder / "binaries" / ("x86_64-linux" if three else "linux64") / f"{identifier}.so"
    resources = folder / "resources"
    seen = [v for v in told.modelVariables if v.causality == "output" and v.type in ("Real", "Float64")]
    return {
        "form": ("me" if exchange else "cs") + told.fmiVersion[0], "library": str(library),
        "token": told.instantiationToken if three else told.guid, "resources": f"{resources}/" if three else resources.as_uri(),
        "references": [v.valueReference for v in seen],
        "values": sum(math.prod(int(d.start) for d in v.dimensions) for v in seen),
        "states": told.numberOfContinuousStates, "indicators": told.numberOfEventIndicators,
    }  # fmt: skip


@HERE
@pytest.mark.parametrize(("model", "form"), CASES)
def test_a_host_that_traps_exceptions_and_rounds_upward_gets_the_same_bits_and_keeps_its_habits(
    model: str, form: str, tmp_path: Path
) -> None:
    export(model, tmp_path / "one.fmu", **FORMS[form] | {"sources": False})
    run = run_of(tmp_path / "one.fmu", tmp_path / "un packed")
    assert bits_in(run, UNUSUAL) == bits_in(run, PLAIN)


@pytest.mark.parametrize("standard", ["2", "3"])
def test_every_function_of_a_standard_sets_the_environment(standard: str) -> None:
    types = (headers() / f"fmi{standard}FunctionTypes.h").read_text()
    declared = set(re.findall(rf"\b(fmi{standard}\w+)TYPE\b", types))
    begin = r"(fmi\d\w+)\([^;{}]*\) \{\n  const tr_environment outside = tr_enter\(\);\n.*(fmu_\w+)"
    made = dict(re.findall(begin, entries(f"{standard}.0")))
    assert made == {name: f"fmu_{name}" for name in declared}
