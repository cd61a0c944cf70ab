"""Of many loops, only few share bodies, and the solver uses this structure. Results agree with dense equations, and the cost grows
with the number of loops (theory, "Loops by structure")."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.engine.checks.reference_comparison import results, worst
from tests.reference import solve
from tests.reference.scenes.random_scenes import Case, random_loop
from tests.reference.scenes.result_table import table
from tests.scalable_mechanisms import n_four_bar
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.parts.kernels import scene_kernel
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.redundant_reactions import Redundancy, redundancy
from trunnion.simulation.run import Model, run, simulate
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.system_builder import build
from trunnion.system.structure import loop_matrix_fill

ROUND_OFF = 1e-12
"""Allowed error relative to the largest number: both ways solve to 1e-16 times the condition of S."""
DENSE = 1e-10
"""The tolerance of ``test_dense_reference``."""
COUNT = 8
"""Loops side by side: some 20 rows."""


def side(given: sm.Side | str, k: int, ground: sm.Ground, hung: str | None) -> sm.Side:
    """A side of a joint in the k-th copy. The body ``hung`` or the ground replaces the ground of the original."""
    s = given if isinstance(given, sm.Side) else sm.Side(*given.split("."))
    if s.body != "ground":
        return replace(s, body=f"c{k}_{s.body}")
    point = ground.points[s.point] if isinstance(s.point, str) else s.point
    return replace(s, body=hung or "ground", point=point)


def together(scenes: Sequence[sm.Scene], hung: Callable[[int], str | None] = lambda k: None) -> sm.Scene:
    """The mechanisms as one scene, with names that begin with c0_, c1_, …. hung(k): body on which mechanism k stands."""
    bodies, joints = {}, {}
    for k, scene in enumerate(scenes):
        bodies |= {f"c{k}_{n}": b for n, b in scene.bodies.items()}
        for n, j in scene.joints.items():
            ends = {which: side(getattr(j, which), k, scene.ground, hung(k)) for which in ("inboard", "outboard")}
            joints[f"c{k}_{n}"] = replace(j, **ends, effort=None)
    return sm.Scene(bodies, joints, "together", gravity=(1.0, -3.0, 9.0))


@cache
def beside(seed: int, friction: float = 0.0, **options) -> Case:
    """Random loops. Every third loop is attached to the first body of the previous loop. friction: share of joints with friction.
    Seed 3 has a freedom with small inertia, and dense equations solve its loops."""
    cases = [random_loop(f"beside{seed}_{k}", drives=0.0, friction=friction, **options) for k in range(COUNT)]
    scene = together([c.scene for c in cases], lambda k: f"c{k - 1}_b1" if k % 3 == 2 else None)
    q = {f"c{k}_{n}": v for k, c in enumerate(cases) for n, v in c.q.items()}
    qd = {f"c{k}_{n}": v for k, c in enumerate(cases) for n, v in c.qd.items()}
    return Case(scene, q, qd, 0.0, tuple(f"c{k}_{n}" for k, c in enumerate(cases) for n in c.tree))


def cranks(n: int) -> sm.Scene:
    """The N-four-bar under inclined gravity, with inclined cranks."""
    return replace(n_four_bar(n), gravity=(1.5, -8.0, 0.0))


@pytest.fixture
def both(monkeypatch: pytest.MonkeyPatch) -> Callable[[sm.Scene, bool], Model]:
    """Creates a scene's model on parts, solved by structure or dense."""
    monkeypatch.setattr(scene_kernel, "_evaluation", scene_kernel._evaluation.__wrapped__)  # no tables of the other method

    def made(scene: sm.Scene, dense: bool) -> Model:
        monkeypatch.setattr(loop_matrix_fill, "MANY_ROWS", 10**6 if dense else 16)
        model = Model(scene, ("*.q[*]",), "parts")
        assert (model.kernel.sizes["nfill"] == 0) == dense
        return model

    return made


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [0, 2, 8])
def test_accelerations_and_reactions_of_many_loops_are_those_of_dense_equations(seed: int) -> None:
    case = beside(seed)
    model = Model(case.scene, ("*",), "parts")
    assert model.kernel.sizes["nfill"] > 0
    row = evaluate(model, case.q, case.qd, case.t)
    free = {n for n, j in case.scene.joints.items() if j.type == "free"}  # the engine reports no reactions of free joints
    expected = {key: v for key, v in table(solve(case.state())).items() if key[0] not in free}
    found, where = worst(expected, results(model, row), ("angular_acceleration",))
    assert found <= DENSE, where


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [None, 0, 2], ids=["cranks", "beside0", "beside2"])
def test_multipliers_by_structure_are_those_of_the_dense_factor(both, seed: int | None) -> None:
    scene, found = cranks(9) if seed is None else beside(seed).scene, []
    for dense in (False, True):
        block = both(scene, dense).block
        block.configure(Settings())
        block.assemble(0.0)
        block.start(0.0, 1.0, 1.0, np.zeros(block.width))
        found.append(block.evaluate())
    for one, other in zip(*found, strict=True):
        assert np.abs(one - other).max() <= ROUND_OFF * np.abs(other).max()


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kernel", ["parts", "compiled"])
def test_a_run_passes_singular_positions_by_the_dense_factor(both, kernel: str) -> None:
    """Where cranks lie flat, a pivot of every loop vanishes, and the dense factor is used. Before and after this position, the
    factor by structure is used."""
    scene, ends = n_four_bar(9), []
    for dense in (False, True):
        both(scene, dense)
        how = {"kernel": "parts" if dense else kernel}
        r = simulate(scene, until=2.0, every=0.5, rtol=1e-10, outputs=("*.q[1]", "audit.constraint"), **how)
        assert r.outcome.ok
        assert r["audit.constraint"].max() <= 1e-12
        ends.append([r[f"pivot{i}.q[1]"][-1] for i in range(10)])
    assert ends[0] == pytest.approx(ends[1], abs=1e-6)


def open_at_start(scene: sm.Scene) -> Redundancy:
    model = Model(scene, ("*.q[*]",), "parts")
    model.block.configure(Settings())
    model.block.assemble(0.0)
    model.begin(Settings(), 0.0, 1.0, 1.0, np.zeros(model.block.width))
    return redundancy(model.block)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(3))
def test_open_reactions_of_mechanisms_together_are_those_of_each_apart(seed: int) -> None:
    """The loops are redundant by structure or in one position. By structure: four-bars, of which neighbours share a crank. In one
    position: Bricard's mechanism."""
    scenes = [n_four_bar(3), n_four_bar(1), load_scene("bricard")]
    scenes = [scenes[i] for i in np.random.default_rng(seed).choice(3, 3 + seed)]
    apart, found = [open_at_start(s) for s in scenes], open_at_start(together(scenes))
    assert found.count == sum(r.count for r in apart) > 0
    assert set(found.joints) == {f"c{k}_{n}" for k, r in enumerate(apart) for n in r.joints}


def test_loops_stay_closed_at_any_tolerance() -> None:
    for rtol in (1e-3, 1e-6, 1e-9):
        r = simulate(cranks(12), until=1.0, every=0.1, rtol=rtol, outputs=("audit.constraint", "energy.residual"), kernel="parts")
        assert r.outcome.ok
        assert r["audit.constraint"].max() <= 1e-13


def test_rows_far_from_the_origin_are_not_corrected_for_round_off() -> None:
    """Points 40 m away have a round-off of 7e-15 m. Corrections by one unit in the last place in every row would take most of the
    time of a run."""
    model = Model(n_four_bar(40), ("audit.constraint",), "parts")
    r = run(model, 0.004, 5e-6, Settings(method="rk5", step=1e-4))
    assert r.stats.counters["projections"] < len(r.time) / 3
    assert r["audit.constraint"].max() <= 4e-13


def test_programs_and_factor_grow_as_the_number_of_loops() -> None:
    """The test counts calls in an evaluation and entries of the factor."""
    sizes = []
    for n in (16, 32):
        built = build(n_four_bar(n))
        made = parts_kernel(built.system, len(built.parameters.values), [], False)
        scene = made.tables["kernel"]
        tapes = next(k for k in made.keep if hasattr(k, "stage1"))
        assert scene.active == 2 * n
        sizes.append((tapes.stage1.length, tapes.stage2.length, scene.nfill, scene.nS, scene.nw))
    for few, many in zip(*sizes, strict=True):
        assert 0 < many <= 2.1 * few


@pytest.mark.parametrize("seed", [0, 2])
def test_the_entries_of_the_factor_are_those_that_are_not_zero(seed: int) -> None:
    """The test compares the lists with the non-zero entries of a factor. The non-zero entries of S are random numbers."""
    system = build(beside(seed).scene).system
    active = list(range(system.rows))
    f, rng = loop_matrix_fill.fill(system, active), np.random.default_rng(seed)
    loops = loop_matrix_fill.rows_by_loop(system, active)
    near = loop_matrix_fill.coupled(system, [c for c, _ in loops])
    S = np.zeros((len(active), len(active)))
    for at, (_, rows) in enumerate(loops):
        for other in (at, *near[at]):
            S[np.ix_(rows, loops[other][1])] = rng.normal(size=(len(rows), len(loops[other][1])))
    S = (S + S.T) + 100.0 * np.eye(len(active))
    L = np.linalg.cholesky(S[np.ix_(f.order, f.order)])
    listed = {(p, k) for k in range(len(active)) for p in f.below[f.start[k] : f.start[k + 1]]}
    assert {(int(i), int(k)) for i, k in np.argwhere(np.tril(L, -1))} <= listed
    assert sorted(f.order) == active
