"""The motion is bit-identical for every choice of columns. Works are as precise as the tolerance."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.benchmarks.speed.parts_kernel import chain
from tests.default_case_selection import crossed, sampled
from tests.reference.scenes.random_scenes import random_loop, random_tree
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, simulate

MOTION = ["*.q[*]", "*.qd[*]"]
ASKED = ([], ["energy.*"], ["audit.*"])
"""Columns in addition to the columns of the motion: none, works, and columns that need the multipliers in every row."""
LAWS = ("coulomb", "regularized", "viscous", "lugre", "stribeck")
TREES = (0, 16, 20, 22)
"""Seeds of trees with stops, drives, loads, a LuGre pair alone, balls under three laws, and a reversal inside a regularised law's
zone."""
LOOPS = (0, 7, 15)
"""Seeds of loops: with friction on the loop under a law with states, with a coordinate measured across the cut, without
friction."""
TURNED = 4
"""Seed of a loop with dry friction whose loads jump while pairs are at rest."""
NOISE = 1e-9
"""Allowed difference of a work between both runs, relative to the energy converted, in addition to the tolerance: the summed
round-off of a long run."""


def told(r: Result) -> list[tuple]:
    """The events of a run."""
    return [(e.kind, e.joint, e.time, e.margin) for e in r.events]


def same(one: Result, other: Result) -> None:
    """Check that two runs with different columns have the same motion to the last bit."""
    assert (other.outcome.name, other.stats.steps, other.stats.rejected) == (one.outcome.name, one.stats.steps, one.stats.rejected)
    assert repr(told(other)) == repr(told(one))
    assert other.audit.energy == one.audit.energy
    for name in (n for n in one.names if n in other.names):
        np.testing.assert_array_equal(other[name], one[name], err_msg=name)


def runs(scene: Scene | str, *more: list[str], **how) -> list[Result]:
    """Two runs of a scene: one with columns of the motion, the other with further columns."""
    return [simulate(scene, outputs=[*MOTION, *columns], **how) for columns in (*ASKED, *more)]


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("method", ["auto", "rosenbrock", "moreau"])
@pytest.mark.parametrize("name", ["double_pendulum", "governor", "crank_slider", "bricard"])
def test_models_move_the_same_whatever_is_asked(name: str, method: str) -> None:
    if method == "moreau" and name in ("governor", "bricard"):
        pytest.skip("the model has no set-valued friction")
    first, *others = runs(name, ["*"], until=min(3.0, float(load_scene(name).simulation.until)), method=method)
    for other in others:
        same(first, other)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("scene", [chain(5), random_tree(20, laws=LAWS).scene], ids=["chain", "balls"])
def test_motion_with_friction_along_the_recursion_does_not_depend_on_outputs(scene: Scene) -> None:
    first, *others = runs(scene, ["*"], until=0.5, every=0.01, kernel="parts")
    for other in others:
        same(first, other)
    often = simulate(scene, outputs=MOTION, until=0.5, every=0.002, kernel="parts")
    assert repr(told(often)) == repr(told(first))
    assert all(often[n][-1] == first[n][-1] for n in first.names)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", TREES)
def test_motion_of_random_trees_does_not_depend_on_outputs(seed: int) -> None:
    for method in ("auto", "rosenbrock"):
        first, *others = runs(random_tree(seed, laws=LAWS).scene, until=0.5, every=0.01, method=method)
        for other in others:
            same(first, other)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", LOOPS)
def test_motion_of_random_loops_does_not_depend_on_outputs(seed: int) -> None:
    for method in ("auto", "rosenbrock"):
        first, *others = runs(random_loop(seed, laws=LAWS).scene, until=0.5, every=0.01, method=method)
        for other in others:
            same(first, other)


def test_contact_jumps_are_not_computed_from_old_accelerations() -> None:
    first, *others = runs(random_loop(TURNED, laws=("coulomb",), friction=0.9).scene, until=0.5, every=0.01)
    for other in others:
        same(first, other)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", sampled(range(8), 4))
def test_a_chaotic_double_pendulum_has_one_course(seed: int) -> None:
    """Round-off of the double pendulum grows a thousandfold every few seconds. Therefore 12 s show any difference."""
    rng = np.random.default_rng(seed)
    numbers = {f"joints.{n}.friction.mu": rng.uniform(0.05, 0.6) for n in ("guide", "cross")}
    patterns = (["guide.q[1]"], ["guide.q[2]", "guide.q[1]"], ["guide.q[1]", "energy.*"], ["*"])
    first, *others = (simulate("double_pendulum", until=12.0, overrides=numbers, outputs=list(p)) for p in patterns)
    for other in others:
        same(first, other)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("every", [0.0, 0.25])
def test_the_motion_does_not_depend_on_the_spacing_of_rows(every: float) -> None:
    scene = random_tree(22, laws=LAWS).scene
    one, other = (simulate(scene, until=0.5, every=e or None, outputs=["j2.q[1]"]) for e in (0.01, every))
    assert told(other) == told(one)
    assert other.stats.steps == one.stats.steps


def test_the_stepping_unit_is_the_same_code() -> None:
    kernels = [Model(load_scene("double_pendulum"), [*MOTION, *more], "compiled").kernel for more in ASKED]
    assert len({(k.folder / "kernel.c").read_text() for k in kernels}) == 1


@cache
def turned_over(name: str) -> tuple[float, Result]:
    """Energy that a model converts within 3 s, J, and the works of the model."""
    r = simulate(name, until=3.0, rtol=1e-11, outputs=["energy.*"])
    each = [r[f"energy.{n}"] for n in ("kinetic", "potential", "dissipated")]
    return each[0].max() + 0.5 * sum(np.abs(np.diff(x)).sum() for x in each), r


@pytest.mark.default_cases(4)
@pytest.mark.parametrize(
    ("name", "method", "rtol"),
    crossed(
        ["crank_slider", "double_pendulum", "governor", "spherical_pendulum"], ["auto", "rk5", "rosenbrock"], [1e-4, 1e-6, 1e-8]
    ),
)
def test_works_are_as_exact_as_the_tolerance(name: str, method: str, rtol: float) -> None:
    energy, exact = turned_over(name)
    r = simulate(name, until=3.0, method=method, rtol=rtol, outputs=["energy.*"])
    allowed = (10.0 * rtol + NOISE) * energy
    assert np.abs(r["energy.residual"]).max() <= allowed
    assert np.abs(r["energy.dissipated"] - exact["energy.dissipated"]).max() <= allowed
