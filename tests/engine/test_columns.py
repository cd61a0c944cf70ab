"""A column says what it is a quantity of; exports, derivatives and comparisons ask that, not its name."""

from __future__ import annotations

import pytest

from engine.basics.numbers import NOT_NEGATIVE
from engine.basics.problems import SceneError
from engine.kernel.columns import Column, columns
from engine.kernel.output_unit import Outputs
from engine.kernel.quantities import ALL
from engine.scene import load_scene, model_names
from engine.sensitivities.asked import checked_request
from engine.simulation.run import Model
from engine.system.build import build
from fmu.description import variables


def every_column() -> list[Column]:
    """The columns of all bundled models."""
    return [c for name in model_names() for c in columns(build(load_scene(name)).system)]


def test_every_column_is_a_quantity_and_every_quantity_has_an_expression() -> None:
    no_model = {"bristle", "tie", "extra.overrun", "extra.overruns"}  # LuGre's law, a joint that follows another, bounded steps
    assert {c.quantity.name for c in every_column()} >= {q.name for q in ALL} - no_model
    assert all(hasattr(Outputs, f"_{q.name.partition('.')[0]}") for q in ALL)


@pytest.fixture(scope="module")
def told() -> dict[str, object]:
    """What an FMU of the spherical pendulum tells of its variables."""
    return {v.name: v for v in variables(Model(load_scene("spherical_pendulum"), ("*",)), 0.0, 1e-6)}


def test_an_fmu_tells_what_changes_at_events_alone(told) -> None:
    """In FMI 2.0 these are the discrete variables: they change at events only."""
    discrete = {n for n, v in told.items() if v.causality == "output" and v.variability == "discrete"}
    assert discrete == {n for n in told if n.startswith("events.") or ".state" in n or n == "audit.verdict"}
    assert {"events.count", "events.last.time", "events.last.turn", "ball.friction.state[1]", "ball.contact[1].state"} <= discrete


def test_an_fmu_tells_what_forces_act_on_at_once(told) -> None:
    direct = {n for n, v in told.items() if v.direct}
    assert {"ball.qdd[1]", "ball.contact[1].angle", "ball.reaction.force[1]"} <= direct
    assert not {"ball.q[1]", "ball.qd[1]", "energy.kinetic", "events.last.time", "audit.complement"} & direct
    assert told["ball.contact[1].normal_force"].bound == told["events.count"].bound == NOT_NEGATIVE


WITHOUT_DERIVATIVE = ("events.last.time", "events.count", "audit.constraint", "ball.friction.state[1]", "energy.residual")


@pytest.mark.parametrize("name", WITHOUT_DERIVATIVE)
def test_what_counts_or_audits_has_no_derivative(name: str) -> None:
    scene = load_scene("spherical_pendulum")
    with pytest.raises(SceneError, match=r"has no derivative"):
        checked_request(scene, ["joints.ball.friction.mu"], [name], 1.0, None, 1e-9)
