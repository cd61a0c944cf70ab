"""The FMU file is complete and correct, and has the same bytes at every export. Its errors are explained."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fmpy import read_model_description

import trunnion
from tests.fmu.exported_fmus import arm, exported
from tests.fmu.fmpy_validation import validated
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.cli import main
from trunnion.cli.command_group import COMMAND
from trunnion.fmu.binaries.platform_builds import chosen, fat, library, prepare
from trunnion.fmu.scene_export import export
from trunnion.kernel.compilation import c_compiler

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])


@pytest.mark.default_cases(2)
@BOTH
@pytest.mark.parametrize("model", ["spherical_pendulum", "crank_slider", "arm"])
def test_descriptions_are_valid_and_complete(model: str, flavour: str) -> None:
    file = exported(model, flavour)
    assert validated(str(file)) == []
    with zipfile.ZipFile(file) as z:
        root, names = ElementTree.fromstring(z.read("modelDescription.xml")), set(z.namelist())
        page = z.read("documentation/index.html").decode()
    assert {"model.png", "documentation/index.html", "documentation/licenses/license.txt"} <= names
    outputs = [v for v in root.find("ModelVariables") if v.get("causality") == "output"]
    assert len(root.findall("ModelStructure/Outputs/Unknown")) == len(outputs)
    assert len(root.findall("ModelStructure/InitialUnknowns/Unknown")) == len(outputs)
    units = {u.get("name") for u in root.findall("UnitDefinitions/Unit")}
    for v in root.find("ModelVariables"):
        assert v.get("description")
        assert v.find("Real") is None or v.find("Real").get("unit") in units
        assert v.get("name") in page
    assert file.stat().st_size <= 1024 * 1024


def test_forces_act_on_accelerations_at_once_and_on_positions_later() -> None:
    md = read_model_description(exported("arm"))
    depends = {u.variable.name: [d.name for d in u.dependencies] for u in md.outputs}
    assert depends["knee.q[1]"] == depends["two.velocity[1]"] == []
    inputs = ["motor", "angle", "inputs.angle.rate", "inputs.angle.acceleration"]
    assert depends["knee.qdd[1]"] == depends["hip.drive.effort[1]"] == inputs


@BOTH
def test_the_same_scene_gives_the_same_bytes(flavour: str, tmp_path: Path) -> None:
    again = tmp_path / "again.fmu"
    export("spherical_pendulum", again, flavour=flavour)
    assert again.read_bytes() == exported("spherical_pendulum", flavour).read_bytes()


def test_another_scene_has_another_guid_and_the_flavours_share_theirs(tmp_path: Path) -> None:
    other = export("spherical_pendulum", tmp_path / "other.fmu", overrides={"joints.ball.friction.mu": 0.5})
    guids = {f: read_model_description(exported("spherical_pendulum", f)).guid for f in ("native", "python")}
    assert guids["native"] == guids["python"] != other.guid


def test_python_files_have_names_of_their_own(tmp_path: Path) -> None:
    """Two FMUs in one process must not run each other's Python code."""
    names = []
    for model in ("spherical_pendulum", "crank_slider"):
        with zipfile.ZipFile(exported(model, "python")) as z:
            names.append({n for n in z.namelist() if n.startswith("resources/") and "trunnion_" in n})
            slave = next(z.read(n).decode() for n in names[-1] if n.endswith(".py"))
            assert "numpy" not in slave
    assert len(names[0]) == 2
    assert not names[0] & names[1]


def test_the_command_reports_all_problems_at_once(tmp_path: Path) -> None:
    words = ["crank_slide", "-o", str(tmp_path / "a.zip"), "--flavour", "rust", "--platform", "amiga"]
    with pytest.raises(SceneError) as refused:
        COMMAND.main(["fmu", *words, "--set", "mu", "--step", "-1"], standalone_mode=False)
    assert {p.where for p in refused.value.problems} == {"--flavour", "--set", "--step", "--platform", "crank_slide", "-o"}
    assert not list(tmp_path.iterdir())


def test_the_command_writes_the_fmu_and_reports_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "small.fmu"
    words = ["simple_pendulum", "-o", str(file), "--outputs", "bob.*", "--set", "simulation.rtol=1e-8", "--json"]
    assert main(["fmu", *words]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["bytes"] == file.stat().st_size
    assert float(read_model_description(file).defaultExperiment.tolerance) == 1e-8


def test_a_scene_that_cannot_start_is_not_exported(tmp_path: Path) -> None:
    scene = trunnion.load_scene("crank_slider")
    short = {"bodies.rod.points.end": [0.3, 0, 0], "joints.crank_pivot.drive.constant.start": 1.5}
    with pytest.raises(SimulationError, match="open_loop"):
        export(scene, tmp_path / "a.fmu", overrides=short)
    assert not list(tmp_path.iterdir())


def test_universal_files_hold_both_parts_where_their_header_says() -> None:
    parts = [b"\xcf\xfa\xed\xfe\x07\x00\x00\x01\x03\x00\x00\x00" + b"a" * 50, b"\xcf\xfa\xed\xfe\x0c\x00\x00\x01\x00\x00\x00\x00b"]
    whole = fat(parts)
    assert whole[:8] == b"\xca\xfe\xba\xbe\x00\x00\x00\x02"
    for k, part in enumerate(parts):
        offset, size = (int.from_bytes(whole[at : at + 4], "big") for at in (8 + 20 * k + 8, 8 + 20 * k + 12))
        assert offset % (1 << 14) == 0
        assert whole[offset : offset + size] == part


def test_input_names_are_variables_and_motions_bring_their_bandwidth() -> None:
    md = read_model_description(exported("arm"))
    found = {v.name: v for v in md.modelVariables}
    assert found["motor"].causality == found["angle"].causality == "input"
    assert found["inputs.angle.bandwidth"].variability == "tunable"
    assert "inputs.motor.bandwidth" not in found
    assert arm().inputs["angle"].bandwidth == float(found["inputs.angle.bandwidth"].start)


def test_a_second_fmu_compiles_its_own_code_only(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """All FMUs have the same runtime and shell. Compiling these two takes nine tenths of the time."""
    exported("arm")
    compiled: list[str] = []
    run = c_compiler.run

    def watched(arguments: Sequence[str], folder: Path) -> None:
        compiled.extend(Path(a).name for a in arguments if a.endswith(".c"))
        run(arguments, folder)

    monkeypatch.setattr(c_compiler, "run", watched)
    made = library(chosen(["host"])[0], tmp_path.name, {"model": f"/* {tmp_path} */ int one(void) {{ return 1; }}\n"})
    assert compiled == ["model.c"]
    assert b"fmi2DoStep" in made


def test_parallel_compilation_covers_all_units_but_the_model_tables(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """``prepare`` compiles the units of a model in parallel. ``library`` then compiles only the tables of the model."""
    compiled: list[str] = []
    run = c_compiler.run

    def watched(arguments: Sequence[str], folder: Path) -> None:
        compiled.extend(Path(a).name for a in arguments if a.endswith(".c"))
        run(arguments, folder)

    exported("arm")
    monkeypatch.setattr(c_compiler, "run", watched)
    names, units = chosen(["host"]), ("kernel", "outputs", "jacobian", "model")
    sources = {unit: f"/* {tmp_path} */ int {unit}_one(void) {{ return 1; }}\n" for unit in units}
    prepare(names, sources)
    assert sorted(compiled) == ["jacobian.c", "kernel.c", "outputs.c"]
    library(names[0], tmp_path.name, sources)
    assert compiled[3:] == ["model.c"]


def test_an_fmu_is_optimised_whatever_the_environment_asks_of_kernels(
    delivered_flags: Callable[[str, str], tuple[str, ...]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Delivered FMUs run for a long time, so they are always optimised; the environment switches off the optimisation of kernels
    only. A library that was compiled with the switch is used without the switch, too."""
    calls: list[Sequence[str]] = []
    run = c_compiler.run

    def watched(arguments: Sequence[str], folder: Path) -> None:
        calls.append(arguments)
        run(arguments, folder)

    monkeypatch.setattr(c_compiler, "optimised_flags", delivered_flags)
    monkeypatch.setattr(c_compiler, "run", watched)
    sources = {"model": f"/* {tmp_path} */ double trice(double x) {{ return 3 * x; }}\n"}
    made = {}
    for switch in ("1", "0"):
        monkeypatch.setenv("TRUNNION_QUICK_BUILD", switch)
        made[switch] = library(chosen(["host"])[0], tmp_path.name, sources)
    assert made["1"] == made["0"]
    assert len(calls) == 2  # one call compiles the code of the model, the other call links
    assert not any(flag in call for call in calls for flag in c_compiler.QUICK)
