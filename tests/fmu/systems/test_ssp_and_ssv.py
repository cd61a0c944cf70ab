"""Systems of FMUs as SSP files, and parameters as SSV files: fmpy runs and reads them."""

from __future__ import annotations

import json
import math
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssm, read_ssv
from scipy.integrate import solve_ivp

from tests.fmu.exported_fmus import arm, exported
from tests.fmu.fmpy_host import Host
from trunnion import load_scene, simulate
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.cli.command_group import COMMAND
from trunnion.fmu.scene_export import export
from trunnion.fmu.ssp.system_export import SSD, SUMS, export_system
from trunnion.fmu.variables.input_sums import Source
from trunnion.scene import scene_to_yaml

ROTOR = """
name: rotor
gravity: [0, 0, 0]
inputs: {load: {unit: N*m, start: 2}}
bodies: {disc: {mass: 1, inertia: [1, 1, 2]}}
joints: {shaft: {type: revolute, axis: z, inboard: ground, outboard: disc, effort: {input: load}, damping: 0.5}}
simulation: {until: 1 s, every: 10 ms}
"""
SYSTEM = """
name: pair
components:
  rotor: {scene: rotor.yaml, set: {joints.shaft.damping: 0.4}, parameters: {"joints.shaft.start.qd[1]": 3 rad/s}}
  arm: {fmu: arm.fmu, parameters: {joints.knee.friction.mu: 0.2}}
connections:
  - {connect: "arm.hip.drive.effort[1] -> rotor.load", factor: -2, offset: 0.5}
  - {connect: "arm.hip.drive.reaction[1] -> rotor.load", factor: -1}
  - {connect: "rotor.shaft.q[1] -> arm.angle", offset: 0.25}
simulation: {until: 0.2 s, step: 10 ms}
"""
MODELS = Path(__file__).parents[3] / "models" / "systems"
SYSTEMS = {
    "rotor_and_arm": ({"rotor.shaft.q[1]": "shaft.q[1]"}, (0.02, 0.01, 0.005)),
    "carts_and_springs": (
        {"first.guide.q[1]": "first_guide.q[1]", "second.guide.q[1]": "second_guide.q[1]"}, (0.01, 0.005, 0.0025)),
}
"""The systems of fmu/README.md: outputs and their columns in the scene of the whole; communication steps."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the system and its parts."""
    made = tmp_path_factory.mktemp("system")
    (made / "rotor.yaml").write_text(ROTOR)
    (made / "system.yaml").write_text(SYSTEM)
    # the copy of the FMU gives a variable in another unit
    with zipfile.ZipFile(exported("arm")) as given, zipfile.ZipFile(made / "arm.fmu", "w") as z:
        for name in given.namelist():
            data = given.read(name)
            if name == "modelDescription.xml":
                data = re.sub(rb'(<Unit name="mN\*m">\s*<BaseUnit)', rb'\1 factor="0.001"', data.replace(b'"N*m"', b'"mN*m"'))
            z.writestr(name, data)
    return made


def test_a_system_of_a_scene_and_an_fmu_runs_in_fmpy_as_its_parts_do_side_by_side(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In fmpy all parts step first, then fmpy passes outputs to inputs. Before the first step it passes nothing. fmpy ignores
    factors, offsets and units; the FMU of the scene applies them, and adds its sources."""
    assert main(["ssp", str(folder / "system.yaml"), "-o", str(folder / "pair.ssp")]) == 0
    assert "components rotor, arm; 3 connections, 2 parameters" in capsys.readouterr().out
    file, h, steps = str(folder / "pair.ssp"), 0.01, 20
    with zipfile.ZipFile(file) as z:
        (folder / "values.ssv").write_bytes(z.read("resources/parameters.ssv"))
        (folder / "rotor.fmu").write_bytes(z.read("resources/rotor.fmu"))
    values = read_ssv(str(folder / "values.ssv"))
    assert {(p.name, p.value, p.unit) for p in values.parameters} == {
        ("rotor.joints.shaft.start.qd[1]", "3.0", "rad/s"), ("arm.joints.knee.friction.mu", "0.2", "1")}  # fmt: skip
    got = simulate_ssp(file, stop_time=steps * h - h / 2, step_size=h, parameter_set=values)
    export(load_scene(folder / "rotor.yaml"), folder / "plain.fmu", overrides={"joints.shaft.damping": 0.4})
    rotor, other = Host(folder / "plain.fmu", begin=False), Host(exported("arm"), begin=False)
    rotor.put("joints.shaft.start.qd[1]", 3.0)
    other.put("joints.knee.friction.mu", 0.2)
    for host in (rotor, other):
        host.fmu.exitInitializationMode()
    effort = angle = 0.0
    for k in range(steps):
        rotor.put("load", 0.001 * -2 * effort + 0.5 + 0.001 * effort)
        other.put("angle", angle)
        rotor.fmu.doStep(k * h, h)
        other.fmu.doStep(k * h, h)
        (effort,), (angle,) = other.get("hip.drive.effort[1]"), rotor.get("shaft.q[1]")
        assert got["rotor.shaft.q[1]"][k] == pytest.approx(angle, abs=1e-9)
        assert got["arm.knee.q[1]"][k] == pytest.approx(other.get("knee.q[1]")[0], abs=1e-6)
    assert angle > 0.3


def test_an_input_with_sources_is_their_sum_in_values_derivatives_and_states(folder: Path) -> None:
    """A source is multiplied by its factor, also in directional derivatives and in derivatives with respect to time. A source is
    part of the FMU's state, and the description lists it as dependency. Before a source is set, the sum is the start value of the
    scene."""
    one = [Source(-2.0, 0.5), Source(4.0)]
    export(load_scene(folder / "rotor.yaml"), folder / "sum.fmu", sums={"load": one}, outputs="*")
    host = Host(folder / "sum.fmu", begin=False)
    of, load = host.reference, "inputs.load.source"
    assert host.get("load", f"{load}[1]", f"{load}[2]") == [2.0, -0.75, 0.0]
    (outer,) = [v for v in host.md.outputs if v.variable.name == "shaft.qdd[1]"]
    assert [v.name for v in outer.dependencies] == [f"{load}[1]", f"{load}[2]"]
    host.fmu.exitInitializationMode()
    host.put(f"{load}[2]", 3.0)
    before = host.fmu.getFMUState()
    host.put(f"{load}[1]", 1.0)
    assert host.get("load") == [10.5]
    host.fmu.setFMUState(before)
    assert host.get("load", f"{load}[1]") == [14.0, -0.75]
    row = [host.fmu.getDirectionalDerivative([of["shaft.qdd[1]"]], [of[x]], [1.0])[0] for x in (f"{load}[1]", f"{load}[2]")]
    assert row == pytest.approx([-2.0 / 2.0, 4.0 / 2.0])
    host.fmu.setRealInputDerivatives([of[f"{load}[1]"], of[f"{load}[2]"]], [1, 1], [1.0, 1.0])
    host.fmu.doStep(0.0, 0.1)
    host.put("joints.shaft.damping", 0.0)  # the changed parameter ends the internal step at this time
    rate = host.get("shaft.qd[1]")[0]
    exact = solve_ivp(lambda t, w: (14.0 + 2.0 * t - 0.5 * w) / 2.0, (0, 0.1), [0.0], rtol=1e-10, atol=1e-12).y[0, -1]
    assert rate == pytest.approx(exact, abs=1e-6)
    with pytest.raises(FMICallException):
        host.put("load", 1.0)


@pytest.mark.parametrize("name", SYSTEMS)
def test_each_documented_system_converges_to_the_scene_of_the_whole_by_first_order(name: str, tmp_path: Path) -> None:
    """fmpy reads no bindings and no values, and adds no signals. Therefore the FMUs have these values as start values, and the FMUs
    add. Springs are components without masses."""
    made = export_system(MODELS / f"{name}.yaml", tmp_path / "whole.ssp")
    columns, steps = SYSTEMS[name]
    until = 1.0
    exact = simulate(MODELS / f"{name}_in_one.yaml", until=until, every=until, rtol=1e-9)
    runs = [(h, simulate_ssp(str(made.file), stop_time=until - h / 2, step_size=h)) for h in steps]
    off = [math.hypot(*(float(got[x][-1] - exact[y][-1]) for x, y in columns.items())) for _, got in runs]
    assert off[-1] < 0.02
    assert 1.6 < off[0] / off[1] < 2.5
    assert 1.6 < off[1] / off[2] < 2.5


def test_every_documented_system_is_among_them() -> None:
    assert {p.stem for p in MODELS.glob("*.yaml") if "\ncomponents:" in p.read_text()} == set(SYSTEMS)


def test_the_structure_follows_its_schema_and_connectors_have_the_units_of_their_variables(folder: Path) -> None:
    made = export_system(folder / "system.yaml", folder / "again.ssp")
    told = read_ssd(str(made.file))  # ``read_ssd`` also validates the file
    assert [c.name for c in told.system.elements] == ["rotor", "arm"]
    with zipfile.ZipFile(made.file) as z:
        root = ElementTree.fromstring(z.read("SystemStructure.ssd"))
    kinds = {(e.get("name"), c.get("name")): (c.get("kind"), c[0].get("unit"))
             for e in root.iter(f"{{{SSD}}}Component") for c in e.iter(f"{{{SSD}}}Connector")}  # fmt: skip
    assert kinds["rotor", "inputs.load.source[1]"] == ("input", "mN*m")
    assert kinds["arm", "angle"] == ("input", "rad")
    assert ("arm", "motor") not in kinds
    assert kinds["arm", "hip.drive.effort[1]"] == ("output", "mN*m")
    of = {c.get("endConnector"): [dict(t.attrib) for t in c] for c in root.iter(f"{{{SSD}}}Connection")}
    sources = {f"inputs.load.source[{i}]": [] for i in (1, 2)}
    assert of == sources | {"angle": [{"factor": "1.0", "offset": "0.25"}]}
    assert made.file.read_bytes() == export_system(folder / "system.yaml", folder / "third.ssp").file.read_bytes()


WRONG = """
components:
  rotor: {scene: rotor.yaml, parameters: {joints.shaft.dampin: 1, joints.shaft.damping: 3 kg}}
  arm: {fmu: arm.fmu}
connections:
  - arm.hip.drive.effort[1] -> rotor.load
  - arm.knee.q[1] -> rotor.load
  - arm.knee.q[2] -> arm.motor
  - rotor.load -> arm.motor
  - crank.q -> arm.angle
  - arm.hip.drive.effort[1] -> rotor.load
"""


def test_everything_wrong_with_a_system_is_reported_at_once_with_its_line(folder: Path) -> None:
    file = folder / "wrong.yaml"
    file.write_text(WRONG)
    with pytest.raises(SceneError) as refused:
        export_system(file, folder / "wrong.ssp")
    told = [(p.line, p.what, p.hint) for p in refused.value.problems]
    assert told == [
        (3, "rotor has no parameter joints.shaft.dampin", "did you mean joints.shaft.damping?"),
        (3, "3 kg is not a value in N*m*s/rad", ""),
        (7, "rad cannot be connected to N*m", "connect quantities of one kind"),
        (8, "arm has no variable knee.q[2]", "did you mean knee.q[1]?"),
        (9, "load of rotor is not an output (it is input)", ""),
        (9, "arm.motor has two sources", SUMS),
        (10, "there is no component crank", "one of rotor, arm"),
        (11, "arm.hip.drive.effort[1] and rotor.load are connected twice", "remove one, or use a factor"),
    ]
    assert not (folder / "wrong.ssp").exists()


def test_a_start_value_that_is_not_allowed_is_refused_with_its_component(folder: Path) -> None:
    file = folder / "negative.yaml"
    file.write_text("components: {rotor: {scene: rotor.yaml, parameters: {joints.shaft.damping: -1}}}")
    with pytest.raises(SceneError) as refused:
        export_system(file, folder / "negative.ssp")
    told = [(p.where, p.what) for p in refused.value.problems]
    assert told == [("components.rotor: joints.shaft.damping", "damping must not be negative (it is -1)")]


MAPPED = """
components:
  rotor: {scene: rotor.yaml, outputs: [shaft.*]}
  arm: {fmu: arm.fmu}
parameters: PARAMETERS
mappings: MAPPINGS
"""
VALUES = {"start rate": "2 rad/s", "loss": 0.15, "torque": "3 N*m", "rotor.joints.shaft.start.q[1]": "90 deg", "gear": 3.5}
LINKS = [
    {"map": "start rate -> rotor.joints.shaft.start.qd[1]", "factor": -1.5, "offset": 0.5},
    "loss -> arm.joints.knee.friction.mu",
    {"map": "loss -> rotor.joints.shaft.damping", "factor": 2},
    "torque -> arm.motor",
]


def mapped(folder: Path, parameters: object, mappings: object) -> Path:
    """The system with these parameters, exported."""
    file = folder / "mapped.yaml"
    file.write_text(MAPPED.replace("PARAMETERS", json.dumps(parameters)).replace("MAPPINGS", json.dumps(mappings)))
    return export_system(file, folder / "mapped.ssp").file


def test_parameters_of_a_system_reach_start_values_and_files_by_their_mapping(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A scene's FMU starts with its values in every host. SSV and SSM files contain these values for hosts that read parameter
    files. A given file has the same effect as its contents. A value is converted into the unit of its variable before the
    factor."""
    made = mapped(folder, VALUES, LINKS)
    assert main(["ssp", str(folder / "mapped.yaml"), "-o", str(folder / "again.ssp")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "  parameters that no variable takes: gear"
    with zipfile.ZipFile(made) as z:
        z.extractall(folder / "mapped")
    resources = folder / "mapped" / "resources"
    rotor = {v.name: v for v in read_model_description(str(resources / "rotor.fmu")).modelVariables}
    expected = {"joints.shaft.start.qd[1]": -2.5, "joints.shaft.start.q[1]": math.pi / 2, "joints.shaft.damping": 0.3}
    assert {n: float(rotor[n].start) for n in expected} == expected
    got = simulate_ssp(str(made), stop_time=0.01, step_size=1e-3)
    assert got["rotor.shaft.qd[1]"][0] == pytest.approx(-2.5, abs=1e-2)
    values = {p.name: (float(p.value), p.unit) for p in read_ssv(str(resources / "parameters.ssv")).parameters}
    assert values == {f"rotor.{n}": (x, rotor[n].unit) for n, x in expected.items()} | {
        "arm.joints.knee.friction.mu": (0.15, "1"), "arm.motor": (3000.0, "mN*m")}  # fmt: skip
    given = {p.name: (float(p.value), p.unit) for p in read_ssv(str(resources / "system_parameters.ssv")).parameters}
    assert given == {"start rate": (2.0, "rad/s"), "loss": (0.15, None), "torque": (3.0, "N*m"), "gear": (3.5, None),
                     "rotor.joints.shaft.start.q[1]": (90.0, "deg")}  # fmt: skip
    links = [(e.source, e.target, e.transformation and (float(e.transformation.factor), float(e.transformation.offset)))
             for e in read_ssm(str(resources / "parameter_mapping.ssm")).mappingEntries]  # fmt: skip
    assert links == [
        ("start rate", "rotor.joints.shaft.start.qd[1]", (-1.5, 0.5)), ("loss", "arm.joints.knee.friction.mu", None),
        ("loss", "rotor.joints.shaft.damping", (2.0, 0.0)), ("torque", "arm.motor", None)]  # fmt: skip
    of, last = read_ssd(str(made)).system.parameterBindings  # if a value has two bindings, the last binding counts
    assert [len(b.parameterMapping) for b in (of, last)] == [0, 1]
    for name in ("system_parameters.ssv", "parameter_mapping.ssm"):
        (folder / name).write_bytes((resources / name).read_bytes())
    assert mapped(folder, "system_parameters.ssv", "parameter_mapping.ssm").read_bytes() == made.read_bytes()


def test_wrong_parameters_of_a_system_and_transformations_that_cannot_be_applied_are_reported(folder: Path) -> None:
    wrong = ["los -> arm.joints.knee.friction.mu", "loss -> leg.x", "loss -> rotor.joints.shaft.dampin", "torque -> rotor.load",
             "torque -> rotor.joints.shaft.damping", "torque -> rotor.load", "torque -> rotor"]  # fmt: skip
    with pytest.raises(SceneError) as refused:
        mapped(folder, VALUES, wrong[-1:])
    assert [p.where for p in refused.value.problems] == ["mappings[1]"]
    with pytest.raises(SceneError) as refused:
        mapped(folder, VALUES, wrong[:-1])
    assert [(p.where, p.what) for p in refused.value.problems] == [
        ("mappings[1]", "there is no parameter los"),
        ("mappings[2]", "there is no component leg"),
        ("mappings[6]", "rotor.load has two values"),
        ("mappings[3]", "rotor has no parameter joints.shaft.dampin"),
        ("mappings[5]", "3 N*m is not a value in N*m*s/rad"),
    ]
    space = "http://ssp-standard.org/SSP1/SystemStructure"
    text = (
        f'<ssm:ParameterMapping xmlns:ssm="{space}ParameterMapping" xmlns:ssc="{space}Common" version="1.0"><ssm:MappingEntry'
        ' source="loss" target="arm.x" OPTION>INSIDE</ssm:MappingEntry></ssm:ParameterMapping>'
    )
    boolean = '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/></ssc:BooleanMappingTransformation>'
    for option, inside, what in (("", boolean, "BooleanMappingTransformation"), ('suppressUnitConversion="true"', "", "units"),
                                 ("mass='2'", "", "cannot be read")):  # fmt: skip
        (folder / "odd.ssm").write_text(text.replace("OPTION", option).replace("INSIDE", inside))
        with pytest.raises(SceneError, match=what):
            mapped(folder, VALUES, "odd.ssm")
    with pytest.raises(SceneError, match=r"there is no file .*none.ssv"):
        mapped(folder, "none.ssv", [])


UNREADABLE = """
components:
  a: {scene: crank_slider, fmu: x.fmu}
  b c: {fmus: x.fmu}
  d: {fmu: arm.fmu, set: {a: 1}}
connections: [a -> b, 7, {connect: a.x -> b.y, factor: 3 N, scale: 2}]
simulation: {until: -1 s, step: 2 kg}
"""


def test_a_file_that_makes_no_sense_is_reported_key_by_key(folder: Path) -> None:
    file = folder / "odd.yaml"
    file.write_text(UNREADABLE)
    with pytest.raises(SceneError) as refused:
        export_system(file, folder / "odd.zip")
    assert {p.where for p in refused.value.problems} == {"-o"}
    with pytest.raises(SceneError) as refused:
        export_system(file, folder / "odd.ssp")
    found = {(p.where, p.line) for p in refused.value.problems}
    assert {("components.a", 3), ("components.b c", 4), ("components.b c.fmus", 4), ("components.d.set", 5)} <= found
    assert {("connections[1]", 6), ("connections[2]", 6), ("simulation.until", 7), ("simulation.step", 7)} <= found
    assert {("connections[3].factor", 6), ("connections[3].scale", 6)} <= found
    for name, what in (("none.fmu", "there is no file"), ("odd.yaml", "cannot be read")):
        file.write_text(f"components: {{a: {{fmu: {name}}}}}")
        with pytest.raises(SceneError, match=what):
            export_system(file, folder / "odd.ssp")


def test_the_parameters_of_a_scene_are_written_beside_its_fmu(tmp_path: Path) -> None:
    scene, file, values = tmp_path / "arm.yaml", tmp_path / "arm.fmu", tmp_path / "arm.ssv"
    scene.write_text(scene_to_yaml(arm()))
    words = [str(scene), "-o", str(file), "--parameters-file", str(values), "--set", "joints.knee.friction.mu=0.15"]
    assert main(["fmu", *words]) == 0
    # ``read_ssv`` also validates the file
    told = {p.name: (p.type, float(p.value), p.unit) for p in read_ssv(str(values)).parameters}
    variables = {v.name: v for v in read_model_description(file).modelVariables if v.causality == "parameter"}
    assert set(variables) - set(told) == {"solver.host_tolerance"}
    assert told["joints.knee.friction.mu"] == ("Real", 0.15, "1")
    assert told["solver.max_steps"][0] == "Integer"
    assert {n: v for n, (_, v, _) in told.items()} == {n: float(variables[n].start) for n in told}
    assert all(unit == variables[n].unit for n, (kind, _, unit) in told.items() if kind == "Real")
    with pytest.raises(SceneError) as refused:
        COMMAND.main(["fmu", *words, "--fmi", "3"], standalone_mode=False)
    assert [p.where for p in refused.value.problems] == ["--parameters-file"]
