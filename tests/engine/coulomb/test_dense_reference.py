"""Sliding with dry friction agrees with one dense solve in absolute coordinates. A joint that sticks acts like a locked joint."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import cycle, product

import numpy as np
import pytest

from tests.engine.checks.random_scene_properties import rubs, some_cut
from tests.engine.checks.reference_comparison import engine_table, take, worst
from tests.reference import solve
from tests.reference.scenes.random_components import RUBBING_TYPES
from tests.reference.scenes.random_scenes import USUAL_TYPES, Case, first, random_loop, random_tree
from tests.reference.scenes.result_table import table
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.elements.joints import REGISTRY
from trunnion.simulation.run import Model
from trunnion.system.construction.system_builder import build

TOLERANCE = 1e-9
"""Required agreement. Both sides solve to about 1e-13 times the condition of the mechanism."""


def dry(case: Case, normal_forces: tuple[str, ...] = ("exact",)) -> Case:
    """The case with dry friction in every joint that has friction. Normal forces of the given kinds are used in turn."""
    joints, forces = {}, cycle(normal_forces)
    for name, j in case.scene.joints.items():
        force = next(forces)
        rub = j.friction and replace(j.friction, law="coulomb", mu=j.friction.mu or 0.3, viscosity=None, normal_force=force)
        joints[name] = replace(j, friction=rub)
    return replace(case, scene=replace(case.scene, joints=joints))


def sliding_speeds(case: Case) -> list[float]:
    """Largest rate of every joint with friction (m/s, rad/s). A joint that its loop does not let move is at rest, and sticks."""
    return [float(np.abs(case.qd[n]).max()) for n, j in case.scene.joints.items() if rubs(j)]


def compared(case: Case, here: Case) -> None:
    """All quantities of the case that the engine and the reference give (free joints have no reaction columns)."""
    free = {n for n, j in case.scene.joints.items() if REGISTRY[j.type].nv == 6}
    expected = {k: v for k, v in table(solve(case.state())).items() if k[0] not in free or k[1] == "qdd"}
    gap, where = worst(expected, engine_table(here), ("angular_acceleration",))
    assert gap <= TOLERANCE, where


@lru_cache(maxsize=12)
def sliding_tree(seed: int) -> Case:
    """Three bodies whose joints have exact contacts or Adams' normal force, both kinds in one tree. In every other tree all joints
    have friction."""
    types = USUAL_TYPES if seed % 2 else RUBBING_TYPES
    turn = ("adams", "exact") if seed // 2 % 2 else ("exact", "adams")
    return dry(random_tree(seed, 3, types=types, friction=1.0, drives=0.0, t=0.3, laws=("regularized",)), turn)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(12))
def test_a_sliding_tree_accelerates_as_the_dense_solve_says(seed: int) -> None:
    compared(sliding_tree(seed), sliding_tree(seed))


def test_the_sliding_trees_have_every_joint_with_either_normal_force() -> None:
    joints = [j for seed in range(12) for j in sliding_tree(seed).scene.joints.values() if j.friction]
    assert {(j.type, j.friction.normal_force) for j in joints} == set(product(RUBBING_TYPES, ("exact", "adams")))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kind", ["revolute", "cylindrical", "universal"])
def test_a_sliding_loop_accelerates_as_the_dense_solve_says(kind: str) -> None:
    """The loop is cut at a joint of the type that has friction; other joints of the loop have friction, too."""
    case = first(
        f"a loop cut at a {kind} joint that rubs, others on it rubbing too, all of them sliding",
        lambda c: some_cut(lambda j: j.type == kind and rubs(j))(c) and len(slides := sliding_speeds(c)) > 1 and min(slides) > 0.1,
        lambda seed: random_loop(f"{kind}{seed}", t=0.3, closing=(kind,), cut=True, friction=0.8, laws=("regularized",)),
    )
    case = dry(case)
    tree = [j.name for j in build(case.scene).system.tree]
    here = replace(case, q={n: case.q[n] for n in tree}, qd={n: case.qd[n] for n in tree})
    compared(case, here)


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(6))
def test_a_joint_that_sticks_is_one_that_is_locked(seed: int) -> None:
    """The journal is wide enough to hold any load (its friction is at most r |F|). One joint is at rest. The other joints
    accelerate as if this joint were fixed."""
    from tests.engine.coulomb.test_random_chains import chain

    scene = chain((40, 41, 42, 43, 44, 47)[seed])
    joints = {n: replace(j, friction=None) for n, j in scene.joints.items()}
    name = next((n for n, j in scene.joints.items() if j.type == "revolute"), "")
    if not name:
        pytest.skip("balls only")
    stuck = scene.joints[name]
    assert stuck.start is not None
    rub = replace(stuck.friction, mu=0.1, mu_static=10.0, radius=5.0)
    joints[name] = replace(stuck, friction=rub, start=replace(stuck.start, qd=0.0))
    held = replace(scene, joints=joints)
    locked = replace(joints[name], friction=None, drive={"constant": {"rate": 0.0, "start": stuck.start.q}}, start=None)
    fixed = replace(scene, joints={**joints, name: locked})
    got, expected = (evaluate(Model(s, ("*",)), {}, {}) for s in (held, fixed))
    for n in joints:
        a, b = take(got, f"{n}.qdd"), take(expected, f"{n}.qdd")
        assert a == pytest.approx(b, rel=1e-9, abs=1e-9 * max(1.0, float(np.abs(b).max())))
