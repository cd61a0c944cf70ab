"""One run carried out: assembly, start, steps in calls to C, rows and events as they come, until its end or an interrupt."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from engine.basics.interrupts import Held, heed, held
from engine.simulation import block as bl
from engine.simulation.audit import Audit, audit_of, judged
from engine.simulation.bounded import note
from engine.simulation.certificate import Certificate, certificate, certificate_notes
from engine.simulation.diagnosis import diagnose
from engine.simulation.events import decode
from engine.simulation.gaps import open_loop
from engine.simulation.memory import Room
from engine.simulation.outcome import DONE, Outcome
from engine.simulation.redundancy import Redundancy, redundancy, redundancy_notes
from engine.simulation.result import Result, Stats
from engine.simulation.summary import marginal_note

if TYPE_CHECKING:
    from engine.simulation.model import Model

log = logging.getLogger("trunnion.simulate")
CHUNK_SECONDS = 0.03
"""How long a call into C is meant to last: under the 50 ms after which progress, Ctrl-C and time budgets must be served."""
FIRST_STEPS, LEAST_STEPS, MOST_STEPS = 50, 4, 2000
"""Steps of the first call where the state is large, and bounds of those that follow, which are sized from the time the last one
took."""
FIRST_NUMBERS = 4000
"""Numbers of the state that the first call moves on: small mechanisms make more steps at once, most of them all they need."""
CHUNK_ROWS = 4096
Progress = Callable[[float, float], None]
"""progress(time, until), called a few times a second."""


class OneRun:
    """A run in progress: the rows and event records so far, and how long its parts took."""

    def __init__(self, model: Model, until: float, every: float, settings: bl.Settings, progress: Progress | None):
        self.model, self.until, self.every, self.settings, self.progress = model, until, every, settings, progress
        self.rows: list[np.ndarray] = []
        self.records: list[np.ndarray] = []
        self.notes: list[str] = []
        self.open_reactions = Redundancy(0)
        self.build = self.setup = self.wall = 0.0
        self.roots = 1
        self.began = False

    def result(self) -> Result:
        """Carry the run out and give its result."""
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
        used["kernel"] = self.model.kernel_kind
        scene = self.model.built.scene
        certified = certificate(block, self.model.system, self.roots, self.open_reactions) if self.began else Certificate()
        self.notes += certificate_notes(certified)
        events = decode(self.model.system, np.concatenate(self.records)) if self.records else []
        audit = self._audit()
        outcome = judged(outcome, audit)
        self.notes += [*audit.notes, *filter(None, [marginal_note(tuple(events)), note(c)])]
        log.info("%s: %s", scene.name, outcome)
        return Result(scene, data, tuple(self.model.columns), tuple(events), outcome, stats, used, tuple(self.notes),
                      self.open_reactions, certified, audit)

    def _audit(self) -> Audit:
        """What the audit says of the run; nothing of one that did not start."""
        if not self.rows:
            return Audit()
        return audit_of(self.model.block.judgement(), [j.name for j in self.model.system.frictional])

    def _begin(self) -> Outcome | None:
        """Close the loops, note which start values were moved, and evaluate the start; gives an outcome when that cannot be
        done."""
        from engine.simulation.assembly import moved_notes
        from engine.simulation.motions import beginning_notes

        model = self.model
        model.block.configure(self.settings)
        code = model.block.assemble()
        if code != 1:
            return open_loop(model, code)
        self.notes += [*moved_notes(model.built, model.block), *beginning_notes(model.built, against_data=True)]
        first = np.zeros(model.block.width)
        status = model.begin(self.settings, 0.0, self.until, self.every, first)
        self.began = True
        self.roots = model.block.roots() if model.system.neta else 1
        if status != bl.OK:
            return diagnose(model, status)
        self.rows.append(first[None, :])
        self.open_reactions = redundancy(model.block)
        self.notes += redundancy_notes(self.open_reactions)
        return None

    def _stepping_or_stopped(self) -> Outcome:
        """Advance to the end, or until Ctrl-C; the rows and events up to then are kept."""
        try:
            with held() as interrupt, self.model.block.asking(lambda: interrupt.asked):
                started = time.perf_counter()
                try:
                    return self._stepping(interrupt)
                finally:
                    self.wall = time.perf_counter() - started - self.build
        except KeyboardInterrupt:
            return Outcome.named("stopped", max(self.model.block.time, float(self.rows[-1][-1, 0])), "")

    def _stepping(self, interrupt: Held) -> Outcome:
        """Advance to the end in calls of about ``CHUNK_SECONDS``; KeyboardInterrupt is raised only between two of them."""
        block = self.model.block
        buffer = np.empty((self._rows_at_once(), block.width))
        told, steps = time.perf_counter(), self._first_steps()
        room = Room(block.width, self.every <= 0.0)
        while True:
            began = time.perf_counter()
            status, count = block.advance(self.until, steps, buffer)
            if count:
                self.rows.append(buffer[:count].copy())
            events = block.take_events()
            if len(events):
                self.records.append(events)
            if status == bl.DONE:
                break
            if status == bl.NEED_JACOBIAN:
                self._attach_jacobian(interrupt)
            elif status == bl.MORE:
                steps = self._next_steps(steps, time.perf_counter() - began)
            elif status not in (bl.ROWS_FULL, bl.EVENTS_FULL, bl.STOPPED, bl.OK):
                failed = diagnose(self.model, status)
                if interrupt.asked:  # the reason may not have been found out
                    raise KeyboardInterrupt
                return failed
            if full := room.take(count, len(events)):
                return Outcome.named(full, float(self.rows[-1][-1, 0]), "")
            heed()
            if interrupt.asked:
                raise KeyboardInterrupt
            if self.progress and time.perf_counter() - told > 0.1:
                told = time.perf_counter()
                self.progress(block.time, self.until)
        if self.every > 0.0 and self.until - self.rows[-1][-1, 0] > 1e-9 * self.until:
            last = np.zeros(block.width)
            code = block.row(last)
            if code != bl.OK:
                return diagnose(self.model, code)
            self.rows.append(last[None, :])
        return Outcome(DONE, self.until)

    def _first_steps(self) -> int:
        """How many steps the first call into C makes."""
        return first_steps(self.model.block.ny)

    def _next_steps(self, steps: int, seconds: float) -> int:
        """How many the next one makes, when the last took ``seconds`` for ``steps`` steps."""
        return sized(steps, seconds)

    def _rows_at_once(self) -> int:
        """How many rows a call into C may return: room for all of a short run, touching no more memory than it fills."""
        return CHUNK_ROWS if self.every <= 0.0 else int(min(CHUNK_ROWS, self.until / self.every + 2))

    def _attach_jacobian(self, interrupt: Held) -> None:
        """Attach the Jacobian unit. Its building time counts as building, not stepping, and may be interrupted: the block is
        not touched before the unit is there."""
        started = time.perf_counter()
        try:
            with interrupt.open():
                self.model.block.kernel.jacobian()
            self.model.block.attach_jacobian()
        finally:
            self.build += time.perf_counter() - started


def first_steps(numbers: int) -> int:
    """How many steps to ask for in the first call into C, with so many numbers in the state."""
    return min(max(FIRST_STEPS, FIRST_NUMBERS // max(numbers, 1)), MOST_STEPS)


def sized(steps: int, seconds: float) -> int:
    """How many steps to ask for in the next call into C, when the last call took ``seconds`` for ``steps`` steps."""
    wanted = steps * min(4.0, CHUNK_SECONDS / max(seconds, 1e-9))
    return int(min(max(wanted, LEAST_STEPS), MOST_STEPS))
