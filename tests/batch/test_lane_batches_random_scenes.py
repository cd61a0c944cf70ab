"""Random mechanisms move in the same way whether they are stepped together in SIMD lanes or alone: trees and loops, every method,
with and without friction."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pyarrow
import pytest

from tests.default_case_selection import slow
from tests.reference.scenes.random_scenes import random_loop, random_tree
from trunnion.batch.plan_and_runner import Plan, Runner, plan
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.settings.run_settings import Run

DIGITS = 1e-9
"""Allowed difference relative to the largest value of its kind over all bodies, after a third of a second at equal steps. Sums
rounded in another order cause this difference (measured, column by column: 5e-13 in trees, 3e-11 in loops)."""
AS_ONE_DIGIT = 30.0
"""Allowed difference where joints have friction, in multiples of the effect of one unit in the last place of the swept value. Near
a ball's friction cone, friction keeps half of its digits, and the direction of slow sliding turns fast. Round-off therefore grows
near a cone in any computation (measured: 0.1 to 5)."""
CASES = 21
KEPT = ("final:*.position[*]", "max:*.acceleration[*]")


def without_tables(scene: sm.Scene) -> sm.Scene:
    """The scene without devices that follow tables and inputs. Springs, dampers, stops and drives by formula stay."""
    drives = {n: j.drive if isinstance(j.drive, tuple) else (j.drive,) for n, j in scene.joints.items()}
    kept = {n: None if any(d is not None and d.table is not None for d in drives[n]) else j.drive for n, j in scene.joints.items()}
    joints = {n: replace(j, effort=None, drive=kept[n]) for n, j in scene.joints.items()}
    return replace(scene, inputs={}, joints=joints, forces={n: f for n, f in scene.forces.items() if f.type == "spring_damper"})


def given(kind: str, seed: int) -> sm.Scene:
    if kind == "tree":
        return without_tables(random_tree(f"lanes{seed}", 1 + seed % 5, friction=0.0, drives=0.3, devices=0.7).scene)
    return without_tables(random_loop(seed, loops=1 + seed % 2, friction=0.0).scene)


@cache
def planned(kind: str, seed: int, kernel: str, method: str = "auto") -> Plan:
    return plan(
        given(kind, seed),
        {"gravity[1]": f"-5.1:5:{CASES}"},
        keep=KEPT,
        run=Run(until=0.3, every=0.05, kernel=kernel, method=method),
    )


def numbers(table: pyarrow.Table, of: str) -> np.ndarray:
    return np.column_stack([table.column(n).to_numpy() for n in table.column_names if n.startswith(of)])


def holds(kind: str, seed: int, method: str) -> None:
    """Cases in lanes agree with cases alone to DIGITS digits. No bit depends on the division into chunks."""
    runners = {k: Runner(planned(kind, seed, k, method)) for k in ("lanes", "compiled")}
    together, alone = (r.chunk(0, CASES) for r in runners.values())
    with_lanes = runners["lanes"].loops[0].together
    assert with_lanes is not None, "it has no lanes"
    assert method == "rosenbrock" or with_lanes.all.asked > CASES
    assert method != "rosenbrock" or with_lanes.batches[0].variant[0].j, "nobody asked for the Jacobian unit"
    assert together.column("outcome") == alone.column("outcome")
    assert together.column("steps") == alone.column("steps")
    for of in ("final:", "max:"):
        a, b = numbers(together, of), numbers(alone, of)
        assert np.nanmax(np.abs(a - b)) <= DIGITS * max(1.0, np.nanmax(np.abs(b)))
        assert np.array_equal(np.isnan(a), np.isnan(b))
    assert runners["lanes"].chunk(5, 12).equals(together.slice(5, 7))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("kind", "seed", "method"), [("loop", 11, "auto"), ("tree", 1, "auto"), ("tree", 1, "rosenbrock")])
def test_random_mechanisms_step_together_as_alone(kind: str, seed: int, method: str) -> None:
    """In the loop, pivots of the factorisation change places after the first step."""
    holds(kind, seed, method)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["auto", "rosenbrock"])
@pytest.mark.parametrize("kind", ["tree", "loop"])
def test_many_random_mechanisms_step_together_as_alone(kind: str, method: str) -> None:
    """``python -m pytest tests/batch/test_lane_batches_random_scenes.py -m slow -n 2``"""
    wrong = {}
    for seed in range(60 if method == "auto" else 12):
        try:
            holds(kind, seed, method)
        except AssertionError as e:
            wrong[seed] = str(e)[:300]
    assert not wrong


LAWS = ("coulomb", "regularized", "viscous")


def rubbing(kind: str, seed: int) -> sm.Scene:
    if kind == "tree":
        return without_tables(random_tree(f"rubbing{seed}", 1 + seed % 4, friction=0.7, drives=0.2, devices=0.5, laws=LAWS).scene)
    return without_tables(random_loop(f"rubbing{seed}", loops=1, friction=0.5, laws=LAWS).scene)


def swept(scene: sm.Scene, kernel: str, part: float = 0.0) -> tuple[Runner, pyarrow.Table]:
    """Cases with many values of gravity, each changed by a relative amount."""
    cases = [{"gravity[1]": float(g) * (1.0 + part)} for g in np.linspace(-5.1, 5.0, CASES)]
    made = Runner(plan(scene, cases=cases, keep=(*KEPT, "count:any"), run=Run(until=0.3, every=0.05, kernel=kernel)))
    return made, made.chunk(0, CASES)


def rubs_alike(kind: str, seed: int) -> None:
    """Cases in lanes agree with cases alone, up to the effect of one lost digit. No bit depends on the division into chunks."""
    scene = rubbing(kind, seed)
    (runner, together), (_, alone) = swept(scene, "lanes"), swept(scene, "compiled")
    others = [swept(scene, "compiled", part)[1] for part in (2.0**-52, -(2.0**-52))]
    assert together.column("outcome") == alone.column("outcome")
    if not runner.loops:
        return  # no case of this scene can run
    with_lanes = runner.loops[0].together
    assert with_lanes is not None, "it has no lanes"
    assert with_lanes.all.asked > CASES
    for name in ("steps", "count:any"):
        assert together.column(name) == alone.column(name) or any(o.column(name) != alone.column(name) for o in others)
    for of in ("final:", "max:"):
        a, b = numbers(together, of), numbers(alone, of)
        digit = max(np.nanmax(np.abs(numbers(o, of) - b)) for o in others)
        assert np.nanmax(np.abs(a - b)) <= max(DIGITS * max(1.0, np.nanmax(np.abs(b))), AS_ONE_DIGIT * digit)
        assert np.array_equal(np.isnan(a), np.isnan(b))
    assert runner.chunk(5, 12).equals(together.slice(5, 7))


@pytest.mark.slow
@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("kind", "seed"), [("tree", 3), slow(("tree", 6)), ("loop", 1)])
def test_random_mechanisms_that_rub_step_together_as_alone(kind: str, seed: int) -> None:
    rubs_alike(kind, seed)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tree", "loop"])
def test_many_random_mechanisms_that_rub_step_together_as_alone(kind: str) -> None:
    """``python -m pytest tests/batch/test_lane_batches_random_scenes.py -m slow -n 2``"""
    wrong = {}
    for seed in range(40 if kind == "tree" else 24):
        try:
            rubs_alike(kind, seed)
        except AssertionError as e:
            wrong[seed] = str(e)[:300]
    assert not wrong
