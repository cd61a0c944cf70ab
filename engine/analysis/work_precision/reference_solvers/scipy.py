"""SciPy's integrators on two kinds of equations: the engine's right-hand side, called from Python, and closed-form equations of
motion."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import BenchmarkModel
from trunnion.analysis.work_precision.reference_solvers.closed_form_equations import EQUATIONS
from trunnion.analysis.work_precision.reference_solvers.scene_snapshot import Snapshot
from trunnion.analysis.work_precision.reference_solvers.solver_interface import ReferenceSolver, SceneNotSupported, Setting
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.runtime_interface.simulation_block import Settings

MOST_EVALUATIONS = 100_000
"""A run is abandoned after this number of evaluations of the right-hand side."""


class TooManyEvaluations(Exception):
    """An integrator needed more than MOST_EVALUATIONS evaluations of the right-hand side."""


def integrate(f: Callable, y0: np.ndarray, s: Setting, times: np.ndarray) -> tuple[np.ndarray, float]:
    """Integrate ẏ = f(t, y) from y0 (n). Returns the states (samples × n) and the stepping time, s. A failed run raises
    RuntimeError or TooManyEvaluations."""
    from scipy.integrate import solve_ivp

    calls = 0

    def count_and_evaluate(t: float, y: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        if calls > MOST_EVALUATIONS:
            raise TooManyEvaluations(f"more than {MOST_EVALUATIONS} evaluations")
        return f(t, y)

    started = time.perf_counter()
    out = solve_ivp(count_and_evaluate, (0.0, times[-1]), y0, method=s.method, rtol=max(s.rtol, 2.3e-14), atol=s.rtol, t_eval=times)
    seconds = time.perf_counter() - started
    if not out.success:
        raise RuntimeError(out.message)
    return out.y.T, seconds


class Scipy(ReferenceSolver):
    """``solve_ivp`` with several methods."""

    package = "scipy"
    methods = ("RK45", "DOP853", "LSODA", "Radau", "BDF")


class ScipyOnEngine(Scipy):
    """``solve_ivp`` on the engine's accelerations."""

    name = "scipy on our equations"
    all_columns = True

    def __init__(self, ready: BenchmarkModel, scene: Snapshot):
        super().__init__(ready, scene)
        self.model = Model(ready.scene, ready.measure.names, runs=math.inf)
        self.block = self.model.block
        self.block.configure(Settings(rtol=1e-9))
        if self.block.assemble() != 1:
            raise SceneNotSupported("the start does not close the loops")
        self.row = np.zeros(self.block.width)
        if self.model.begin(Settings(rtol=1e-9), 0.0, ready.until, ready.every, self.row) != bl.OK:
            raise SceneNotSupported("the start cannot be evaluated")
        self.block = self.model.block
        self.start = self.block.y[: self.block.ny].copy()
        self.row = np.zeros(self.block.width)
        if not len(self.start):
            raise SceneNotSupported("all motion is prescribed: nothing to integrate")
        self.modes = bool(self.model.system.sliders) or self.model.system.stops > 0 or bool(self.model.built.numbers.breaks)

    def describe_omissions(self) -> str:
        """The differences from the engine."""
        words = ["our equations, called from Python"]
        words += ["kinks of the friction law not located"] if self.scene.rubs else []
        words += ["loops drift (no projection)"] if self.scene.loops else []
        return "; ".join(words)

    def _rate(self, t: float, y: np.ndarray) -> np.ndarray:
        """ẏ at (t, y). The friction modes follow from this state."""
        block = self.block
        block.y[: block.ny] = y
        if block.start(t, t + 1.0, 1.0, self.row) != bl.OK:
            raise RuntimeError("the state cannot be evaluated")
        return block.evaluate()[0]

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Integrate, then evaluate the compared columns at the samples (see ``ReferenceSolver.run``)."""
        y, seconds = integrate(self._rate, self.start, s, self.times)
        rows = []
        for t, state in zip(self.times, y, strict=True):
            self.block.y[: self.block.ny] = state
            self.block.start(t, t + 1.0, 1.0, self.row)
            rows.append(self.row[1:].copy())
        return np.array(rows), seconds


class ScipyOnClosedForm(Scipy):
    """``solve_ivp`` on the closed-form equation of motion of one mechanism."""

    name = "scipy on the closed form"

    def __init__(self, ready: BenchmarkModel, scene: Snapshot):
        super().__init__(ready, scene)
        form = EQUATIONS.get(ready.scene.name)
        if form is None:
            raise SceneNotSupported("no closed-form equations are available for this scene")
        self.form = form(ready.scene, ready.variant)
        now = np.array([p.center for p in scene.parts])
        if np.abs(self._centers(self.form.start) - now).max() > 1e-9:
            raise SceneNotSupported("the closed-form equations do not hold for this scene's numbers")

    def describe_omissions(self) -> str:
        """The differences from the engine."""
        return self.form.about

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Integrate, then compute the positions from the coordinate (see ``ReferenceSolver.run``)."""
        y, seconds = integrate(lambda _t, y: self.form.rate(y), np.array(self.form.start), s, self.times)
        return self.by_position(np.array([self._centers(v) for v in y])), seconds

    def _centers(self, y) -> np.ndarray:
        """Mass centres at the state y in the order of the scene's parts, bodies × 3, m."""
        at = self.form.positions(y)
        return np.array([at[p.name] for p in self.scene.parts])


