"""FMI 3.0: the description, variables and arrays, derivatives, calls between communication points, states, refusals."""

from __future__ import annotations

import ctypes
import random
import re
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException

from tests.fmu.exported_fmus import arm, exported
from tests.fmu.fmi3.event_mode_host import ERROR, Host3
from tests.fmu.fmpy_host import Host
from tests.fmu.fmpy_validation import validated
from trunnion.basics.errors import SceneError
from trunnion.fmu.scene_export import export
from trunnion.scene import model_names

SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
INPUTS = ("motor", "angle", "inputs.angle.rate", "inputs.angle.acceleration")


def described(file: Path) -> ElementTree.Element:
    """The description of an FMU."""
    with zipfile.ZipFile(file) as z:
        return ElementTree.fromstring(z.read("modelDescription.xml"))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", [*model_names(), "arm"])
def test_fmpy_finds_no_problem_in_any_bundled_model_and_terminals_follow_their_schema(model: str) -> None:
    from lxml import etree

    assert validated(str(exported(model, fmi=3))) == []
    with zipfile.ZipFile(exported(model, fmi=3)) as z:
        names = set(z.namelist())
        found = etree.fromstring(z.read("terminalsAndIcons/terminalsAndIcons.xml"))
        page = z.read("documentation/index.html").decode()
    etree.XMLSchema(etree.parse(str(SCHEMAS / "fmi3TerminalsAndIcons.xsd"))).assertValid(found)
    assert {"documentation/diagram.png", "terminalsAndIcons/icon.png"} <= names
    shown = re.search(r'<img src="(.*?)"', page)
    assert shown is not None
    assert f"documentation/{shown[1]}" in names
    assert "fmi2" not in page
    variables = {v.name for v in read_model_description(exported(model, fmi=3)).modelVariables}
    told = {v for v in variables if not v.endswith((".time", ".count", ".joint_name")) and v != "time"}
    assert not [v for v in told if f"<td>{v}" not in page]
    assert {m.get("variableName") for m in found.iter("TerminalMemberVariable")} <= variables
    assert {f"terminalsAndIcons/{g.get('iconBaseName')}.png" for g in found.iter("TerminalGraphicalRepresentation")} <= names


def test_an_fmu_without_arrays_has_the_variables_of_fmi_2_and_the_same_bits(tmp_path: Path) -> None:
    file = tmp_path / "scalars.fmu"
    export("spherical_pendulum", file, fmi=3, scalars=True)
    assert validated(str(file)) == []
    assert not list(described(file).iter("Dimension"))
    three = {v.name: v for v in read_model_description(file).modelVariables}
    two = {v.name: v for v in read_model_description(exported("spherical_pendulum")).modelVariables}
    assert set(two) <= set(three)
    names = [n for n, v in two.items() if v.type == "Real" and v.causality in ("output", "local")]
    files = (str(file), str(exported("spherical_pendulum")))
    runs = [fmpy.simulate_fmu(f, stop_time=1, output_interval=0.01, output=names) for f in files]
    assert all(np.array_equal(runs[0][n], runs[1][n]) for n in names)
    with pytest.raises(SceneError) as refused:
        export("spherical_pendulum", file, scalars=True)
    assert [p.where for p in refused.value.problems] == ["--scalars"]


def test_driven_and_loaded_joints_have_flanges_of_the_modelica_library_and_others_are_buses() -> None:
    with zipfile.ZipFile(exported("arm", fmi=3)) as z:
        root = ElementTree.fromstring(z.read("terminalsAndIcons/terminalsAndIcons.xml"))
    found = {t.get("name"): t for t in root.iter("Terminal")}
    told = {name: [tuple(m.attrib.values()) for m in t.iter("TerminalMemberVariable")] for name, t in found.items()}
    assert told == {"hip": [("angle", "phi", "signal"), ("hip.drive.effort[1]", "tau", "inflow")],
                    "knee": [("knee.q[1]", "phi", "signal"), ("motor", "tau", "inflow")]}  # fmt: skip
    flange = {("plug", "Modelica.Mechanics.Rotational.Interfaces.Flange_a")}
    assert {(t.get("matchingRule"), t.get("terminalKind")) for t in found.values()} == flange
    with zipfile.ZipFile(exported("spherical_pendulum", fmi=3)) as z:
        root = ElementTree.fromstring(z.read("terminalsAndIcons/terminalsAndIcons.xml"))
    (ball,) = root.iter("Terminal")
    assert (ball.get("matchingRule"), ball.get("terminalKind")) == ("bus", "_trunnion_joint")
    causality = {v.name: v.causality for v in read_model_description(exported("spherical_pendulum", fmi=3)).modelVariables}
    for member in ball.iter("TerminalMemberVariable"):
        assert f"ball.{member.get('memberName')}" == member.get("variableName")
        assert causality[member.get("variableName")] == "output"


def test_components_are_arrays_and_derivatives_of_each_other() -> None:
    host, two = Host3(exported("arm", fmi=3)), Host(exported("arm"))
    assert (host.size("one.position"), host.size("one.orientation"), host.size("knee.q[1]")) == (3, 4, 1)
    derivative = {n: v.derivative.name for n, v in host.of.items() if v.derivative is not None}
    assert derivative["one.velocity"] == "one.position"
    assert derivative["knee.qdd[1]"] == "knee.qd[1]"
    assert host.of["one.position"].valueReference == two.reference["one.position[1]"]
    assert host.get("one.position", "one.orientation") == two.get(
        *(f"one.position[{k}]" for k in (1, 2, 3)), *(f"one.orientation[{k}]" for k in (1, 2, 3, 4)))  # fmt: skip


def test_types_are_those_of_the_values() -> None:
    host = Host3(exported("spherical_pendulum", fmi=3))
    kinds = {n: v.type for n, v in host.of.items()}
    expected = {"ball.q": "Float64", "events.count": "UInt64", "events.last.kind": "Enumeration", "events.last.joint": "Int32",
                "events.last.marginal": "Boolean", "events.last.joint_name": "String", "ball.events.stick": "Clock",
                "solver.max_steps": "UInt64", "solver.host_tolerance": "Enumeration", "time": "Float64"}  # fmt: skip
    assert {n: kinds[n] for n in expected} == expected
    host.run(2.0, 0.5)
    assert host.get("events.last.kind", "events.last.joint", "events.last.marginal") == [1, 1, False]
    for wrong in (host.fmu.getInt32, host.fmu.getUInt64, host.fmu.getFloat32):
        with pytest.raises(FMICallException):
            wrong([host.reference["ball.q"]])
    assert re.search(r"no variables? of type (Int32|UInt64|Float32)", host.log[-1][1])


def test_a_vector_is_set_as_one_and_refused_as_one(tmp_path: Path) -> None:
    file = tmp_path / "whole.fmu"
    export("simple_pendulum", file, whole_vectors=True, fmi=3)
    host = Host3(file, begin=False)
    assert host.size("gravity") == 3
    start = host.get("gravity")
    with pytest.raises(FMICallException) as refused:
        host.put("gravity", 1.0, float("nan"), 2.0)
    assert refused.value.status == ERROR
    assert host.get("gravity") == start
    host.put("gravity", 1.0, 2.0, 3.0)
    assert host.get("gravity") == [1.0, 2.0, 3.0]
    with pytest.raises(FMICallException):
        host.fmu.setFloat64([host.reference["gravity"]], [1.0])
    assert host.log[-1][1] == "nValues must be the number of values of all variables, 3, not 1"


def test_adjoint_derivatives_are_the_directional_ones_transposed() -> None:
    host = Host3(exported("arm", fmi=3))
    host.run(0.37, 0.01)
    unknown = ["two.acceleration", "knee.qdd[1]", "hip.drive.effort[1]", "two.position"]
    n, refs, known = sum(map(host.size, unknown)), [host.reference[u] for u in unknown], [host.reference[k] for k in INPUTS]
    columns = [host.fmu.getDirectionalDerivative(refs, [k], [1.0], nSensitivity=n) for k in known]
    jacobian = np.array(columns).T
    assert np.abs(jacobian).max() > 1.0
    weight, seed = np.random.default_rng(3).normal(size=n), np.random.default_rng(4).normal(size=len(known))
    adjoint = host.fmu.getAdjointDerivative(refs, known, list(weight), nSensitivity=len(known))
    along = host.fmu.getDirectionalDerivative(refs, known, list(seed), nSensitivity=n)
    assert adjoint == pytest.approx(list(weight @ jacobian), rel=1e-12)
    assert weight @ np.array(along) == pytest.approx(np.array(adjoint) @ seed, rel=1e-12)
    with pytest.raises(FMICallException):
        host.fmu.getAdjointDerivative(refs, known, [1.0], nSensitivity=len(known))


def test_derivatives_of_outputs_are_those_of_fmi_2() -> None:
    host, two = Host3(exported("arm", fmi=3), events=False), Host(exported("arm"))
    names = ["knee.q[1]", "energy.kinetic", "knee.qdd[1]"]
    host.step(0.25)
    two.fmu.doStep(0.0, 0.25)
    found = host.fmu.getOutputDerivatives([host.reference[n] for n in names], [1] * len(names))
    assert found == two.fmu.getRealOutputDerivatives([two.reference[n] for n in names], [1] * len(names))
    array = (ctypes.c_double * 3)()
    refs, orders = (ctypes.c_uint * 1)(host.reference["one.position"]), (ctypes.c_int32 * 1)(1)
    host.fmu.fmi3GetOutputDerivatives(host.fmu.component, refs, 1, orders, array, 3)
    assert list(array) == host.get("one.velocity")


class Between:
    """The action of a host that is called between communication points. During this call, the host may use its instance."""

    def __init__(self, act: Callable | None = None):
        self.host: Host3 | None = None
        self.act, self.seen, self.finished = act, [], True

    def __call__(self, environment, time, set_, get, finished, may_return, asked, when) -> None:
        self.finished = self.finished and finished
        self.seen.append((time, *self.host.get("knee.q[1]")))  # type: ignore[union-attr]
        if self.act is not None:
            self.act(self.host, time, may_return, asked, when)


def between(act: Callable | None = None, **how) -> tuple[Host3, Between]:
    """A host of ``arm`` that is informed of every step of the FMU."""
    told = Between(act)
    host = told.host = Host3(exported("arm", fmi=3), between=told, wanted=["knee.q[1]", "motor"], **how)
    return host, told


@pytest.mark.parametrize("early", [True, False])
def test_a_host_that_is_informed_between_communication_points_stops_at_the_same_events(early: bool) -> None:
    hosts = [Host3(exported("spherical_pendulum", fmi=3), early=early, **how) for how in ({}, {"between": lambda *_: None})]
    (plain, rows), (informed, same) = [h.run(3.0, 0.1, "ball.qd") for h in hosts]
    assert len(plain) == 3
    assert [e[:2] for e in informed] == [e[:2] for e in plain]
    assert np.allclose([e[2:] for e in informed], [e[2:] for e in plain], rtol=0.0, atol=1e-60)
    assert np.allclose(same, rows, rtol=0.0, atol=1e-60)


def test_between_communication_points_a_host_sees_the_steps_of_the_run_and_changes_nothing() -> None:
    host, told = between()
    plain, fine = Host3(exported("arm", fmi=3)), Host(exported("arm"))
    assert host.run(0.5, 0.1, "knee.q[1]", "knee.qdd[1]") == plain.run(0.5, 0.1, "knee.q[1]", "knee.qdd[1]")
    times = [t for t, _ in told.seen]
    assert told.finished
    assert times == sorted(times)
    assert len(set(times) - {k * 0.1 for k in range(6)}) > 10
    now = 0.0
    for t, q in told.seen:
        if t > now:
            fine.fmu.doStep(now, t - now)
        assert fine.get("knee.q[1]") == pytest.approx([q], abs=1e-12)
        now = max(now, t)


def test_between_communication_points_inputs_can_be_set_and_parameters_cannot() -> None:
    said = []

    def act(host: Host3, *_) -> None:
        host.put("motor", 5.0)
        try:
            host.put("joints.knee.friction.mu", 0.3)
        except FMICallException as e:
            said.append(e.status)

    host, _ = between(act)
    plain = Host3(exported("arm", fmi=3), motor=5.0)
    host.step(0.4)
    plain.step(0.4)
    assert set(said) == {ERROR}
    assert host.get("motor") == [5.0]
    # the FMU gets the input one internal step later
    assert host.get("knee.q[1]") == pytest.approx(plain.get("knee.q[1]"), abs=1e-2)
    assert host.get("knee.q[1]") != plain.get("knee.q[1]")


def test_a_host_can_end_a_step_where_it_wants() -> None:
    def act(host: Host3, time: float, may_return: bool, asked, when) -> None:
        if may_return and time > 0.05:
            asked[0], when[0] = True, max(time, 0.0815)

    host, _ = between(act, events=False)
    assert host.step(0.2) == (False, False, True, 0.0815)
    plain = Host3(exported("arm", fmi=3), events=False)
    plain.step(0.0815)
    assert host.get("knee.q[1]") == plain.get("knee.q[1]")


def test_no_bit_of_a_state_can_be_turned_unseen_and_the_run_continues() -> None:
    host = Host3(exported("arm", fmi=3))
    host.run(0.1, 0.01)
    state = host.fmu.serializeFMUState(host.fmu.getFMUState())
    chance = random.Random(9)
    for bit in (chance.randrange(8 * len(state)) for _ in range(10_000)):
        changed = bytearray(state)
        changed[bit // 8] ^= 1 << bit % 8
        taken = True
        with suppress(FMICallException):
            host.fmu.deserializeFMUState(bytes(changed))
            taken = False
        assert taken
        assert host.log[-1][0] == ERROR
        assert host.log[-1][1].startswith("these bytes are")
    same = Host3(exported("arm", fmi=3))
    same.run(0.1, 0.01)
    assert host.run(0.3, 0.01, "knee.q[1]") == same.run(0.3, 0.01, "knee.q[1]")


def test_log_tolerance_and_reset_are_as_in_fmi_2() -> None:
    host = Host3(exported("spherical_pendulum", fmi=3), tolerance=1e-9, logging=True)
    host.run(1.0, 0.5)
    said = [text for _, text in host.log]
    assert any("the run uses the tolerance 1e-09 of the host" in text for text in said)
    assert "logEvents" in host.categories
    first = host.get("ball.q")
    host.fmu.reset()
    host.time = 0.0
    host.begin(tolerance=1e-9)
    host.run(1.0, 0.5)
    assert host.get("ball.q") == first


def test_the_same_scene_gives_the_same_bytes_and_each_standard_its_own(tmp_path: Path) -> None:
    export(arm(), tmp_path / "again.fmu", outputs="*", fmi=3)
    assert (tmp_path / "again.fmu").read_bytes() == exported("arm", fmi=3).read_bytes()
    root = described(exported("arm", fmi=3))
    assert root.get("fmiVersion") == "3.0"
    assert root.get("instantiationToken") != read_model_description(exported("arm")).guid
