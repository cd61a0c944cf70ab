"""An FMU in fmpy. Its variables are read and set by name."""

from __future__ import annotations

import atexit
import shutil
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave


class Host:
    """An instance in fmpy, whose variables are accessed by name."""

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
        """Set real variables given as keywords. In a keyword, "__" stands for a dot."""
        for name, value in values.items():
            self.put(name.replace("__", "."), value)

    def put(self, name: str, value: float) -> None:
        """Set one real variable."""
        self.fmu.setReal([self.reference[name]], [value])

    def run(self, start: float, steps: int, h: float, *names: str) -> list[list[float]]:
        """Make communication steps of h seconds. Returns the values of the named variables after each step."""
        out = []
        for k in range(steps):
            self.fmu.doStep(start + k * h, h)
            out.append(self.get(*names))
        return out

    def all_outputs(self) -> list[str]:
        """Names of all outputs, and of the existing local variables."""
        return [v.name for v in self.md.modelVariables if v.causality in ("output", "local")]
