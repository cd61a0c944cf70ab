"""Results as tables: Arrow with units and metadata, CSV and Parquet files that say where they came from.

A CSV file begins with lines ``# key: value`` (version, scene, settings, outcome, events, notes, audit as JSON), of which the
last, ``# units: s,m,…``, has one unit for every name in the header line that follows it; then one line a row. Read it
with ``load_result_table``, or with ``pandas.read_csv(file, comment="#")``. Parquet and Arrow hold the same keys in the
schema's metadata, units and descriptions in that of the fields. A file depends on the run alone (no dates, no timings)
and is written whole or not at all.
"""

from __future__ import annotations

import csv
import json
import math
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.basics import arrow
from engine.basics.extras import brought
from engine.basics.files import writing
from engine.basics.problems import Problem, SceneError
from engine.basics.version import version
from engine.simulation.certainty.tabled import with_errors
from engine.simulation.event import Event
from engine.simulation.outcome import Outcome

if TYPE_CHECKING:
    import pyarrow

    from engine.scene.model import Scene
    from engine.simulation.result import Result

SUFFIXES = (".csv", ".parquet")
FORMAT = "trunnion result 1"
AT_ONCE = 4096
"""Rows of a CSV file that are made into text at once."""
ENCODED = ("scene", "settings", "outcome", "events", "notes", "audit", "certainty")
"""Metadata keys whose values are JSON; the others are plain text."""


def metadata(result: Result) -> dict[str, str]:
    """Where the result came from: format, version, scene, settings, outcome, events, notes and audit, all as text."""
    from engine.scene.dump import scene_to_dict

    encoded = {
        "scene": scene_to_dict(result.scene),
        "settings": result.settings,
        "outcome": asdict(result.outcome),
        "events": [asdict(e) for e in result.events],
        "notes": list(result.notes),
        "audit": result.audit.document(),
    }
    if result.certainty is not None:
        encoded["certainty"] = result.certainty.document()
    plain = {"format": FORMAT, "version": version(), "name": result.scene.name}
    return plain | {k: json.dumps(finite(v), ensure_ascii=False) for k, v in encoded.items()}


def finite(value: Any) -> Any:
    """Nested data ready for JSON: null in place of every number that JSON does not have (NaN, infinities), and lists in place
    of tuples."""
    if isinstance(value, dict):
        return {str(k): finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def to_arrow(result: Result) -> pyarrow.Table:
    """Arrow table of float64, errors behind the columns where there are any: ``unit`` and ``description`` in each field's
    metadata, ``metadata`` in the schema's."""
    pa = brought("pyarrow", "tables", "to_arrow()")
    about_run, result = metadata(result), with_errors(result)
    about = [("s", "time"), *((c.unit, c.description) for c in result.columns)]
    fields = [
        pa.field(name, pa.float64(), nullable=False, metadata={"unit": unit, "description": text})
        for name, (unit, text) in zip(result.names, about, strict=True)
    ]
    arrays = [arrow.numbers(column) for column in result.data.T]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=about_run))


def save(result: Result, path: str | os.PathLike[str]) -> Path:
    """Write CSV or Parquet, by suffix. SceneError when the name has another suffix or its folder cannot be written."""
    with writing(path, SUFFIXES) as work:
        if work.suffix.lower() == ".csv":
            _write_csv(result, work)
        else:
            _write_parquet(result, work)
    return Path(path)


def _write_parquet(result: Result, path: Path) -> None:
    import pyarrow.parquet as pq

    pq.write_table(to_arrow(result), path, compression="zstd")


def _write_csv(result: Result, path: Path) -> None:
    head = [f"# {key}: {text}" for key, text in metadata(result).items()]
    result = with_errors(result)
    units = ",".join(result.units.values())
    lines = [*(" ".join(line.split("\n")) for line in head), f"# units: {units}", ",".join(result.names)]
    with path.open("wb") as f:
        f.write(("\n".join(lines) + "\n").encode())
        for first in range(0, len(result.data), AT_ONCE):
            f.write(lines_of(result.data[first : first + AT_ONCE]).encode())


def lines_of(data: np.ndarray) -> str:
    """Rows as lines of a CSV file: each number in the fewest digits that give it back. A microsecond a number; Parquet takes a
    sixth of that."""
    return "".join(",".join(map(repr, row)) + "\n" for row in data.tolist())


@dataclass(frozen=True)
class ResultTable:
    """A result read back from a file: names, units and data (rows × names), and the metadata, decoded."""

    names: tuple[str, ...]
    units: dict[str, str]
    data: np.ndarray
    metadata: dict[str, Any] = field(default_factory=dict)

    @property
    def time(self) -> np.ndarray:
        """Output times, s."""
        return self["time"]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.data[:, self.names.index(name)]

    def __contains__(self, name: str) -> bool:
        return name in self.names

    @property
    def scene(self) -> Scene:
        """The scene that was run."""
        from engine.scene.load import scene_from_dict

        return scene_from_dict(self.metadata["scene"])

    @property
    def outcome(self) -> Outcome:
        """How the run ended."""
        return Outcome(**self.metadata["outcome"])

    @property
    def events(self) -> tuple[Event, ...]:
        """The events of the run."""
        return tuple(_event(e) for e in self.metadata["events"])


def _event(e: dict[str, Any]) -> Event:
    before, after, turn, (margin,) = (
        tuple(math.nan if a is None else float(a) for a in x) for x in (e["before"], e["after"], e["turn"], (e.get("margin"),))
    )
    return Event(e["time"], e["kind"], e["joint"], e["part"], before, after, turn, margin, e.get("marginal", False))


def load_result_table(path: str | os.PathLike[str]) -> ResultTable:
    """Read a file that ``save`` wrote. SceneError when it is not one."""
    file = Path(path)
    reader = {".csv": _read_csv, ".parquet": _read_parquet}.get(file.suffix.lower())
    if reader is None:
        raise SceneError([Problem("file", f"{str(path)!r} is no table of results", f"{' or '.join(SUFFIXES)} is read")])
    try:
        return reader(file)
    except (OSError, ValueError, KeyError, StopIteration) as e:
        raise SceneError([Problem("file", f"cannot read {str(path)!r}: {e}", "was it written by Trunnion?")]) from e


def _decoded(texts: dict[str, str]) -> dict[str, Any]:
    return {k: json.loads(v) if k in ENCODED else v for k, v in texts.items()}


def _read_csv(path: Path) -> ResultTable:
    texts: dict[str, str] = {}
    with path.open(encoding="utf-8", newline="") as f:
        while (line := next(f)).startswith("#"):
            key, _, text = line[1:].partition(":")
            texts[key.strip()] = text.strip()
        names = tuple(next(csv.reader([line])))
        body = f.read().split("\n")[:-1]
    data = np.loadtxt(body, delimiter=",", ndmin=2) if body else np.zeros((0, len(names)))
    units = texts.pop("units").split(",")
    return ResultTable(names, dict(zip(names, units, strict=True)), data, _decoded(texts))


def _read_parquet(path: Path) -> ResultTable:
    pq = brought("pyarrow.parquet", "tables", "reading Parquet")
    table = pq.read_table(path)
    texts = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()}
    if texts.get("format") != FORMAT:
        raise ValueError("it has no metadata of a result")
    units = {f.name: f.metadata[b"unit"].decode() for f in table.schema}
    columns = [c.to_numpy() for c in table.columns]
    data = np.column_stack(columns) if columns else np.zeros((table.num_rows, 0))
    return ResultTable(tuple(table.column_names), units, data, _decoded(texts))
