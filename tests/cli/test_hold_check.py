"""Text, exit code and JSON output of the command ``trunnion check --hold``."""

from __future__ import annotations

import json
import math

import pytest

from trunnion.cli import main
from trunnion.scene.library.model_folders import bundled_names

LIMIT = math.asin(0.05 * 0.6 / math.hypot(1, 0.6) / 0.5)


def asked(angle: float, *words: str) -> list[str]:
    start = f"joints.ball.start.q={{axis: y, angle: {math.pi / 2 - angle}}}"
    return ["check", "spherical_pendulum", "--hold", "--set", start, *words]


def test_a_pendulum_inside_its_friction_cone_holds_with_the_margin_of_statics(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(asked(math.radians(2.0), "--json")) == 0
    report = json.loads(capsys.readouterr().out)["hold"]
    (pair,) = report["pairs"]
    assert report["holds"]
    assert pair["sticks"]
    assert pair["unique"]
    assert pair["share"] == pytest.approx(math.sin(math.radians(2.0)) / math.sin(LIMIT), rel=1e-10)
    assert pair["margin"] == pytest.approx(1.0 - pair["share"], rel=1e-12)


def test_a_pendulum_outside_its_friction_cone_slips_and_the_joint_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(asked(LIMIT * 1.1)) == 1
    out = capsys.readouterr().out
    assert "the mechanism does not hold: ball slips first" in out
    assert "110 %" in out


def test_the_question_is_asked_of_dry_friction_whatever_the_law(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(asked(math.radians(2.0), "--set", "friction.law=regularized")) == 0
    assert "statics uses dry friction" in capsys.readouterr().out


def test_a_joint_without_friction_holds_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "simple_pendulum", "--hold"]) == 1
    assert "nothing holds pivot, which starts to move" in capsys.readouterr().out


def test_an_unknown_scene_is_reported_without_a_traceback(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "no_such_scene", "--hold"]) == 2
    assert "no_such_scene" in capsys.readouterr().err


LONG = {"toggle_press": pytest.mark.slow}
"""Models whose bounds take half as long as the bounds of all other models together."""


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG.get(name, ())) for name in bundled_names()])
def test_bounds_of_every_model_are_json(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(["check", name, "--hold", "--bounds", "--json"])
    assert "error" not in json.loads(capsys.readouterr().out)
