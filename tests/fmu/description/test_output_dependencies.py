"""Declared dependencies of outputs include all actual dependencies and few others. The test finds actual dependencies by
differences."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

from tests.fmu.cosimulation.test_parts_kernel import of_parts
from tests.fmu.exported_fmus import FOLDER, arm, exported
from tests.fmu.fmpy_host import Host
from tests.fmu.systems.scenarios import motor_and_crank
from trunnion.fmu.scene_export import export

MADE = {"arm": arm, "motor": motor_and_crank.motor, "crank": motor_and_crank.crank_slider}
STEPS = ((0, 0.01), (7, 0.01), (40, 0.005))


@cache
def made(name: str) -> Path:
    """The FMU of a scene with inputs. All columns of the scene are outputs."""
    file = FOLDER / f"depends-{name}.fmu"
    export(MADE[name](), file, outputs="*")
    return file


def declared(file: Path, at_start: bool) -> dict[str, set[str]]:
    """The variables on which each output depends according to the description."""
    md = read_model_description(file)
    return {u.variable.name: {d.name for d in u.dependencies} for u in (md.initialUnknowns if at_start else md.outputs)}


def inputs_of(host: Host) -> list[str]:
    """Names of the inputs."""
    return [v.name for v in host.md.modelVariables if v.causality == "input"]


def moved(host: Host, name: str, by: float, outputs: list[str]) -> set[str]:
    """The outputs that change immediately with a variable."""
    before, value = host.get(*outputs), host.get(name)[0]
    host.put(name, value + by)
    after = host.get(*outputs)
    host.put(name, value)
    host.get(*outputs)
    return {o for o, a, b in zip(outputs, before, after, strict=True) if a != b}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("file", [lambda: made("arm"), lambda: made("motor"), lambda: made("crank"), lambda: of_parts("arm")])
def test_no_output_depends_on_more_than_is_declared(file) -> None:
    """Dependencies during the motion and at the start, on inputs and on parameters. The test excludes results of the audit."""
    now, start = declared(file(), at_start=False), declared(file(), at_start=True)
    for steps, h in STEPS:
        host = Host(file())
        outputs = [o for o in host.all_outputs() if not o.startswith("audit.")]
        host.run(0.0, steps, h)
        for name in inputs_of(host):
            assert {o for o in moved(host, name, 1e-3, outputs) if name not in now[o]} == set(), name
    host = Host(file(), begin=False)
    own = {v.name: float(v.start) for v in host.md.modelVariables if v.causality == "parameter" and "solver." not in v.name}
    for name in [*inputs_of(host), *own]:
        by = 1e-3 * max(1.0, abs(own.get(name, 0.0)))
        assert {o for o in moved(host, name, by, outputs) if name not in start[o]} == set(), name


def test_little_more_is_declared_than_there_is() -> None:
    """Of the outputs that are declared to depend on the angle, four in five change with the angle in one of three states. The other
    outputs are zero only for these numbers, or are states of contacts."""
    now, found = declared(made("arm"), at_start=False), set()
    for steps, h in STEPS:
        host = Host(made("arm"))
        host.run(0.0, steps, h)
        found |= moved(host, "angle", 1e-2, host.all_outputs())
    said = {o for o in now if "angle" in now[o]}
    assert len(found & said) >= 0.8 * len(said)


def test_events_audit_and_structural_zeros_depend_on_no_input() -> None:
    now = declared(made("crank"), at_start=False)
    assert not [o for o in now if o.startswith(("events.", "audit.")) and now[o]]
    assert now["crank.acceleration[3]"] == now["crank.angular_velocity[1]"] == set()
    said = {o for o, inputs in declared(made("motor"), at_start=False).items() if inputs}
    # the reaction torque is about the axis of the effort
    efforts = {"shaft.effort[1]", "shaft.effort.power[1]", "shaft.reaction.torque[1]"}
    assert said == {"shaft.qdd[1]", *efforts}


def test_declared_dependencies_of_motor_and_crank_form_no_algebraic_loop() -> None:
    """The crank follows the angle of a motor. The torque of the crank's drive acts on the motor. Neither the start nor a
    communication point has an algebraic loop."""
    links = {"angle": "shaft.q[1]", "load": motor_and_crank.LOAD}
    for at_start in (True, False):
        needs = declared(made("crank"), at_start) | declared(made("motor"), at_start)
        reached, todo = set(), [motor_and_crank.LOAD]
        while todo:
            todo = [links[i] for o in todo for i in needs[o] if i in links]
            assert motor_and_crank.LOAD not in todo
            reached |= set(todo)
        assert reached == {"shaft.q[1]"}


def test_every_unknown_says_its_dependencies_and_their_kind() -> None:
    md = read_model_description(exported("crank_slider"))
    for unknown in (*md.outputs, *md.initialUnknowns):
        assert unknown.dependencies is not None
        assert unknown.dependenciesKind is not None
        assert len(unknown.dependencies) == len(unknown.dependenciesKind)
    assert np.mean([len(u.dependencies) for u in md.initialUnknowns]) > 1
