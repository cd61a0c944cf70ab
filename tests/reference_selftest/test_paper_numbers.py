"""Reference numbers that need no long run (theory, "Reference numbers"): F1 (first stop), F2, F4, the start of 8.3."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.reference import NoRoot, every_root, forward, solve, solve_scene
from tests.reference.scenes.paper_examples import ball_pendulum, double_pendulum, pendulum_start, slider_crank, slider_crank_state

F2 = [(0.0, -4680.6, -369.147681, 13.4913692), (0.05, -3682.15986, 1368.19074, 11.2874138)]
F2 += [(0.1, -1078.24889, 1037.43376, 4.29956317)]


@pytest.mark.parametrize(("t", "along", "across", "torque"), F2)
def test_f2_slider_pin(t, along, across, torque):
    result = solve_scene(slider_crank(), *slider_crank_state(t), t)
    force, moment = result.reaction["pin"]
    assert force[1:] == pytest.approx([along, across], abs=6e-6)
    assert abs(moment[0]) == pytest.approx(torque, abs=6e-8)
    assert result.friction["pin"] == pytest.approx([moment[0]])
    f1, f2 = (c.normal_force for c in result.contacts["pin"])
    assert f1 == pytest.approx(f2)
    if t == 0:
        assert f1 == pytest.approx(2248.5615, rel=1e-7)
    assert (result.rows - 1, result.rank - 1) == (18, 17)
    assert "pin" in result.not_unique


def test_f4_acceleration():
    scene = ball_pendulum(radius=0.0257 * np.sqrt(1.36) / 0.6, law="coulomb")
    result = solve_scene(scene, *pendulum_start(np.pi / 3, 2.0))
    assert -result.qdd["ball"][1] == pytest.approx(-13.261857, abs=5e-7)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("R", "counts"), [(0.6, {1}), (0.66, {1}), (0.675, {0, 2})])
def test_f4_root_count_on_both_sides_of_the_painleve_threshold(R, counts):
    scene = ball_pendulum(radius=R * np.sqrt(1.36) / 0.6, law="coulomb")
    for angle, rate in ((0.4, 1.0), (-1.2, 3.0)):
        state = forward(scene, *pendulum_start(angle, rate))
        assert len(every_root(state, starts=25, spread=20.0)) in counts


@pytest.mark.slow
def test_f1_first_stop():
    scene = ball_pendulum(law="coulomb")

    def rate(t, y):
        return [y[1], -solve_scene(scene, *pendulum_start(*y)).qdd["ball"][1]]

    def stop(t, y):
        return y[1]

    stop.terminal, stop.direction = True, 1
    run = solve_ivp(rate, (0, 2), [np.pi / 2, -1e-9], "LSODA", events=stop, rtol=1e-9, atol=1e-10)
    assert run.t_events[0][0] == pytest.approx(0.944980, abs=1e-6)
    assert np.degrees(run.y_events[0][0][0]) == pytest.approx(-76.609899, abs=1e-5)


def test_8_3_starts_with_the_paper_guide_and_jams_with_half_of_it():
    start = {"shaft": (0, 0), "cross": (0, 0)}, {"shaft": (10, 0), "cross": (0, 0)}
    result = solve(forward(double_pendulum(), *start))
    assert result.power["friction"] < 0
    assert result.qdd["shaft"][0] < 0
    with pytest.raises(NoRoot):
        solve(forward(double_pendulum(c=0.15), *start))
