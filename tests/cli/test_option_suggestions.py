"""Suggestions for an unknown option are options of the same command."""

from __future__ import annotations

from pathlib import Path

import pytest

from trunnion.cli import main
from trunnion.cli.command_group import COMMAND

CONTEXT = COMMAND.make_context("trunnion", [], resilient_parsing=True)


def long_options(name: str) -> list[str]:
    """The long options that a command shows in its help."""
    params = COMMAND.get_command(CONTEXT, name).params
    return [o for p in params if not getattr(p, "hidden", False) for o in (*p.opts, *p.secondary_opts) if o.startswith("--")]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", ["simulate", "sweep", "check", "chart", "sensitivity", "advise", "fmu"])
def test_every_option_of_a_command_is_suggested_for_a_slip_of_the_pen(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    for option in long_options(name):
        slip = option + "z"
        assert main([name, "spherical_pendulum", slip]) == 2
        assert f"{slip}: there is no such option\n    → did you mean {option}?" in capsys.readouterr().err


def test_no_command_keeps_a_list_of_its_options() -> None:
    root = Path(__file__).resolve().parents[2]
    for file in (*(root / "engine" / "cli").rglob("*.py"), *(root / "fmu" / "cli").rglob("*.py")):
        assert "\nKNOWN = " not in file.read_text(encoding="utf-8"), file
