"""Times and places of sliding reversals, and turns of the contact normals. Runs are accurate only if these reversals are
located."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.engine.mechanisms.paper_examples_closed_form import pendulum_run
from trunnion.scene import load_scene
from trunnion.scene.overrides import apply
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface import simulation_block as bl

NORMAL_TURNS = {1: 58.897, 5: 57.610}
"""Stop → degrees by which the ball's normal turns at this stop: 2 atan μ less the jump of the reaction (theory, "Turns of
normals")."""


@cache
def pendulum(every: float = 0.1, rtol: float = 1e-9, locate: bool = True, v_eps: float = 1e-4, until: float = 10.0) -> Result:
    """A run of example 8.1, the spherical pendulum."""
    scene = apply(load_scene("spherical_pendulum"), {"friction.law": "regularized", "friction.v_eps": v_eps})
    return run(Model(scene, ("*",)), until, every, bl.Settings(rtol=rtol, locate=locate))


@cache
def crank(v_eps: float = 1e-4) -> Result:
    """One second of example 8.2, the crank-slider."""
    scene = apply(load_scene("crank_slider"), {"friction.law": "regularized", "friction.v_eps": v_eps})
    return run(Model(scene, ("*",)), 1.0, 0.1, bl.Settings(rtol=1e-10))


def angle(r: Result) -> np.ndarray:
    """Angle of the pendulum from the downward vertical, degrees."""
    return np.degrees(np.arctan2(r["pendulum.position[1]"], -r["pendulum.position[3]"]))


def reversals(r: Result, joint: str) -> np.ndarray:
    """Times of the reversals of a joint, s."""
    return np.array([e.time for e in r.events if e.kind == "reversal" and e.joint == joint])


def test_the_pendulum_stops_at_the_times_of_the_model_with_one_freedom() -> None:
    """Reversals of the regularised law. Reversals with dry friction are 5e-7 s to 6e-5 s earlier. The eleventh stop is a creep, not
    a reversal."""
    stops, _ = pendulum_run()
    found = reversals(pendulum(), "ball")
    assert len(found) == 10
    assert found == pytest.approx(stops[:10, 0], abs=1e-8)


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("stop", range(10))
def test_the_pendulum_stops_at_the_angles_of_the_model_with_one_freedom(stop: int) -> None:
    """A run that ends at a reversal has rate zero at its end. The angle equals the angle of the model with one freedom."""
    stops, _ = pendulum_run()
    r = pendulum(every=0.0, until=float(stops[stop, 0]))
    assert angle(r)[-1] == pytest.approx(np.degrees(stops[stop, 1]), abs=1e-6)  # the error is 2e-8 rad at rtol 1e-9
    assert abs(r["ball.qd[2]"][-1]) <= 1e-6  # stop times are precise to 1e-8 s, and accelerations are at most 14 rad/s²


@pytest.mark.parametrize("stop", NORMAL_TURNS)
def test_the_balls_normal_turns_as_published(stop: int) -> None:
    (turn,) = [e for e in pendulum(v_eps=1e-6).events if e.kind == "reversal"][stop - 1].turn
    assert np.degrees(turn) == pytest.approx(NORMAL_TURNS[stop], abs=1e-3)


@pytest.mark.parametrize("stop", NORMAL_TURNS)
def test_the_balls_normal_turns_as_published_between_rows_on_both_sides(stop: int) -> None:
    """Two rows give the turn, not the event: with v_eps = 1e-6 m/s, the normal has turned within 1e-5 s after the reversal."""
    at = pendulum(v_eps=1e-6, until=8.0).events[stop - 1].time
    normals = []
    for t in (at - 1e-5, at + 1e-5):
        r = pendulum(v_eps=1e-6, every=0.0, until=t)
        normals.append(np.array([r[f"ball.contact[1].normal[{k}]"][-1] for k in (1, 2, 3)]))
    assert np.degrees(np.arccos(normals[0] @ normals[1])) == pytest.approx(NORMAL_TURNS[stop], abs=1e-2)


def test_the_slider_pin_reverses_where_the_crank_stands_upright() -> None:
    r = crank()
    assert reversals(r, "slider_pin") == pytest.approx(np.pi / 20 + np.pi / 10 * np.arange(3), abs=1e-12)
    assert {(e.kind, e.joint, e.part) for e in r.events} == {("reversal", "slider_pin", 1)}
    assert r["events.count"][-1] >= 6  # each reversal passes two kinks of the law: into the linear zone and out of the zone


def test_the_slider_pins_normals_turn_as_published() -> None:
    """Dry friction turns the normals by 33.083 and 33.029 degrees. The turns of the regularised law tend to these as v_eps
    falls."""
    for v_eps, tolerance in ((1e-6, 4e-3), (1e-8, 1e-3)):
        for e, expected in zip(crank(v_eps).events, (33.083, 33.029, 33.083), strict=True):
            assert np.degrees(e.turn) == pytest.approx([expected, expected], abs=tolerance)
            for before, after, turn in zip(e.before, e.after, e.turn, strict=True):
                assert abs(np.angle(np.exp(1j * (after - before)))) == pytest.approx(turn, abs=1e-12)


@pytest.mark.parametrize("every", [0.01, 0.0137, 0.0])
def test_output_spacing_changes_nothing(every: float) -> None:
    base, other = pendulum(), pendulum(every=every)
    assert reversals(other, "ball") == pytest.approx(reversals(base, "ball"), abs=1e-10)
    assert other.data[-1, 1:] == pytest.approx(base.data[-1, 1:], abs=1e-10, rel=1e-10)
    assert other.stats.steps == base.stats.steps


def test_every_zero_gives_a_row_at_every_event() -> None:
    r = pendulum(every=0.0)
    assert r.stats.events > 0
    assert len(r) == 1 + r.stats.steps


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_kinks_must_be_located(rtol: float) -> None:
    """At equal tolerance, a run that locates the kinks of the law is far more accurate. Without location, the law stays on its old
    branch after a kink."""
    _, truth = pendulum_run()
    with_kinks, without = (pendulum(every=1.0, rtol=rtol, locate=locate) for locate in (True, False))
    errors = [max(abs(np.radians(angle(r)[t]) - truth(float(t))) for t in (1, 2, 5, 7)) for r in (with_kinks, without)]
    assert errors[0] <= 30 * rtol
    assert errors[0] < 0.1 * errors[1]


def test_stops_of_a_table_are_hit_exactly() -> None:
    """Steps end at every kink of a signal. Therefore a ramped drive is exact at any tolerance."""
    from trunnion.scene.data_classes import scene as sm

    drive = sm.Drive(ramp=sm.Ramp(0.0, 2.0, duration=0.7, begin=0.31))
    joints = {
        "turn": sm.Joint("revolute", "ground", "arm", axis="z", drive=drive),
        "free": sm.Joint(
            "prismatic", "ground", "mass", axis="x", effort=sm.Signal(ramp=sm.Ramp(0.0, 3.0, duration=0.7, begin=0.31))
        ),
    }
    scene = sm.Scene(
        {"arm": sm.Body(box=(1.0, 0.1, 0.1), mass=1.0), "mass": sm.Body(sphere=0.1, mass=1.0)}, joints, gravity=(0, 0, 0)
    )
    r = run(Model(scene, ("*",)), 2.0, 0.1, bl.Settings(rtol=1e-3))
    t = np.clip((r.time - 0.31) / 0.7, 0, 1)
    late = np.maximum(r.time - 1.01, 0.0)
    # a force of at most 3 N moves 1 kg: the travel consists of polynomials
    travel = 3.0 * 0.7**2 * t**3 / 6 + 3.0 * (0.7 / 2 * late + late**2 / 2)
    assert r["free.q[1]"] == pytest.approx(travel, abs=1e-13)
    assert r["turn.q[1]"] == pytest.approx(2.0 * 0.7 * t**2 / 2 + 2.0 * late, abs=1e-13)
