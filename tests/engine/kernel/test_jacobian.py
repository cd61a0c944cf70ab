"""The derivative of the right-hand side is exact in both variants of its code. The multipliers of loops and friction are
eliminated."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.engine.checks.random_scene_properties import Property, both, drives, rubs, some_joint
from tests.engine.checks.right_hand_side import block_after, block_at, differences, rate, time_differences
from tests.engine.mechanisms.redundant_loops import case_of as redundant_case
from tests.engine.mechanisms.redundant_loops import four_bar
from tests.reference.scenes.random_components import RUBBING_TYPES
from tests.reference.scenes.random_scenes import Case, first, random_loop, random_tree
from trunnion.kernel.c_sources import jacobian_source
from trunnion.kernel.compilation import c_compiler
from trunnion.kernel.compilation import library_cache as kernel_cache
from trunnion.kernel.shared_libraries import write_headers
from trunnion.kernel.units import jacobian_unit
from trunnion.scene import load_scene, model_names
from trunnion.simulation.run import simulate
from trunnion.simulation.runtime_interface.simulation_block import Block
from trunnion.system.construction.system_builder import build

TOLERANCE = 1e-8
"""Allowed difference relative to the largest entry of a row, or to 1. Differences of fourth order with steps of 1e-5 lose 11 of 16
digits. They lose more where a sliding speed of millimetres a second is differenced; a missing term causes errors of percents."""
TIMES = {"andrews": 0.01, "cart_pole": 0.1}
"""Times at which models are examined, s. All other models are examined at 0.37 s."""
BALL, CROSS = (lambda j: j.type == "spherical" and rubs(j)), (lambda j: j.type == "universal" and rubs(j))
CASES: dict[str, tuple[int, Property]] = {
    "ball and cross on a loop": (1, lambda c: both(BALL, CROSS)(c) and small(c)),
    "shaft on a loop": (1, lambda c: some_joint(lambda j: j.type == "cylindrical" and rubs(j))(c) and small(c)),
    "driven": (0, lambda c: both(drives, rubs)(c) and small(c)),
    "ball and cross": (0, lambda c: both(BALL, CROSS)(c) and small(c)),
    "table": (0, lambda c: some_joint(lambda j: any(d.table for d in drives(j)))(c) and small(c)),
    "large": (0, lambda c: some_joint(rubs)(c) and large(c)),
}
"""Cases by name: number of loops, and the property that the scene must have."""


SMALL = 14
"""Most states of a case that compiles fast; with 16 states the compilation takes twice as long, with 22 ten times."""


def states(case: Case) -> int:
    """Number of coordinates and rates of the case's system."""
    system = build(case.scene).system
    return system.nq + system.nv


def small(case: Case) -> bool:
    """True if the case's Jacobian is written as a matrix and is small."""
    return states(case) <= SMALL


def large(case: Case) -> bool:
    """True if the case's Jacobian is written direction by direction, as for large systems."""
    return states(case) > jacobian_unit.DENSE_STATES


@cache
def case_of(which: str) -> Case:
    """The first random case with the property."""
    if which == "open reactions":
        return redundant_case("regularized")
    loops, holds = CASES[which]
    return first(which, holds, lambda seed: random_loop(seed, loops=loops, t=0.3) if loops else random_tree(seed, t=0.3))


def check(block: Block) -> None:
    """Check that the Jacobian's columns for the state and for time equal differences, row by row."""
    exact = block.derivatives()
    t = block.time
    for numeric, part in ((differences(block), exact[:, :-1]), (time_differences(block, t)[:, None], exact[:, -1:])):
        size = np.maximum(np.abs(part).max(axis=1, keepdims=True), 1.0) + np.abs(rate(block)[: block.ny])[:, None]
        assert np.all(np.abs(part - numeric) <= TOLERANCE * size)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", model_names())
def test_derivatives_of_every_model_are_those_of_its_right_hand_side(name: str) -> None:
    check(block_after(load_scene(name), TIMES.get(name, 0.37)))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", CASES)
def test_derivatives_of_random_scenes_are_those_of_their_right_hand_side(which: str) -> None:
    check(block_at(case_of(which)))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("law", ["stribeck", "lugre"])
@pytest.mark.parametrize("kind", RUBBING_TYPES)
def test_derivatives_of_every_joint_type_under_laws_that_depend_on_speed_and_state(law: str, kind: str) -> None:
    """Each scene has one joint of the type. The test runs each law and each type with exact contacts and with Adams' normal force.
    The random scenes contain joints that affect each other."""
    adams = (RUBBING_TYPES.index(kind) + (law == "lugre")) % 2
    how = {"types": (kind,), "friction": 1.0, "drives": 0.0, "laws": (law,), "adams": float(adams)}
    case = random_tree(3, 1, t=0.3, **how)
    assert all(map(rubs, case.scene.joints.values()))
    block = block_at(case)
    block.y[block.kernel.sizes["nq"] + block.kernel.sizes["nv"] : block.ny] += 0.05  # bristles are displaced
    check(block)


def test_derivatives_with_friction_that_depends_on_open_reactions() -> None:
    check(block_at(redundant_case("regularized")))


@pytest.mark.slow
def test_the_random_scenes_change_with_time_and_rub_on_loops() -> None:
    moving = [which for which in CASES if np.abs(block_at(case_of(which)).derivatives()[:, -1]).max() > 1e-2]
    assert len(moving) >= 3
    assert sum(j.friction is not None for w in CASES for j in case_of(w).scene.joints.values()) >= 6
    assert block_at(case_of("large")).ny > jacobian_unit.DENSE_STATES >= block_at(case_of("table")).ny


def test_the_stiff_method_keeps_its_order_with_friction_that_depends_on_open_reactions() -> None:
    """The number of steps grows as the fifth root of the tolerance. With an incomplete Jacobian, it would grow as the square root:
    77 and 6435 steps."""
    loose, tight = (simulate(four_bar(), until=1.0, rtol=r, method="rosenbrock").stats.steps for r in (1e-6, 1e-10))
    assert tight <= 10 * loose


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", ["ball and cross on a loop", "shaft on a loop", "table", "open reactions"])
@pytest.mark.slow
def test_dense_and_directional_code_agree(which: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    dense = block_at(case_of(which))
    assert dense.ny <= jacobian_unit.DENSE_STATES
    expected = dense.derivatives()
    monkeypatch.setattr(jacobian_unit, "DENSE_STATES", 0)
    other = block_at(case_of(which))
    system, parameters, _, redundant = other.kernel.structure
    text = jacobian_source(system, parameters, redundant)
    assert "j_along" in text
    source, library = tmp_path / "jacobian.c", tmp_path / f"jacobian{c_compiler.library_suffix()}"
    source.write_text(text)
    write_headers(tmp_path)
    c_compiler.build_library([source], library, [tmp_path], kernel_cache.cache_folder(), c_compiler.unit_flags("jacobian", text))
    other.kernel.libraries["jacobian"] = ctypes.CDLL(str(library))
    got = other.derivatives()
    size = np.maximum(np.abs(expected).max(axis=1, keepdims=True), 1.0)
    assert np.all(np.abs(got - expected) <= 1e-12 * size)  # the sums are computed in a different order
