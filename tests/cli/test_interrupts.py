"""Ctrl-C keeps all rows, events and finished cases so far, in complete files.

Every test runs a separate program. This program sends itself SIGINT at a fixed place in the work. The first kind of place is the
return of a call into C whose rows are not stored yet. The second kind is the end of the fifth case of a batch."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import trunnion
from trunnion.basics.number_declarations import ZERO_BELOW
from trunnion.simulation.results.csv_and_parquet import load_result_table
from trunnion.simulation.results.result import Result

UNTIL, EVERY = 50.0, 0.01
MU = "joints.ball.friction.mu"
PRELUDE = """
import json, signal, sys, time
from trunnion.simulation.runtime_interface.simulation_block import Block

advance, calls = Block.advance, 0

def interrupted_after(n):
    def call(block, *arguments):
        global calls
        found = advance(block, *arguments)
        calls += 1
        if calls == n:
            signal.raise_signal(signal.SIGINT)
        return found
    Block.advance = call
"""
COMMAND = "import sys; from trunnion.cli import main; sys.exit(main(sys.argv[1:]))"
SWEEP = """
import signal, time
from trunnion.batch.sweep import _Work

def go_on(work, done):
    if work.done + done >= 5 and not work.stopped:
        signal.raise_signal(signal.SIGINT)
        while not work.stopped:
            time.sleep(0.001)
    return not work.stopped

_Work.go_on = go_on
"""


def ran(program: str, *words: str) -> subprocess.CompletedProcess[str]:
    """Run a program to its end in a new process, in which Ctrl-C acts as at a terminal. (A shell makes its background jobs ignore
    Ctrl-C.)"""
    program = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n" + program
    return subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def whole() -> Result:
    """The result of the same run without interruption."""
    return trunnion.simulate("spherical_pendulum", until=UNTIL, every=EVERY)


def held_against(whole: Result, time: np.ndarray, data: np.ndarray, events: Any, end: float) -> None:
    """Check rows and events up to the time of the interruption. All rows and events of the uninterrupted run up to this time must
    be present, bit for bit."""
    assert 0.0 < end < UNTIL
    assert len(time) == np.count_nonzero(whole.time <= end) > 1
    assert np.array_equal(data, whole.data[: len(data)], equal_nan=True)
    assert [e.time for e in events] == [e.time for e in whole.events if e.time <= end]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_simulate_keeps_every_row_and_event(suffix: str, tmp_path: Path, whole: Result) -> None:
    file = tmp_path / f"r.{suffix}"
    words = ["simulate", "spherical_pendulum", "--until", f"{UNTIL}", "--every", f"{EVERY}", "-o", str(file)]
    done = ran(PRELUDE + "interrupted_after(1)\n" + COMMAND, *words)
    table = load_result_table(file)
    assert done.returncode == 1
    assert "cancelled at t =" in done.stdout
    assert f"wrote {file}" in done.stdout
    assert (table.outcome.name, table.metadata["settings"]["until"]) == ("cancelled", UNTIL)
    if suffix == "csv":  # CSV writes 0 for round-off of zero
        whole = replace(whole, data=np.where(np.abs(whole.data) < ZERO_BELOW, 0.0, whole.data))
    held_against(whole, table.time, table.data, table.events, table.outcome.time)


def test_json_reports_the_interrupt_in_its_one_document(tmp_path: Path, whole: Result) -> None:
    file = tmp_path / "r.parquet"
    words = ["simulate", "spherical_pendulum", "--until", f"{UNTIL}", "--every", f"{EVERY}", "-o", str(file), "--json"]
    done = ran(PRELUDE + "interrupted_after(1)\n" + COMMAND, *words)
    told = json.loads(done.stdout)
    assert (done.returncode, told["exit_code"], told["outcome"]["name"]) == (1, 1, "cancelled")
    assert told["files"] == {"table": str(file)}
    table = load_result_table(file)
    held_against(whole, table.time, table.data, table.events, told["outcome"]["time"])


def test_python_gets_the_result_so_far_and_continues() -> None:
    program = PRELUDE + "interrupted_after(1)\nimport trunnion\n"
    program += f"r = trunnion.simulate('spherical_pendulum', until={UNTIL}, every={EVERY})\n"
    program += "print(json.dumps([r.outcome.name, len(r), len(r.events), signal.getsignal(2) is signal.default_int_handler]))"
    done = ran(program)
    name, rows, events, restored = json.loads(done.stdout)
    assert (name, restored) == ("cancelled", True)
    assert rows > 1
    assert events > 0


def test_a_run_within_larger_work_passes_the_interrupt_on() -> None:
    """A chart consists of many runs; Ctrl-C ends all of these runs."""
    program = PRELUDE + "interrupted_after(1)\nimport trunnion\nfrom trunnion.simulation.run import Model, run\n"
    program += "from trunnion.simulation.runtime_interface.simulation_block import Settings\n"
    program += "try:\n    run(Model(trunnion.load_scene('spherical_pendulum')), 50.0, 0.01, Settings())\n"
    program += "except KeyboardInterrupt:\n    print('passed on')"
    assert ran(program).stdout == "passed on\n"


def test_a_program_with_a_handler_of_its_own_keeps_it() -> None:
    program = PRELUDE + "interrupted_after(1)\nimport trunnion\nseen = []\nsignal.signal(2, lambda *a: seen.append(a))\n"
    program += "r = trunnion.simulate('spherical_pendulum', until=1.0)\nprint(r.outcome.name, len(seen))"
    assert ran(program).stdout == "done 1\n"


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(
    ("suffix", "words"),
    [
        ("csv", []),
        ("parquet", ["--json"]),
        pytest.param("csv", ["--json"], marks=pytest.mark.slow),
        pytest.param("parquet", [], marks=pytest.mark.slow),
    ],
)
def test_sweep_writes_the_finished_cases_and_says_how_many_of_how_many(suffix: str, words: list[str], tmp_path: Path) -> None:
    file = tmp_path / f"s.{suffix}"
    over = ["--vary", f"{MU}=0.1:0.6:100000", "--until", "1", "--reduce", "final:ball.qd[2]", "--workers", "1"]
    done = ran(SWEEP + COMMAND, "sweep", "spherical_pendulum", *over, "-o", str(file), *words)
    assert done.returncode == 1, done.stderr
    columns = read(file)
    n = len(columns["case"])
    if words:
        told = json.loads(done.stdout)
        assert (told["cases"], told["of"], told["cancelled"], told["outcomes"]) == (n, 100000, True, {"done": n})
    else:
        assert f"cancelled: {n} of 100000 cases finished" in done.stdout
    assert 5 <= n < 100000
    assert list(columns["case"]) == list(range(n))
    # a batch as large as the interrupted batch uses the compiled kernel
    again = {"reductions": ["final:ball.qd[2]"], "until": 1.0, "kernel": "compiled"}
    same = trunnion.sweep("spherical_pendulum", {MU: list(columns[MU])}, **again)
    assert list(columns["final:ball.qd[2]"]) == same.table["final:ball.qd[2]"].to_pylist()


def read(file: Path) -> dict[str, Any]:
    """Columns of a table in any format. A partial table must have a mark if the format allows marks."""
    if file.suffix == ".parquet":
        table = pq.read_table(file)
        assert table.schema.metadata[b"cancelled"].decode() == f"{table.num_rows} of 100000 cases finished"
        return {name: table[name].to_pylist() for name in table.column_names}
    from pyarrow import csv

    table = csv.read_csv(file)
    return {name: table[name].to_pylist() for name in table.column_names}


def test_a_sweep_without_a_finished_case_writes_nothing(tmp_path: Path) -> None:
    file = tmp_path / "s.csv"
    program = SWEEP.replace(">= 5", ">= 0").replace("_Work.go_on = go_on", "_Work.take = lambda w: go_on(w, 0)") + COMMAND
    done = ran(program, "sweep", "spherical_pendulum", "--vary", f"{MU}=0.1:0.6:10", "-o", str(file))
    assert done.returncode == 1
    assert "cancelled before the first results" in done.stderr
    assert not file.exists()
