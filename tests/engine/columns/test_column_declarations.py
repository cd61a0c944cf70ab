"""Each column has one declaration. Both kernels create the column from this declaration; exports, derivatives and comparisons read
it. An incomplete declaration is refused."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from tests.documentation.reference_generators.result_pages import reference
from trunnion.analysis.sensitivities.request_checks import check_request
from trunnion.basics.errors import SceneError
from trunnion.basics.number_declarations import NOT_NEGATIVE
from trunnion.columns.declaration import ColumnKind, Quantity, registered
from trunnion.columns.operands import provides_all
from trunnion.columns.registry import REGISTRY
from trunnion.fmu.variables.outputs_inputs_parameters import variables
from trunnion.kernel.interface.output_columns import Column, columns
from trunnion.kernel.units.column_operand_expressions import ColumnOperands
from trunnion.scene import load_scene, model_names
from trunnion.simulation.run import Model
from trunnion.system.construction.system_builder import build

MASS_CENTRE = REGISTRY["mass_centre"]


def every_column() -> list[Column]:
    """The columns of all bundled models."""
    return [c for name in model_names() for c in columns(build(load_scene(name)).system)]


def test_every_quantity_is_a_column_of_some_model() -> None:
    # no bundled model has LuGre's law, a joint that follows another joint, a gearbox, a band, a contact that opens, or bounded
    # steps
    units = {"input_torque", "output_torque", "tension"}
    no_model = {"bristle", "tie", "gap", "extra.overrun", "extra.overruns", *units}
    assert {c.quantity.name for c in every_column()} == {q.name for k in REGISTRY.values() for q in k.quantities} - no_model


def test_a_kernel_that_does_not_provide_an_operand_is_refused() -> None:
    class Nothing:
        pass

    assert provides_all(ColumnOperands) is ColumnOperands
    with pytest.raises(TypeError, match=r"provides no .*body_motion.*gravity"):
        provides_all(Nothing)


def test_references_have_a_pattern_a_unit_and_words_for_every_column() -> None:
    rows = list(reference())
    assert ("BODY.position[COMPONENT]", "m", "mass centre of BODY, world frame") in rows
    assert ("JOINT.qd[NUMBER]", "DISPLACEMENT/s", "rate NUMBER of JOINT") in rows
    assert all(all(row) for row in rows)


def nothing() -> dict[str, object]:
    """An expression without operands."""
    return {}


QUANTITY = MASS_CENTRE.quantities[0]
WRONG: dict[str, ColumnKind] = {
    "no operands": replace(MASS_CENTRE, operands={}, expression=nothing),
    "no quantities": replace(MASS_CENTRE, quantities=()),
    "no expression": replace(MASS_CENTRE, expression=None),
    "the expression's parameters are not its operands": replace(MASS_CENTRE, expression=lambda motion, center: {}),
    "its name is not an identifier": replace(MASS_CENTRE, name="mass centre"),
    "position: no unit": replace(MASS_CENTRE, quantities=(replace(QUANTITY, unit=""),)),
    "position: no text": replace(MASS_CENTRE, quantities=(replace(QUANTITY, text=""),)),
    "position: no output of the expression": replace(MASS_CENTRE, quantities=(replace(QUANTITY, output=""),)),
    "column uses words that a body does not have: joint": replace(
        MASS_CENTRE, quantities=(replace(QUANTITY, column="{joint}.position[{component}]"),)
    ),
    "column lacks {component}": replace(MASS_CENTRE, quantities=(replace(QUANTITY, column="{body}.position"),)),
}


@pytest.mark.parametrize("fault", WRONG)
def test_a_declaration_that_lacks_something_is_refused(fault: str) -> None:
    with pytest.raises(ValueError, match=re.escape(fault)):
        registered(WRONG[fault])


def test_all_faults_are_reported_at_once() -> None:
    bare = ColumnKind(name="", of=MASS_CENTRE.of, operands={}, expression=nothing, quantities=(
        Quantity(name="", column="", unit="", text=""),))  # fmt: skip
    with pytest.raises(ValueError, match=r"not an identifier.*no operands.*no name.*no column.*no unit.*no text"):
        registered(bare)
    with pytest.raises(ValueError, match="column kind mass_centre: declared twice"):
        registered(MASS_CENTRE, MASS_CENTRE)


@pytest.fixture(scope="module")
def told() -> dict[str, object]:
    """Variables in the model description of an FMU of the spherical pendulum."""
    return {v.name: v for v in variables(Model(load_scene("spherical_pendulum"), ("*",)), 0.0, 1e-6)}


def test_an_fmu_reports_what_changes_at_events_alone(told) -> None:
    """In FMI 2.0 these variables are discrete: they change only at events."""
    discrete = {n for n, v in told.items() if v.causality == "output" and v.variability == "discrete"}
    assert discrete == {n for n in told if n.startswith("events.") or ".state" in n or n == "audit.verdict"}
    assert {"events.count", "events.last.time", "events.last.turn", "ball.friction.state[1]", "ball.contact[1].state"} <= discrete


def test_an_fmu_reports_what_forces_act_on_at_once(told) -> None:
    direct = {n for n, v in told.items() if v.direct}
    assert {"ball.qdd[1]", "ball.contact[1].angle", "ball.reaction.force[1]"} <= direct
    assert not {"ball.q[1]", "ball.qd[1]", "energy.kinetic", "events.last.time", "audit.complement"} & direct
    assert told["ball.contact[1].normal_force"].bound == told["events.count"].bound == NOT_NEGATIVE


WITHOUT_DERIVATIVE = ("events.last.time", "events.count", "audit.constraint", "ball.friction.state[1]", "energy.residual")


@pytest.mark.parametrize("name", WITHOUT_DERIVATIVE)
def test_counters_and_audit_columns_have_no_derivative(name: str) -> None:
    scene = load_scene("spherical_pendulum")
    with pytest.raises(SceneError, match=r"has no derivative"):
        check_request(scene, ["joints.ball.friction.mu"], [name], 1.0, None, 1e-9)
