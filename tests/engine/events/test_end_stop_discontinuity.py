"""Damped stops whose force ends while the body is still within them. Steps end at this discontinuity. After it, the motion is
accurate to the tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.reference.scenes.random_scenes import random_loop, random_tree
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

MASS, SPRING, STIFF, DAMPING, THROWN = 1.0, 40.0, 900.0, 0.8, 1.0
"""Mass, kg; stiffness, N/m, of a spring that is relaxed 1 m outside the stop at 0; stiffness, N/m, and damping, s/m, of the stop;
speed towards the stop, m/s."""
UNTIL = 0.6


def thrown(**stop: float) -> sm.Scene:
    """A block is thrown into a stop. A spring pulls the block out faster than the stop can follow."""
    stops = sm.EndStops(STIFF, **{"lower": 0.0, "damping": DAMPING} | stop)
    joint = sm.Joint("prismatic", "ground", "block", axis="x", spring=sm.Spring(SPRING, rest=1.0), end_stops=stops,
                     start=sm.Start(q=0.02, qd=-8.0 * THROWN))  # fmt: skip
    body = sm.Body(mass=MASS, inertia=(0.1, 0.1, 0.1))
    return sm.Scene({"block": body}, {"slide": joint}, "thrown", gravity=(0.0, 0.0, 0.0))


def pieces() -> tuple[list[float], np.ndarray]:
    """Times at which the block reaches the stop, the stop's force ends, and the block leaves the stop; place and rate at the end.
    ``solve_ivp`` integrates each phase with the force of this phase."""

    def spring(x: float) -> float:
        return -SPRING * (x - 1.0)

    def free(_: float, y: np.ndarray) -> list[float]:
        return [y[1], spring(y[0]) / MASS]

    def pushed(_: float, y: np.ndarray) -> list[float]:
        return [y[1], (spring(y[0]) - STIFF * y[0] * (1.0 - DAMPING * y[1])) / MASS]

    def place(_: float, y: np.ndarray) -> float:
        return y[0]

    def push(_: float, y: np.ndarray) -> float:
        return 1.0 - DAMPING * y[1]

    times, y = [0.0], np.array([0.02, -8.0 * THROWN])
    for force, ends in ((free, place), (pushed, push), (free, place)):
        ends.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(force, (times[-1] + 1e-12, UNTIL), y, "DOP853", rtol=1e-13, atol=1e-13, events=ends)
        times.append(float(found.t_events[0][0]))
        y = found.y_events[0][0]
    last = solve_ivp(free, (times[-1], UNTIL), y, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return times[1:], last


@pytest.mark.default_cases(6)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
@pytest.mark.parametrize("method", ["rk5", "rk8", "rosenbrock"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9])
def test_a_step_ends_where_a_stop_lets_go_and_what_follows_is_right(kernel: str, method: str, rtol: float) -> None:
    (reached, lets_go, left), last = pieces()
    assert reached < lets_go < left < UNTIL
    r = simulate(thrown(), until=UNTIL, every=0, rtol=rtol, method=method, kernel=kernel)
    assert [e.kind for e in r.events] == ["end_stop_engaged", "end_stop_released"]
    assert np.abs([r.events[0].time - reached, r.events[1].time - left]).max() < 20.0 * rtol
    assert np.abs(r.time - lets_go).min() < 20.0 * rtol  # one row for each step
    found = np.array([r["slide.q[1]"][-1], r["slide.qd[1]"][-1]])
    assert np.abs(found - last).max() < 100.0 * rtol * (1.0 + np.abs(last).max())


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(6))
def test_corners_of_any_joint_are_the_same_to_parts_and_to_compiled_kernels(seed: int) -> None:
    """Trees and loop joints, driven or free, with stops whose force ends at small outward rates. Kernels of both kinds take the
    same steps."""
    scene = (random_loop if seed % 2 else random_tree)(f"corners{seed}", devices=1.0, friction=0.0).scene
    joints = {n: replace(j, end_stops=_soon(j.end_stops)) for n, j in scene.joints.items()}
    scene = replace(scene, joints=joints)
    runs = [simulate(scene, until=0.5, every=0, rtol=1e-6, kernel=k, outputs="*.q*") for k in ("parts", "compiled")]
    ends = [r.time for r in runs]
    assert len(ends[0]) == len(ends[1])
    assert np.abs(ends[0] - ends[1]).max() < 1e-7


def _soon(stops: object) -> object:
    if isinstance(stops, tuple):
        return tuple(map(_soon, stops))
    return replace(stops, damping=2.0) if isinstance(stops, sm.EndStops) else stops
