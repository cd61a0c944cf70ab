"""A run without progress ends as `no_progress` after bounded work. Short steps that the user requests do not count as lack of
progress."""

from __future__ import annotations

from typing import Any

import pytest

from trunnion.simulation.run import simulate


def on_a_spring(stiffness: float) -> dict[str, Any]:
    """A block of 1 kg on a stretched spring."""
    spring = {"stiffness": stiffness, "rest": 0.0}
    way = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block", "spring": spring, "start": {"q": 0.1}}
    return {"schema": 1, "name": "swing", "bodies": {"block": {"box": [1, 1, 1], "mass": 1.0}}, "joints": {"way": way}}


@pytest.mark.parametrize("method", ["auto", "rk5", "rk8", "rosenbrock"])
def test_a_motion_too_fast_for_any_step_ends_as_stalled(method: str) -> None:
    """The rate is 1e14 rad/s. The first nanosecond would take a million steps, and a second 1e15 steps."""
    r = simulate(on_a_spring(1e28), until=1.0, every=0.1, method=method, outputs=["way.q[1]"])
    assert r.outcome.name == "no_progress"
    assert r.stats.steps + r.stats.rejected < 25_000
    assert r.outcome.time < 1e-9
    assert len(r) == 1


def test_a_fixed_step_far_too_long_ends_where_events_follow_each_other_without_end() -> None:
    """From 2.47176 s on, two branches of friction alternate every 1e-11 s. The third fixed step would contain 1e11 events."""
    r = simulate("spherical_pendulum", until=4.0, step=1.1, every=1.1, method="rosenbrock", kernel="parts",
                 overrides={"friction.law": "regularized"}, outputs=["ball.q[1]"])  # fmt: skip
    assert r.outcome.name == "no_progress"
    assert r.stats.steps + r.stats.rejected < 25_000


def test_short_steps_that_were_asked_for_are_no_stall() -> None:
    r = simulate(on_a_spring(100.0), until=3e-10, every=1e-10, step=1e-14, outputs=["way.q[1]"])
    assert r.outcome.ok
    assert r.stats.steps >= 29_000
