"""``trunnion.sweep`` and the command ``trunnion sweep``: cases, threads, tables, errors of the user."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import trunnion
from trunnion.batch.cases.grids_and_samples import grid, listed, sampled
from trunnion.batch.plan_and_runner import Run, Runner, Stopped, plan
from trunnion.cli import main

MU = "joints.ball.friction.mu"
KEEP = ["max:ball.contact[1].normal_force", "first:reversal"]


def test_the_number_of_threads_changes_nothing() -> None:
    over = {MU: "0.1:0.6:40"}
    one, three = (trunnion.sweep("spherical_pendulum", over, reductions=KEEP, until=1.0, workers=n) for n in (1, 3))
    assert one.table.equals(three.table)
    assert one.counts == {"done": 40}


def test_a_sweep_is_a_frame_with_units_and_any_case_can_be_run_again() -> None:
    s = trunnion.sweep("spherical_pendulum", cases=[{MU: 0.2}, {MU: 0.4}], reductions=KEEP, until=1.0)
    frame = s.to_pandas()
    assert list(frame[MU]) == [0.2, 0.4]
    assert frame.attrs["units"][KEEP[0]] == "N"
    r = s.trajectory(1, ["ball.contact[1].normal_force"])
    assert r["ball.contact[1].normal_force"].max() == frame[KEEP[0]][1]


def test_a_grid_has_every_combination_the_last_path_fastest() -> None:
    scene = trunnion.load_scene("spherical_pendulum")
    c = grid(scene, {MU: "0.1:0.3:3", "gravity[3]": [-9.81, "-1 m/s^2"]})
    assert c.count == 6
    assert c.units == ("1", "m/s^2")
    assert np.allclose(c.values(1, 4), [[0.1, -1.0], [0.2, -9.81], [0.2, -1.0]], atol=1e-15)


def test_a_latin_sample_has_one_case_in_every_strip_and_the_same_seed_gives_the_same() -> None:
    scene = trunnion.load_scene("spherical_pendulum")
    ranges = {MU: (0.0, 1.0), "gravity[3]": ("-10 m/s^2", 0)}
    c = sampled(scene, ranges, 50, 7)
    v = c.values(0, 50)
    for k, (low, high) in enumerate(((0.0, 1.0), (-10.0, 0.0))):
        assert sorted(np.floor((v[:, k] - low) / (high - low) * 50)) == list(range(50))
    assert (sampled(scene, ranges, 50, 7).values(10, 20) == v[10:20]).all()
    assert (sampled(scene, ranges, 50, 8).values(10, 20) != v[10:20]).any()


def test_a_list_takes_values_with_units() -> None:
    c = listed(
        trunnion.load_scene("spherical_pendulum"), [{"joints.ball.friction.radius": "50 mm"}, {"joints.ball.friction.radius": 0.02}]
    )
    assert c.values(0, 2).tolist() == [[0.05], [0.02]]


def test_every_mistake_is_reported_at_once() -> None:
    with pytest.raises(trunnion.SceneError) as e:
        trunnion.sweep(
            "spherical_pendulum", {"joints.ball.friction.nu": [1], MU: "0.1:0.2"}, reductions=["max:bal", "last:x"], until=-1.0
        )
    told = " ".join(map(str, e.value.problems))
    for word in ("nu", "first:last:count", "max:bal", "last:x", "until"):
        assert word in told


def test_a_path_that_leads_nowhere_is_one_mistake_however_many_values_it_is_given() -> None:
    for values in ("0.1:0.2:3", [0.1, 0.2, 0.3]):
        with pytest.raises(trunnion.SceneError) as e:
            trunnion.sweep("spherical_pendulum", {"joints.ball.friction.nu": values})
        assert [p.where for p in e.value.problems] == ["vary.joints.ball.friction.nu"]


@pytest.mark.parametrize(
    "wrong", [{}, {MU: []}, {MU: "1:2:0"}, {MU: [float("nan")]}, {MU: [True]}, {"gravity": [1.0]}, {"bodies": [1]}, {MU: ["x"]}]
)
def test_values_that_mean_nothing_are_refused(wrong: dict) -> None:
    with pytest.raises(trunnion.SceneError):
        trunnion.sweep("spherical_pendulum", wrong)


def test_a_batch_can_be_stopped_between_two_calls_into_c() -> None:
    p = plan(trunnion.load_scene("spherical_pendulum"), {MU: "0.1:0.6:5000"}, keep=KEEP, run=Run(5.0))
    with pytest.raises(Stopped):
        Runner(p).chunk(0, 5000, lambda done: False)


def test_the_command_writes_a_table_and_one_json_document(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "s.parquet"
    words = [
        "sweep",
        "spherical_pendulum",
        "--vary",
        f"{MU}=0.1:0.5:5",
        "--reduce",
        KEEP[0],
        "--until",
        "500 ms",
        "-o",
        str(file),
        "--json",
    ]
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["outcomes"] == {"done": 5}
    table = pq.read_table(file)
    assert table.num_rows == 5
    assert table.schema.field(KEEP[0]).metadata[b"unit"] == b"N"


def test_the_command_reports_every_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(["sweep", "spherical_pendulum", "--vary", f"{MU}", "--sample", "x=1", "--until", "-1", "--law", "coulumb", "--foo"])
        == 2
    )
    err = capsys.readouterr().err
    for word in ("PATH=VALUES", "PATH=LOW:HIGH", "--until", "--law", "--foo"):
        assert word in err


@pytest.mark.parametrize("way", ["says no", "raises"])
def test_a_call_into_c_is_left_in_its_middle_when_the_tick_asks_for_it(way: str) -> None:
    """One call into C could run both cases to their end. A request by the tick function ends the call within the first case."""
    asked: list[int] = []

    def tick(done: int) -> bool:
        asked.append(done)
        if way == "raises":
            raise TimeoutError
        return False

    p = plan(trunnion.load_scene("spherical_pendulum"), {MU: [0.2, 0.4]}, keep=KEEP, run=Run(1e5))
    runner = Runner(p)
    (rows,), _ = runner.preparer.rows(p.cases.values(0, 2))
    runner._loop(rows).budget = 10**9
    with pytest.raises(TimeoutError if way == "raises" else Stopped):
        runner.chunk(0, 2, tick)
    assert asked == [0]
