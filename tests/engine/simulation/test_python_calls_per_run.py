"""The Python cost of a run is the same for each call into C, independent of the work inside the call."""

from __future__ import annotations

import sys
from types import FrameType

import pytest

from trunnion import load_scene
from trunnion.basics.interrupts import DeferredInterrupt
from trunnion.scene.overrides import apply
from trunnion.simulation.execution.run_loop import FIRST_STEPS, OneRun
from trunnion.simulation.results.outcome import Outcome
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate


def calls_while_stepping(monkeypatch: pytest.MonkeyPatch, until: float) -> tuple[int, Result]:
    """Number of function calls in Python while example 8.1 steps to ``until`` under law coulomb; also the run's result."""
    called: list[str] = []
    stepping = OneRun._step

    def note(frame: FrameType, what: str, function: object) -> None:
        if what in ("call", "c_call"):
            called.append(what)

    def watched(run: OneRun, interrupt: DeferredInterrupt) -> Outcome:
        before = sys.getprofile()
        sys.setprofile(note)
        try:
            return stepping(run, interrupt)
        finally:
            sys.setprofile(before)

    monkeypatch.setattr(OneRun, "_step", watched)
    scene = apply(load_scene("spherical_pendulum"), {"friction.law": "coulomb"})
    result = simulate(scene, until=until, every=until, outputs="ball.q[1]")
    monkeypatch.undo()
    return len(called), result


def test_events_cost_no_python_while_a_run_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    calls_while_stepping(monkeypatch, 0.1)  # this call does the work that is done only once
    few, short = calls_while_stepping(monkeypatch, 1.0)
    many, long = calls_while_stepping(monkeypatch, 5.0)
    assert 0 < len(short.events) < len(long.events)
    assert short.stats.steps < long.stats.steps < FIRST_STEPS  # both runs take one call into C
    assert few == many
