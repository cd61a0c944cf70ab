"""Results do not depend on the description of a mechanism: order, sides, world axes, body frames, units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.engine.checks.random_scene_properties import Property, both, rubs, some_cut, some_joint
from tests.engine.checks.reference_comparison import engine_table, worst
from tests.reference.mechanics.joint_constraints import of
from tests.reference.scenes.frame_changes import reframed, rotated, shuffled
from tests.reference.scenes.joint_side_swap import swap_joint_sides
from tests.reference.scenes.random_components import RUBBING_TYPES
from tests.reference.scenes.random_scenes import ALL_TYPES, Case, _started, first, random_loop, random_tree
from tests.reference.scenes.result_table import Moved
from tests.reference.scenes.unit_changes import rescaled
from trunnion.elements.joints import REGISTRY
from trunnion.system.construction.spanning_tree import span
from trunnion.system.construction.system_builder import build

TOLERANCE = 1e-10
"""Round-off of both descriptions times the condition of the mechanism: at most 1e-12 here."""
TIME = 0.3
CASES: dict[str, tuple[int, Property]] = {
    "screw and universal": (0, both(lambda j: j.type == "screw", lambda j: j.type == "universal" and rubs(j))),
    "shaft and ball": (0, both(lambda j: j.type == "cylindrical" and rubs(j), lambda j: j.type == "spherical" and rubs(j))),
    "journal in a loop": (1, some_joint(lambda j: j.type == "revolute" and rubs(j))),
    "two loops": (2, some_cut(rubs)),
}
"""Cases by name: number of loops, and the property that the scene must have."""
TWO_SIDED = tuple(k for k in ALL_TYPES if not of(k).one_sided)
"""Types whose meaning does not change when their sides change places."""


def told(case: Case, *ways: Callable[[Case], Moved]) -> Moved:
    """The case with changed order, frame, side and unit, and the map of its results back."""
    if not ways:
        return Moved(case, lambda table: table)
    first_way, *others = ways
    moved = first_way(case)
    further = told(moved.case, *others)
    return Moved(further.case, lambda table: moved.back(further.back(table)))


WAYS: dict[str, Callable[[Case], Moved]] = {
    "order": lambda case: shuffled(case, 3),
    "world axes, body frames and units": lambda case: told(
        case, lambda c: rotated(c, 4), lambda c: reframed(c, 5), lambda c: rescaled(c, 1000.0, 1e-3, 2.0)
    ),
}
"""Other descriptions by name. The order of names does not change the kernel. The other three descriptions are applied together,
which gives only one new kernel. Each of them changes every vector, so that none can hide a dependence on another."""


@cache
def case_of(which: str) -> Case:
    """The first random case with the property."""
    loops, holds = CASES[which]
    n = 3 + (loops > 1)
    return first(which, holds, lambda seed: random_loop(seed, loops, n, t=TIME) if loops else random_tree(seed, n, t=TIME))


def difference(case: Case, moved: Moved) -> tuple[float, tuple[str, str] | None]:
    """(largest difference, its place) between the engine's results for the case and those for its other description, mapped
    back."""
    back = moved.back(engine_table(moved.case))
    return worst({k: v for k, v in engine_table(case).items() if k in back}, back)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("which", CASES)
def test_results_do_not_depend_on(way: str, which: str) -> None:
    case = case_of(which)
    gap, where = difference(case, WAYS[way](case))
    assert gap <= TOLERANCE, where


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", [k for k in TWO_SIDED if REGISTRY[k].nv < 6])
def test_results_do_not_depend_on_the_side_a_joint_is_described_from(kind: str) -> None:
    devices = 0.6 if of(kind).swaps_by_sign else 0.0  # devices of other types cannot be described from the other side
    case = random_tree(11, 2, types=(kind,), friction=1.0, devices=devices, drives=0.0, t=TIME)
    gap, where = difference(case, swap_joint_sides(case, "j2"))
    assert gap <= TOLERANCE, where


def test_results_do_not_depend_on_the_side_a_free_body_is_described_from() -> None:
    case = random_tree(11, 2, types=("free",), devices=0.0, drives=0.0, t=TIME)
    gap, where = difference(case, swap_joint_sides(case, "j1"))
    assert gap <= TOLERANCE, where


def cut_at(case: Case, name: str) -> Case:
    """The case with its loop cut at this joint."""
    joints = {n: replace(j, cut=n == name) for n, j in case.scene.joints.items()}
    return replace(case, scene=replace(case.scene, joints=joints))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", [k for k in TWO_SIDED if REGISTRY[k].cuttable and REGISTRY[k].nv < 6])
def test_results_do_not_depend_on_the_side_a_cut_joint_is_described_from(kind: str) -> None:
    devices = 0.6 if of(kind).swaps_by_sign else 0.0
    case = first(
        f"a loop cut at a joint of type {kind}",
        some_cut(lambda j: j.type == kind),
        lambda seed: random_loop(f"{kind}{seed}", bodies=2, t=TIME, closing=(kind,), cut=True, friction=1.0, devices=devices),
    )
    (name,) = span(case.scene).cut
    case = cut_at(case, name)
    moved = swap_joint_sides(case, name)
    assert span(moved.case.scene).cut == (name,)
    gap, where = difference(case, moved)
    assert gap <= TOLERANCE, where


def test_results_do_not_depend_on_which_joint_is_cut() -> None:
    case = first(
        "a loop of three joints that rub, each of which can be cut",
        lambda c: all(map(rubs, c.scene.joints.values())) and all(span(cut_at(c, n).scene).cut == (n,) for n in c.scene.joints),
        lambda seed: random_loop(seed, bodies=2, types=RUBBING_TYPES, closing=RUBBING_TYPES, friction=1.0, drives=0.0, t=TIME),
    )
    assert len(case.scene.joints) == 3
    for name in case.scene.joints:
        moved = cut_at(case, name)
        assert span(moved.scene).cut == (name,)
        gap, where = difference(case, Moved(moved, lambda t: t))
        assert gap <= TOLERANCE, (name, where)


@pytest.mark.slow
def test_other_units_are_other_parameters_of_the_same_structure() -> None:
    """A change of numbers alone never causes a compilation."""
    loops, holds = CASES["journal in a loop"]
    what = "a journal in a loop, and no input (which becomes a number in other units)"
    case = first(what, lambda c: holds(c) and "FromInput" not in repr(c.scene), lambda s: random_loop(s, loops=loops, t=TIME))
    base, moved = build(case.scene), build(rescaled(case, 1000.0, 1e-3, 2.0).case.scene)
    assert base.system == moved.system
    assert repr(base.system) == repr(moved.system)  # the key of the kernel is made from this text
    assert not np.allclose(base.parameters.values, moved.parameters.values)


@pytest.mark.parametrize("fast", ["prismatic", "revolute"])
def test_scales_of_tolerances_follow_the_units_of_the_scene(fast: str) -> None:
    """The start rate of a travel or an angle is so large that it determines the scale of rates."""
    case = random_tree(1, 2, types=(fast,), friction=0.0, devices=0.0, drives=0.0)
    scene = replace(case.scene, joints={n: _started(j, case.q[n], 1e3 * case.qd[n]) for n, j in case.scene.joints.items()})
    case = Case(scene, case.q, {n: 1e3 * x for n, x in case.qd.items()}, tree=case.tree)
    slow = replace(scene, joints={n: replace(j, start=None) for n, j in scene.joints.items()})
    was, now = build(scene).numbers, build(rescaled(case, 100.0, 3.0, 10.0).case.scene).numbers
    assert was.rate > 10.0 * build(slow).numbers.rate
    assert (now.length, now.rate, now.energy) == pytest.approx((was.length * 100.0, was.rate / 10.0, was.energy * 300.0), rel=1e-12)
