"""Chains with friction at every joint start from rest as dense equations in absolute coordinates require. The tests include all
joint types, also near the friction cones of balls. The work is bounded for any number of pairs."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.mechanisms.friction_chains import balls, mixed
from tests.reference import forward
from tests.reference.contact_and_friction.mode_enumeration import SLIDES, STICKS, Decision
from trunnion.runtime.abi import PairState, Status
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl

OBEYED = 1e-7
"""Allowed residual, relative to the forces and accelerations that cancel. The round-off of dense equations of a chain is far
smaller, 1e-10."""
STEPS = 150
"""Most matrices that the decision of a start may factorise, in Newton's method and along the path on which friction grows. Nineteen
chains in twenty need 12 to 30."""


def begun(scene: sm.Scene) -> tuple[Model, dict[str, float]]:
    """A model that has started at rest, and its first row. Its kernel is made of precompiled parts, so that no chain needs a
    compilation."""
    model, settings = Model(scene, ("*.friction.*", "*.q[*]"), kernel="parts"), bl.Settings()
    model.block.configure(settings)
    assert model.block.assemble() == 1
    row = np.zeros(model.block.width)
    assert model.begin(settings, 0.0, 1.0, 0.1, row) == Status.OK, scene.name
    return model, dict(zip([c.name for c in model.columns], row[1:].tolist(), strict=True))


def work(model: Model) -> int:
    """Matrices that the model has factorised so far."""
    counted = model.block.statistics()
    return counted["newton_iterations"] + counted.get("creeps", 0)


def friction(row: dict[str, float], joint: str) -> list[float]:
    """Friction of a joint along its freedoms."""
    parts = [f"{joint}.friction.{what}" for what in ("force", "torque", *(f"torque[{k}]" for k in (1, 2, 3)))]
    return [row[p] for p in parts if p in row]


def modes(decision: Decision, row: dict[str, float]) -> dict[str, str]:
    """The modes of all pairs, by the names that the search uses. A second pair of a joint belongs to the joint's second freedom."""
    found = {}
    for p in decision.rest:
        state = row[f"{p.joint}.friction.state[{p.freedoms[0] + 1}]"]
        found[p.name] = STICKS if state == PairState.STUCK.value else SLIDES if len(p.freedoms) > 1 else "+" if state > 0.0 else "-"
    return found


def obeys(scene: sm.Scene) -> dict[str, str]:
    """Check that the friction at the start of a chain satisfies Coulomb's law in equations of bodies in absolute coordinates.
    Returns the modes."""
    model, row = begun(scene)
    q = {n: np.array([row[c] for c in row if c.startswith(f"{n}.q[")]) for n in scene.joints}
    decision = Decision(forward(scene, q))
    eta = np.concatenate([friction(row, n) for n in scene.joints])
    found = modes(decision, row)
    assert np.abs(decision.lack(eta / decision.unit, found)).max() <= OBEYED, scene.name
    assert decision.fits(eta, found), scene.name
    assert work(model) <= STEPS, scene.name
    return found


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(4))
def test_a_chain_of_balls_starts_as_dense_equations_ask(seed: int) -> None:
    obeys(balls(12, seed))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("seed", "grip"), [*((k, 1.0) for k in range(4)), *((k, 1.3) for k in range(3))])
def test_a_chain_of_all_joints_starts_as_dense_equations_ask(seed: int, grip: float) -> None:
    """Static friction may exceed sliding friction."""
    found = obeys(mixed(12, seed, grip))
    assert STICKS in found.values()
    assert set(found.values()) > {STICKS}


@pytest.mark.slow
@pytest.mark.parametrize("block", range(8))
def test_many_chains_start_as_dense_equations_ask(block: int) -> None:
    for seed in range(8 * block, 8 * block + 8):
        obeys(balls(30, seed))
        obeys(mixed(30, seed))


def test_a_hundred_balls_take_as_few_matrices_as_ten() -> None:
    for count in (10, 30, 100):
        assert work(begun(balls(count, 0))[0]) <= STEPS
