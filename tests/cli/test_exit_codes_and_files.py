"""The command line's exit codes and files. Commands report all problems at once, and JSON output is one document."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from trunnion.cli import main
from trunnion.cli.entry_point import defect_text
from trunnion.cli.output.printed_output import number
from trunnion.simulation.results.csv_and_parquet import load_result_table

SHORT = ["simulate", "spherical_pendulum", "--until", "500 ms", "--every", "10 ms"]


def test_a_run_that_reaches_its_end_exits_with_0_and_reports_what_it_did(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(SHORT) == 0
    out, err = capsys.readouterr()
    assert "done at t = 0.5 s" in out
    assert "ball.contact[1].normal_force" in out
    assert "steps" in out
    assert err == ""


def test_files_are_written_and_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = {"-o": "r.parquet", "--plot": "r.svg", "--animate": "r.html"}
    words = [w for option, name in names.items() for w in (option, str(tmp_path / name))]
    assert main([*SHORT, *words]) == 0
    out = capsys.readouterr().out
    for name in names.values():
        assert (tmp_path / name).stat().st_size > 1000
        assert f"wrote {tmp_path / name}" in out


def test_json_is_one_document_and_nothing_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "spherical_pendulum", "--until", "1", "--json", "-o", str(tmp_path / "r.csv")]) == 0
    out, err = capsys.readouterr()
    data = json.loads(out)
    assert err == ""
    assert data["outcome"]["ok"] is True
    assert data["files"] == {"table": str(tmp_path / "r.csv")}
    assert data["final"]["time"] == 1.0
    assert data["units"]["ball.qd[1]"] == "rad/s"
    assert data["events"][0]["kind"] == "reversal"
    assert data["stats"]["steps"] > 0
    assert data["problems"] == []


def test_a_run_reports_what_the_audit_says_and_an_inaccurate_one_fails_with_its_files_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(SHORT) == 0
    assert "audit within: energy within" in capsys.readouterr().out
    file = tmp_path / "r.csv"
    words = ["simulate", "spherical_pendulum", "--rtol", "0.1", "--set", "joints.ball.friction.mu=0", "-o", str(file)]
    assert main(words) == 1
    out, err = capsys.readouterr()
    assert "audit inaccurate: energy within" in out
    assert "note: audit at t = " in out
    assert "inaccurate" in err
    assert "Try a tighter rtol" in err
    assert load_result_table(file).outcome.name == load_result_table(file).metadata["audit"]["verdict"] == "inaccurate"
    assert main([*words, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["audit"]["verdict"] == "inaccurate"


def test_all_wrong_options_are_reported_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "bad.yaml"
    scene.write_text("bodies: {a: {box: [1, 1, 1], densty: 5}}\njoints: {j: {type: revolut, inboard: ground, outboard: a}}\n")
    words = ["--until", "-3", "--every", "5 kg", "--method", "rk9", "--rtol", "3", "--law", "coulom", "--set", "foo"]
    words += ["-o", "out.txt", "--plot", "/no/such/x.png", "--untill", "3"]
    assert main(["simulate", str(scene), *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    for word in (
        "--until:",
        "--every:",
        "--method:",
        "--rtol:",
        "--law:",
        "--set:",
        "-o:",
        "--plot:",
        "--untill:",
        "densty",
        "revolut",
    ):
        assert word in err, word
    assert f"{scene}:1:" in err
    assert "did you mean" in err
    assert "Traceback" not in err


def test_wrong_changes_and_patterns_are_reported_with_their_remedy(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--set", "joints.ball.friction.m=1", "--outputs", "bal.*", "--json"]
    assert main(["simulate", "spherical_pendulum", *words]) == 2
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert [p["where"] for p in problems] == ["--set", "--outputs"]
    assert all(p["what"] and p["hint"] for p in problems)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["simulate"], "no scene is given"),
        (["simulate", "spherical_pendulm"], 'did you mean "spherical_pendulum"'),
        (["simulate", "spherical_pendulum", "again"], "is an extra word"),
        (["simulate", "no/such/file.yaml"], "there is no such file"),
        (["simulat"], "did you mean 'simulate'"),
        (["simulate", "spherical_pendulum", "--until"], "requires an argument"),
        (["--nope"], "No such option"),
        (["check", "spherical_pendulum", "--colunms"], "did you mean --columns"),
        (["new", "3x"], "cannot be the name"),
    ],
)
def test_wrong_use_exits_with_2_and_names_the_remedy(words: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert text in err
    assert out == ""


def test_a_run_that_fails_exits_with_1_names_the_joint_and_still_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Example 8.3 with c = 0.15 m jams from the start (theory, "Errata of the paper")."""
    words = ["--set", "joints.guide.friction.half_length=0.15", "-o", str(tmp_path / "r.csv"), "--plot", str(tmp_path / "r.png")]
    assert main(["simulate", "double_pendulum", "--until", "1", "--law", "regularized", "--json", *words]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["outcome"]["name"] == "no_solution"
    assert data["outcome"]["joint"] == "guide"
    assert data["files"] == {"table": str(tmp_path / "r.csv")}
    assert load_result_table(tmp_path / "r.csv").outcome.name == "no_solution"


def test_only_the_columns_asked_for_are_written_beside_a_moving_picture(tmp_path: Path) -> None:
    words = ["--outputs", "ball.friction.*", "-o", str(tmp_path / "r.csv"), "--animate", str(tmp_path / "r.html")]
    assert main([*SHORT, *words]) == 0
    names = load_result_table(tmp_path / "r.csv").names
    assert names[0] == "time"
    assert all(n.startswith("ball.friction.") for n in names[1:])
    assert (tmp_path / "r.html").exists()


def test_the_summary_shows_the_columns_of_the_option_and_zeros_as_0(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SHORT, "--outputs", "ball.*", "-o", str(tmp_path / "r.csv")]) == 0
    shown = {line.split()[0] for line in capsys.readouterr().out.splitlines() if line.startswith("ball.")}
    written = load_result_table(tmp_path / "r.csv")
    assert shown == set(written.names) - {"time"}
    table = (tmp_path / "r.csv").read_text().splitlines()
    assert not any("e-1" in cell and float(cell) < 1e-100 for line in table[-5:] for cell in line.split(",") if "e-1" in cell)
    assert not any(cell == "-0.0" for line in table[-5:] for cell in line.split(","))
    assert number(-1e-150) == number(-0.0) == "0"


def test_the_summary_shows_the_main_columns_where_all_are_computed(capsys: pytest.CaptureFixture[str]) -> None:
    tables = []
    for more in ([], ["--outputs", "*"]):
        assert main([*SHORT, *more]) == 0
        lines = capsys.readouterr().out.splitlines()
        tables.append([line.split()[0] for line in lines[next(i for i, line in enumerate(lines) if line.startswith("column")) :]])
    assert tables[0] == tables[1]


def test_check_reports_masses_loops_and_freedoms_of_a_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "crank_slider", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {b["name"]: round(b["mass"], 3) for b in data["bodies"]} == {"crank": 39.005, "rod": 78.01, "slider": 62.408}
    assert data["loops"] == 1
    assert data["cut"] == ["crank_pin"]
    assert data["start"]["redundant_rows"] == 1
    assert data["start"]["moving_freedoms"] == 0
    assert data["columns"]["chosen"] == data["columns"]["available"]


LEAVES = {
    "start": ("pin: inboard, start: {q: 800 mm}", True),
    "pin": ("pin: outboard, start: {q: 800 mm}", False),
    "ends": ("pin: inboard, ends: outboard, start: {q: 800 mm}", False),
    "steady drive": ("drive: {constant: {rate: 0.2}}", True),
    "slow drive": ("drive: {constant: {rate: 0.002}}", False),
    "ramp": ("drive: {ramp: {start: 0, end: 1, duration: 1}}", True),
    "ramp there and back": ("drive: {ramp: {start: 0.1, end: -0.1, duration: 0.4}}", True),
    "sine": ("drive: {harmonic: {amplitude: 0.2, frequency: 1}}", True),
    "short sine": ("drive: {harmonic: {amplitude: 0.02, frequency: 1}}", False),
    "curve": ("drive: {table: {time: [0, 1, 2], value: [0, 0.3, 0]}}", True),
}


@pytest.mark.default_cases(8)
@pytest.mark.parametrize("how", LEAVES)
def test_check_asks_whether_ends_that_are_left_behind_are_meant(
    how: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motion, told = LEAVES[how]
    guide = f"type: prismatic, axis: x, {motion}, inboard: ground, outboard: sleeve"
    rub = "friction: {law: regularized, mu: 0.1, half_length: 50 mm, half_width: 20 mm, half_height: 20 mm}"
    file = tmp_path / "sleeve.yaml"
    file.write_text(f"schema: 1\nbodies: {{sleeve: {{box: [0.1, 0.1, 0.1], mass: 1}}}}\njoints: {{guide: {{{guide}, {rub}}}}}\n")
    assert main(["check", str(file)]) == 0
    assert ("write ends: outboard" in capsys.readouterr().out) is told


def test_check_lists_columns_with_units(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "spherical_pendulum", "--columns"]) == 0
    out = capsys.readouterr().out
    assert any(line.split()[:2] == ["ball.contact[1].normal_force", "N"] for line in out.splitlines())


def test_new_writes_a_scene_that_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "demo", "--dir", str(tmp_path)]) == 0
    assert main(["check", str(tmp_path / "demo")]) == 0
    assert "no problems" in capsys.readouterr().out
    assert main(["new", "demo", "--dir", str(tmp_path)]) == 2


def test_models_and_schema_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["models"]) == 0
    assert "spherical_pendulum" in capsys.readouterr().out
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Trunnion scene"


def test_a_defect_is_reported_without_a_traceback(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("oops")

    monkeypatch.setattr("trunnion.simulation.run.run_checked", broken)
    assert main(SHORT) == 1
    err = capsys.readouterr().err
    assert "defect of Trunnion" in err
    assert "Traceback" not in err
    assert main([*SHORT, "-v"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_version_and_help_do_not_wait_for_heavy_packages() -> None:
    code = "import sys; from trunnion.cli import main; main(['--help']); assert 'typing' not in sys.modules; main(['--version']); "
    code += "print([m for m in ('numpy', 'casadi', 'matplotlib', 'pyarrow', 'pandas', 'pydantic', 'rich') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "\ntrunnion " in done.stdout
    assert done.stdout.strip().endswith("[]")


def test_a_warm_run_does_not_import_what_it_does_not_need() -> None:
    """A warm run reads the stored scene. It does not import pydantic, the parts of typer that use pydantic, or the reader of
    scenes."""
    check = ["check", SHORT[1], "--hold"]
    main(SHORT), main(check)
    code = f"import sys; from trunnion.cli import main; main({SHORT!r}); main({check!r}); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    modules = done.stdout.splitlines()[-1].split()
    heavy = {"casadi", "importlib.metadata", "matplotlib", "numpy.polynomial.legendre", "pandas", "pyarrow", "pydantic", "rich"}
    heavy |= {"concurrent.futures", "secrets"}
    own = {"scene.checks", "scene.overrides", "scene.scene_loader", "scene.validation", "simulation.global_error.event_pairs"}
    assert not {*modules} & (heavy | {f"trunnion.{m}" for m in own} | {"scipy", "yaml"})
    assert len(modules) <= 620


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_files_are_written_without_packages_that_only_some_have(suffix: str, tmp_path: Path) -> None:
    """Arrow imports pandas, if installed, when Arrow receives an array of another type."""
    runs = [*SHORT, "-o", str(tmp_path / f"r.{suffix}")]
    over = ["--vary", "joints.ball.friction.mu=0.1:0.2:2", "--until", "0.01"]
    sweep = ["sweep", SHORT[1], *over, "-o", str(tmp_path / f"s.{suffix}")]
    code = f"import sys; from trunnion.cli import main; print(main({runs!r}) + main({sweep!r})); "
    code += "print([m for m in ('matplotlib', 'pandas', 'rich') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-2:] == ["0", "[]"], done.stdout


@pytest.mark.slow
def test_the_first_hundred_of_thousands_of_mistakes_are_reported_and_all_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.yaml").write_text("bodies: {}\njoints: {}\n" + "".join(f"wrong{i}: 1\n" for i in range(4000)))
    assert main(["check", str(tmp_path / "s.yaml"), "--json"]) == 2
    document = json.loads(capsys.readouterr().out)
    assert document["problem_count"] == 4001  # 4000 unknown keys, and no bodies
    assert len(document["problems"]) == 101
    assert main(["check", str(tmp_path / "s.yaml")]) == 2
    assert "and 3901 more: not listed" in capsys.readouterr().err


def test_a_folder_without_a_scene_is_reported_with_the_file_to_give(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(tmp_path)]) == 2
    assert "the folder has no scene.yaml" in capsys.readouterr().err
    (tmp_path / "crane.yaml").write_text("schema: 1\n")
    assert main(["check", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert "the folder has no scene.yaml" in err
    assert f"give the file itself: {tmp_path / 'crane.yaml'}" in err


def test_a_declaration_that_contradicts_itself_is_no_internal_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The text names the file and line that cannot be imported, the cause and the remedy."""
    (tmp_path / "declared_law.py").write_text('"""A law."""\n\nraise ValueError("law trial: no formula")\n', encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ValueError, match="no formula") as raised:
        importlib.import_module("declared_law")
    cause, remedy = defect_text(raised.value, False).splitlines()
    assert cause == "declared_law.py:3: cannot be imported: law trial: no formula"
    assert "correct this declaration" in remedy
    assert defect_text(ValueError("a defect"), False).startswith("internal error: ValueError")
