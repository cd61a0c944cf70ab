"""A brake fades until a drive with a gear unit slips. A balance by hand gives the instant of slip."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.reference.compliant.runs_and_limit import judged
from trunnion import scene_from_dict, simulate

FADED = 0.1
"""Time at which the brake of the motor's shaft has faded, s."""


def braked_feed(seed: int) -> tuple[dict[str, Any], float, float]:
    """A torque turns a gear unit. The output of the gear unit moves a slide with friction by a rod. A brake on the motor's shaft
    fades. Also returns the times at which the shaft's balance fails, for the unit's friction at rest and for its friction in
    motion."""
    rng = np.random.default_rng([37, seed])
    ratio, efficiency, static = rng.uniform(4, 10), rng.uniform(0.57, 0.7), rng.uniform(1.15, 1.3)
    angle, radius, reach, rub, pin = rng.uniform(0.5, 2.6), 0.03, 0.25, rng.uniform(0.5, 1.5), rng.uniform(0.005, 0.02)
    end = radius * np.array([math.cos(angle), math.sin(angle), 0.0])
    rod = np.array([reach, 0.0, 0.0]) - end
    turned = rub * abs(np.cross(end, rod)[2] / rod[0]) + pin  # torque at the output that overcomes slide and pin
    moving, resting = (turned * (1 + more * (1 / efficiency - 1)) / ratio for more in (1.0, static))
    torque, start = 1.5 * resting, rng.uniform(0.7, 0.9) * resting  # the brake's torque falls linearly from `start` to 0.4 resting
    at_rest, in_motion = (FADED * (start - (torque - carried)) / (start - 0.4 * resting) for carried in (resting, moving))
    bodies = {
        "rotor": {"mass": 0.6, "inertia": [1e-4] * 3, "position": [0, 0, -0.1]},
        "output": {"mass": 1.2, "inertia": [4e-4] * 3, "position": [0, 0, 0]},
        "slide": {"mass": 1.1, "inertia": [5e-4] * 3, "position": [reach, 0, 0]},
    }  # fmt: skip
    brake = {"ramp": {"start": start, "end": 0.4 * resting, "duration": FADED}}
    place = {"inboard": "ground", "axis": "z"}
    joints = {
        "motor": place | {"type": "revolute", "outboard": "rotor", "at": [0, 0, -0.1], "effort": torque,
                          "friction": {"torque": brake}},
        "hub": place | {"type": "revolute", "outboard": "output", "at": [0, 0, 0], "friction": {"torque": pin}},
        "unit": {"type": "gearbox", "inboard": "rotor", "outboard": "output", "ratio": ratio,
                 "friction": {"efficiency": efficiency, "mu_static": static}},
        "link": {"type": "rod", "inboard": {"body": "output", "point": end.tolist()}, "outboard": "slide"},
        "rail": place | {"type": "prismatic", "axis": "x", "outboard": "slide", "at": [reach, 0, 0], "friction": {"force": rub}},
    }  # fmt: skip
    return {"schema": 1, "gravity": [0, 0, 0], "bodies": bodies, "joints": joints}, at_rest, in_motion


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(6))
def test_a_drive_at_rest_slips_where_the_unit_carries_no_more_with_its_friction_at_rest(seed: int) -> None:
    data, at_rest, _ = braked_feed(seed)
    run = simulate(scene_from_dict(data), until=FADED, every=FADED, kernel="parts")
    slips = {e.joint: e.time for e in run.events if e.kind == "slip"}
    assert slips == pytest.approx(dict.fromkeys(("motor", "hub", "unit", "rail"), at_rest), rel=1e-8)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(6))
def test_the_compliant_model_of_such_a_drive_rests_as_long(seed: int) -> None:
    """The springs carry no load at the start and must not turn the unit for a moment. Otherwise the unit would keep its friction of
    motion."""
    data, at_rest, in_motion = braked_feed(seed)
    assert in_motion < at_rest - 0.005
    model = judged(scene_from_dict(data), 0.98 * at_rest, ["motor.q[*"], instants=1, rtol=1e-5, levels=2)
    assert abs(model.values["motor.q[1]"][-1]) < 1e-5  # the creep of each level is in proportion to its speeds of rest
