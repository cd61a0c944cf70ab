"""Friction along the recursion equals friction from maps, in every evaluation and run. The pivots of the recursion give the sign of
the determinant."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.speed.parts_kernel import chain
from tests.engine.parts.test_compiled_kernel_equivalence import State, called, tree
from tests.engine.stick_slip.test_active_set_many_pairs import links
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model, simulate
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.simulation.settings.kernel_choice import MANY, RUNS, kernel_of
from trunnion.system.construction.system_builder import build
from trunnion.system.structure.friction_joint_indices import elements

TREES = (8, 9, 10, 15, 20, 25, 27)
"""Seeds of trees. Together they have friction in every joint type with friction, in both directions, a driven joint, and every
law."""
SAME = 1e-11
"""Allowed difference relative to the largest number. Newton's method leaves 1e-15 of the largest friction, which the lightest
body's acceleration amplifies."""


def blocks(scene: Scene) -> list:
    """A scene's assembled blocks, on parts and compiled."""
    out = []
    for kind in ("parts", "compiled"):
        model = Model(scene, ("*.q[*]",), kind)
        model.block.configure(Settings())
        model.block.assemble(0.0)
        out.append((model, model.block))
    return out


def evaluated(pairs: list, y: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """ẏ and multipliers of both blocks at a state. The modes are the modes that a run started at this state has."""
    found = []
    for _, block in pairs:
        block.y[: len(y)] = y
        block.start(0.0, 1.0, 1.0, np.zeros(block.width))
        found.append(block.evaluate())
    return found


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize("seed", TREES)
def test_accelerations_and_frictions_are_those_from_maps(seed: int, resting: bool) -> None:
    """resting: every second rate is zero, so that pairs stick if they can."""
    pairs = blocks(tree(seed))
    y, nq = pairs[0][1].y.copy(), pairs[0][0].kernel.sizes["nq"]
    nv = pairs[0][0].kernel.sizes["nv"]
    rng = np.random.default_rng(seed)
    for _ in range(4):
        y[nq : nq + nv] = rng.normal(size=nv) * (np.arange(nv) % 2 if resting else 1.0)
        one, other = evaluated(pairs, y)
        for found, expected in zip(one, other, strict=True):
            assert np.abs(found - expected).max() <= SAME * max(np.abs(expected).max(), 1.0)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", TREES)
def test_pivots_over_those_without_friction_are_the_determinant_of_newtons_matrix(seed: int) -> None:
    """The sign of det(E − law′ Ne) determines which roots the engine follows."""
    built = build(tree(seed))
    made = parts_kernel(built.system, len(built.parameters.values), [], False)
    table = made.tables["kernel"]
    s, rng = State(built, table, seed), np.random.default_rng(seed)
    c, w, maps, dy = (np.zeros(n + 64) for n in (table.nc, table.nw, table.nmaps, len(s.y)))
    called(table, "prepare", s.p, c)
    called(table, "stage1", s.x, s.y, c, w, maps, dy)
    dn, moves = 0.1 * rng.normal(size=table.ndn + 8), np.ones(table.neta + 8)
    with_it, without = np.zeros(table.nbodies + 1), np.zeros(table.nbodies + 1)
    called(table, "narrow", c, w, moves, dn, with_it)
    called(table, "narrow", c, w, moves, np.zeros_like(dn), without)
    at = table.active * (table.active + table.neta + 1) + table.nn * (1 + table.active)
    by_friction = maps[at : at + table.nn * table.neta].reshape(table.neta, table.nn).T
    slopes, dn0 = np.zeros((table.neta, table.nn)), 0
    for e in elements(built.system):
        size = len(e.eta) * len(e.needs)
        free = [k in e.joint.free for k in range(e.joint.kind.nv)]
        block = dn[dn0 : dn0 + size].reshape(len(e.needs), len(e.eta)).T * np.array(free)[:, None]
        slopes[e.eta[0] : e.eta[0] + len(e.eta), e.n0 : e.n0 + len(e.needs)] = block
        dn0 += size
    exact = np.linalg.det(np.eye(table.neta) - slopes @ by_friction)
    ratio = np.prod(with_it[: table.nbodies] / without[: table.nbodies])
    assert ratio == pytest.approx(exact, rel=1e-9, abs=1e-9)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("scene", [chain(5), links(4, 1, "spherical", apart=False), links(6, 2, "revolute", apart=False)])
def test_a_run_has_the_same_events_as_from_maps(scene: Scene) -> None:
    one, other = (simulate(scene, until=0.4, every=0.1, rtol=1e-8, outputs=("*.q[*]",), kernel=k) for k in ("parts", "compiled"))
    assert one.outcome.name == other.outcome.name == "done"
    assert [(e.kind, e.joint) for e in one.events] == [(e.kind, e.joint) for e in other.events]
    assert [e.time for e in one.events] == pytest.approx([e.time for e in other.events], abs=100 * 1e-8 * 0.4)


def test_both_kernels_report_the_contacts_up_to_an_event() -> None:
    """Contacts follow from accelerations with friction. Accelerations without friction would give false contact jumps."""
    turns = []
    for kind in ("parts", "compiled"):
        r = simulate(chain(8), until=0.01, every=0.01, rtol=1e-8, outputs=("*.q[*]",), kernel=kind)
        turns.append([(e.joint, e.part, *e.before, *e.after) for e in r.events if e.kind == "contact_jump"])
    assert len(turns[0]) == len(turns[1]) > 0
    for one, other in zip(*turns, strict=True):
        assert one == pytest.approx(other, abs=1e-6)


@pytest.mark.slow
def test_many_joints_have_many_events_that_do_not_accumulate() -> None:
    """64 joints reverse 140 times in 4 ms. At loose tolerances, no jam may be reported."""
    ends = []
    for rtol in (1e-4, 1e-7):
        r = simulate(chain(64), until=0.02, every=0.02, rtol=rtol, outputs=("*.q[*]",))
        assert r.outcome.ok
        assert r.stats.counters["moreau"] == 0
        ends.append([r[c][-1] for c in r.names])
    assert ends[0] == pytest.approx(ends[1], abs=1e-3)


def test_locating_an_event_among_many_joints_takes_few_evaluations() -> None:
    """The limit includes the evaluations of two steps and of the points inside the second step."""
    counters = simulate(chain(24), until=0.02, every=0.02, outputs=("*.q[*]",)).stats.counters
    assert counters["events"] > 40
    assert counters["rhs_evaluations"] <= 55 * counters["events"]


def test_the_kernel_is_chosen_by_the_structure_and_the_request_and_reported() -> None:
    """For one run, no code is compiled. For many runs of a small structure, code is compiled."""
    few, many = (links(n, 0, "revolute", apart=False) for n in (3, MANY))
    for runs, kinds in ((1, ["parts", "parts"]), (RUNS - 1, ["parts", "parts"]), (RUNS, ["compiled", "parts"])):
        assert [kernel_of(build(s).system, runs)[0] for s in (few, many)] == kinds
    for asked, kind in (({}, "parts"), ({"kernel": "compiled"}, "compiled"), ({"kernel": "parts"}, "parts")):
        assert simulate(few, until=0.01, outputs=("j0.q[1]",), **asked).settings["kernel"] == kind


def test_a_ball_without_a_coefficient_swings_as_one_without_friction() -> None:
    """The law gives no friction. Round-off must not give the ball a friction of 1e-33 N."""
    ball = {"overrides": {"joints.ball.friction.mu": 0.0}, "outputs": ("*.position[*]",), "until": 1.0, "every": 0.1}
    one, other = (simulate("spherical_pendulum", kernel=kind, **ball) for kind in ("parts", "compiled"))
    assert one.outcome.ok
    assert one.stats.steps == other.stats.steps
    np.testing.assert_allclose([one[c] for c in one.names], [other[c] for c in one.names], atol=1e-9)
