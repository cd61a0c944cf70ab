"""Encoding of tables as JSON, CSV, Parquet or Arrow, streamed in batches. Content negotiation chooses the format."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

from trunnion.service.api.documents.problem_documents import Refusal
from trunnion.service.basics.json_text import text_of

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
"""{media type: description in the OpenAPI document}."""
JSON_ROWS = 500
"""Number of rows that are encoded at a time. The number is small because encoding blocks all other Python threads."""


def choose_format(asked: str | None, accept: str) -> str:
    """The format that the query names, else the format that the Accept header prefers. Refusal (406) if the client accepts none of
    the formats."""
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


def table_bytes(kind: str, schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    """The bytes of one document in a format. The document contains the rows of all tables. The first table is read before the first
    bytes are yielded, so that an error in this table gives an error status."""
    unread = iter(tables)
    read = list(islice(unread, 1))
    yield from {"json": _json, "csv": _csv, "parquet": _parquet, "arrow": _arrow}[kind](schema, chain(read, unread))


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

    sink = io.BytesIO()
    arrow_csv.write_csv(schema.empty_table(), sink)  # the header
    yield _take(sink)
    for table in tables:
        for batch in table.to_batches(max_chunksize=20000):
            arrow_csv.write_csv(batch, sink, arrow_csv.WriteOptions(include_header=False))
            yield _take(sink)


def _take(sink: io.BytesIO) -> bytes:
    """The bytes written since the last call. These bytes are removed from the sink. Arrow's writers count their position
    themselves."""
    data = sink.getvalue()
    sink.seek(0)
    sink.truncate()
    return data


def _parquet(schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    import pyarrow.parquet as pq

    sink = io.BytesIO()
    yield from _written(sink, pq.ParquetWriter(sink, schema, compression="zstd"), tables)


def _arrow(schema: pyarrow.Schema, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    import pyarrow as pa

    sink = io.BytesIO()
    yield from _written(sink, pa.ipc.new_stream(sink, schema), tables)


def _written(sink: io.BytesIO, writer: Any, tables: Iterable[pyarrow.Table]) -> Iterator[bytes]:
    """The bytes that a writer of Arrow writes into the sink. Bytes are returned after each table and at the end."""
    for table in tables:
        writer.write_table(table)
        yield _take(sink)
    writer.close()
    yield _take(sink)
