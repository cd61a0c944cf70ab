"""The commands ``trunnion serve`` and ``trunnion jobs``, called as users call them."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pyarrow.parquet as pq
import pytest

import trunnion
from tests.service.http_servers import MU, Served
from trunnion.cli import main
from trunnion.service.client import remote_jobs


class Told:
    """A callable that runs a command: (exit code, its output)."""

    def __init__(self, capsys: pytest.CaptureFixture[str]):
        self.capsys = capsys

    def __call__(self, *words: str) -> tuple[int, str, str]:
        code = main(["jobs", *words])
        out, err = self.capsys.readouterr()
        return code, out, err


@pytest.fixture
def told(served: Served, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Told:
    """The command ``trunnion jobs``, connected to the server."""
    monkeypatch.setenv("TRUNNION_SERVER", f"http://127.0.0.1:{served.port}")
    return Told(capsys)


def test_a_job_is_submitted_waited_for_and_fetched(told: Told, tmp_path: Path) -> None:
    words = (
        "submit",
        "spherical_pendulum",
        "--vary",
        f"{MU}=0.1:0.5:9",
        "--reduce",
        "count:any",
        "--until",
        "200 ms",
        "--label",
        "mine",
    )
    code, out, _ = told(*words, "--wait", "--json")
    job = json.loads(out)
    assert (code, job["state"], job["done"], job["label"]) == (0, "done", 9, "mine")
    file = tmp_path / "r.parquet"
    assert told("results", job["id"], "-o", str(file))[0] == 0
    assert pq.read_table(file).num_rows == 9
    one = tmp_path / "one.csv"
    assert told("results", job["id"], "--case", "3", "-o", str(one))[0] == 0
    assert one.read_text().startswith('"time"')
    for words in (("show", job["id"]), ("watch", job["id"]), ("cancel", job["id"]), ("list",)):
        code, out, _ = told(*words)
        assert (code, job["id"] in out, "done" in out) == (0, True, True)


def test_a_scene_is_submitted_without_a_sweep(told: Told) -> None:
    code, out, _ = told("submit", "spherical_pendulum", "--until", "200 ms", "--wait", "--json")
    job = json.loads(out)
    assert (code, job["state"], job["cases"], job["outcomes"]) == (0, "done", 1, {"done": 1})


@pytest.mark.slow
def test_rows_of_all_cases_are_kept_and_fetched(told: Told, tmp_path: Path) -> None:
    over, kept = f"{MU}=0.1:0.6:3", ["--trajectories", "ball.qd[2]", "--spacing", "100 ms"]
    code, job, _ = told("submit", "spherical_pendulum", "--vary", over, "--until", "0.5", *kept, "--wait", "--json")
    assert code == 0
    file = tmp_path / "rows.csv"
    assert told("results", json.loads(job)["id"], "--rows", "-o", str(file))[0] == 0
    expected = trunnion.sweep("spherical_pendulum", {MU: "0.1:0.6:3"}, trajectories=["ball.qd[2]"], spacing=0.1, until=0.5)
    assert expected.trajectories is not None
    head, *lines = file.read_text().splitlines()
    assert head == '"case","time","ball.qd[2]"'
    assert [[float(x) for x in line.split(",")] for line in lines] == [list(r.values()) for r in expected.trajectories.to_pylist()]
    assert told("submit", "spherical_pendulum", "--vary", over, "--spacing", "0.1")[0] == 2
    assert told("results", "0" * 24, "--rows", "--case", "1", "-o", str(file))[0] == 2


def test_a_user_who_stops_following_a_job_learns_that_it_continues(told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(seconds: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(remote_jobs, "ENDED", ())
    monkeypatch.setattr(remote_jobs, "time", SimpleNamespace(sleep=interrupted))
    code, out, err = told("submit", "spherical_pendulum", "--vary", f"{MU}=0.1,0.2", "--until", "10 ms", "--wait")
    assert (code, out) == (1, "")
    assert "the job continues: trunnion jobs watch " in err


def test_mistakes_are_reported_with_the_exit_codes_of_the_command_line(
    told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, _, err = told("submit", "spherical_pendulum", "--vary", "joints.ball.friction.nu=1", "--reduce", "max:nothing")
    assert (code, "nu" in err, "max:nothing" in err) == (2, True, True)
    code, _, err = told("submit", "spherical_pendulum", "--vary", "x", "--until", "-1")
    assert (code, "PATH=VALUES" in err, "--until" in err) == (2, True, True)
    assert told("show", "0" * 24)[0] == 1
    assert told("results", "x", "-o", "r.xlsx")[0] == 2
    monkeypatch.setenv("TRUNNION_SERVER", "http://127.0.0.1:9")
    code, _, err = told("list")
    assert (code, "trunnion serve" in err) == (1, True)
    monkeypatch.setenv("TRUNNION_SERVER", "http://")
    assert told("list")[0] == 2


def test_a_first_key_is_made_and_wrong_settings_are_reported_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def served_with(*words: str) -> tuple[int, str, str]:
        code = main(["serve", "--data", str(tmp_path / "d"), "--port", "0", *words])
        return code, *capsys.readouterr()

    code, out, _ = served_with("--new-key", "me:admin")
    assert (code, out[:3]) == (0, "tr_")
    code, _, err = served_with("--rate", "often", "--limit", "cases=x", "--limit", "wings=2")
    assert code == 2
    for word in ("often", "cases=x", "wings"):
        assert word in err
    code, _, err = served_with("--database", "nonsense")
    assert (code, "--database" in err) == (2, True)
    code, _, err = served_with("--database", "postgresql://x@127.0.0.1:9/x")
    assert (code, "database" in err) == (1, True)
