"""Comparison of runs of FMUs in fmpy with runs of the engine. A separate process computes the engine's runs."""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

import trunnion
from tests.fmu.exported_fmus import FOLDER, LAWS, exported
from trunnion.simulation.settings.kernel_choice import kernel_for
from trunnion.system.construction.system_builder import build

ROWS, BEYOND = 200, 2.0
"""Number of rows of a run; duration of the engine's run, relative to the duration of the FMU's run."""
REFERENCE = """
import json, sys, numpy, trunnion
from trunnion.kernel.compilation import c_compiler
from trunnion.kernel.shared_libraries import runtime
flags = c_compiler.FLAGS
c_compiler.FLAGS += c_compiler.QUICK  # for the runtime alone; without fused operations it gives the same bits
runtime()
c_compiler.FLAGS = flags
for line in sys.stdin:
    name, until, every, changes, kernel, file = json.loads(line)
    r = trunnion.simulate(name, until=until, every=every, overrides=changes, kernel=kernel)  # as in the FMU
    numpy.savez(file, data=r.data, names=numpy.array(r.names))
    print("done", flush=True)
"""


@cache
def reference() -> subprocess.Popen[str]:
    """A process that simulates with optimised kernels, compiled for the processors of FMUs. It ends with this process. (In this
    process, fused operations of newer processors round differently.)"""
    env = dict(os.environ, TRUNNION_CPU="x86_64", TRUNNION_QUICK_BUILD="0")
    made = subprocess.Popen([sys.executable, "-c", REFERENCE], env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(made.communicate)
    return made


def engine_run(model: str, until: float, kernel: str | None = None) -> dict[str, np.ndarray]:
    """Columns of one engine run, compiled for the processors for which FMUs are compiled. The run continues beyond ``until``, as an
    FMU's own steps do."""
    name, _, law = model.partition(":")
    kernel = kernel_for(kernel, build(trunnion.load_scene(name)).system, np.inf)
    file = FOLDER / f"{model.replace(':', '-')}-{kernel}.npz"
    process = reference()
    assert process.stdin is not None
    assert process.stdout is not None
    print(json.dumps([name, BEYOND * until, until / ROWS, LAWS[law], kernel, str(file)]), file=process.stdin, flush=True)
    assert process.stdout.readline() == "done\n", "the engine's run ended in an error, which is printed above"
    with np.load(file) as data:
        return dict(zip(data["names"], data["data"][: ROWS + 1].T, strict=True))


def fmu_run(file: Path, until: float, names: list[str], **more) -> dict[str, np.ndarray]:
    """Columns, by name, of a run in fmpy with ROWS steps."""
    h = until / ROWS
    got = simulate_fmu(str(file), stop_time=until, step_size=h, output_interval=h, output=names, fmi_type="CoSimulation", **more)
    return {n: got[n] for n in ["time", *names]}


def claim_equal_to_engine(model: str) -> None:
    """Check that both flavours give the same bits, and the engine's columns to 1e-9 of each column's size (of 1 where the size is
    smaller)."""
    until = min(float(trunnion.load_scene(model.partition(":")[0]).simulation.until), 2.0)
    expected = engine_run(model, until)
    names = [n for n in expected if n != "time"]
    runs = [fmu_run(exported(model, flavour), until, names) for flavour in ("native", "python")]
    for name in names:
        assert np.array_equal(runs[0][name], runs[1][name]), name
        size = max(1.0, np.abs(expected[name]).max())
        assert np.abs(runs[0][name] - expected[name]).max() <= 1e-9 * size, name
