"""Arrow columns, built from memory buffers, and their fields. (To build a column from a NumPy array or a list, Arrow would first
import an installed pandas. The import takes half a second.)"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pyarrow


def field(name: str, kind: pyarrow.DataType, unit: str, text: str, nullable: bool = False) -> pyarrow.Field:
    """A field of a schema, with its unit and description as metadata."""
    import pyarrow as pa

    return pa.field(name, kind, nullable, {"unit": unit, "description": text})


def numbers(values: np.ndarray, nulls: bool = False) -> pyarrow.Array:
    """Column of the n values, as int64 if their type is integer, otherwise as float64. nulls: whether NaN becomes null."""
    import pyarrow as pa

    kind, dtype = (pa.int64(), np.int64) if np.issubdtype(values.dtype, np.integer) else (pa.float64(), np.float64)
    data = np.ascontiguousarray(values, dtype=dtype)
    valid = pa.py_buffer(np.packbits(~np.isnan(data), bitorder="little")) if nulls else None
    return pa.Array.from_buffers(kind, len(data), [valid, pa.py_buffer(data)])


def texts(values: Sequence[str]) -> pyarrow.Array:
    """A column of texts."""
    import pyarrow as pa

    data = [v.encode() for v in values]
    ends = np.cumsum([0, *map(len, data)], dtype=np.int32)
    return pa.Array.from_buffers(pa.string(), len(data), [None, pa.py_buffer(ends), pa.py_buffer(b"".join(data))])


def count_by(table: pyarrow.Table, column: str = "outcome") -> dict[str, int]:
    """Number of rows by the text in a column."""
    import pyarrow.compute as pc

    return {c["values"]: c["counts"] for c in pc.value_counts(table[column]).to_pylist()}
