"""``trunnion sweep`` and ``trunnion.sweep`` store the same rows of every case. Both report mistakes before they run any case."""

from __future__ import annotations

from pathlib import Path

import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest

import trunnion
from trunnion.cli import main

MU = "joints.ball.friction.mu"
WORDS = ["sweep", "spherical_pendulum", "--vary", f"{MU}=0.1:0.6:3", "--until", "0.5"]


def test_the_rows_kept_are_those_of_python_as_a_file_and_as_a_data_set(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = trunnion.sweep("spherical_pendulum", {MU: "0.1:0.6:3"}, trajectories=["ball.qd*"], spacing=0.1, until=0.5)
    expected = whole.trajectories
    kept = ["--trajectories", "ball.qd*", "--spacing", "100 ms"]
    assert main([*WORDS, *kept, "--rows", str(tmp_path / "rows.parquet")]) == 0
    assert "rows.parquet" in capsys.readouterr().out
    assert pq.read_table(tmp_path / "rows.parquet").to_pylist() == expected.to_pylist()
    assert main([*WORDS, *kept, "--rows", str(tmp_path / "set")]) == 0
    again = ds.dataset(tmp_path / "set", partitioning="hive").to_table().select(expected.column_names)
    assert again.sort_by([("case", "ascending"), ("time", "ascending")]).to_pylist() == expected.to_pylist()
    assert main([*WORDS, *kept, "--rows", str(tmp_path / "rows.csv")]) == 0
    assert (tmp_path / "rows.csv").read_text().count("\n") == 1 + len(expected)


@pytest.mark.parametrize(
    ("words", "where"),
    [
        (["--trajectories", "ball.qd*"], "--trajectories"),
        (["--rows", "rows.csv"], "--rows"),
        (["--spacing", "0.1"], "--spacing"),
        (["--trajectories", "ball.qd*", "--spacing", "-1", "--rows", "rows.csv"], "--spacing"),
        (["--trajectories", "ball.qd*", "--rows", "rows.txt"], "--rows"),
        (["--trajectories", "ball.qd*", "--rows", "not/there/rows"], "--rows"),
        (["--trajectories", "nothing*", "--rows", "rows.csv"], "trajectories"),
    ],
)
def test_rows_that_cannot_be_kept_are_reported_at_once(
    words: list[str], where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*WORDS, *words]) == 2
    assert f"{where}: " in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
