"""The recursion says what one dense solve in absolute coordinates says: tests.reference shares no code with the engine."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
import pytest

from engine.system.spanning import span
from tests.engine.compare import engine_row, motion, reference_motion, results, worst
from tests.reference import solve
from tests.reference.random_parts import RUBBING_TYPES
from tests.reference.random_scenes import ALL_TYPES, Case, random_loop, random_tree
from tests.reference.values import table

TIME = 0.3
"""At this time ramps, tables and harmonic signals all have a value, a rate and an acceleration."""
TOLERANCE = 1e-10
"""Both sides solve to about 1e-14 times the condition of the mechanism (largest difference seen: 8e-13); one dropped velocity term
or a wrong sign shows at 1e-3 and more."""
TREES = tuple((seed, 0) for seed in (*range(19), 62))
LOOPS = (
    (42, 2),
    (1, 2),
    (111, 2),
    (93, 1),
    (109, 2),
    (106, 2),
    (70, 2),
    (3, 2),
    (34, 2),
    (12, 1),
    (18, 1),
    (31, 1),
    (58, 2),
    (88, 1),
    (25, 1),
)
"""(seed, loops); these cut a joint of every type that can be cut, those that rub with every law and the pin on either part."""
CASES = (*TREES, *LOOPS)
WITHOUT = ("angular_acceleration",)
"""The engine has no such column."""


@lru_cache(maxsize=64)
def case_of(seed: int, loops: int) -> Case:
    """The seed's case."""
    return random_loop(seed, loops=loops, t=TIME) if loops else random_tree(seed, t=TIME)


@pytest.mark.parametrize(("seed", "loops"), CASES)
def test_recursion_is_the_dense_solve(seed: int, loops: int) -> None:
    case = case_of(seed, loops)
    state = case.state()
    result = solve(state)
    model, row = engine_row(case)
    free = {(n, q) for n, j in case.scene.joints.items() if j.type == "free" for q in ("reaction.force", "reaction.torque")}
    expected = {k: v for k, v in table(result).items() if k not in free}
    gap, where = worst(expected, results(model, row), WITHOUT)
    assert gap <= TOLERANCE, where
    gap, where = worst(reference_motion(model, state), motion(model, row))
    assert gap <= TOLERANCE, where
    assert row["energy.potential"] == pytest.approx(result.potential, rel=TOLERANCE, abs=TOLERANCE)
    assert row["audit.complement"] <= 1e-12  # Newton's last step is quadratic from 1e-7: round-off is left
    for name, friction in result.friction.items():
        mine = results(model, row)[name, "friction"]
        floor = -1e-14 * np.abs(mine) @ np.abs(state.qd[name])  # round-off of the sum
        assert mine @ state.qd[name] >= floor, name  # on the inboard part, along the rates: takes energy out
        assert friction @ state.qd[name] >= floor, name


def test_random_cases_hold_everything_a_scene_can_say() -> None:
    scenes = [case_of(*c).scene for c in CASES]
    joints = [j for s in scenes for j in s.joints.values()]
    cuts = [s.joints[n] for s in scenes for n in span(s).cut]
    rubbing = [j for j in joints if j.friction]
    assert {j.type for j in joints} == set(ALL_TYPES)
    assert {j.type for j in cuts} == set(ALL_TYPES) - {"screw"}  # a screw is never cut
    for some in (rubbing, [j for j in cuts if j.friction]):
        assert {j.type for j in some} == set(RUBBING_TYPES)
        assert {(j.friction.law, j.friction.normal_force) for j in some} == set(
            product(("regularized", "viscous"), (None, "adams"))
        )
        assert {j.pin for j in some} == {"inboard", "outboard"}
    assert {(j.type, j.pin) for j in rubbing} == set(product(RUBBING_TYPES, ("inboard", "outboard")))
    assert any(j.friction.thrust_radius for j in rubbing)
    for device in ("spring", "damping", "stops", "effort", "drive"):
        assert sum(getattr(j, device) is not None for j in joints) >= 5, device
        assert device == "drive" or any(getattr(j, device) is not None for j in cuts), device  # driven joints are never cut
    drives = [d for j in joints for d in (j.drive if isinstance(j.drive, tuple) else (j.drive,)) if d is not None]
    assert {k for d in drives for k in ("constant", "ramp", "harmonic", "table") if getattr(d, k) is not None} == {
        "constant",
        "ramp",
        "harmonic",
        "table",
    }
    assert {f.type for s in scenes for f in s.forces.values()} == {"force", "torque", "spring_damper"}
    assert {f.frame for s in scenes for f in s.forces.values() if f.type != "spring_damper"} == {"world", "body"}


def test_some_stops_press_and_some_sliding_is_in_the_linear_zone() -> None:
    pressed = linear = saturated = 0
    for c in CASES:
        case = case_of(*c)
        for name, j in case.scene.joints.items():
            stops = j.stops if isinstance(j.stops, tuple) else (j.stops,)
            q = np.atleast_1d(case.state().q[name])
            pressed += sum(
                s is not None and ((s.lower is not None and q[k] < s.lower) or (s.upper is not None and q[k] > s.upper))
                for k, s in enumerate(stops)
                if k < len(q)
            )
            if j.type in ("prismatic", "revolute") and j.friction and j.friction.law == "regularized":
                arm = 1.0 if j.type == "prismatic" else j.friction.radius
                slow = abs(arm * case.qd[name][0]) < j.friction.v_eps
                linear, saturated = linear + slow, saturated + (not slow)
    assert pressed >= 2
    assert linear >= 1
    assert saturated >= 3
