"""FMUs for model exchange, made once in each process of tests. Also runs of these FMUs in fmpy, and a separate instance."""

from __future__ import annotations

import atexit
import re
import shutil
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Model, fmi2CallbackFreeMemoryTYPE, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi2 import calloc as allocate
from fmpy.fmi2 import fmi2CallbackAllocateMemoryTYPE as Allocate
from fmpy.fmi2 import free as release

import trunnion
from tests.fmu.exported_fmus import FOLDER
from tests.reference.scenes.random_device_scenes import crossed
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict
from trunnion.scene.overrides import apply

TOLD = re.compile(r"event at t = (\S+) s: (.*) in joint (\S+)$")
EVERY = 0.01
AFTER = 1e-13
"""Time after a root at which an event is handled, s."""
Told = list[tuple[float, str, str]]


def swing() -> trunnion.Scene:
    """Two horizontal links. An input presses the first link against a stop. The second link has friction. A table pushes the second
    link, and each knot of the table is an event."""
    bar = {"box": [0.6, 0.04, 0.04], "density": 7800, "points": {"a": [-0.3, 0, 0], "b": [0.3, 0, 0]}}
    rub = {"mu": 0.3, "mu_static": 0.39, "radius": 0.1, "half_length": 0.05}
    load = {"table": {"time": [0, 0.5, 0.50001, 1, 1.00001, 3], "value": [0, 0, 40, 40, 0, 0]}}
    stops = {"stiffness": 2000, "damping": 5, "lower": -1, "upper": 1}
    hinge = {"type": "revolute", "axis": "z"}
    return scene_from_dict({
        "name": "swing", "gravity": [0, 0, -9.81], "bodies": {"one": bar, "two": bar},
        "inputs": {"motor": {"unit": "N*m", "start": 9}},
        "joints": {
            "hip": {**hinge, "inboard": "ground", "outboard": "one.a", "end_stops": stops, "effort": {"input": "motor"}},
            "knee": {**hinge, "inboard": "one.b", "outboard": "two.a", "friction": rub, "effort": load},
        },
        "simulation": {"until": 2, "every": EVERY},
    })  # fmt: skip


def driven() -> trunnion.Scene:
    """Three links with friction. Drives start the first two links from rest, and stop the second link twice. The third link sticks
    at first."""
    bar = {"box": [0.6, 0.04, 0.04], "density": 7800, "points": {"a": [-0.3, 0, 0], "b": [0.3, 0, 0]}}
    hinge, rub = {"type": "revolute", "axis": "z"}, {"mu": 0.2, "radius": 0.02, "half_length": 0.05}
    table = {"table": {"time": [0, 0.2, 0.5, 0.8, 1.2, 1.5], "value": [0, 0, 0.3, 0.3, -0.4, 0]}}
    move = {"move": {"start": 0, "end": -0.7, "duration": 0.6}}
    return scene_from_dict({
        "name": "driven", "gravity": [0, -9.81, 0], "bodies": {"one": bar, "two": bar, "three": bar},
        "joints": {
            "hip": {**hinge, "inboard": "ground", "outboard": "one.a", "friction": {"torque": 4}, "drive": move},
            "knee": {**hinge, "inboard": "one.b", "outboard": "two.a", "friction": rub, "drive": table},
            "foot": {**hinge, "inboard": "two.b", "outboard": "three.a", "friction": {**rub, "mu": 2, "mu_static": 2.5}},
        },
        "simulation": {"until": 0.9, "every": EVERY},
    })  # fmt: skip


def thrown() -> trunnion.Scene:
    """Two blocks are thrown up a rail past their latches. A signal releases one block; the other block slips on the teeth of its
    ratchet."""
    body = {"mass": 2, "inertia": [1, 1, 1]}
    hook, rail = {"at": 0.3, "stiffness": 4e4}, {"type": "prismatic", "axis": "x", "inboard": "ground"}
    rail |= {"effort": -6, "start": {"qd": 3}}
    release = {"table": {"time": [0, 2.5, 3.5], "value": [0, 0, 1]}}
    return scene_from_dict({
        "name": "thrown", "gravity": [0, 0, 0], "bodies": {"one": body, "two": body},
        "joints": {
            "held": {**rail, "outboard": "one", "latch": {**hook, "damping": 5, "release": release}},
            "breaks": {**rail, "outboard": "two", "latch": {**hook, "holds": 200, "pitch": 0.4}},
        },
        "simulation": {"until": 4, "every": EVERY},
    })  # fmt: skip


def bristles() -> trunnion.Scene:
    """Example 8.3 with LuGre friction: bristles are states."""
    law = {"friction.law": "lugre"}
    rub = {"bristle_stiffness": 1e3, "bristle_damping": 0.03}
    scene = trunnion.load_scene("double_pendulum")
    numbers = {f"joints.{j}.friction.{k}": v for j in scene.joints if scene.joints[j].friction for k, v in rub.items()}
    return apply(scene, law | numbers)


BUILT = {"swing": swing, "driven": driven, "thrown": thrown, "bristles": bristles, "planets": partial(crossed, "planets", 67)}


@cache
def exchange(name: str, fmi: int = 2, kind: str = "me", changes: tuple[tuple[str, Any], ...] = ()) -> Path:
    """The FMU of a bundled model, or of a scene in ``BUILT``, with changes."""
    file = FOLDER / f"{name}-{fmi}-{kind}-{abs(hash(changes))}.fmu"
    export(scene_of(name, changes), file, fmi=fmi, kind=kind)
    return file


def scene_of(name: str, changes: tuple[tuple[str, Any], ...] = ()) -> trunnion.Scene:
    """The scene with the same name and changes."""
    return BUILT[name]() if name in BUILT else apply(trunnion.load_scene(name), dict(changes))


def run_me(
    file: Path, until: float, names: list[str], log: list | None = None, **more: Any
) -> tuple[dict[str, np.ndarray], Told, list[str]]:
    """A run in fmpy (CVode, 1e-8): columns by name, the events in the log, all other warnings and errors."""
    log = [] if log is None else log

    def hear(*said: Any) -> None:
        log.append((said[-3], said[-1].decode()))

    how = {"solver": "CVode", "relative_tolerance": 1e-8, "record_events": False, **more}
    how |= {"stop_time": until, "output_interval": EVERY, "output": names, "debug_logging": True, "logger": hear}
    got = simulate_fmu(str(file), fmi_type="ModelExchange", **how)
    told = [m for _, text in log if (m := TOLD.match(text))]
    events = [(float(m[1]), m[2].replace(" ", "_"), m[3]) for m in told]
    return {n: got[n] for n in ("time", *names)}, events, [text for status, text in log if status]


def engine_run(scene: trunnion.Scene, until: float) -> tuple[trunnion.Result, Told]:
    """A run of the engine at a far tighter tolerance, and its events."""
    made = trunnion.simulate(scene, until=until, every=EVERY, rtol=1e-11)
    assert made.outcome.ok, made.outcome
    return made, [(e.time, e.kind, e.joint) for e in made.events]


class Importer:
    """A separate instance of FMI 2.0, in continuous-time mode."""

    def __init__(self, file: Path):
        self.md = read_model_description(file)
        self.log: list[str] = []
        self.reference = {v.name: v.valueReference for v in self.md.modelVariables}
        self.folder = folder = extract(file)
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        self.fmu = FMU2Model(guid=self.md.guid, unzipDirectory=folder, instanceName="i",
                             modelIdentifier=self.md.modelExchange.modelIdentifier)  # fmt: skip
        self.calls = fmi2CallbackFunctions()
        self.calls.logger = fmi2CallbackLoggerTYPE(lambda env, name, status, kind, text: self.log.append(text.decode()))
        self.calls.allocateMemory, self.calls.freeMemory = Allocate(allocate), fmi2CallbackFreeMemoryTYPE(release)
        self.fmu.instantiate(callbacks=self.calls)
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.fmu.newDiscreteStates()
        self.fmu.enterContinuousTimeMode()

    def _numbers(self, call: Any, n: int) -> np.ndarray:
        import ctypes

        out = (ctypes.c_double * n)()
        call(out, n)
        return np.array(out)

    def states(self) -> np.ndarray:
        """The continuous states."""
        return self._numbers(self.fmu.getContinuousStates, self.md.numberOfContinuousStates)

    def rates(self) -> np.ndarray:
        """The derivatives of the continuous states."""
        return self._numbers(self.fmu.getDerivatives, self.md.numberOfContinuousStates)

    def indicators(self) -> np.ndarray:
        """The event indicators."""
        return self._numbers(self.fmu.getEventIndicators, self.md.numberOfEventIndicators)

    def place(self, t: float, x: np.ndarray) -> None:
        """Set time and states."""
        import ctypes

        self.fmu.setTime(t)
        self.fmu.setContinuousStates((ctypes.c_double * len(x))(*x), len(x))

    def euler(self, t: float, h: float, steps: int) -> float:
        """Steps of Euler's method, with events handled at their ends; returns the time reached."""
        for _ in range(steps):
            before = self.indicators()
            x = self.states() + h * self.rates()
            t += h
            self.place(t, x)
            due, _ = self.fmu.completedIntegratorStep()
            if due or np.any((self.indicators() > 0.0) != (before > 0.0)):
                self.handle()
        return t

    def handle(self) -> None:
        """Handle an event."""
        self.fmu.enterEventMode()
        while self.fmu.newDiscreteStates()[0]:
            pass
        self.fmu.enterContinuousTimeMode()


def run_scipy(host: Importer, until: float, tolerance: float, columns: list[str], method: str = "DOP853") -> np.ndarray:
    """A run in SciPy, in which each indicator is an event function. Returns states by name (rows) every EVERY seconds."""
    from scipy.integrate import solve_ivp

    states = [u.variable.derivative for u in host.md.derivatives]
    sizes = np.array([float(v.nominal or 1.0) for v in states])

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        host.place(t, x)
        return host.rates()

    def event(i: int) -> Any:
        def told(t: float, x: np.ndarray) -> float:
            host.place(t, x)
            return float(host.indicators()[i])

        told.terminal = True  # type: ignore[attr-defined]
        return told

    events = [event(i) for i in range(host.md.numberOfEventIndicators)]
    grid, out, t, x = EVERY * np.arange(round(until / EVERY) + 1), [host.states()], 0.0, host.states()
    while t < until:
        part = solve_ivp(rates, (t, until), x, method, events=events, rtol=tolerance, atol=tolerance * sizes, dense_output=True)
        t = part.t[-1]
        out += [part.sol(g) for g in grid[len(out) :] if g <= t]
        if part.status == 1:
            host.place(t + AFTER, part.y[:, -1] + AFTER * rates(t, part.y[:, -1]))  # SciPy's roots may be slightly early
            host.fmu.completedIntegratorStep()
            host.handle()
            t, x = t + AFTER, host.states()
    names = [v.name for v in states]
    return np.array(out).T[[names.index(f"states.{n}") for n in columns]]


def run_bdf(host: Importer, until: float, tolerance: float) -> tuple[int, int]:
    """(steps, events that completed steps request) of SciPy's BDF method, which starts anew after each event."""
    from scipy.integrate import BDF

    sizes = np.array([float(u.variable.derivative.nominal or 1.0) for u in host.md.derivatives])

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        host.place(t, x)
        return host.rates()

    def begun(t: float) -> BDF:
        return BDF(rates, t, host.states(), until, rtol=tolerance, atol=tolerance * sizes)

    steps, events, solver = 0, 0, begun(0.0)
    while solver.status == "running":
        solver.step()
        steps += 1
        host.place(solver.t, solver.y)
        if host.fmu.completedIntegratorStep()[0]:
            host.handle()
            events += 1
            solver = begun(solver.t) if solver.t < until else solver
    return steps, events
