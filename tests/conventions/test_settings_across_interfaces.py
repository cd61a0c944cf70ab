"""Settings of a run are declared once. The command line, Python and REST have the same names, bounds, texts and error messages. The
test calls all three interfaces."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest

import trunnion
from trunnion.basics.errors import SceneError
from trunnion.basics.setting_declarations import SETTINGS, Setting, offered
from trunnion.cli import main
from trunnion.cli.command_declaration import click_command, meaning
from trunnion.cli.command_registry import COMMANDS as REGISTERED
from trunnion.cli.command_registry import function_of
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import JobRequest, document_of, plan_of_document, plan_of_request
from trunnion.service.request_models.sensitivity_and_fmu_requests import SensitivityRequest, plain
from trunnion.simulation.settings.run_settings import describe_setting, settings_read

PYTHON: dict[str, Any] = {f"trunnion.{f.__name__}": f for f in (trunnion.simulate, trunnion.sweep, trunnion.sensitivity)}
REST = {"POST /v1/jobs": JobRequest, "POST /v1/sensitivities": SensitivityRequest}
COMMANDS = [f"trunnion {n}" for n in REGISTERED if offered(f"trunnion {n}")]
NAMES = {s.name for s in SETTINGS}
WRONG = {"until": ["-1", "0", "x", "5 kg", "10 parsec"], "every": ["-1", "5 kg"], "rtol": ["1", "0", "1 m"], "method": ["rk55"],
         "cpu_limit": ["0", "-1", "5 kg"], "max_steps": ["0", "x"],
         "step": ["-1"], "law": ["nonsense"], "kernel": ["part"]}  # fmt: skip
CASES = [pytest.param(s, who, id=f"{who}, {s.name}") for s in SETTINGS for who in s.offered]


def option(name: str) -> str:
    """The name of a setting on the command line."""
    return f"--{name.replace('_', '-')}"


def words(who: str) -> dict[str, str]:
    """The texts of one interface about each setting, by name."""
    if who in PYTHON:
        lines = inspect.getdoc(PYTHON[who]).partition("Settings:")[2].strip().splitlines()
        return dict(line.strip().split(": ", 1) for line in lines)
    if who in REST:
        properties = REST[who].model_json_schema()["properties"]
        return {n: p["description"] for n, p in properties.items() if n in NAMES}
    name = who.removeprefix("trunnion ")
    command = click_command(name, function_of(name))
    return {p.name: meaning(p) for p in command.params if p.name in NAMES}


@pytest.mark.parametrize("who", [*COMMANDS, *PYTHON, *REST])
def test_every_interface_offers_the_settings_of_the_table_in_its_words(who: str) -> None:
    expected = {s.name: describe_setting(s, who) for s in offered(who)}
    if who in COMMANDS:  # a command gives in brackets what the other interfaces give in sentences
        several = {s.name: "repeatable; " if who in s.several else "" for s in offered(who)}
        sentence = re.compile(r"(?: Repeatable\.)? Default: (.*)\.$", re.DOTALL)
        expected = {n: sentence.sub(lambda m, n=n: f" ({several[n]}default: {m[1]})", text) for n, text in expected.items()}
    assert words(who) == expected


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
    """Request a run with these settings. The interface refuses a wrong setting before the run."""
    varied = {"vary": {"gravity[3]": [-1.0]}}
    wanted = {"parameters": ["gravity[3]"], "outputs": ["*.q*"]}
    if who == "POST /v1/jobs":
        plan_of_request(JobRequest(scene="simple_pendulum", **varied, **given), Limits())
    elif who == "POST /v1/sensitivities":
        plain(SensitivityRequest(scene="simple_pendulum", **wanted, **given), Limits())
    else:
        PYTHON[who]("simple_pendulum", **{"trunnion.sweep": varied, "trunnion.sensitivity": wanted}.get(who, {}), **given)


@pytest.mark.default_cases(22)
@pytest.mark.parametrize(("s", "who"), [c for c in CASES if c.values[1] in (*PYTHON, *REST)])
def test_a_wrong_value_is_refused_in_the_same_words(s: Setting, who: str) -> None:
    for text in WRONG[s.name]:
        _, (problem,) = settings_read(who, {s.name: text})
        with pytest.raises(SceneError) as refused:
            asked(who, **{s.name: text})
        assert [(p.what, p.hint) for p in refused.value.problems if p.where == s.name] == [(problem.what, problem.hint)]


@pytest.mark.default_cases(10)
@pytest.mark.parametrize(("s", "who"), [c for c in CASES if c.values[1] in COMMANDS])
def test_commands_refuse_a_wrong_setting_in_the_same_words(s: Setting, who: str, capsys: pytest.CaptureFixture[str]) -> None:
    for text in WRONG[s.name]:
        _, (problem,) = settings_read(who, {s.name: [text] if who in s.several else text}, option)
        assert main([*who.split()[1:], "simple_pendulum", f"{option(s.name)}={text}"]) == 2
        assert f"{option(s.name)}: {problem.what}\n    → {problem.hint}" in capsys.readouterr().err


def test_units_are_read_by_everybody() -> None:
    for who in next(s for s in SETTINGS if s.name == "until").offered:
        values, problems = settings_read(who, {"until": "10 ms"})
        assert (values["until"], problems) == (0.01, [])


def test_a_request_with_units_means_the_same_when_it_is_read_again() -> None:
    request = JobRequest(scene="simple_pendulum", vary={"gravity[3]": [-1.0]}, until="10 ms", every="1 ms")
    made = plan_of_request(request, Limits())
    assert (made.run.until, made.run.every) == (0.01, 0.001)
    assert plan_of_document(document_of(request, made)).run == made.run
