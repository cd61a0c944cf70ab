"""For many pairs at rest, one search decides together which pairs stick and which slip. Independent pairs behave as they would
alone. Coupled pairs obey their laws. The work does not grow with the number of pairs. If the search finds no decision but excludes
none, the run does not report a jam."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from tests.engine.checks.debug_runtime import in_place_of_the_runtime
from tests.engine.mechanisms.stewart_platform import stewart
from trunnion.runtime.abi import Status
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.execution.failure_diagnosis import diagnose
from trunnion.simulation.run import Model, simulate
from trunnion.simulation.runtime_interface import simulation_block as bl

STEPS = 120
"""Most iterations, of the creep and of Newton's method, for the decision of a start. The limit does not depend on the number of
pairs."""
MOST = 400_000
"""Largest number of iterations in the start of ten balls, which tries every search method several times."""


def links(count: int, seed: int, kind: str, apart: bool) -> sm.Scene:
    """Bars on joints with friction, at rest: a chain or, with ``apart``, each bar on the ground."""
    rng = np.random.default_rng([seed, count])
    bodies: dict[str, sm.Body] = {}
    joints: dict[str, sm.Joint] = {}
    for k in range(count):
        length, mu, radius = float(rng.uniform(0.2, 0.4)), float(rng.uniform(0.05, 0.5)), float(rng.uniform(0.005, 0.03))
        ends = {"a": (-length / 2, 0.0, 0.0), "b": (length / 2, 0.0, 0.0)}
        bodies[f"b{k}"] = sm.Body(box=(length, 0.06, 0.04), density=2700.0, points=ends)
        inboard, down = ("ground", np.pi / 2) if apart or k == 0 else (f"b{k - 1}.b", 0.0)
        if kind == "spherical":
            turn = np.array([1.0, 0.05 * rng.normal(), 0.5 * down + rng.uniform(-0.1, 0.1), 0.05 * rng.normal()])
            start = sm.Start(tuple(map(float, turn / np.linalg.norm(turn))), (0.0, 0.0, 0.0))
            joints[f"j{k}"] = sm.Joint(kind, inboard, f"b{k}.a", friction=sm.Friction(mu=mu, radius=radius), start=start)
            continue
        rub = sm.Friction(mu=mu, radius=radius, half_length=0.06)
        start = sm.Start(down + float(rng.uniform(-0.1, 0.1)), 0.0)
        joints[f"j{k}"] = sm.Joint(kind, inboard, f"b{k}.a", axis="y", friction=rub, start=start)
    return sm.Scene(bodies, joints, f"links_{count}", gravity=(0.0, 0.0, -9.81))


def rough(seed: int, count: int = 10) -> sm.Scene:
    """A chain of wide, rough balls near their friction cones. In this chain the search takes long."""
    scene, rub = links(count, seed, "spherical", apart=False), sm.Friction(mu=0.9, radius=0.1)
    joints = {n: sm.Joint(j.type, j.inboard, j.outboard, friction=rub, start=j.start) for n, j in scene.joints.items()}
    return sm.Scene(scene.bodies, joints, scene.name, gravity=scene.gravity)


def begun(scene: sm.Scene, outputs: str, kernel: str | None = None) -> tuple[Model, int, np.ndarray]:
    """A model at its start, with the outcome and the first row of the start."""
    model, settings = Model(scene, outputs, kernel), bl.Settings()
    model.block.configure(settings)
    assert model.block.assemble() == 1
    row = np.zeros(model.block.width)
    return model, model.begin(settings, 0.0, 1.0, 0.1, row), row


def work(model: Model) -> int:
    """Iterations that the model has counted so far."""
    counted = model.block.statistics()
    return counted["newton_iterations"] + counted.get("creeps", 0)


@pytest.mark.parametrize("count", [9, 20])
def test_pairs_that_do_not_feel_each_other_are_decided_as_each_would_be_alone(count: int) -> None:
    """A pendulum rests if the lever of its weight is within R = r μ/√(1 + μ²), the radius of the friction circle."""
    scene = links(count, 3, "revolute", apart=True)
    model, status, row = begun(scene, "*.qdd[1]")
    assert status == Status.OK
    names = [c.name for c in model.columns]
    rests = []
    for (name, joint), body in zip(scene.joints.items(), scene.bodies.values(), strict=True):
        assert joint.friction is not None
        assert joint.start is not None
        assert isinstance(joint.start.q, float)
        assert body.box is not None
        mu, lever = float(joint.friction.mu), 0.5 * body.box[0] * abs(np.cos(joint.start.q))
        rests.append(lever <= float(joint.friction.radius) * mu / np.sqrt(1.0 + mu * mu))
        assert (abs(row[1 + names.index(f"{name}.qdd[1]")]) <= 1e-9) == rests[-1]
    assert 0 < sum(rests) < count
    assert work(model) <= STEPS


def decided(model: Model, debug: ctypes.CDLL, by_cones: bool) -> tuple[np.ndarray, np.ndarray]:
    """Frictions and modes of pairs with one component, decided by one of the two methods."""
    eta, flags = np.zeros(model.system.neta), np.zeros(model.system.neta)
    at, *out = (ctypes.c_void_p(a) for a in (model.block.at, eta.ctypes.data, flags.ctypes.data))
    assert debug.tr_decide_one_way(at, int(by_cones), *out)
    return eta, flags


def test_neighbouring_modes_and_the_cone_equations_decide_alike() -> None:
    """The engine tries the search through neighbouring modes first. The cone equations share no code with this search."""
    with in_place_of_the_runtime() as debug:
        for seed in range(3):
            model, status, _ = begun(links(12, seed, "revolute", apart=False), "j0.q[*]", "parts")
            assert status == Status.OK
            (nearby, modes), (cones, others) = (decided(model, debug, by_cones) for by_cones in (False, True))
            assert 0 < np.count_nonzero(modes) < len(modes)
            assert list(modes) == list(others)
            assert np.abs(nearby - cones).max() <= 1e-9 * np.abs(cones).max()


@pytest.mark.parametrize(("kind", "count"), [("revolute", 24), ("spherical", 10)])
def test_a_chain_from_rest_takes_no_more_work_for_more_pairs(kind: str, count: int) -> None:
    model, status, _ = begun(links(count, 1, kind, apart=False), "j0.q[*]")
    assert status == Status.OK
    assert not model.block.broken(deciding=True)
    assert work(model) <= STEPS


def test_a_decision_about_many_pairs_is_bounded_and_no_jam_where_it_fails() -> None:
    model, status, _ = begun(rough(0), "j0.q[*]")
    assert work(model) <= MOST
    if status == Status.OK:
        assert not model.block.broken(deciding=True)
    else:
        assert diagnose(model, status).name == "undecided"


def stands(legs: int, until: float) -> None:
    """Check that a Stewart platform on this number of legs moves from rest, keeps the balance of energy and takes little work."""
    r = simulate(stewart(legs), until=until, every=0.01, outputs=["platform.position[*]", "energy.residual", "energy.dissipated"])
    assert r.outcome.ok
    assert np.abs(r["energy.residual"]).max() <= 1e-4 * r["energy.dissipated"][-1]
    counted = r.stats.counters
    assert counted["newton_iterations"] + counted.get("creeps", 0) <= 400_000
    assert counted["rhs_evaluations"] <= 20_000


def test_a_stewart_platform_moves_from_rest() -> None:
    stands(4, 0.3)


@pytest.mark.slow
@pytest.mark.parametrize("legs", [4, 5, 6])
def test_a_stewart_platform_moves_until_it_rests_on_any_legs(legs: int) -> None:
    stands(legs, 2.0)


def test_a_released_leg_moves_off_though_dense_output_of_a_long_step_has_it_go_back() -> None:
    """From rest, the speed grows with the square of time. At first, the speed is smaller than the error of a long step's dense
    output. This error must not be taken for a stop."""
    r = simulate(stewart(4), until=0.3, every=0.3, method="rosenbrock", rtol=1e-5, outputs=["energy.kinetic"])
    assert r.outcome.ok
    assert r.stats.steps <= 100
    assert [(e.joint, e.kind) for e in r.events if 0.137 < e.time < 0.15] == [("leg0", "slip"), ("u3", "reversal")]
