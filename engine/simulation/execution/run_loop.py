"""The loop of a run: assembly, start, steps in calls to C, and collection of rows and events, until the end or an interrupt."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from trunnion.basics.interrupts import DeferredInterrupt, heed, held
from trunnion.runtime.abi.header_constants import number
from trunnion.simulation.execution.assembly_notes import assembly_notes
from trunnion.simulation.execution.drive_motion import beginning_notes
from trunnion.simulation.execution.failure_diagnosis import diagnose
from trunnion.simulation.execution.field_notes import field_notes
from trunnion.simulation.execution.follower_pull_notes import FollowerPulls
from trunnion.simulation.execution.guide_end_notes import guide_end_notes
from trunnion.simulation.execution.missing_inertia import missing_inertia
from trunnion.simulation.execution.open_loop_report import open_loop
from trunnion.simulation.execution.undetermined_reactions import open_reactions
from trunnion.simulation.results.audit import Audit, audit_of, judged
from trunnion.simulation.results.event_decoder import decode
from trunnion.simulation.results.friction_uniqueness import Certificate, certificate, certificate_notes
from trunnion.simulation.results.outcome import CANCELLED, DONE, Outcome
from trunnion.simulation.results.redundant_reactions import Redundancy, redundancy_notes
from trunnion.simulation.results.result import Result
from trunnion.simulation.results.result_data import Stats
from trunnion.simulation.results.summary import impact_note, marginal_note, stiffness_note
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.settings.memory_limits import Room
from trunnion.simulation.settings.realtime_steps import overrun_note

if TYPE_CHECKING:
    from trunnion.simulation.execution.runnable_model import Model

log = logging.getLogger("trunnion.simulate")
CHUNK_SECONDS = 0.03
"""Target duration of a call into C, s. Progress, Ctrl-C and time limits must be handled at least every 50 ms."""
FIRST_STEPS, LEAST_STEPS, MOST_STEPS = 50, 4, 2000
"""FIRST_STEPS: smallest number of steps of the first call into C. LEAST_STEPS, MOST_STEPS: smallest and largest number of steps of
later calls. The number of steps of a later call follows from the duration of the previous call."""
FIRST_NUMBERS = 4000
"""Size of the state × number of steps of the first call: the smaller the mechanism, the more steps the first call makes."""
CHUNK_ROWS = 4096
Progress = Callable[[float, float], None]
"""progress(time, until), called a few times a second."""


class OneRun:
    """A run in progress: rows and event records so far, and the durations of build, setup and stepping."""

    def __init__(self, model: Model, until: float, every: float, settings: bl.Settings, progress: Progress | None):
        self.model, self.until, self.every, self.settings, self.progress = model, until, every, settings, progress
        self.rows: list[np.ndarray] = []
        self.records: list[np.ndarray] = []
        self.notes: list[str] = []
        self.redundancy = Redundancy(0)
        self.pulls: FollowerPulls | None = None
        self.build = self.setup = self.wall = 0.0
        self.roots = 1
        self.began = False

    def result(self) -> Result:
        """Execute the run. Returns the result."""
        started = time.perf_counter()
        outcome = self._begin()
        self.setup = time.perf_counter() - started + self.model.setup_seconds
        if outcome is None:
            outcome = self._step_until_interrupt()
        block = self.model.block
        data = np.concatenate(self.rows) if self.rows else np.zeros((0, block.width))
        c = block.statistics()
        stats = Stats(self.wall, self.model.build_seconds + self.build, self.setup, c["steps"], c["rejected"], c["rhs_evaluations"],
                      c["jacobians"], c["events"], c)
        s = self.settings
        used = {"until": self.until, "every": self.every, "rtol": s.rtol, "method": s.method, "step": s.step}
        used["kernel"] = self.model.kernel_kind
        scene = self.model.built.scene
        certified = certificate(block, self.model.system, self.roots, self.redundancy) if self.began else Certificate()
        events = decode(self.model.system, np.concatenate(self.records)) if self.records else []
        frictional = [j.name for j in self.model.system.frictional]
        audit = audit_of(block.judgement(), frictional) if self.rows else Audit()
        outcome = judged(outcome, audit)
        if self.redundancy.count:  # the statistics and the audit do not count evaluations after this line
            self.redundancy = self.redundancy.or_at(open_reactions(self.model, s))
            certified = replace(certified, not_unique=self.redundancy.joints)
        self.notes += [*redundancy_notes(self.redundancy), *certificate_notes(certified)]
        found = marginal_note(tuple(events)), overrun_note(c), stiffness_note(s.method, stats), impact_note(c)
        self.notes += [*audit.notes, *(self.pulls.notes() if self.pulls else ()),
                       *guide_end_notes(scene, self.model.columns, data), *field_notes(scene), *filter(None, found)]
        log.info("%s: %s", scene.name, outcome)
        return Result(scene, data, tuple(self.model.columns), tuple(events), outcome, stats, used, tuple(self.notes),
                      self.redundancy, certified, audit)

    def _begin(self) -> Outcome | None:
        """Close the loops, add notes about changed start values, and evaluate the start. Returns an outcome if one of these fails,
        else None."""
        model = self.model
        model.block.configure(self.settings)
        code = model.block.assemble()
        if code != 1:
            return open_loop(model, code)
        self.notes += [*assembly_notes(model.built, model.block), *beginning_notes(model.built, against_data=True)]
        if lacking := missing_inertia(model):
            return lacking
        first = np.zeros(model.block.width)
        status = model.begin(self.settings, 0.0, self.until, self.every, first)
        self.began = True
        self.roots = model.block.roots() if model.system.neta else 1
        if status != bl.OK:
            return diagnose(model, status)
        self.rows.append(first[None, :])
        self.pulls = FollowerPulls(model.system, model.block)
        self.redundancy = open_reactions(model, self.settings)
        return None

    def _step_until_interrupt(self) -> Outcome:
        """Step to the end, or until Ctrl-C. Rows and events up to Ctrl-C are kept."""
        try:
            with held() as interrupt, self.model.block.cancellable(lambda: interrupt.asked):
                started = time.perf_counter()
                try:
                    return self._step(interrupt)
                finally:
                    self.wall = time.perf_counter() - started - self.build
        except KeyboardInterrupt:
            return Outcome.named(CANCELLED, max(self.model.block.time, float(self.rows[-1][-1, 0])), "")

    def _step(self, interrupt: DeferredInterrupt) -> Outcome:
        """Step to the end in calls of about ``CHUNK_SECONDS``. Ctrl-C raises KeyboardInterrupt only between calls."""
        block = self.model.block
        rows_at_once = CHUNK_ROWS if self.every <= 0.0 else int(min(CHUNK_ROWS, self.until / self.every + 2))
        buffer = np.empty((rows_at_once, block.width))
        reported, steps = time.perf_counter(), self._first_steps()
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
            elif status not in (bl.ROWS_FULL, bl.EVENTS_FULL, bl.CANCELLED, bl.OK):
                failed = diagnose(self.model, status)
                if interrupt.asked:  # Ctrl-C may have interrupted the diagnosis
                    raise KeyboardInterrupt
                return failed
            if full := room.take(count, len(events)):
                return Outcome.named(full, float(self.rows[-1][-1, 0]), "")
            heed()
            if interrupt.asked:
                raise KeyboardInterrupt
            if self.progress and time.perf_counter() - reported > 0.1:
                reported = time.perf_counter()
                self.progress(block.time, self.until)
        if self.every > 0.0 and self.until - self.rows[-1][-1, 0] > number("LAST_ROW") * self.until:
            last = np.zeros(block.width)
            code = block.row(last)
            if code != bl.OK:
                return diagnose(self.model, code)
            self.rows.append(last[None, :])
        return Outcome(DONE, self.until)

    def _first_steps(self) -> int:
        """Number of steps of the first call into C."""
        return min(max(FIRST_STEPS, FIRST_NUMBERS // max(self.model.block.ny, 1)), MOST_STEPS)

    def _next_steps(self, steps: int, seconds: float) -> int:
        """Number of steps of the next call into C. steps, seconds: length and duration of the last call."""
        wanted = steps * min(4.0, CHUNK_SECONDS / max(seconds, 1e-9))
        return int(min(max(wanted, LEAST_STEPS), MOST_STEPS))

    def _attach_jacobian(self, interrupt: DeferredInterrupt) -> None:
        """Build and attach the Jacobian unit. An interrupt during the build leaves the block unchanged. The time counts as build
        time."""
        started = time.perf_counter()
        try:
            with interrupt.open():
                self.model.block.kernel.jacobian()
            self.model.block.attach_jacobian()
        finally:
            self.build += time.perf_counter() - started
