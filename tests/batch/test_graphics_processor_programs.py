"""The C code of a mechanism compiles for graphics processors without changes. The compiled code computes the same cases as a
sweep."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.graphics_processor import device_programs as programs
from trunnion import sweep
from trunnion.fmu.c_library.library_files import library

TOLERANCE = 1e-4
"""Allowed difference relative to the largest value. Both runs have rtol 1e-6, but different steps: the library does not end its
steps at rows."""


@pytest.mark.slow
@pytest.mark.parametrize("which", ["8.1", "crank-slider"])
def test_cases_are_those_of_a_sweep(which: str) -> None:
    ensemble = programs.ENSEMBLES[which]
    values = programs.drawn(ensemble, 5, seed=3)
    out = programs.on_this_machine(library(ensemble.scene), ensemble, values)
    assert (out[:, 0] == 0).all(), "a case ended early"
    path, columns = next(iter(ensemble.varied)), [f"final:{name}" for name in ensemble.read[:2]]
    expected = sweep(ensemble.scene, {path: values[:, 0].tolist()}, reductions=columns, until=ensemble.until).table
    for at, column in enumerate(columns):
        of_sweep = np.asarray(expected[column])
        np.testing.assert_allclose(out[:, 2 + at], of_sweep, rtol=0, atol=TOLERANCE * np.abs(of_sweep).max())


@pytest.mark.slow
def test_programs_call_only_functions_that_they_define(tmp_path: Path) -> None:
    try:
        programs.libdevice()
    except FileNotFoundError as missing:
        pytest.skip(str(missing))
    files = programs.ptx(library("double_pendulum"), tmp_path)
    text = "\n".join(file.read_text() for file in files)
    declared, defined = (
        set(re.findall(rf"^\.{kind} \.func(?:\s*\([^)]*\))?\s+(\w+)", text, re.M)) for kind in ("extern", "visible")
    )
    assert re.findall(r"\.entry (\w+)\(", text) == ["cases"]
    assert declared
    assert not declared - defined
