"""A run with more rows than memory allows is refused, or ends when memory is full. A server at an unavailable port or address is
refused at once."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion.cli import main
from trunnion.simulation.execution import run_loop
from trunnion.simulation.settings import memory_limits
from trunnion.simulation.settings.memory_limits import expected_rows, row_problems

MU = "joints.ball.friction.mu"


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Set the memory of the machine to 1 GB."""
    monkeypatch.setattr(memory_limits, "memory", lambda: 10**9)


ASKED: dict[str, Callable[[], object]] = {
    "simulate": lambda: trunnion.simulate("spherical_pendulum", until=5, every=1e-9),
    "fixed steps": lambda: trunnion.simulate("spherical_pendulum", until=5, every=0, step=1e-9),
    "sweep": lambda: trunnion.sweep("spherical_pendulum", {MU: [0.1]}, until=5, every=1e-9),
    "sensitivity": lambda: trunnion.sensitivity("spherical_pendulum", [MU], ["ball.qd[2]"], until=5, every=1e-9),
    "one case again": lambda: trunnion.sweep("spherical_pendulum", {MU: [0.1]}, until=5, every=1e-5).trajectory(0),
}


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("who", ASKED)
def test_a_run_in_python_beyond_memory_is_refused_with_its_rows_and_a_remedy(who: str) -> None:
    with pytest.raises(trunnion.SceneError) as told:
        ASKED[who]()
    (problem,) = told.value.problems
    assert ("5e+05 rows" if who == "one case again" else "5e+09 rows") in problem.what
    assert "set every to" in problem.hint


@pytest.mark.usefixtures("small")
def test_the_command_is_refused_with_memory_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "r.csv"
    assert main(["simulate", "spherical_pendulum", "--until", "5", "--every", "1e-9", "-o", str(file), "--json"]) == 2
    (problem,) = json.loads(capsys.readouterr().out)["problems"]
    numbers = 1 + len(trunnion.simulate("spherical_pendulum", until=0.1).columns)  # a row holds the time and the columns
    assert f"5e+09 rows of {numbers} numbers, which need {5e9 * numbers * 8 * 2 / 1e12:.3g} TB" in problem["what"]
    assert "1 GB" in problem["what"]
    assert not file.exists()


def test_rows_at_every_step_end_the_run_when_memory_is_full_and_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The number of steps is unknown at the start, so the command does not refuse the run. The run ends when memory is full and
    keeps its rows."""
    asked = {"until": 60.0, "every": 0, "rtol": 1e-12, "outputs": "crank_pivot.q*"}
    whole = trunnion.simulate("crank_slider_free", **asked)
    assert whole.outcome.ok
    assert len(whole.time) > 1000
    monkeypatch.setattr(
        memory_limits, "memory", lambda: 100 * memory_limits.COPIES * memory_limits.NUMBER * len(whole.names) / memory_limits.SHARE
    )
    part = trunnion.simulate("crank_slider_free", **asked)
    assert part.outcome.name == "too_many_rows"
    assert "Set every to the time between rows" in part.outcome.advice
    assert part.outcome.time == part.time[-1] < 60.0
    assert 100 < len(part.time) < len(whole.time)
    assert np.array_equal(part.data, whole.data[: len(part.time)])
    assert part.events == tuple(e for e in whole.events if e.time <= part.time[-1])


def test_events_end_the_run_when_memory_is_full_and_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, asked = str(trunnion.models_dir() / "stability" / "21_ratchet.yaml"), {"until": 20.0, "every": 0.1}
    monkeypatch.setattr(run_loop.OneRun, "_first_steps", lambda self: 20)  # 20 steps a call: the run needs many calls
    monkeypatch.setattr(run_loop.OneRun, "_next_steps", lambda self, steps, seconds: steps)
    whole = trunnion.simulate(scene, **asked)
    assert whole.outcome.ok
    assert len(whole.events) > 4
    monkeypatch.setattr(memory_limits, "most_events", lambda: 3)
    part = trunnion.simulate(scene, **asked)
    assert part.outcome.name == "too_many_events"
    assert 3 < len(part.events) < len(whole.events)
    assert part.events == whole.events[: len(part.events)]
    assert np.array_equal(part.data, whole.data[: len(part.time)])


@pytest.mark.usefixtures("small")
def test_the_spacing_that_is_advised_is_taken_and_a_finer_one_is_not() -> None:
    advised = float(row_problems(5.0, 1e-9, columns=63)[0].hint.split()[3])
    assert not row_problems(5.0, advised, columns=63)
    assert row_problems(5.0, 0.5 * advised, columns=63)
    assert expected_rows(5.0, advised) * 63 * 16 <= 0.5e9


def test_a_request_to_the_service_goes_through_the_same_place() -> None:
    from trunnion.service.basics.server_settings import Limits
    from trunnion.service.request_models.job_request import JobRequest, plan_of_request

    asked = JobRequest(scene="spherical_pendulum", vary={MU: [0.1]}, until=5.0, every=1e-9)
    with pytest.raises(trunnion.SceneError, match=r"5e\+09 rows"):
        plan_of_request(asked, Limits(rows=10**12))


def test_the_memory_of_the_machine_is_known() -> None:
    assert 2**28 < memory_limits.memory() < 2**50


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_port_in_use_is_refused_before_anything_starts(host: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        assert main(["serve", "--host", host, "--port", str(port), "--data", str(tmp_path / "data")]) == 2
    out, err = capsys.readouterr()
    assert f"--port: {port} is in use at {host}" in err
    assert f"--port {port + 1}" in err
    assert out == ""
    assert not (tmp_path / "data").exists()


def test_a_host_that_is_not_ours_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--host", "203.0.113.7", "--port", "0", "--data", str(tmp_path / "data")]) == 2
    assert "--host: '203.0.113.7' is not an address of this machine" in capsys.readouterr().err
