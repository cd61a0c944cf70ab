"""What is told of large things at a prompt is a line, whatever they hold."""

from __future__ import annotations

import engine

MU = "joints.ball.friction.mu"


def test_sweeps_and_sensitivities_are_told_in_a_line() -> None:
    swept = engine.sweep("spherical_pendulum", over={MU: "0.1:0.6:3"}, reductions=["max:ball.qd[1]"], until=0.05)
    assert repr(swept).startswith("<Sweep of spherical_pendulum: 3 cases")
    assert "3 done" in repr(swept)
    derived = engine.sensitivity("spherical_pendulum", [MU], ["ball.qd[2]"], until=0.05)
    assert repr(derived) == f"<Sensitivity of ball.qd[2] to {MU}: {len(derived.time)} times>"
