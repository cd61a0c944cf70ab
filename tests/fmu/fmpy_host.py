"""FMUs for the tests, made once in each process, and a small host around fmpy."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave

import trunnion
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict
from trunnion.scene.overrides import apply
from trunnion.simulation.settings.kernel_choice import kernel_for
from trunnion.system.construction.system_builder import build

FOLDER = Path(tempfile.mkdtemp(prefix="trunnion-fmu-tests-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
ROWS, BEYOND = 200, 2.0
LAWS: dict[str, dict[str, object]] = {
    "": {},
    "lugre": {"friction.law": "lugre", "joints.ball.friction.bristle_stiffness": 1e3, "joints.ball.friction.bristle_damping": 0.03},
    "stribeck": {"friction.law": "stribeck", "joints.ball.friction.mu_static": 0.8, "joints.ball.friction.v_stribeck": 0.01},
    "regularized": {"friction.law": "regularized"},
}


@cache
def exported(model: str, flavour: str = "native") -> Path:
    """The FMU of a bundled model (``model:law``: with that law everywhere), or of ``arm``, all of whose columns are outputs."""
    file = FOLDER / f"{model.replace(':', '-')}-{flavour}.fmu"
    name, _, law = model.partition(":")
    if model == "arm":
        export(arm(), file, flavour=flavour, outputs="*")
    else:
        export(apply(trunnion.load_scene(name), LAWS[law]), file, flavour=flavour)
    return file


def arm() -> trunnion.Scene:
    """Two links: the first follows an input angle, and a torque input acts in the second's joint, which has friction."""
    bar = {"box": [0.6, 0.04, 0.04], "density": 7800, "points": {"a": [-0.3, 0, 0], "b": [0.3, 0, 0]}}
    rub = {"mu": 0.1, "radius": 0.01, "half_length": 0.02}
    return scene_from_dict({
        "name": "arm", "gravity": [0, -9.81, 0], "bodies": {"one": bar, "two": bar},
        "inputs": {"motor": {"start": 0.5, "unit": "N*m"}, "angle": {"start": 0.2, "unit": "rad", "bandwidth": 50}},
        "joints": {
            "hip": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "one.a", "drive": {"input": "angle"}},
            "knee": {"type": "revolute", "axis": "z", "inboard": "one.b", "outboard": "two.a", "friction": rub,
                     "effort": {"input": "motor"}},
        },
        "simulation": {"until": 1, "every": 0.01},
    })  # fmt: skip


class Host:
    """An instance in fmpy with names instead of references."""

    def __init__(self, file: Path, start: float = 0.0, stop: float | None = None, begin: bool = True,
                 tolerance: float | None = None, logging: bool = False, **settings: float):
        self.md = read_model_description(file)
        self.log: list[tuple[int, str]] = []
        self.unzipped = extract(file)
        atexit.register(shutil.rmtree, self.unzipped, ignore_errors=True)
        self.reference = {v.name: v.valueReference for v in self.md.modelVariables}
        self.fmu = FMU2Slave(guid=self.md.guid, unzipDirectory=self.unzipped, instanceName="i",
                             modelIdentifier=self.md.coSimulation.modelIdentifier)
        self.fmu.instantiate(callbacks=self._callbacks(), loggingOn=logging)
        self.fmu.setupExperiment(tolerance=tolerance, startTime=start, stopTime=stop)
        self.fmu.enterInitializationMode()
        self.set(**settings)
        if begin:
            self.fmu.exitInitializationMode()

    def _callbacks(self):
        import fmpy.fmi2 as f

        c = f.fmi2CallbackFunctions()
        c.logger = f.fmi2CallbackLoggerTYPE(lambda env, name, status, kind, text: self.log.append((status, text.decode())))
        c.allocateMemory, c.freeMemory = f.fmi2CallbackAllocateMemoryTYPE(f.calloc), f.fmi2CallbackFreeMemoryTYPE(f.free)
        return c

    def get(self, *names: str) -> list[float]:
        """Values of real variables by name."""
        return self.fmu.getReal([self.reference[n] for n in names])

    def set(self, **values: float) -> None:
        """Set real variables given as keywords, in which "__" stands for a dot."""
        for name, value in values.items():
            self.put(name.replace("__", "."), value)

    def put(self, name: str, value: float) -> None:
        """Set one real variable."""
        self.fmu.setReal([self.reference[name]], [value])

    def run(self, start: float, steps: int, h: float, *names: str) -> list[list[float]]:
        """Make communication steps of h seconds; the values of the named variables after each."""
        out = []
        for k in range(steps):
            self.fmu.doStep(start + k * h, h)
            out.append(self.get(*names))
        return out

    def all_outputs(self) -> list[str]:
        """Names of all outputs, and of the existing local variables."""
        return [v.name for v in self.md.modelVariables if v.causality in ("output", "local")]


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
    """A process that simulates for the processors for which FMUs are compiled, with optimised kernels; it ends with this process.
    (In this process, fused operations of newer processors round differently.)"""
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
    assert process.stdout.readline() == "done\n", "the engine's run ended in an error, which stands above"
    with np.load(file) as data:
        return dict(zip(data["names"], data["data"][: ROWS + 1].T, strict=True))


def fmu_run(file: Path, until: float, names: list[str], **more) -> dict[str, np.ndarray]:
    """Columns, by name, of a run in fmpy with ROWS steps."""
    h = until / ROWS
    got = simulate_fmu(str(file), stop_time=until, step_size=h, output_interval=h, output=names, fmi_type="CoSimulation", **more)
    return {n: got[n] for n in ["time", *names]}


def claim_equal_to_engine(model: str) -> None:
    """Check that both flavours give the engine's columns to 1e-9 of each column's size (1 where it is smaller), and the same bits
    as each other."""
    until = min(float(trunnion.load_scene(model.partition(":")[0]).simulation.until), 2.0)
    expected = engine_run(model, until)
    names = [n for n in expected if n != "time"]
    runs = [fmu_run(exported(model, flavour), until, names) for flavour in ("native", "python")]
    for name in names:
        assert np.array_equal(runs[0][name], runs[1][name]), name
        size = max(1.0, np.abs(expected[name]).max())
        assert np.abs(runs[0][name] - expected[name]).max() <= 1e-9 * size, name
