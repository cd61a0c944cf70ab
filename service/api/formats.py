"""Tables as JSON, CSV, Parquet or Arrow, by content negotiation, streamed batch by batch."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from service.api.problems import Refusal
from service.plain import text_of

if TYPE_CHECKING:
    import pyarrow

MEDIA = {
    "json": "application/json",
    "csv": "text/csv",
    "parquet": "application/vnd.apache.parquet",
    "arrow": "application/vnd.apache.arrow.stream",
}
SUFFIX = {"json": "json", "csv": "csv", "parquet": "parquet", "arrow": "arrows"}
CONTENT: dict[str, Any] = {
    MEDIA["json"]: {
        "schema": {
            "type": "object",
            "required": ["columns", "rows"],
            "properties": {
                "columns": {
                    "type": "array",
                    "items": {
                        "type": "object",
                        "properties": {k: {"type": "string"} for k in ("name", "unit", "description")},
                    },
                },
                "rows": {"type": "array", "items": {"type": "array"}},
            },
        },
        "example": {"columns": [{"name": "case", "unit": "1", "description": "number of the case, from 0"}], "rows": [[0], [1]]},
    },
    MEDIA["csv"]: {"schema": {"type": "string"}},
    MEDIA["parquet"]: {"schema": {"type": "string", "format": "binary"}},
    MEDIA["arrow"]: {"schema": {"type": "string", "format": "binary"}},
}
"""Media type → its description in the OpenAPI document."""
JSON_ROWS = 500
"""Rows made text at a time: nothing else in the process goes on meanwhile."""


def chosen(asked: str | None, accept: str) -> str:
    """Name of the format: the one the query asks for, else the one the Accept header prefers. Refusal (406) when there is none."""
    if asked is not None:
        return asked
    best, name = 0.0, None
    for part in accept.split(",") if accept.strip() else ["*/*"]:
        kind, *parameters = (p.strip().lower() for p in part.split(";"))
        weight = _weight(parameters)
        for candidate, media in MEDIA.items():
            if weight > best and kind in ("*/*", media, f"{media.split('/')[0]}/*"):
                best, name = weight, candidate
                break
    if name is None:
        raise Refusal(406, f"one of {', '.join(MEDIA.values())}")
    return name


def _weight(parameters: list[str]) -> float:
    try:
        return next((min(1.0, float(p[2:])) for p in parameters if p.startswith("q=")), 1.0)
    except ValueError:
        return 0.0


def stream(kind: str, schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    """The tables, one after another, as one document of this format."""
    return {"json": _json, "csv": _csv, "parquet": _parquet, "arrow": _arrow}[kind](schema, tables)


def _json(schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    columns = [
        {"name": f.name, "unit": f.metadata[b"unit"].decode(), "description": f.metadata[b"description"].decode()} for f in schema
    ]
    yield b'{"columns":' + text_of(columns) + b',"rows":['
    first = True
    for table in tables:
        for batch in table.to_batches(max_chunksize=JSON_ROWS):
            rows = [list(r) for r in zip(*(c.to_pylist() for c in batch.columns), strict=True)]
            if rows:
                yield (b"" if first else b",") + text_of(rows)[1:-1]
                first = False
    yield b"]}"


def _csv(schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    from pyarrow import csv as arrow_csv

    head = io.StringIO()
    csv.writer(head, quoting=csv.QUOTE_ALL, lineterminator="\n").writerow(schema.names)
    yield head.getvalue().encode()
    for table in tables:
        for batch in table.to_batches(max_chunksize=20000):
            sink = io.BytesIO()
            arrow_csv.write_csv(batch, sink, arrow_csv.WriteOptions(include_header=False))
            yield sink.getvalue()


class _Pipe(io.RawIOBase):
    """A file that is only ever written; what was written is taken away in pieces."""

    def __init__(self) -> None:
        self.pieces: list[bytes] = []
        self.position = 0

    def writable(self) -> bool:
        """Whether it can be written: always (writers ask)."""
        return True

    def write(self, data: Any) -> int:
        """Keep bytes until they are taken."""
        self.pieces.append(bytes(data))
        self.position += len(self.pieces[-1])
        return len(self.pieces[-1])

    def tell(self) -> int:
        """Bytes written so far."""
        return self.position

    def take(self) -> bytes:
        """What was written since the last time."""
        out, self.pieces = b"".join(self.pieces), []
        return out


def _parquet(schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    import pyarrow.parquet as pq

    pipe = _Pipe()
    writer = pq.ParquetWriter(pipe, schema, compression="zstd")
    for table in tables:
        writer.write_table(table)
        yield pipe.take()
    writer.close()
    yield pipe.take()


def _arrow(schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    import pyarrow as pa

    pipe = _Pipe()
    with pa.ipc.new_stream(pipe, schema) as writer:
        for table in tables:
            writer.write_table(table)
            yield pipe.take()
    yield pipe.take()
