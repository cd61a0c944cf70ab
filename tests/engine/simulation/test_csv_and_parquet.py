"""Tables contain the exact numbers of a result, and metadata about the origin of the result."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from trunnion.basics.errors import SceneError
from trunnion.simulation.results.csv_and_parquet import lines_of, load_result_table, to_arrow
from trunnion.simulation.results.result import Result


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_saved_result_reads_back_exactly(pendulum: Result, tmp_path: Path, suffix: str) -> None:
    back = load_result_table(pendulum.save(tmp_path / f"r{suffix}"))
    assert list(back.names) == pendulum.names
    assert back.units == pendulum.units
    np.testing.assert_array_equal(back.data, pendulum.data)
    assert back.scene == pendulum.scene
    assert back.outcome == pendulum.outcome
    assert back.events == pendulum.events
    assert back.metadata["settings"] == pendulum.settings
    assert back.metadata["notes"] == ["a note"]
    assert back.metadata["version"]


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_values_that_are_no_numbers_survive(pendulum: Result, tmp_path: Path, suffix: str) -> None:
    pendulum.data[3, 5] = math.nan
    back = load_result_table(pendulum.save(tmp_path / f"r{suffix}"))
    assert math.isnan(back.data[3, 5])
    assert np.isnan(back.data).sum() == 1


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_result_without_rows_can_be_saved(pendulum: Result, tmp_path: Path, suffix: str) -> None:
    from dataclasses import replace

    back = load_result_table(replace(pendulum, data=pendulum.data[:0]).save(tmp_path / f"r{suffix}"))
    assert back.data.shape == (0, len(pendulum.names))


@pytest.mark.parametrize("columns", [1, 3, 65])
def test_lines_of_numbers_read_back_to_the_same_bits(columns: int) -> None:
    bits = np.random.default_rng(7).integers(0, 2**63, 780, dtype=np.uint64)
    wild = np.concatenate([[0.0, -0.0, 5e-324, 1e22, -1.7976931348623157e308, math.nan], bits.view(float)[:-6]])
    for data in (wild.reshape(-1, columns), np.where(wild < 1e-3, math.inf, -wild).reshape(-1, columns)):
        back = [[float(x) for x in line.split(",")] for line in lines_of(data).decode().splitlines()]
        np.testing.assert_array_equal(np.nan_to_num(back, nan=7.0).view(np.uint64), np.nan_to_num(data, nan=7.0).view(np.uint64))


def test_the_size_of_blocks_does_not_change_a_csv_file(
    pendulum: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = pendulum.save(tmp_path / "a.csv").read_bytes()
    monkeypatch.setattr("trunnion.simulation.results.csv_and_parquet.AT_ONCE", 3 * len(pendulum.names))
    assert len(pendulum.data) % 3, "the last block is shorter"
    assert pendulum.save(tmp_path / "b.csv").read_bytes() == whole


def test_pandas_reads_the_csv(pendulum: Result, tmp_path: Path) -> None:
    frame = pd.read_csv(pendulum.save(tmp_path / "r.csv"), comment="#")
    assert list(frame.columns) == pendulum.names
    np.testing.assert_array_equal(frame.to_numpy(), pendulum.data)


def test_the_csv_has_one_unit_for_every_name(pendulum: Result, tmp_path: Path) -> None:
    lines = pendulum.save(tmp_path / "r.csv").read_text().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("# units: "))
    units, names = lines[at].removeprefix("# units: ").split(","), lines[at + 1].split(",")
    assert dict(zip(names, units, strict=True)) == pendulum.units
    assert all(line.startswith("# ") for line in lines[:at])


def test_arrow_fields_carry_units_and_descriptions(pendulum: Result) -> None:
    table = to_arrow(pendulum)
    field = table.schema.field("ball.contact[1].normal_force")
    assert field.metadata == {b"unit": b"N", b"description": b"normal force at contact 1 of ball"}
    assert b"scene" in table.schema.metadata


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_the_same_result_gives_the_same_bytes(pendulum: Result, tmp_path: Path, suffix: str) -> None:
    a, b = (pendulum.save(tmp_path / f"{n}{suffix}").read_bytes() for n in "ab")
    assert a == b


@pytest.mark.parametrize(
    ("name", "word"), [("r.xls", "suffix|ends in"), ("r", "no suffix"), ("no/such/r.csv", "does not exist"), (".csv", "suffix")]
)
def test_a_name_that_cannot_be_written_is_a_problem(pendulum: Result, tmp_path: Path, name: str, word: str) -> None:
    with pytest.raises(SceneError, match=word):
        pendulum.save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file_and_nothing_else(
    pendulum: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = pendulum.save(tmp_path / "r.csv")
    old = target.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("trunnion.simulation.results.csv_and_parquet.lines_of", full)
    with pytest.raises(SceneError, match="No space left"):
        pendulum.save(target)
    assert target.read_bytes() == old
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_of_someone_else_is_a_problem(tmp_path: Path) -> None:
    for name, text in (("a.csv", "x,y\n1,2\n"), ("b.parquet", "PAR1"), ("c.txt", ""), ("d.csv", "")):
        (tmp_path / name).write_text(text)
        with pytest.raises(SceneError):
            load_result_table(tmp_path / name)
    with pytest.raises(SceneError):
        load_result_table(tmp_path / "absent.csv")
