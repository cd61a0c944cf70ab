"""Systems of FMUs as SSP files, and parameters as SSV files: fmpy runs and reads them."""

from __future__ import annotations

import math
import shutil
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from scipy.integrate import solve_ivp

from tests.fmu.fmpy_host import Host, arm, exported
from trunnion.basics.problems import SceneError
from trunnion.cli import main
from trunnion.cli.command_group import COMMAND
from trunnion.fmu.ssp.system_export import SSD, SUMS, export_system
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
  - {connect: "arm.hip.drive.effort[1] -> rotor.load", factor: -1, offset: 0.5}
  - rotor.shaft.q[1] -> arm.angle
simulation: {until: 0.2 s, step: 10 ms}
"""
ROOT = Path(__file__).parents[3]
DAMPING, STEPS = 0.6, (0.02, 0.01, 0.005)
DOCUMENTED = ROOT / "models" / "systems" / "rotor_and_arm.yaml"
"""The system that fmu/README.md runs."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the system and its parts."""
    made = tmp_path_factory.mktemp("system")
    (made / "rotor.yaml").write_text(ROTOR)
    (made / "system.yaml").write_text(SYSTEM)
    shutil.copyfile(exported("arm"), made / "arm.fmu")
    return made


def test_a_system_of_a_scene_and_an_fmu_runs_in_fmpy_as_its_parts_do_side_by_side(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """fmpy's order: first all parts step, then it passes on outputs; before the first step it passes nothing. It does not apply
    factor and offset."""
    assert main(["ssp", str(folder / "system.yaml"), "-o", str(folder / "pair.ssp")]) == 0
    assert "components rotor, arm; 2 connections, 2 parameters" in capsys.readouterr().out
    file, h, steps = str(folder / "pair.ssp"), 0.01, 20
    with zipfile.ZipFile(file) as z:
        (folder / "values.ssv").write_bytes(z.read("resources/parameters.ssv"))
        (folder / "rotor.fmu").write_bytes(z.read("resources/rotor.fmu"))
    values = read_ssv(str(folder / "values.ssv"))
    assert {(p.name, p.value, p.unit) for p in values.parameters} == {
        ("rotor.joints.shaft.start.qd[1]", "3.0", "rad/s"), ("arm.joints.knee.friction.mu", "0.2", "1")}  # fmt: skip
    got = simulate_ssp(file, stop_time=steps * h - h / 2, step_size=h, parameter_set=values)
    rotor, other = Host(folder / "rotor.fmu", begin=False), Host(exported("arm"), begin=False)
    other.put("joints.knee.friction.mu", 0.2)
    assert rotor.get("joints.shaft.damping", "joints.shaft.start.qd[1]") == [0.4, 3.0]
    for host in (rotor, other):
        host.fmu.exitInitializationMode()
    load = angle = 0.0
    for k in range(steps):
        rotor.put("load", load)
        other.put("angle", angle)
        rotor.fmu.doStep(k * h, h)
        other.fmu.doStep(k * h, h)
        (load,), (angle,) = other.get("hip.drive.effort[1]"), rotor.get("shaft.q[1]")
        assert got["rotor.shaft.q[1]"][k] == pytest.approx(angle, abs=1e-9)
        assert got["arm.knee.q[1]"][k] == pytest.approx(other.get("knee.q[1]")[0], abs=1e-6)
    assert angle > 0.3


def test_the_documented_system_converges_to_the_equation_of_the_whole_by_first_order(tmp_path: Path) -> None:
    """A rotor (4 kg m², whose damping the system sets) carries a bar that hangs on its hub: one freedom. Cut in two, the rotor
    tells its angle with rate and acceleration, and the drive its reaction. fmpy reads neither bindings nor values: the damping is
    the start value of the FMU. With the effort in place of the reaction, the rotor turns the other way."""
    made = export_system(DOCUMENTED, tmp_path / "pair.ssp")
    mass, length, side, until = 0.6 * 0.04 * 0.04 * 7800, 0.6, 0.04, 1.0
    inertia = 4.0 + mass * (length**2 + side**2) / 12 + mass * (length / 2) ** 2

    def rate(_: float, y: np.ndarray) -> list[float]:
        return [y[1], (-DAMPING * y[1] - mass * 9.81 * length / 2 * math.cos(y[0])) / inertia]

    exact = solve_ivp(rate, (0, until), [0, 0], rtol=1e-10, atol=1e-12).y[0, -1]
    off = [float(simulate_ssp(str(made.file), stop_time=until - h / 2, step_size=h)["rotor.shaft.q[1]"][-1]) - exact for h in STEPS]
    assert abs(off[-1]) < 0.02
    assert 1.6 < off[0] / off[1] < 2.5
    assert 1.6 < off[1] / off[2] < 2.5


def test_the_structure_follows_its_schema_and_connectors_have_the_units_of_their_variables(folder: Path) -> None:
    made = export_system(folder / "system.yaml", folder / "again.ssp")
    told = read_ssd(str(made.file))  # which validates
    assert [c.name for c in told.system.elements] == ["rotor", "arm"]
    with zipfile.ZipFile(made.file) as z:
        root = ElementTree.fromstring(z.read("SystemStructure.ssd"))
    kinds = {(e.get("name"), c.get("name")): (c.get("kind"), c[0].get("unit"))
             for e in root.iter(f"{{{SSD}}}Component") for c in e.iter(f"{{{SSD}}}Connector")}  # fmt: skip
    assert kinds["rotor", "load"] == ("input", "N*m")
    assert kinds["arm", "angle"] == ("input", "rad")
    assert ("arm", "motor") not in kinds
    assert kinds["arm", "hip.drive.effort[1]"] == ("output", "N*m")
    of = {c.get("endConnector"): [dict(t.attrib) for t in c] for c in root.iter(f"{{{SSD}}}Connection")}
    assert of == {"load": [{"factor": "-1.0", "offset": "0.5"}], "angle": []}
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
"""


def test_everything_wrong_with_a_system_is_told_at_once_with_its_line(folder: Path) -> None:
    file = folder / "wrong.yaml"
    file.write_text(WRONG)
    with pytest.raises(SceneError) as refused:
        export_system(file, folder / "wrong.ssp")
    told = [(p.line, p.what, p.hint) for p in refused.value.problems]
    assert told == [
        (3, "rotor has no parameter joints.shaft.dampin", "did you mean joints.shaft.damping?"),
        (3, "3 kg is not a value in N*m*s/rad", ""),
        (7, "rad cannot be connected to N*m", "connect quantities of one kind"),
        (7, "rotor.load has two sources", SUMS),
        (8, "arm has no variable knee.q[2]", "did you mean knee.q[1]?"),
        (9, "load of rotor is not an output (it is input)", ""),
        (9, "arm.motor has two sources", SUMS),
        (10, "there is no component crank", "one of rotor, arm"),
    ]
    assert not (folder / "wrong.ssp").exists()


def test_a_start_value_that_is_not_allowed_is_refused_with_its_component(folder: Path) -> None:
    file = folder / "negative.yaml"
    file.write_text("components: {rotor: {scene: rotor.yaml, parameters: {joints.shaft.damping: -1}}}")
    with pytest.raises(SceneError) as refused:
        export_system(file, folder / "negative.ssp")
    told = [(p.where, p.what) for p in refused.value.problems]
    assert told == [("components.rotor: joints.shaft.damping", "damping must not be negative (it is -1)")]


UNREADABLE = """
components:
  a: {scene: crank_slider, fmu: x.fmu}
  b c: {fmus: x.fmu}
  d: {fmu: arm.fmu, set: {a: 1}}
connections: [a -> b, 7, {connect: a.x -> b.y, factor: 3 N, scale: 2}]
simulation: {until: -1 s, step: 2 kg}
"""


def test_a_file_that_makes_no_sense_is_told_key_by_key(folder: Path) -> None:
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
    told = {p.name: (p.type, float(p.value), p.unit) for p in read_ssv(str(values)).parameters}  # which validates
    variables = {v.name: v for v in read_model_description(file).modelVariables if v.causality == "parameter"}
    assert set(variables) - set(told) == {"solver.host_tolerance"}
    assert told["joints.knee.friction.mu"] == ("Real", 0.15, "1")
    assert told["solver.max_steps"][0] == "Integer"
    assert {n: v for n, (_, v, _) in told.items()} == {n: float(variables[n].start) for n in told}
    assert all(unit == variables[n].unit for n, (kind, _, unit) in told.items() if kind == "Real")
    with pytest.raises(SceneError) as refused:
        COMMAND.main(["fmu", *words, "--fmi", "3"], standalone_mode=False)
    assert [p.where for p in refused.value.problems] == ["--parameters-file"]
