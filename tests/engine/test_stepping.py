"""What a run costs in Python beside its steps in C: as much for each call into C, whatever happens inside that call."""

from __future__ import annotations

import sys
from types import FrameType

import pytest

from engine import load_scene
from engine.basics.interrupts import Held
from engine.scene.overrides import apply
from engine.simulation.outcome import Outcome
from engine.simulation.result import Result
from engine.simulation.run import simulate
from engine.simulation.stepping import FIRST_STEPS, OneRun


def calls_while_stepping(monkeypatch: pytest.MonkeyPatch, until: float) -> tuple[int, Result]:
    """How many functions Python calls while example 8.1 steps to ``until`` under law coulomb, and the run's result."""
    called: list[str] = []
    stepping = OneRun._stepping

    def note(frame: FrameType, what: str, function: object) -> None:
        if what in ("call", "c_call"):
            called.append(what)

    def watched(run: OneRun, interrupt: Held) -> Outcome:
        before = sys.getprofile()
        sys.setprofile(note)
        try:
            return stepping(run, interrupt)
        finally:
            sys.setprofile(before)

    monkeypatch.setattr(OneRun, "_stepping", watched)
    scene = apply(load_scene("spherical_pendulum"), {"friction.law": "coulomb"})
    result = simulate(scene, until=until, every=until, outputs="ball.q[1]")
    monkeypatch.undo()
    return len(called), result


def test_events_cost_no_python_while_a_run_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    calls_while_stepping(monkeypatch, 0.1)  # whatever is done once only
    few, short = calls_while_stepping(monkeypatch, 1.0)
    many, long = calls_while_stepping(monkeypatch, 5.0)
    assert 0 < len(short.events) < len(long.events)
    assert short.stats.steps < long.stats.steps < FIRST_STEPS  # both in one call into C
    assert few == many
