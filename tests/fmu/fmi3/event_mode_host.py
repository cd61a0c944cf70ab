"""A small host of FMI 3.0 around fmpy that handles event mode."""

from __future__ import annotations

import atexit
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Slave

ERROR, DISCARD = 3, 2
GETTERS = {"Float64": "getFloat64", "Enumeration": "getInt64", "UInt64": "getUInt64", "Int32": "getInt32", "Boolean": "getBoolean",
           "String": "getString"}  # fmt: skip


class Host3:
    """An instance in fmpy with names instead of references. events: the host handles events; early: steps may return early;
    between: function that is called between communication points; begin: until the step mode."""

    def __init__(self, file: Path, events: bool = True, early: bool = True, between: Callable | None = None, begin: bool = True,
                 stop: float | None = None, tolerance: float | None = None, logging: bool = False, wanted: Iterable[str] = (),
                 **settings: float):  # fmt: skip
        self.md = read_model_description(file)
        self.log: list[tuple[int, str]] = []
        self.categories: list[str] = []
        folder = extract(file)
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        self.of = {v.name: v for v in self.md.modelVariables}
        self.reference = {n: v.valueReference for n, v in self.of.items()}
        self.events = events
        self.fmu = FMU3Slave(guid=self.md.instantiationToken, unzipDirectory=folder, instanceName="i",
                             modelIdentifier=self.md.coSimulation.modelIdentifier)  # fmt: skip
        self.fmu.instantiate(loggingOn=logging, eventModeUsed=events, earlyReturnAllowed=early, logMessage=self._hear,
                             intermediateUpdate=between,
                             requiredIntermediateVariables=[self.reference[n] for n in wanted])  # fmt: skip
        self.time = 0.0
        if begin:
            self.begin(stop, tolerance, **settings)

    def begin(self, stop: float | None = None, tolerance: float | None = None, **settings: float) -> None:
        """Initialize, up to the step mode."""
        self.fmu.enterInitializationMode(tolerance=tolerance, startTime=0.0, stopTime=stop)
        for name, value in settings.items():
            self.put(name.replace("__", "."), value)
        self.fmu.exitInitializationMode()
        if self.events:
            self.fmu.updateDiscreteStates()
            self.fmu.enterStepMode()

    def _hear(self, environment: object, status: int, category: bytes, text: bytes) -> None:
        self.log.append((status, text.decode()))
        self.categories.append(category.decode())

    def size(self, name: str) -> int:
        """The number of values of a variable."""
        return int(self.of[name].dimensions[0].start) if self.of[name].dimensions else 1

    def get(self, *names: str) -> list:
        """Values of variables by name; all elements of an array follow each other."""
        out: list = []
        for n in names:
            found = getattr(self.fmu, GETTERS[self.of[n].type])([self.reference[n]], nValues=self.size(n))
            out += [x.decode() if isinstance(x, bytes) else x for x in found]
        return out

    def put(self, name: str, *values: float) -> None:
        """Set a real variable. An array is set with all its numbers."""
        self.fmu.setFloat64([self.reference[name]], list(values))

    def ticking(self) -> list[str]:
        """Names of the clocks that tick at this event."""
        names = [n for n, v in self.of.items() if v.type == "Clock"]
        on = self.fmu.getClock([self.reference[n] for n in names])
        return [n for n, ticks in zip(names, on, strict=True) if ticks]

    def step(self, until: float) -> tuple[bool, bool, bool, float]:
        """Make one step towards a time. Returns (events to handle, terminated, early, reached)."""
        said = self.fmu.doStep(self.time, until - self.time)
        self.time = said[3]
        return said

    def handle(self, *names: str) -> tuple[list[str], list, list]:
        """Handle the present event. Returns (clocks that tick, values before, values after)."""
        self.fmu.enterEventMode()
        ticking, before = self.ticking(), self.get(*names)
        again, *_ = self.fmu.updateDiscreteStates()
        assert not again
        after = self.get(*names)
        self.fmu.enterStepMode()
        return ticking, before, after

    def run(self, until: float, h: float, *names: str) -> tuple[list[tuple], list[list]]:
        """Make steps of h up to a time, and handle events. Returns ([(time, clocks, values before, values after)], [values at
        communication points])."""
        events, rows, begin = [], [], self.time
        for k in range(round((until - begin) / h)):
            end = begin + (k + 1) * h
            while self.time < end:
                due, *_ = self.step(end)
                if due:
                    events.append((self.time, *self.handle(*names)))
            rows.append(self.get(*names))
        return events, rows
