"""The version of the engine that computed the rows of a part. The part's metadata contain the version, and the table of a job shows
the version in a column."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trunnion.basics import arrow_columns

if TYPE_CHECKING:
    import pyarrow

VERSION, KEY = "version", b"version"
"""Name of the column, and key of the version in the metadata of a part."""
BEFORE = "steps"
"""Name of the column that follows the column of the version."""


def computed_by(table: pyarrow.Table, version: str) -> pyarrow.Table:
    """The table, with the version in its metadata."""
    return table.replace_schema_metadata((table.schema.metadata or {}) | {KEY: version.encode()})


def version_of(table: pyarrow.Table) -> str:
    """The version in the metadata of a part; "" for metadata without a version."""
    return str((table.schema.metadata or {}).get(KEY, b"").decode())


def with_version(schema: pyarrow.Schema) -> pyarrow.Schema:
    """The schema of a job's table: the schema of the job's plan, and a column for the version."""
    import pyarrow as pa

    new = arrow_columns.field(VERSION, pa.string(), "", "version of Trunnion that computed the row, with a digest of its sources")
    return schema.insert(schema.get_field_index(BEFORE), new)


def shaped(table: pyarrow.Table, schema: pyarrow.Schema) -> pyarrow.Table:
    """The rows of a part with the columns of a schema. A column that an earlier version did not store has no values."""
    import pyarrow as pa

    def column(field: pyarrow.Field) -> pyarrow.ChunkedArray | pyarrow.Array:
        if field.name in table.column_names:
            return table[field.name].cast(field.type)
        if field.name == VERSION:
            return arrow_columns.texts([version_of(table)] * len(table))
        return pa.nulls(len(table), field.type) if field.nullable else arrow_columns.texts([""] * len(table))

    if table.schema.names == schema.names:
        return table.cast(schema)
    return pa.Table.from_arrays([column(f) for f in schema], schema=schema)
