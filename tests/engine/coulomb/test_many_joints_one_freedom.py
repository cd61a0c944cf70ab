"""Many joints with friction share one freedom. Their events coincide, and do not depend on method or tolerance. The motion is the
limit of a smooth law of growing steepness."""

from __future__ import annotations

from collections import Counter
from functools import cache
from itertools import pairwise

import pytest

from trunnion.scene import Scene, scene_from_text
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

METHODS = ("auto", "rk5", "rk8", "rosenbrock")
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
UNTIL = 1.0
ALL = {"lower_in", "upper_in", "lower_ball", "upper_ball", "steer"}
FEWEST = {"lower_in", "lower_ball"}
"""A smallest set of joints whose friction can cause events again and again."""

CORNER = """
schema: 1
name: wishbone corner
gravity: [0, 0, -9.81]
ground:
  points: {lower_in: [0, 0.35, 0.20], upper_in: [0, 0.45, 0.50], rack: [-0.12, 0.38, 0.22], top: [0, 0.50, 0.65]}
bodies:
  lower: {box: [0.3, 0.4, 0.03], mass: 4, center: [0, 0.2, -0.01], points: {ball: [0, 0.40, -0.02], spring: [0, 0.27, 0.0]}}
  upper: {box: [0.2, 0.25, 0.02], mass: 2, center: [0, 0.125, 0.01], points: {ball: [0, 0.25, 0.02]}}
  knuckle:
    cylinder: {radius: 0.33, length: 0.2, axis: y}
    mass: 35
    points: {lower: [0, -0.05, -0.15], upper: [0, -0.10, 0.19], steer: [-0.12, -0.06, -0.13], patch: [0, 0, -0.33]}
  rod: {cylinder: {radius: 0.008, length: 0.36, axis: y}, mass: 1, center: [0, 0.18, -0.01], points: {outer: [0, 0.36, -0.02]}}
joints:
  lower_in: {type: revolute, axis: x, inboard: ground.lower_in, outboard: lower, start: {q: 0}, RUB 0.01, half_length: 0.12}}
  upper_in: {type: revolute, axis: x, inboard: ground.upper_in, outboard: upper, start: {q: 0}, RUB 0.01, half_length: 0.08}}
  lower_ball: {type: spherical, inboard: lower.ball, outboard: knuckle.lower, RUB 0.014}}
  upper_ball: {type: spherical, inboard: upper.ball, outboard: knuckle.upper, RUB 0.012}}
  rack: {type: universal, axis: x, reference: z, inboard: ground.rack, outboard: rod}
  steer: {type: spherical, inboard: rod.outer, outboard: knuckle.steer, RUB 0.01}}
forces:
  road: {type: force, on: knuckle.patch, force: [0, 0, {harmonic: {amplitude: 3000, offset: 4000, frequency: 0.5 Hz}}]}
  strut: {type: spring_damper, between: [lower.spring, ground.top], stiffness: 60000, damping: 1500, length: 0.575}
"""


def corner(rub: set[str], law: str = "law: coulomb") -> Scene:
    """The corner of a car with friction in these joints. The load of the wheel comes and goes."""
    lines = []
    for line in CORNER.splitlines():
        head, found, sizes = line.partition(", RUB ")
        friction = f", friction: {{mu: 0.1, {law}, radius: {sizes}" if found else ""
        plain = head + "}" if found and head.strip().split(":")[0] not in rub else head + friction
        lines.append(plain)
    return scene_from_text("\n".join(lines))


@cache
def run(rub: frozenset[str], method: str, rtol: float) -> Result:
    r = simulate(corner(set(rub)), until=UNTIL, every=0.01, method=method, rtol=rtol)
    assert r.outcome.ok, r.outcome
    return r


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rub", [ALL, FEWEST], ids=["all", "fewest"])
def test_joints_on_one_freedom_have_the_same_events_whatever_method_and_tolerance(rub: set[str], method: str) -> None:
    best = run(frozenset(rub), "rk8", TOLERANCES[-1]).events
    for rtol in TOLERANCES:
        events = run(frozenset(rub), method, rtol).events
        assert [(e.kind, e.joint) for e in events] == [(e.kind, e.joint) for e in best], rtol
        assert [e.time for e in events] == pytest.approx([e.time for e in best], abs=100 * rtol * UNTIL)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("rub", [ALL, FEWEST], ids=["all", "fewest"])
@pytest.mark.slow
def test_joints_on_one_freedom_turn_stop_and_let_go_at_one_time(rub: set[str]) -> None:
    for method in METHODS:
        for rtol in TOLERANCES:
            together = Counter((e.time, e.kind) for e in run(frozenset(rub), method, rtol).events)
            assert set(together.values()) == {len(rub)}
            assert [kind for _, kind in together] == ["reversal", "stick", "slip"]


def test_the_motion_is_what_a_steep_law_without_rest_tends_to() -> None:
    """The regularised law has no modes, no distribution of loads and no events. Its error is of first order in its speed."""
    exact = run(frozenset(ALL), "rk8", 1e-9)
    off = []
    for speed in (4e-6, 2e-6, 1e-6):
        steep = simulate(corner(ALL, f"law: regularized, v_eps: {speed}"), until=UNTIL, every=0.01, method="rosenbrock", rtol=1e-8)
        assert steep.outcome.ok, steep.outcome
        off.append(steep["lower_in.q[1]"][-1] - exact["lower_in.q[1]"][-1])
    for rough, fine in pairwise(off):
        assert rough / fine == pytest.approx(2.0, abs=0.03)
    assert abs(2.0 * off[-1] - off[-2]) <= 3e-9  # this combination extrapolates the error of first order away
