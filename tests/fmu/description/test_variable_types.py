"""Variables as the standard defines them: types, quantities, derivatives, a short list of outputs, and the scene's information
about itself."""

from __future__ import annotations

import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException

import trunnion
from tests.fmu.exported_fmus import FOLDER, exported
from tests.fmu.fmpy_host import Host
from trunnion.basics.errors import SceneError
from trunnion.fmu.scene_export import export
from trunnion.runtime.abi import EventKind
from trunnion.scene import scene_from_dict, scene_to_dict

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
WHOLE = {
    "events.count": "Integer", "events.last.kind": "EventKind", "ball.friction.state[1]": "SlidingState",
    "ball.contact[1].state": "ContactState", "audit.verdict": "AuditVerdict", "solver.max_steps": "Integer",
    "solver.host_tolerance": "HostTolerance",
}  # fmt: skip


def described(file: Path) -> ElementTree.Element:
    """The description of an FMU."""
    with zipfile.ZipFile(file) as z:
        return ElementTree.fromstring(z.read("modelDescription.xml"))


@BOTH
def test_counts_are_integers_and_kinds_are_enumerations_with_words(flavour: str) -> None:
    file = exported("spherical_pendulum", flavour)
    root, host = described(file), Host(file, logging=True)
    types = {t.get("name"): t for t in root.findall("TypeDefinitions/SimpleType")}
    for v in host.md.modelVariables:
        if v.name in WHOLE:
            assert (v.declaredType.name if v.declaredType else v.type) == WHOLE[v.name]
    words = {int(i.get("value")): i.get("name") for i in types["EventKind"].findall("Enumeration/Item")}
    assert words == {0: "none"} | {e.value: e.name.lower().replace("_", " ") for e in EventKind}
    host.run(0.0, 40, 0.1)
    told = [text for _, text in host.log if text.startswith("event at")]
    count, kind = host.fmu.getInteger([host.reference[n] for n in ("events.count", "events.last.kind")])
    assert (float(count), float(kind)) == tuple(host.get("events.count", "events.last.kind"))
    assert words[kind] in told[-1]
    with pytest.raises(FMICallException):
        host.fmu.getInteger([host.reference["ball.q[1]"]])


@BOTH
def test_whole_numbers_are_set_as_such(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour), solver__step=1e-3)
    most = host.reference["solver.max_steps"]
    host.fmu.setInteger([most], [15])
    assert host.fmu.getInteger([most]) == [15]
    with pytest.raises(FMICallException):
        host.fmu.setInteger([most], [-1])
    host.run(0.0, 3, 0.01)
    with pytest.raises(FMICallException):
        host.fmu.doStep(0.03, 0.1)
    assert "solver.max_steps" in host.log[-1][1]


def test_real_variables_have_the_quantity_of_their_unit() -> None:
    root = described(exported("crank_slider"))
    types = {t.get("name"): t.find("Real") for t in root.findall("TypeDefinitions/SimpleType") if t.find("Real") is not None}
    for v in root.findall("ModelVariables/ScalarVariable"):
        real = v.find("Real")
        if real is not None and real.get("unit") != "1":
            assert types[real.get("declaredType")].get("unit") == real.get("unit"), v.get("name")


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", ["double_pendulum", "spherical_pendulum", "crank_slider"])
def test_declared_derivatives_equal_differences(model: str) -> None:
    """The test uses central differences over half a microsecond on each side. They are as precise as round-off over this time."""
    host, h = Host(exported(model)), 1e-6
    pairs = [(v.name, v.derivative.name) for v in host.md.modelVariables if v.derivative is not None]
    assert {"position", "velocity", "qd"} <= {base.split(".")[-1].partition("[")[0] for _, base in pairs}
    host.run(0.0, 37, 0.01)
    before = host.get(*(b for _, b in pairs))
    host.fmu.doStep(0.37, h / 2)
    slopes = host.get(*(n for n, _ in pairs))
    host.fmu.doStep(0.37 + h / 2, h / 2)
    found = (np.array(host.get(*(b for _, b in pairs))) - before) / h
    assert np.allclose(found, slopes, rtol=1e-5, atol=1e-5 * max(1.0, np.abs(slopes).max()))


@pytest.mark.default_cases(1)
@BOTH
def test_derivatives_of_outputs_are_known(flavour: str) -> None:
    """If the derivative of an output is also an output, the FMU returns its value. A discrete output has the derivative 0. For
    other outputs, the derivative is a forward difference. Reading derivatives changes nothing."""
    host, same = (Host(exported("double_pendulum", flavour)) for _ in range(2))
    names = ["guide.q[1]", "guide.qd[2]", "upper.position[3]", "energy.kinetic", "cross.friction.torque[1]"]
    names.append("guide.friction.state[1]")
    for h in (host, same):
        h.run(0.0, 37, 0.01)
    found = host.fmu.getRealOutputDerivatives([host.reference[n] for n in names], [1] * len(names))
    assert found[:3] == host.get("guide.qd[1]", "guide.qdd[2]", "upper.velocity[3]")
    assert found[5] == 0.0
    assert host.run(0.37, 3, 0.01, *names) == same.run(0.37, 3, 0.01, *names)
    other, h = Host(exported("double_pendulum", flavour)), 1e-5
    other.run(0.0, 37, 0.01)
    now = np.array(other.get(*names[3:5]))
    other.fmu.doStep(0.37, h)
    assert found[3:5] == pytest.approx((np.array(other.get(*names[3:5])) - now) / h, rel=1e-3)
    with pytest.raises(FMICallException):
        host.fmu.getRealOutputDerivatives([host.reference["guide.q[1]"]], [2])


def test_outputs_are_few_unless_the_scene_or_the_user_says_which(tmp_path: Path) -> None:
    md = read_model_description(exported("crank_slider"))
    kinds = {v.name: v.causality for v in md.modelVariables}
    outputs = [n for n, c in kinds.items() if c == "output"]
    assert {"guide.q[1]", "slider_pin.friction.torque[1]", "slider_pin.contact[1].normal_force", "events.count"} <= set(outputs)
    assert kinds["rod.acceleration[1]"] == kinds["events.last.kind"] == "local"
    assert len(outputs) <= 0.4 * sum(c in ("output", "local") for c in kinds.values())
    assert {u.variable.name for u in md.outputs} == {u.variable.name for u in md.initialUnknowns} == set(outputs)
    named = export("crank_slider", tmp_path / "named.fmu", outputs=["*"])
    assert named.variables["local"] == 0
    got = simulate_fmu(str(exported("crank_slider")), stop_time=0.01, output=["rod.acceleration[1]"])
    assert np.isfinite(got["rod.acceleration[1]"]).all()


def test_the_scene_says_who_made_it_which_version_it_is_and_of_which_day(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    plain = scene_to_dict(trunnion.load_scene("simple_pendulum"))
    said = {"author": "Ada L.", "version": "2.1", "date": "2026-11-23"}
    file = FOLDER / "said.fmu"
    export(scene_from_dict(plain | said), file)
    root = described(file)
    assert {k: root.get(k) for k in ("author", "version")} == {k: said[k] for k in ("author", "version")}
    assert root.get("generationDateAndTime") == "2026-11-23T00:00:00Z"
    for wrong in ("23.11.2026", "2026-02-30", "20261123"):
        with pytest.raises(SceneError, match="is not a date"):
            scene_from_dict(plain | {"date": wrong})
