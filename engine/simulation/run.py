"""``simulate``: a scene in, a Result out."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.kernel.columns import Column, columns, needs_quadratures, select
from engine.kernel.library import Kernel, kernel
from engine.scene.model import Scene
from engine.simulation import block as bl
from engine.simulation.certificate import Certificate, certificate, certificate_notes
from engine.simulation.events import decode
from engine.simulation.outcome import ADVICE, DONE, Outcome
from engine.simulation.redundancy import Redundancy, redundancy, redundancy_notes
from engine.simulation.result import Event, Result, Stats
from engine.system.build import Built, build
from engine.system.structure import System

log = logging.getLogger("trunnion.simulate")
CHUNK_STEPS = 2000
"""Steps between returns to Python: well under 50 ms, so that progress, Ctrl-C and time budgets are served."""
CHUNK_ROWS = 4096
Progress = Callable[[float, float], None]
"""progress(time, until), called a few times a second."""


class Model:
    """A scene made ready to run: structure, kernel and block. Runs of the same structure share the kernel; parameters may be
    changed between runs."""

    def __init__(self, scene: Scene, outputs: Sequence[str] | None = None):
        started = time.perf_counter()
        self.built: Built = build(scene)
        everything = columns(self.built.system)
        wanted = tuple(outputs if outputs is not None else scene.outputs)
        self.columns: list[Column] = select(everything, wanted)
        if problems := pattern_problems(everything, wanted):
            raise SceneError(problems)
        self.build_seconds = 0.0
        self._load(redundant=False)
        self.setup_seconds = time.perf_counter() - started - self.build_seconds

    def _load(self, redundant: bool) -> None:
        table = self.built.parameters
        chosen = (self.columns, needs_quadratures(self.columns), redundant)
        self.kernel: Kernel = kernel(self.built.system, len(table.values), *chosen)
        self.build_seconds += self.kernel.build_seconds
        self.block = bl.Block(self.kernel, self.built.numbers, np.array(table.values))

    def begin(self, settings: bl.Settings, t: float, until: float, every: float, row: np.ndarray) -> int:
        """Start a run from an assembled block. When friction turns out to depend on reactions that redundant loops leave open, the
        kernel's redundant variant takes over, in the same state."""
        status = self.block.start(t, until, every, row)
        if status != bl.NEED_REDUNDANT:
            return status
        y = self.block.y.copy()
        self._load(redundant=True)
        self.block.configure(settings)
        self.block.y[:] = y
        return self.block.start(t, until, every, row)

    @property
    def system(self) -> System:
        """The structure."""
        return self.built.system


def pattern_problems(everything: list[Column], patterns: tuple[str, ...]) -> list[Problem]:
    """A pattern that matches nothing is a mistake."""
    from difflib import get_close_matches

    problems = []
    for p in patterns:
        if p == "*" or select(everything, (p,)):
            continue
        near = get_close_matches(p, [c.name for c in everything], 3, 0.4)
        hint = f"did you mean {', '.join(near)}?" if near else "see `trunnion check SCENE --outputs` for the names"
        problems.append(Problem("outputs", f"pattern {p!r} matches no column", hint))
    return problems


def simulate(
    scene: Scene | str,
    until: float | None = None,
    every: float | None = None,
    rtol: float | None = None,
    method: str | None = None,
    overrides: Mapping[str, Any] | None = None,
    outputs: Sequence[str] | None = None,
    step: float = 0.0,
    max_steps: int = 0,
    progress: Progress | None = None,
) -> Result:
    """Run a scene.

    scene: a Scene, a file, or a bundled model's name. until: end time, s. every: output spacing, s (default: 1000 rows; 0: every
    step). rtol: relative tolerance of positions and velocities (also absolute, in the scene's own scales). method: auto, rk5, rk8,
    rosenbrock. overrides: {"joints.ball.friction.mu": 0.5, …}. outputs: patterns of columns. step: fixed step instead of error
    control. max_steps: give up after so many (0: never). Raises SceneError for wrong input; a run that cannot go on returns a
    Result with what it has and a named outcome.
    """
    from engine.scene import load_scene
    from engine.scene.overrides import apply

    loaded = load_scene(scene) if isinstance(scene, str) else scene
    if overrides:
        loaded = apply(loaded, overrides)
    sim = loaded.simulation
    until = float(sim.until if until is None else until)
    if every is None:
        every = float(sim.every) if sim.every is not None else until / 1000.0
    rtol = float(sim.rtol if rtol is None else rtol)
    jams = sim.jams == "impact"
    settings = bl.Settings(rtol, method or sim.method, step, max_steps=max_steps, through_jams=jams)
    check_settings(until, every, settings, loaded)
    model = Model(loaded, outputs)
    return run(model, until, every, settings, progress)


def check_settings(until: float, every: float, s: bl.Settings, scene: Scene) -> None:
    """SceneError with everything that is wrong with these for the scene."""
    problems = []
    if not 0.0 < until < math.inf:
        problems.append(Problem("until", f"{until:g} s is not after the start", "give a positive end time"))
    if not 0.0 <= every < math.inf:
        problems.append(Problem("every", f"{every:g} s is no spacing of rows", "give a positive spacing, or 0 for every step"))
    if not 1e-14 <= s.rtol <= 0.1:
        problems.append(Problem("rtol", f"{s.rtol:g} is out of range", "between 1e-14 and 0.1; 1e-6 is a good start"))
    if s.method not in bl.METHODS:
        problems.append(Problem("method", f"{s.method!r} is unknown", f"one of {', '.join(bl.METHODS)}"))
    if not 0.0 <= s.step < math.inf:
        problems.append(Problem("step", f"{s.step:g} s is no step", "a positive step, or 0 for error control"))
    stiff = {j.friction.law or scene.friction.law for j in scene.joints.values() if j.friction} & {"regularized", "lugre"}
    if s.method == "moreau" and stiff:
        problems.append(Problem("method", f"moreau cannot step law {min(stiff)}", "use law coulomb or stribeck, or method auto"))
    if problems:
        raise SceneError(problems)


def run(model: Model, until: float, every: float, settings: bl.Settings, progress: Progress | None = None) -> Result:
    """Assemble, start, step to the end; keep everything up to a failure."""
    return _Run(model, until, every, settings, progress).result()


class _Run:
    """One run: rows and events as they come, and the times of its parts."""

    def __init__(self, model: Model, until: float, every: float, settings: bl.Settings, progress: Progress | None):
        self.model, self.until, self.every, self.settings, self.progress = model, until, every, settings, progress
        self.rows: list[np.ndarray] = []
        self.events: list[Event] = []
        self.notes: list[str] = []
        self.open_reactions = Redundancy(0)
        self.build = self.setup = self.wall = 0.0
        self.roots = 1
        self.began = False

    def result(self) -> Result:
        """Carry it out."""
        started = time.perf_counter()
        outcome = self._begin()
        self.setup = time.perf_counter() - started + self.model.setup_seconds
        if outcome is None:
            outcome = self._stepping_or_stopped()
        block = self.model.block
        data = np.concatenate(self.rows) if self.rows else np.zeros((0, block.width))
        c = block.statistics()
        stats = Stats(self.wall, self.model.build_seconds + self.build, self.setup, c["steps"], c["rejected"], c["rhs_evaluations"],
                      c["jacobians"], c["events"], c)
        s = self.settings
        used = {"until": self.until, "every": self.every, "rtol": s.rtol, "method": s.method, "step": s.step}
        scene = self.model.built.scene
        log.info("%s: %s", scene.name, outcome)
        certified = certificate(block, self.model.system, self.roots, self.open_reactions) if self.began else Certificate()
        self.notes += certificate_notes(certified)
        return Result(scene, data, tuple(self.model.columns), tuple(self.events), outcome, stats, used, tuple(self.notes),
                      self.open_reactions, certified)

    def _begin(self) -> Outcome | None:
        """Close the loops, say what was moved, evaluate the start; an outcome when that cannot be done."""
        from engine.simulation.assembly import moved_notes

        model = self.model
        model.block.configure(self.settings)
        code = model.block.assemble()
        if code != 1:
            return open_loop(model, code)
        self.notes += moved_notes(model.built, model.block)
        first = np.zeros(model.block.width)
        status = model.begin(self.settings, 0.0, self.until, self.every, first)
        self.began = True
        self.roots = model.block.roots() if model.system.neta else 1
        if status != bl.OK:
            return failure(model, status)
        self.rows.append(first[None, :])
        self.open_reactions = redundancy(model.block)
        self.notes += redundancy_notes(self.open_reactions)
        return None

    def _stepping_or_stopped(self) -> Outcome:
        """Advance to the end, or to the interrupt (Ctrl-C): what there is by then is kept."""
        started = time.perf_counter()
        try:
            return self._stepping()
        except KeyboardInterrupt:
            return Outcome("stopped", self.model.block.time, "", ADVICE["stopped"])
        finally:
            self.wall = time.perf_counter() - started - self.build

    def _stepping(self) -> Outcome:
        """Advance to the end in chunks."""
        block = self.model.block
        buffer = np.empty((CHUNK_ROWS, block.width))
        told = time.perf_counter()
        while True:
            status, count = block.advance(self.until, CHUNK_STEPS, buffer)
            if count:
                self.rows.append(buffer[:count].copy())
            self.events += decode(self.model.system, block.take_events())
            if status == bl.DONE:
                break
            if status == bl.NEED_JACOBIAN:
                self._attach_jacobian()
            elif status not in (bl.MORE, bl.ROWS_FULL, bl.EVENTS_FULL, bl.OK):
                return failure(self.model, status)
            if self.progress and time.perf_counter() - told > 0.1:
                told = time.perf_counter()
                self.progress(block.time, self.until)
        if self.every > 0.0 and self.until - self.rows[-1][-1, 0] > 1e-9 * self.until:
            last = np.zeros(block.width)
            block.row(last)
            self.rows.append(last[None, :])
        return Outcome(DONE, self.until)

    def _attach_jacobian(self) -> None:
        """Building the unit is building, not stepping."""
        started = time.perf_counter()
        self.model.block.attach_jacobian()
        self.build += time.perf_counter() - started


def open_loop(model: Model, code: int) -> Outcome:
    """Start values that cannot close the loops (0: positions, −1: velocities)."""
    what = "positions" if code == 0 else "velocities"
    through = ", ".join(j.name for j in model.system.cuts)
    advice = f"the start {what} of the loops through {through} cannot be made to agree: check "
    advice += "lengths and start values" if code == 0 else "the drives and start rates"
    return Outcome("open_loop", 0.0, model.system.cuts[0].name if model.system.cuts else "", advice)


def failure(model: Model, status: int) -> Outcome:
    """Named outcome, with the joint it is about."""
    from engine.simulation.diagnosis import diagnose

    return diagnose(model, status)
