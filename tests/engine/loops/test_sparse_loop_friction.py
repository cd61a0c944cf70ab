"""Friction of many loops along the recursion equals friction from maps. The tests compare a Newton step with any derivative of the
laws, its determinant, and whole runs. The cost of the recursion grows with the number of loops (theory, "Friction along the
recursion")."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from tests.benchmarks.speed.four_bar_loops import rubbing
from tests.default_case_selection import slow
from tests.engine.checks.debug_runtime import in_place_of_the_runtime
from tests.engine.loops.test_sparse_loop_solve import beside, cranks
from tests.engine.mechanisms.scissor_lift import driven, scissor, statics
from tests.engine.mechanisms.stewart_platform import stewart
from tests.engine.parts.test_compiled_kernel_equivalence import State, called
from tests.scalable_mechanisms import n_four_bar
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.parts.kernels import scene_kernel
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.runtime.abi import PairState
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model, run, simulate
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.system.construction.system_builder import Built, build
from trunnion.system.structure.friction_joint_indices import elements

NEWTON = 1e-9
"""Allowed error relative to the largest number, for equations in which random derivatives cause conditions of 1e4 and more."""
SAME = 1e-12
"""Allowed error relative to the largest number, at roots."""


def loops_beside(seed: int, friction: float, **options) -> sm.Scene:
    """Random loops in which the share ``friction`` of joints has friction."""
    return beside(seed, friction, **options).scene


SCENES: dict[str, Callable[[], sm.Scene]] = {
    **{f"beside{seed}": partial(loops_beside, seed, 0.75, laws=tuple(LAWS)) for seed in (0, 2, 4)},
    "scissor": lambda: scissor(9),
    "cranks": lambda: rubbing(cranks(9)),
}
"""Random loops with every law and friction in three joints of four, cut ones included; a ladder whose loops share bodies; N
four-bars."""
COULOMB: dict[str, Callable[[], sm.Scene]] = {
    **{name: SCENES[name] for name in ("scissor", "cranks")},
    "stewart": lambda: stewart(3),
    **{f"half{seed}": partial(loops_beside, seed, 0.5) for seed in (0, 4)},
}
"""Scenes with Coulomb's law alone; half the joints of the random loops have friction."""


class Equations:
    """Functions of a scene's kernel at random numbers, and the maps of the scene: S λ + Se η + g0 = 0, and f and q̈ as functions of
    λ and η."""

    def __init__(self, scene: sm.Scene):
        self.built: Built = build(scene)
        self.made = parts_kernel(self.built.system, len(self.built.parameters.values), [], False)
        t = self.table = self.made.tables["kernel"]
        self.state = s = State(self.built, t, 1)
        self.c, self.w, self.maps, self.dy = (np.zeros(n + 64) for n in (t.nc, t.nw, t.nmaps, len(s.y)))
        called(t, "prepare", s.p, self.c)
        called(t, "begin", s.x, s.y, self.c, self.w, self.maps, self.dy)
        called(t, "stage1", s.x, s.y, self.c, self.w, self.maps, self.dy, np.zeros(t.npowers + 1))
        a, e, n, every = t.active, t.neta, t.nn, 1 + t.active + t.neta
        S, Se, g0, N, _, Q = np.split(self.maps, np.cumsum([a * a, a * e, a, n * every, t.nrates]))
        self.S, self.Se, self.g0 = S.reshape(a, a).T, Se.reshape(e, a).T, g0
        self.N, self.Q = N.reshape(every, n).T, Q[: e * every].reshape(every, e).T

    def derivative(self) -> tuple[np.ndarray, np.ndarray]:
        """A random ∂law/∂f, as kernels receive it and as a matrix (neta × nn)."""
        dn, D, at = 0.1 * np.random.default_rng(2).normal(size=self.table.ndn + 8), np.zeros((self.table.neta, self.table.nn)), 0
        for e in elements(self.built.system):
            size = len(e.eta) * len(e.needs)
            free = [e.joint.cut or k in e.joint.free for k in range(e.joint.kind.nv)]
            block = dn[at : at + size].reshape(len(e.needs), len(e.eta)).T
            D[e.eta[0] : e.eta[0] + len(e.eta), e.n0 : e.n0 + len(e.needs)] = block * np.array(free)[:, None]
            at += size
        return dn, D

    def narrow(self, dn: np.ndarray) -> np.ndarray:
        """All pivots for the derivative ``dn``."""
        t = self.table
        pivots = np.zeros(t.nbodies + t.nelements + 2 * t.active + 8)
        called(t, "narrow", self.c, self.w, np.ones(t.neta + 8), dn, pivots)
        return pivots[: t.nbodies + t.nelements + t.active]

    def free(self) -> np.ndarray:
        """Multipliers of freedoms with free motion. Only these multipliers have an effect."""
        free = np.zeros(self.table.neta, bool)
        for e in elements(self.built.system):
            free[list(e.eta)] = [e.joint.cut or k in e.joint.free for k in range(e.joint.kind.nv)]
        return free


@cache
def equations(name: str) -> Equations:
    """Cases of the scene with this name."""
    return Equations(SCENES[name]())


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.slow
def test_a_newton_step_is_that_with_maps(name: str) -> None:
    """η = e + D f for any D and e. The test compares reactions, accelerations and the loops' multipliers."""
    it = equations(name)
    t, (dn, D) = it.table, it.derivative()
    a, e, n = t.active, t.neta, t.nn
    known = np.random.default_rng(3).normal(size=e + 8)
    A = np.block([[it.S, it.Se], [-D @ it.N[:, 1 : 1 + a], np.eye(e) - D @ it.N[:, 1 + a :]]])
    z = np.linalg.solve(A, np.concatenate([-it.g0, known[:e] + D @ it.N[:, 0]]))
    it.narrow(dn)
    N, borne, acc = (np.zeros(size + 8) for size in (n, e + a, e + a))
    called(t, "respond", it.c, it.w, -known, N, borne, acc)
    expected = {"N": it.N @ [1.0, *z], "λ": z[:a], "q̈": it.Q @ [1.0, *z]}
    found = {"N": N[:n], "λ": borne[e : e + a], "q̈": acc[:e]}
    for which, value in expected.items():
        if t.sets or which != "q̈":
            assert np.abs(found[which] - value).max() <= NEWTON * np.abs(value).max(), which


@pytest.mark.slow
@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", SCENES)
def test_pivots_over_those_without_friction_are_the_determinant_of_newtons_matrix(name: str) -> None:
    """The multipliers of the loops are eliminated. The determinant also changes its sign where a row of S_D becomes linearly
    dependent on its other rows."""
    it = equations(name)
    dn, D = it.derivative()
    a = it.table.active
    R = it.N[:, 1 + a :] - it.N[:, 1 : 1 + a] @ np.linalg.solve(it.S, it.Se)
    sense, exact = np.linalg.slogdet(np.eye(len(D)) - D @ R)
    ratio = it.narrow(dn) / it.narrow(np.zeros_like(dn))
    assert np.prod(np.sign(ratio)) == sense
    assert np.log(np.abs(ratio)).sum() == pytest.approx(exact, rel=1e-9, abs=1e-8)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", SCENES)
def test_given_multipliers_leave_the_residual_of_the_maps(name: str) -> None:
    """A separate pass, without the derivative of friction, computes the residual that checks solutions."""
    it = equations(name)
    t, rng = it.table, np.random.default_rng(4)
    a, e, n = t.active, t.neta, t.nn
    z = rng.normal(size=a + e) * np.concatenate([np.ones(a), it.free()])
    N, acc = np.zeros(n + 8), np.zeros(e + a + 8)
    called(t, "answer", it.c, it.w, np.concatenate([-z[a:], z[:a], np.zeros(8)]), N, acc)
    gap, reactions = it.S @ z[:a] + it.Se @ z[a:] + it.g0, it.N @ [1.0, *z]
    assert np.abs(acc[e : e + a] - gap).max() <= NEWTON * np.abs(gap).max()
    assert np.abs(N[:n] - reactions).max() <= NEWTON * np.abs(reactions).max()


def models(monkeypatch: pytest.MonkeyPatch, scene: sm.Scene) -> list[Model]:
    """The models of one scene: along the recursion, and with maps."""
    made = []
    monkeypatch.setattr(scene_kernel, "_evaluation", scene_kernel._evaluation.__wrapped__)  # no tables of the other method
    for along in (True, False):
        monkeypatch.setattr(scene_kernel, "is_recursion_shorter", lambda *_, along=along: along)
        made.append(Model(scene, ("*.q[*]",), "parts"))
        assert bool(made[-1].kernel.tables["kernel"].shift) == along
    return made


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", ["cranks", "scissor", "stewart", "half0", slow("half4")])
def test_accelerations_and_multipliers_of_what_slides_are_those_from_maps(monkeypatch, name: str) -> None:
    both = models(monkeypatch, COULOMB[name]())
    for m in both:
        m.block.configure(Settings())
        m.block.assemble(0.0)
    y, nq, nv = both[0].block.y.copy(), both[0].kernel.sizes["nq"], both[0].kernel.sizes["nv"]
    for trial in range(3):
        found = []
        for m in both:
            m.block.y[: len(y)] = y
            m.block.y[nq : nq + nv] = np.random.default_rng(trial).normal(size=nv)
            m.block.start(0.0, 1.0, 1.0, np.zeros(m.block.width))
            found.append(m.block.evaluate())
        for one, other in zip(*found, strict=True):
            assert np.abs(one - other).max() <= SAME * np.abs(other).max()


def test_friction_of_pairs_at_rest_along_the_recursion_solves_the_equations_of_maps() -> None:
    """In a Stewart platform, two legs are at rest while all other pairs slide. Later all pairs are at rest, most of them with
    stored loads."""
    with in_place_of_the_runtime() as debug:
        debug.tr_gap_to_maps.restype = ctypes.c_double
        model = Model(stewart(6), ("*.friction.state*",), "parts")
        held = []
        for until in (0.1145, 0.2):
            r = run(model, until, until, Settings())
            held.append(sum(r[c][-1] == PairState.STUCK.value for c in r.names if c.startswith("leg")))
            assert 0.0 <= debug.tr_gap_to_maps(ctypes.c_void_p(model.block.at)) <= SAME
    assert held == [2, 6]
    assert r.stats.counters["newton_iterations"] <= 19_500


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", ["cranks", "half0"])
def test_a_run_is_that_with_maps(monkeypatch, name: str) -> None:
    """Both runs have the same events, end and certificate. The engine refuses no step."""
    scene, ends, contractions = COULOMB[name](), [], []
    monkeypatch.setattr(scene_kernel, "_evaluation", scene_kernel._evaluation.__wrapped__)  # no tables of the other method
    for along in (True, False):
        monkeypatch.setattr(scene_kernel, "is_recursion_shorter", lambda *_, along=along: along)
        r = simulate(scene, until=0.3, every=0.1, rtol=1e-9, outputs=("*.q[*]", "audit.constraint"), kernel="parts")
        assert r.outcome.ok
        assert r.stats.counters["refused"] == 0
        ends.append(([(e.kind, e.joint) for e in r.events], [r[c][-1] for c in r.names if c != "audit.constraint"]))
        assert r["audit.constraint"].max() <= 1e-12
        assert r.certificate.complement <= 1e-12
        contractions.append(r.certificate.contraction)
    assert ends[0][0] == ends[1][0]
    assert ends[0][1] == pytest.approx(ends[1][1], abs=1e-6)
    assert contractions[0] == pytest.approx(contractions[1], rel=1e-6)


def one_rubs(scene: sm.Scene) -> sm.Scene:
    return replace(scene, joints=scene.joints | {"pivot0": rubbing(scene).joints["pivot0"]})


@pytest.mark.default_cases(4)
@pytest.mark.parametrize(
    ("scene", "along"),
    [(stewart(3), True), (stewart(6), True), (scissor(3), True), (rubbing(n_four_bar(2)), True), (rubbing(n_four_bar(1)), False),
     (one_rubs(n_four_bar(3)), False)],
    ids=["stewart3", "stewart6", "scissor3", "four_bars2", "four_bar", "one_of_ten_joints"],
)  # fmt: skip
def test_the_form_with_fewer_multiplications_solves_the_friction_of_loops(scene: sm.Scene, along: bool) -> None:
    """The engine chooses the form as measured: along the recursion from two loops on; with maps for one loop, or for one joint with
    friction among ten."""
    assert bool(Model(scene, ("*.q[*]",), "parts").kernel.tables["kernel"].shift) == along


@pytest.mark.slow
def test_a_lift_of_many_stages_carries_what_statics_by_hand_says() -> None:
    """The condition of the equations grows as the fourth power of the number of stages."""
    r = simulate(driven(40, -1e-6), until=0.01, every=0.01, outputs=("*.reaction.force[*]", "guide.q[1]"), kernel="parts")
    assert r.outcome.ok
    for joint, force in statics(40, 0.15, r["guide.q[1]"][-1], -1.0).items():
        found = np.linalg.norm([r[f"{joint}.reaction.force[{k}]"][-1] for k in (1, 2, 3)])
        assert found == pytest.approx(force, rel=4e-11)


def test_programs_with_friction_grow_as_the_number_of_loops() -> None:
    sizes = []
    for n in (16, 32):
        built = build(rubbing(n_four_bar(n)))
        made = parts_kernel(built.system, len(built.parameters.values), [], False)
        tapes = next(k for k in made.keep if hasattr(k, "stage1"))
        sizes.append([getattr(tapes, name).length for name in ("begin", "narrow", "respond", "answer", "derive", "shift")])
    for few, many in zip(*sizes, strict=True):
        assert 0 < many <= 2.1 * few


def maps_formed(model: Model, until: float) -> int:
    """Number of times that a run forms the maps of all multipliers."""
    table, count = model.kernel.tables["kernel"], []
    address = ctypes.cast(table.stage1, ctypes.c_void_p).value or 0
    kind = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 7)
    formed = kind(lambda *arrays: (count.append(1), kind(address)(*arrays))[1])
    table.stage1 = ctypes.cast(formed, ctypes.c_void_p).value
    try:
        assert run(model, until, until, Settings()).outcome.ok
    finally:
        table.stage1 = address
    return len(count)


def test_many_rubbing_loops_start_and_step_without_maps() -> None:
    """The recursion's factor proves the rank of S. (Maps would take half of the start of 256 loops, and their cost grows with the
    cube.)"""
    assert maps_formed(Model(rubbing(n_four_bar(9)), ("events.count",), "parts"), 1e-3) == 0


def test_the_row_scales_and_the_rank_are_those_from_maps() -> None:
    """The pivots of the recursion give the rank of S. The diagonal of S follows from the recursion, too."""
    it = equations("scissor")
    t = it.table
    pivots = np.zeros(t.nbodies + t.nelements + 2 * t.active + 8)
    called(t, "narrow", it.c, it.w, np.ones(t.neta + 8), np.zeros(t.ndn + 8), pivots)
    own = pivots[t.nbodies + t.nelements :][: 2 * t.active]
    assert own[t.active :] == pytest.approx(np.diag(it.S), rel=1e-12)
    assert np.prod(own[: t.active]) == pytest.approx(np.linalg.det(it.S), rel=1e-6)
