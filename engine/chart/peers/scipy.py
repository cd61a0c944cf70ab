"""SciPy's integrators: on our right-hand side (called from Python), and on a closed-form equation of motion where there is one."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from engine.chart.peers.base import TOLERANCES, Peer, Setting, Unable
from engine.chart.peers.closed import CLOSED
from engine.chart.peers.snapshot import Snapshot
from engine.chart.runs import Prepared
from engine.simulation import block as bl
from engine.simulation.block import Settings
from engine.simulation.run import Model

METHODS = ("RK45", "DOP853", "LSODA", "Radau", "BDF")
CALLS = 100_000
"""Right-hand sides after which a run is given up."""


class TooLong(Exception):
    """Raised when an integrator asks for more than CALLS right-hand sides."""


def _integrate(f: Callable, span: tuple[float, float], y0: np.ndarray, s: Setting, times: np.ndarray) -> tuple[np.ndarray, float]:
    from scipy.integrate import solve_ivp

    calls = 0

    def counted(t: float, y: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        if calls > CALLS:
            raise TooLong(f"more than {CALLS} evaluations")
        return f(t, y)

    started = time.perf_counter()
    out = solve_ivp(counted, span, y0, method=s.method, rtol=max(s.rtol, 2.3e-14), atol=s.rtol, t_eval=times)
    seconds = time.perf_counter() - started
    if not out.success:
        raise RuntimeError(out.message)
    return out.y.T, seconds


class ScipyOnOurs(Peer):
    """solve_ivp over the engine's accelerations."""

    name = "scipy on our equations"
    package = "scipy"
    all_columns = True

    def __init__(self, ready: Prepared, scene: Snapshot):
        super().__init__(ready, scene)
        self.model = Model(ready.scene, ready.measure.names, runs=math.inf)
        self.block = self.model.block
        self.block.configure(Settings(rtol=1e-9))
        if self.block.assemble() != 1:
            raise Unable("the start does not close the loops")
        self.row = np.zeros(self.block.width)
        if self.model.begin(Settings(rtol=1e-9), 0.0, ready.until, ready.every, self.row) != bl.OK:
            raise Unable("the start cannot be evaluated")
        self.block = self.model.block
        self.start = self.block.y[: self.block.ny].copy()
        self.row = np.zeros(self.block.width)
        if not len(self.start):
            raise Unable("all motion is prescribed: nothing to integrate")
        self.modes = bool(self.model.system.sliders) or self.model.system.stops > 0 or bool(self.model.built.numbers.breaks)

    def leaves_out(self) -> str:
        """What SciPy does not do that the engine does."""
        words = ["our equations, called from Python"]
        words += ["kinks of the friction law not located"] if self.scene.rubs else []
        words += ["loops drift (no projection)"] if self.scene.loops else []
        return "; ".join(words)

    def settings(self) -> list[Setting]:
        """Every method and tolerance."""
        return [Setting(m, r) for m in METHODS for r in TOLERANCES]

    def _rate(self, t: float, y: np.ndarray) -> np.ndarray:
        """ẏ at (t, y), with the friction modes that belong to this state."""
        block = self.block
        block.y[: block.ny] = y
        if block.start(t, t + 1.0, 1.0, self.row) != bl.OK:
            raise RuntimeError("the state cannot be evaluated")
        return block.evaluate()[0]

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Integrate, then evaluate the compared columns at the samples (see ``Peer.run``)."""
        y, seconds = _integrate(self._rate, (0.0, self.ready.until), self.start, s, self.times)
        rows = []
        for t, state in zip(self.times, y, strict=True):
            self.block.y[: self.block.ny] = state
            self.block.start(t, t + 1.0, 1.0, self.row)
            rows.append(self.row[1:].copy())
        return np.array(rows), seconds


class ScipyClosed(Peer):
    """solve_ivp over an equation of motion written by hand for one mechanism."""

    name = "scipy on the closed form"
    package = "scipy"

    def __init__(self, ready: Prepared, scene: Snapshot):
        super().__init__(ready, scene)
        form = CLOSED.get(ready.scene.name)
        if form is None:
            raise Unable("no closed form is written down for this scene")
        self.form = form(ready.scene, ready.variant)
        now = np.array([p.center for p in scene.parts])
        if np.abs(self._centers(self.form.start) - now).max() > 1e-9:
            raise Unable("its closed form is that of other numbers")

    def leaves_out(self) -> str:
        """What SciPy does not do that the engine does."""
        return self.form.about

    def settings(self) -> list[Setting]:
        """Every method and tolerance."""
        return [Setting(m, r) for m in METHODS for r in TOLERANCES]

    def run(self, s: Setting) -> tuple[np.ndarray, float]:
        """Integrate, then compute positions from the one coordinate (see ``Peer.run``)."""
        y, seconds = _integrate(lambda _t, y: self.form.rate(y), (0.0, self.ready.until), np.array(self.form.start), s, self.times)
        return self.by_position(np.array([self._centers(v) for v in y])), seconds

    def _centers(self, y) -> np.ndarray:
        """Mass centres in the order of the scene's parts, samples × bodies × 3, m."""
        at = self.form.positions(y)
        return np.array([at[p.name] for p in self.scene.parts])


