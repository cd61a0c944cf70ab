"""Results as Arrow tables, CSV and Parquet files, with units and the origin of the run.

A CSV file begins with lines ``# key: value``: version, scene, settings, outcome, events, notes, audit; most values are JSON. The
last of these lines is ``# units: s,m,…``, with a unit for every name in the header line below. Each further line is a row. Such a
file can be read with ``load_result_table``, or with ``pandas.read_csv(file, comment="#")``. Parquet and Arrow have the same keys in
the schema's metadata; units and descriptions are in the metadata of the fields. A file depends only on the run and has no dates or
timings. Files are written atomically.
"""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Iterator
from dataclasses import asdict, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from trunnion.basics import arrow_columns
from trunnion.basics.atomic_files import writing
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.json_values import finite
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.number_declarations import ZERO_BELOW
from trunnion.basics.optional_packages import brought
from trunnion.basics.version import version
from trunnion.simulation.results.error_columns import with_errors
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.outcome import Outcome

if TYPE_CHECKING:
    import pyarrow

    from trunnion.scene.data_classes.scene import Scene
    from trunnion.simulation.results.result_data import ResultData

SUFFIXES = (".csv", ".parquet")
FORMAT = "trunnion result 1"
AT_ONCE = 20_000
"""Number of values of a CSV file that are formatted at once, in about 2 ms. Their text fits into the processor's cache."""
ENCODED = ("scene", "settings", "outcome", "events", "notes", "audit", "certainty")
"""Metadata keys whose values are JSON. The values of all other keys are plain text."""


def metadata(result: ResultData) -> dict[str, str]:
    """The origin of a result as text: format, version, scene, settings, outcome, events, notes, audit."""
    from trunnion.scene.file_format.yaml_writer import scene_to_dict

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


def to_arrow(result: ResultData) -> pyarrow.Table:
    """An Arrow table of float64. Columns of stated errors come last. The metadata of each field has ``unit`` and ``description``;
    the schema's metadata has the origin of the result."""
    pa = brought("pyarrow", "tables", "to_arrow()")
    about_run, result = metadata(result), with_errors(result)
    about = [("s", "time"), *((c.unit, c.description) for c in result.columns)]
    fields = [
        arrow_columns.field(name, pa.float64(), unit, text)
        for name, (unit, text) in zip(result.names, about, strict=True)
    ]
    arrays = [arrow_columns.numbers(column) for column in result.data.T]
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=about_run))


def save(result: ResultData, path: str | os.PathLike[str]) -> Path:
    """Write CSV or Parquet, depending on the suffix. Raises SceneError for another suffix or a folder that is not writable."""
    with writing(path, SUFFIXES) as work:
        if work.suffix.lower() == ".csv":
            _write_csv(result, work)
        else:
            brought("pyarrow.parquet", "tables", "saving Parquet").write_table(to_arrow(result), work, compression="zstd")
    return Path(path)


def _write_csv(result: ResultData, path: Path) -> None:
    head = [f"# {key}: {text}" for key, text in metadata(result).items()]
    result = with_errors(result)
    units = ",".join(result.units.values())
    lines = [*(" ".join(line.split("\n")) for line in head), f"# units: {units}", ",".join(result.names)]
    with path.open("wb") as f:
        f.write(("\n".join(lines) + "\n").encode())
        for rows in blocks_of(result.data):
            f.write(lines_of(np.where(np.abs(rows) < ZERO_BELOW, 0.0, rows)))


def blocks_of(data: np.ndarray) -> Iterator[np.ndarray]:
    """The rows of ``data`` in blocks of at most ``AT_ONCE`` values. Ctrl-C is handled between two blocks."""
    some = max(1, AT_ONCE // data.shape[1])
    return (data[first : first + some] for first in range(0, len(data), some))


def lines_of(data: np.ndarray) -> bytes | bytearray:
    """Rows as lines of a CSV file. Each number has the fewest digits that restore it exactly. data: (n × c), n and c at least 1."""
    if np.isinf(data).any():  # orjson would write null for infinity
        return "".join(",".join(map(repr, row)) + "\n" for row in data.tolist()).encode()
    text = orjson.dumps(data.ravel(), option=orjson.OPT_SERIALIZE_NUMPY)
    if np.isnan(data).any():
        text = text.replace(b"null", b"nan")
    lines = bytearray(text)
    characters = np.frombuffer(lines, np.uint8)
    commas = np.flatnonzero(characters == ord(","))
    characters[commas[data.shape[1] - 1 :: data.shape[1]]] = ord("\n")
    characters[-1] = ord("\n")  # a line feed replaces the list's closing bracket
    del characters  # delete the view: a bytearray with a view cannot change its size
    del lines[:1]
    return lines


@dataclass(frozen=True)
class ResultTable:
    """A result from a file.

    Attributes:
        names: names of the columns (c), ``time`` first.
        units: unit of each column.
        data: values (n × c).
        metadata: origin of the result, decoded.
    """

    names: tuple[str, ...]
    units: dict[str, str]
    data: np.ndarray
    metadata: dict[str, Any] = field(default_factory=dict)

    @property
    def time(self) -> np.ndarray:
        """Output times (n), s."""
        return self["time"]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.data[:, self.names.index(name)]

    def __contains__(self, name: str) -> bool:
        return name in self.names

    @property
    def scene(self) -> Scene:
        """The scene that was run."""
        from trunnion.scene.scene_loader import scene_from_dict

        return scene_from_dict(self.metadata["scene"])

    @property
    def outcome(self) -> Outcome:
        """The outcome of the run."""
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
    """Read a file that ``save`` wrote. Raises SceneError for other files."""
    file = Path(path)
    reader = {".csv": _read_csv, ".parquet": _read_parquet}.get(file.suffix.lower())
    if reader is None:
        raise SceneError([Problem("file", f"{str(path)!r} is not a result file", f"give a {' or '.join(SUFFIXES)} file")])
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
        raise ValueError("metadata of a result is missing")
    units = {f.name: f.metadata[b"unit"].decode() for f in table.schema}
    columns = [c.to_numpy() for c in table.columns]
    data = np.column_stack(columns) if columns else np.zeros((table.num_rows, 0))
    return ResultTable(tuple(table.column_names), units, data, _decoded(texts))
