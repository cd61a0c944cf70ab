"""Rows stored for many cases of a sweep equal the rows of each case alone. The stored rows do not depend on the division into
chunks, nor on where the batch ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.dataset as ds
import pytest

import trunnion
from trunnion.basics.errors import SceneError
from trunnion.batch.tables.trajectories import save_dataset

MU, C = "joints.guide.friction.mu", "joints.guide.friction.half_length"
COLUMNS = ("guide.q[1]", "guide.contact[1].normal_force")


@pytest.fixture(scope="module")
def swept() -> Any:
    """Cases of which some jam, and one is not a valid scene."""
    cases = [{MU: m, C: c} for m in (0.05, 0.3, 0.6) for c in (0.1, 0.3)] + [{MU: -1.0, C: 0.3}]
    return trunnion.sweep(
        "double_pendulum", cases=cases, reductions="final:guide.q[1]", trajectories=COLUMNS, until=0.4, every=0.001, kernel="parts"
    )


def rows_of(swept: Any, case: int) -> Any:
    return swept.trajectories.filter(swept.trajectories["case"].to_numpy() == case)


def test_the_rows_kept_are_those_of_single_runs_to_the_last_bit(swept: Any) -> None:
    assert set(swept.counts) == {"done", "jammed", "invalid"}
    for case in range(6):
        run = swept.trajectory(case, list(COLUMNS))
        mine = rows_of(swept, case)
        assert mine["time"].to_pylist() == run.time.tolist()
        for name in COLUMNS:
            assert mine[name].to_numpy().tobytes() == run[name].tobytes(), (case, name)
    assert len(rows_of(swept, 6)) == 0
    assert swept.trajectories["case"].to_pylist() == sorted(swept.trajectories["case"].to_pylist())


def test_trajectories_do_not_depend_on_threads_and_other_columns(swept: Any) -> None:
    over = {MU: "0.05:0.15:60"}
    run: dict[str, Any] = {"trajectories": "guide.q[1]", "until": 0.1, "every": 0.01, "kernel": "parts"}
    one, three = (trunnion.sweep("double_pendulum", over, reductions="max:cross.q[1]", workers=n, **run) for n in (1, 3))
    assert one.trajectories.equals(three.trajectories)
    plain = trunnion.sweep("double_pendulum", over, reductions="max:cross.q[1]", until=0.1, every=0.01, kernel="parts")
    assert plain.trajectories is None
    assert plain.table.to_pylist() == one.table.to_pylist()


def test_rows_are_kept_at_a_spacing_and_become_a_data_set_by_case(tmp_path: Path) -> None:
    run: dict[str, Any] = {"reductions": "final:guide.q[1]", "trajectories": "guide.q[*]", "until": 0.4, "every": 0.01}
    s = trunnion.sweep("double_pendulum", {MU: [0.05, 0.1]}, spacing=0.1, **run)
    assert s.trajectories.column_names == ["case", "time", "guide.q[1]", "guide.q[2]"]
    assert s.trajectories["time"].to_numpy() == pytest.approx(np.tile(np.linspace(0.0, 0.4, 5), 2), abs=1e-9)
    assert s.trajectories.schema.field("guide.q[1]").metadata[b"unit"] == b"m"
    save_dataset(s.trajectories, tmp_path / "set")
    assert sorted(p.name for p in (tmp_path / "set").iterdir()) == ["case=0", "case=1"]
    back = ds.dataset(tmp_path / "set", partitioning="hive").to_table(filter=ds.field("case") == 1)
    assert back["guide.q[1]"].to_pylist() == rows_of(s, 1)["guide.q[1]"].to_pylist()


def test_invalid_requests_for_trajectories_are_refused() -> None:
    for wrong in ({"trajectories": "nothing.*"}, {"trajectories": "guide.q[1]", "spacing": 0.0}, {"spacing": 0.1}):
        with pytest.raises(SceneError):
            trunnion.sweep("double_pendulum", {MU: [0.1]}, **wrong)  # type: ignore[arg-type]
