"""Settings of a run are declared once: the command line, Python and REST have the same names, bounds, words and refusals, asked of
these interfaces themselves."""

from __future__ import annotations

import inspect
from typing import Any

import pytest
import typer

import engine
from engine.basics.problems import SceneError
from engine.basics.settings import SETTINGS, Setting, offered
from engine.cli import main, questions
from engine.cli.helping import named
from engine.simulation.settings import settings_read, told
from service.answered import SensitivityRequest, plain
from service.client import app as jobs
from service.request import JobRequest, document_of, plan_of_document, plan_of_request
from service.settings import Limits

COMMAND = typer.main.get_command(questions.app)
CONTEXT = COMMAND.make_context("trunnion", [], resilient_parsing=True)
JOBS = typer.main.get_command(jobs)
PYTHON: dict[str, Any] = {f"engine.{f.__name__}": f for f in (engine.simulate, engine.sweep, engine.sensitivity)}
REST = {"POST /v1/jobs": JobRequest, "POST /v1/sensitivities": SensitivityRequest}
COMMANDS = [f"trunnion {n}" for n in ("simulate", "sweep", "sensitivity", "wear", "kinematics", "chart", "advise", "jobs submit")]
NAMES = {s.name for s in SETTINGS}
WRONG = {"until": ["-1", "0", "x", "5 kg", "10 parsec"], "every": ["-1", "5 kg"], "rtol": ["1", "0", "1 m"], "method": ["rk55"],
         "patience": ["0", "-1", "5 kg"], "steps": ["0", "x"],
         "step": ["-1"], "law": ["nonsense"], "kernel": ["part"]}  # fmt: skip
CASES = [pytest.param(s, who, id=f"{who}, {s.name}") for s in SETTINGS for who in s.offered]


def words(who: str) -> dict[str, str]:
    """What one of those who offer settings says of each, by name."""
    if who in PYTHON:
        lines = inspect.getdoc(PYTHON[who]).partition("Settings:")[2].strip().splitlines()
        return dict(line.strip().split(": ", 1) for line in lines)
    if who in REST:
        properties = REST[who].model_json_schema()["properties"]
        return {n: p["description"] for n, p in properties.items() if n in NAMES}
    name = who.removeprefix("trunnion ")
    command = JOBS.commands["submit"] if name == "jobs submit" else COMMAND.get_command(CONTEXT, name)
    return {p.name: p.help.format_map(named()) for p in command.params if p.name in NAMES}


@pytest.mark.parametrize("who", [*COMMANDS, *PYTHON, *REST])
def test_whoever_offers_settings_offers_those_of_the_table_in_its_words(who: str) -> None:
    assert words(who) == {s.name: told(s, who) for s in offered(who)}


@pytest.mark.parametrize("who", PYTHON)
def test_a_function_takes_the_settings_it_offers_and_no_others(who: str) -> None:
    assert set(inspect.signature(PYTHON[who]).parameters) & NAMES == {s.name for s in offered(who)}


@pytest.mark.parametrize("who", REST)
def test_a_request_has_the_bounds_of_the_table_in_its_schema(who: str) -> None:
    for s in offered(who):
        field = REST[who].model_json_schema()["properties"][s.name]["anyOf"]
        bound = s.bound_at(who)
        numbers = [f for f in field if f["type"] == "number"]
        assert len(numbers) == (not s.words)
        for f in numbers:
            assert f.get("exclusiveMinimum" if bound.open else "minimum") == bound.least
            assert f.get("maximum", float("inf")) == bound.most


def asked(who: str, **given: str) -> None:
    """Ask for a run with these settings; nothing is run where one of them is wrong."""
    varied = {"over": {"gravity[3]": [-1.0]}}
    wanted = {"parameters": ["gravity[3]"], "outputs": ["*.q*"]}
    if who == "POST /v1/jobs":
        plan_of_request(JobRequest(scene="simple_pendulum", **varied, **given), Limits())
    elif who == "POST /v1/sensitivities":
        plain(SensitivityRequest(scene="simple_pendulum", **wanted, **given), Limits())
    else:
        PYTHON[who]("simple_pendulum", **{"engine.sweep": varied, "engine.sensitivity": wanted}.get(who, {}), **given)


@pytest.mark.parametrize(("s", "who"), [c for c in CASES if c.values[1] in (*PYTHON, *REST)])
def test_a_wrong_value_is_refused_in_the_same_words(s: Setting, who: str) -> None:
    for text in WRONG[s.name]:
        _, (problem,) = settings_read(who, {s.name: text})
        with pytest.raises(SceneError) as refused:
            asked(who, **{s.name: text})
        assert [(p.what, p.hint) for p in refused.value.problems if p.where == s.name] == [(problem.what, problem.hint)]


@pytest.mark.parametrize(("s", "who"), [c for c in CASES if c.values[1] in COMMANDS[:5]])
def test_the_command_line_refuses_it_in_these_words_too(s: Setting, who: str, capsys: pytest.CaptureFixture[str]) -> None:
    for text in WRONG[s.name]:
        _, (problem,) = settings_read(who, {s.name: [text] if who in s.several else text}, lambda name: f"--{name}")
        assert main([who.removeprefix("trunnion "), "simple_pendulum", f"--{s.name}={text}"]) == 2
        assert f"--{s.name}: {problem.what}\n    → {problem.hint}" in capsys.readouterr().err


def test_units_are_read_by_everybody() -> None:
    for who in next(s for s in SETTINGS if s.name == "until").offered:
        values, problems = settings_read(who, {"until": "10 ms"})
        assert (values["until"], problems) == (0.01, [])


def test_a_request_with_units_means_the_same_when_it_is_read_again() -> None:
    request = JobRequest(scene="simple_pendulum", over={"gravity[3]": [-1.0]}, until="10 ms", every="1 ms")
    made = plan_of_request(request, Limits())
    assert (made.run.until, made.run.every) == (0.01, 0.001)
    assert plan_of_document(document_of(request, made)).run == made.run
