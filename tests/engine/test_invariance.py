"""How a mechanism is told does not change what the engine finds: order, sides, world axes, body frames, units."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from engine.system.build import build
from engine.system.spanning import span
from tests.engine.compare import engine_table, worst
from tests.reference.random_scenes import ALL_TYPES, Case, random_loop, random_tree
from tests.reference.reversal import reversed_joint
from tests.reference.transforms import reframed, rotated, shuffled
from tests.reference.units import rescaled
from tests.reference.values import Moved

TOLERANCE = 1e-10
"""Round-off of both tellings times the condition of the mechanism: 1e-12 at most here."""
TIME = 0.3
CASES = {"screw and universal": (6, 0), "shaft and ball": (16, 0), "journal in a loop": (93, 1), "two loops": (42, 2)}
WAYS = {
    "order": lambda case: shuffled(case, 3),
    "world axes": lambda case: rotated(case, 4),
    "body frames": lambda case: reframed(case, 5),
    "units": lambda case: rescaled(case, 1000.0, 1e-3, 2.0),
}


@lru_cache(maxsize=16)
def case_of(seed: int, loops: int) -> Case:
    return random_loop(seed, loops=loops, t=TIME) if loops else random_tree(seed, t=TIME)


def difference(case: Case, moved: Moved) -> tuple[float, tuple[str, str] | None]:
    """Of the engine's results for the case and for its other telling, brought back."""
    back = moved.back(engine_table(moved.case))
    return worst({k: v for k, v in engine_table(case).items() if k in back}, back)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("which", CASES)
def test_results_do_not_depend_on(way: str, which: str) -> None:
    case = case_of(*CASES[which])
    gap, where = difference(case, WAYS[way](case))
    assert gap <= TOLERANCE, where


@pytest.mark.parametrize("kind", [k for k in ALL_TYPES if k != "free"])
def test_results_do_not_depend_on_the_side_a_joint_is_told_from(kind: str) -> None:
    quaternion = kind in ("planar", "spherical")  # their devices cannot be said from the other side
    case = random_tree(11, 2, types=(kind,), friction=1.0, devices=0.0 if quaternion else 0.6, drives=0.0, t=TIME)
    gap, where = difference(case, reversed_joint(case, "j2"))
    assert gap <= TOLERANCE, where


def test_results_do_not_depend_on_the_side_a_free_body_is_told_from() -> None:
    case = random_tree(11, 2, types=("free",), devices=0.0, drives=0.0, t=TIME)
    gap, where = difference(case, reversed_joint(case, "j1"))
    assert gap <= TOLERANCE, where


def cut_at(case: Case, name: str) -> Case:
    """The case with its loop opened at this joint."""
    joints = {n: replace(j, cut=n == name) for n, j in case.scene.joints.items()}
    return replace(case, scene=replace(case.scene, joints=joints))


@pytest.mark.parametrize("seed", [93, 12, 18, 25])
def test_results_do_not_depend_on_the_side_a_cut_joint_is_told_from(seed: int) -> None:
    (name,) = span(case_of(seed, 1).scene).cut
    case = cut_at(case_of(seed, 1), name)
    moved = reversed_joint(case, name)
    assert span(moved.case.scene).cut == (name,)
    gap, where = difference(case, moved)
    assert gap <= TOLERANCE, where


def test_results_do_not_depend_on_which_joint_is_cut() -> None:
    case = case_of(31, 1)
    assert sum(j.friction is not None for j in case.scene.joints.values()) == 3
    for name in case.scene.joints:
        moved = cut_at(case, name)
        assert span(moved.scene).cut == (name,)
        gap, where = difference(case, Moved(moved, lambda t: t))
        assert gap <= TOLERANCE, (name, where)


def test_other_units_are_other_parameters_of_the_same_structure() -> None:
    """So a change of numbers alone never compiles anything."""
    case = case_of(*CASES["journal in a loop"])
    base, moved = build(case.scene), build(rescaled(case, 1000.0, 1e-3, 2.0).case.scene)
    assert base.system == moved.system
    assert repr(base.system) == repr(moved.system)  # the kernel's key
    assert not np.allclose(base.parameters.values, moved.parameters.values)
