"""At every step size, the run finds a contact with an end stop that is shorter than a step. One body is thrown slightly into a
stop; another body leaves its stop only briefly."""

from __future__ import annotations

import math

import pytest

from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

G, STIFF, MASS = 9.81, 1000.0, 1.0
METHODS = ("rk5", "rk8", "rosenbrock")


def thrown(way: float, speed: float, start: float, stops: sm.EndStops, method: str, rtol: float, until: float = 1.0) -> Result:
    """A body on a vertical guide, thrown against gravity. way: 1 up; −1 down, with gravity reversed."""
    joint = sm.Joint("prismatic", "ground", "body", axis="y", start=sm.Start(q=way * start, qd=way * speed), end_stops=stops)
    scene = sm.Scene({"body": sm.Body(mass=MASS, inertia=(0.1, 0.1, 0.1))}, {"guide": joint}, gravity=(0.0, -way * G, 0.0))
    return simulate(scene, until=until, rtol=rtol, method=method)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("over", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
@pytest.mark.parametrize("method", METHODS)
def test_a_stop_that_is_touched_inside_a_step_is_found_at_its_time(method: str, rtol: float, over: float) -> None:
    speed = 4.905
    end = speed**2 / (2 * G) - over
    for way, stops in ((1.0, sm.EndStops(upper=end, stiffness=STIFF)), (-1.0, sm.EndStops(lower=-end, stiffness=STIFF))):
        r = thrown(way, speed, 0.0, stops, method, rtol)
        assert [e.kind for e in r.events] == ["end_stop_engaged", "end_stop_released"]
        reached = (speed - math.sqrt(2 * G * over)) / G
        # the event is located to 2e-12 m of depth at a step's end
        assert r.events[0].time == pytest.approx(reached, abs=2e-12 / math.sqrt(2 * G * over) + 1e-12)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize("method", METHODS)
def test_a_stop_that_is_left_for_a_part_of_a_step_is_left(method: str, rtol: float) -> None:
    """A body oscillates in its stop. The amplitude exceeds by 0.1 % the depth to which the weight presses the body into the
    stop."""
    rest, rate = MASS * G / STIFF, math.sqrt(STIFF / MASS)
    swing = 1.001 * rest
    r = thrown(1.0, 0.0, -rest - swing, sm.EndStops(lower=0.0, stiffness=STIFF), method, rtol, until=1.5 * math.pi / rate)
    assert [e.kind for e in r.events] == ["end_stop_released", "end_stop_engaged"]
    across = swing * rate * math.sqrt(1.0 - (rest / swing) ** 2)  # speed at which the body leaves the stop, m/s
    # positions have an error of rtol times 1 m
    assert r.events[0].time == pytest.approx(math.acos(-rest / swing) / rate, abs=10.0 * rtol / across)
