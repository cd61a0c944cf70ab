"""The advice warns about gear units, worms, curves, attracting points and jumps, and reports the effect of their friction."""

from __future__ import annotations

import numpy as np
import pytest

from tests.stability.entries.gear_units_and_loads import coils, elbow, flyby, pulse, winch, worm
from tests.stability.entries.loads_and_starts import hill, valve
from trunnion.analysis.advice.device_cautions import CURVES, FIELDS, JUMPS, LOCKS, PASSAGE, device_cautions
from trunnion.analysis.advice.friction_influence import rank_influences
from trunnion.analysis.work_precision.error_measure import make_error_measure
from trunnion.scene.data_classes import scene as sm


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (winch(1.0, driven=0.0), [f"unit: {LOCKS}"]),
        (winch(1.0), []),
        (worm(1e-6), [f"mesh: {LOCKS}"]),
        (worm(-1e-6), []),
        (coils(0.0), [f"guide: {CURVES}"]),
        (flyby(0.0), [f"sun: {PASSAGE}"]),
        (hill(0.0), [f"hill: {FIELDS}"]),
        (valve(0.0), [f"guide: {CURVES}"]),
        (pulse(0.0), [f"guide: {JUMPS}"]),
        (elbow(40.0), []),
    ],
)
def test_each_device_with_a_weakness_is_named_with_it(scene: sm.Scene, said: list[str]) -> None:
    assert device_cautions(scene) == said


def test_the_influence_of_given_friction_is_the_change_without_it() -> None:
    """A motor lifts a load by a gear unit. The influence of its friction is the change of the result without this friction."""
    scene = winch(5.0)
    what = make_error_measure(scene, ("bearing.q[1]",), "rms")
    (unit,), note = rank_influences(scene, ["unit"], what, 0.05, 20)
    t = np.linspace(0.0, 0.05, 21)[:, None]
    loss, carried = 1 / 0.9 - 1, 0.1 / 0.9 + 50.0**2 * 1e-3  # balance of torques: i (T_m - T_0) = T/0.9 + (J_out/0.9 + i^2 J_in) a
    a = (50.0 * (5.0 - 0.2) - 98.1 / 0.9) / carried
    change = -(50.0 * 0.2 + loss * (98.1 + 0.1 * a)) / carried  # derivative of a with respect to a common factor of all friction
    assert note == ""
    assert unit.predicted == pytest.approx(what.error((a - change) * t**2 / 2, a * t**2 / 2), rel=1e-6)
