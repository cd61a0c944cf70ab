"""Texts of the command line: help names the entries of the registries, the tab key completes words, each option has one meaning,
and colours."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from trunnion.basics.renamed_words import OPTIONS
from trunnion.cli import main
from trunnion.cli.command_group import COMMAND
from trunnion.cli.command_registry import COMMANDS, GROUPS
from trunnion.cli.output.terminal_capabilities import has_colours, is_redrawable
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.runtime.integrators import METHODS

RUN = ["simulate", "spherical_pendulum", "--until", "100 ms", "--every", "10 ms"]
COLUMN = "ball.qd[2]"


def commands() -> dict[str, Any]:
    """All commands by name."""
    context = COMMAND.make_context("trunnion", ["--version"], resilient_parsing=True)
    found = {}
    for name in COMMANDS:
        group, _, last = name.rpartition(" ")
        holder = COMMAND.get_command(context, group) if group in GROUPS else COMMAND
        found[name] = holder.get_command(context, last)
    return found


def options() -> list[tuple[str, Any]]:
    """Pairs (command, option) for every option that a command's help shows."""
    return [(n, p) for n, c in commands().items() for p in c.params if p.param_type_name == "option" and not p.hidden]


@pytest.mark.parametrize("name", ["simulate", "sweep", "chart"])
def test_help_names_every_method_and_law(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--help"]) == 0
    words = set(re.findall(r"\w+", capsys.readouterr().out))
    assert {*METHODS, *LAWS} <= words


def test_a_request_to_the_service_names_every_method() -> None:
    from trunnion.service.request_models.job_request import JobRequest

    text = JobRequest.model_fields["method"].description or ""
    assert set(METHODS) <= set(re.findall(r"\w+", text))


# -- One meaning ----------------------------------------------------------------------------------------------------------------


def test_an_option_means_the_same_in_every_command() -> None:
    """-o and --output give the output file of a command; --outputs selects columns; --vary names the numbers that vary."""
    names = defaultdict(set)
    for _, option in options():
        names[option.opts[-1]].add(frozenset(option.opts))
    assert all(len(spellings) == 1 for spellings in names.values()), names
    assert names["--output"] == {frozenset({"-o", "--output"})}
    writes = {n: o.metavar for n, o in options() if "-o" in o.opts}
    files = ["simulate", "check", "sweep", "sensitivity", "advise", "import", "inverse", "wear", "kinematics", "optimise", "refine"]
    files += ["fmu", "ssp", "jobs results"]
    assert writes.items() >= (dict.fromkeys(files, "FILE") | dict.fromkeys(("chart", "export c", "export web"), "DIR")).items()
    assert {*writes.values()} == {"FILE", "DIR"}
    columns = {"simulate", "chart", "sensitivity", "advise", "inverse", "kinematics", "fmu", "export c"}
    assert {n for n, o in options() if "--outputs" in o.opts} >= columns
    assert {o.metavar for _, o in options() if "--outputs" in o.opts} == {"PATTERN"}
    varies = {"sweep", "optimise", "refine", "sensitivity", "fit", "jobs submit", "jobs fit"}
    assert {n for n, o in options() if "--vary" in o.opts} >= varies


def test_a_column_given_as_the_file_to_write_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["sensitivity", "spherical_pendulum", "--vary", "joints.ball.friction.mu"], ["chart", "simple_pendulum"]):
        assert main([*words, "--output", COLUMN]) == 2
        assert "columns are chosen with --outputs" in capsys.readouterr().err


def test_deprecated_options_work_are_reported_once_and_are_in_no_help(capsys: pytest.CaptureFixture[str]) -> None:
    mu = "joints.ball.friction.mu"
    for old, words in {
        "--over": ["sweep", "spherical_pendulum", "--over", f"{mu}=0.1,0.2", "--over", "gravity[3]=-9,-10", "--until", "0.01"],
        "--steps": ["sweep", "spherical_pendulum", "--vary", f"{mu}=0.1,0.2", "--until", "0.01", "--steps=1000"],
        "--to": ["sensitivity", "spherical_pendulum", "--to", mu, "--outputs", COLUMN, "--until", "0.01"],
        "--outputs": ["check", "spherical_pendulum", "--outputs"],
    }.items():
        assert main(words) == 0
        assert capsys.readouterr().err == f"option {old} is deprecated: write {OPTIONS[old]}\n"
    shown = {n for _, o in options() for n in (*o.opts, *o.secondary_opts)}
    # the word is also an old option: in ``check`` it gave the list of columns, in other commands it selected columns
    assert shown & OPTIONS.keys() == {"--outputs"}
    assert set(OPTIONS.values()) <= shown


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", list(COMMANDS))
def test_every_command_has_one_format_of_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*name.split(), "--help"]) == 0
    usage, sentence, *sections = re.split(r"\n(?=\S)|\n\n", capsys.readouterr().out.strip())
    assert usage.startswith(f"Usage: trunnion {name} ")
    assert sentence.strip()[0].isupper()
    assert [s.split("\n")[0] for s in sections if s.startswith(("A", "O"))] in (["Arguments:", "Options:"], ["Options:"])
    assert not re.search(r"[Ll]eft out|\(else |\[default|\[env", " ".join(sections))
    for option in commands()[name].params:
        assert option.hidden or (option.help or "").endswith("."), option.name


def test_the_old_option_of_a_file_to_write_still_works(tmp_path: Path) -> None:
    words = ["sensitivity", "spherical_pendulum", "--vary", "joints.ball.friction.mu", "--outputs", COLUMN, "--until", "0.1"]
    for option in ("--file", "--output"):
        file = tmp_path / f"{option[2:]}.csv"
        assert main([*words, option, str(file)]) == 0
        assert file.stat().st_size > 100


# -- The tab key ----------------------------------------------------------------------------------------------------------------


def completed(line: str) -> list[str]:
    """The words that completion offers to bash at the end of a line."""
    words = line.split(" ")
    env = os.environ | {"_TRUNNION_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
    done = subprocess.run([sys.executable, "-m", "trunnion"], env=env, capture_output=True, text=True)
    return done.stdout.split()


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("trunnion simulate spherical_p", ["spherical_pendulum"]),
        ("trunnion sim", ["simulate"]),
        ("trunnion simulate spherical_pendulum --set joints.ball.friction.m", ["joints.ball.friction.mu="]),
        ("trunnion sweep spherical_pendulum --vary joints.ball.friction.m", ["joints.ball.friction.mu="]),
        ("trunnion sensitivity spherical_pendulum --vary joints.ball.friction.m", ["joints.ball.friction.mu"]),
        ("trunnion simulate spherical_pendulum --method r", ["rk5", "rk8", "rosenbrock"]),
        ("trunnion simulate spherical_pendulum --law c", ["coulomb"]),
        ("trunnion simulate no_such_scene --set joi", []),
    ],
)
def test_the_tab_key_completes_what_a_scene_has(line: str, offered: list[str]) -> None:
    assert completed(line) == offered


def test_the_tab_key_completes_files_and_folders(tmp_path: Path) -> None:
    (tmp_path / "crane.yaml").touch()
    (tmp_path / "crate").mkdir()
    (tmp_path / "crab.txt").touch()
    assert completed(f"trunnion check {tmp_path}/cra") == [f"{tmp_path}/crane.yaml", f"{tmp_path}/crate/"]


def test_completion_can_be_installed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    assert "--install-completion" in capsys.readouterr().out


# -- Colours --------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("setting", "colours", "bars"),
    [({}, True, True), ({"NO_COLOR": "1"}, False, True), ({"TERM": "dumb"}, False, False), ({"NO_COLOR": ""}, True, True)],
)
def test_colours_are_shown_only_where_they_are_wanted(
    setting: dict[str, str], colours: bool, bars: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    for name, value in setting.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert main(RUN) == 0
    assert ("\033[" in capsys.readouterr().out) is colours
    assert (has_colours(sys.stdout), is_redrawable(sys.stdout)) == (colours, bars)
