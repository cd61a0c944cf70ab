"""``trunnion fit`` reads files with units, prints the results of ``trunnion.fit``, and reports all mistakes at once."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.analysis.fits.closed_form_motions import GLIDER, QD, TIME, Q, X, noisy
from trunnion.cli import main
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.overrides import scene_given

Said = pytest.CaptureFixture[str]


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the scene of the glider and two measured runs in millimetres. The file of each run has an unused column."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "glider.json").write_text(json.dumps(scene_to_dict(scene_given(GLIDER))))
    for name, seed, q in (("a", 1, 0.1), ("b", 2, -0.2)):
        data = np.column_stack([1e3 * TIME, 1e3 * noisy(seed, q=q), 0.0 * TIME])
        np.savetxt(f"{name}.csv", data, delimiter=",", header="time [ms],place (mm),spare", comments="")
    return tmp_path


def asked(*more: str) -> list[str]:
    return ["fit", "glider.json", "--column", f"{X}=place", *more]


def document(said: Said) -> dict[str, Any]:
    return json.loads(said.readouterr().out)


def test_the_command_finds_the_values_of_the_function(files: Path, capsys: Said) -> None:
    assert main(asked("--data", "a.csv", "--vary", QD, "--vary", f"{Q}=normal(100 mm, 50 mm)", "--noise", "20 mm", "--json")) == 0
    told = document(capsys)
    found = trunnion.fit(GLIDER, [QD, Q], TIME, {X: noisy(1)}, noise=0.02, priors={Q: "normal(0.1, 0.05)"})
    assert told["values"] == pytest.approx(found.values, rel=1e-6)
    assert told["intervals"][QD]["high"] == pytest.approx(found.intervals[QD].high, rel=1e-6)
    assert told["units"] == {QD: "m/s", Q: "m"}
    assert told["unused"] == ["a.csv: spare"]


@pytest.mark.slow
def test_several_runs_are_reported_and_drawn(files: Path, capsys: Said) -> None:
    runs = ("--data", "a.csv", "--data", f"b.csv; {Q}=-0.1 m")
    assert main(asked(*runs, "--vary", QD, "--own", Q, "--plot", "fit.png", "--try", f"{QD}=1; until=4 s", "--level", "0.9")) == 0
    told = capsys.readouterr().out
    for words in (f"{Q} @ a", f"{Q} @ b", "90 % interval", "gain, bits", "not used: a.csv: spare", "wrote fit.png"):
        assert words in told, words
    assert (files / "fit.png").stat().st_size > 20_000


def test_an_end_at_a_bound_is_reported_as_a_bound(files: Path, capsys: Said) -> None:
    assert main(asked("--data", "a.csv", "--vary", f"{QD}=0.495:", "--noise", f"{X}=20 mm")) == 0
    told = capsys.readouterr().out
    assert "[0.495]" in told
    assert "the data do not exclude any value up to this bound" in told


def test_laws_are_compared(files: Path, capsys: Said) -> None:
    drag = ("--compare", "coulomb", "--compare", "coulomb; joints.rail.damping~0.05", "--set", "joints.rail.damping=0")
    assert main(asked("--data", "a.csv", "--vary", QD, *drag, "--json")) == 0
    told = document(capsys)
    assert [c["name"] for c in told["compared"]["candidates"]] == ["coulomb", "coulomb; joints.rail.damping~0.05"]
    assert told["compared"]["candidates"][1]["worse_by_bic"] > 0
    assert any("do not decide" in n or "cannot separate" in n or "bound" in n for n in told["compared"]["notes"])


def test_all_mistakes_are_reported_at_once(files: Path, capsys: Said) -> None:
    wrong = ("--data", "c.csv", "--data", "b.csv", "--vary", f"{QD}=3", "--compare", "colomb", "--noise", "x", "--level", "nine",
             "--try", "y=1", "--plot", "x.txt")  # fmt: skip
    assert main(["fit", "glider.json", "--column", f"{X}=plaice", "--column", "rail=place", *wrong]) == 2
    told = capsys.readouterr().err
    for words in ("c.csv", "no column 'plaice'", "'rail' is not a column", "neither bounds nor a prior", "did you mean coulomb",
                  "--noise", "--level", "--try", "--plot"):  # fmt: skip
        assert words in told, words


def test_a_fit_without_data_or_parameters_is_reported(files: Path, capsys: Said) -> None:
    assert main(["fit", "glider.json"]) == 2
    told = capsys.readouterr().err
    assert "--vary" in told
    assert "--data" in told
    assert main(["fit", "glider.json", "--data", "a.csv", "--vary", QD]) == 2
    assert "--column 'JOINT.q[1]=place'" in capsys.readouterr().err
