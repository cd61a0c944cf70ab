"""The file format of parts: writing and reading, with identity and checksum. A reader finds any damage.

A part is an ordinary Parquet file. Its metadata contain the identity of its cases (``CaseRange``) and a checksum. The checksum is
the SHA-256 of the file with zeros in place of the checksum."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from trunnion.basics.arrow_columns import texts
from trunnion.basics.renamed_words import OUTCOMES, current_result

if TYPE_CHECKING:
    import pyarrow

MARK = b"trunnion-part-sha256="
ZEROS = b"0" * 64
IDENTITY, CHECKSUM = b"trunnion.part", b"zz.trunnion.checksum"
"""Keys of the identity and the checksum in the metadata."""


class CorruptPart(RuntimeError):
    """A part is missing or damaged, so that its cases must be recomputed."""


@dataclass(frozen=True)
class CaseRange:
    """A range of cases whose results are in one file. The range consists of the cases start … stop − 1 of a job. document: digest
    of the job's document."""

    job: str
    document: str
    start: int
    stop: int

    @property
    def of_rows(self) -> CaseRange:
        """Identity of the trajectory rows of these cases."""
        return CaseRange(self.job, f"{self.document} rows", self.start, self.stop)

    @property
    def text(self) -> str:
        """The identity as a text for the metadata."""
        return json.dumps([self.job, self.document, self.start, self.stop])


def document_bytes(document: dict[str, Any]) -> bytes:
    """The bytes of a job's document that are stored in the folder of its parts."""
    return json.dumps(document).encode()


def digest_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def part_bytes(table: pyarrow.Table, case_range: CaseRange) -> bytes:
    """The bytes of a part that contains this table, with identity and checksum."""
    import pyarrow.parquet as pq

    about = (table.schema.metadata or {}) | {IDENTITY: case_range.text.encode(), CHECKSUM: MARK + ZEROS}
    sink = io.BytesIO()
    pq.write_table(table.replace_schema_metadata(about), sink, compression="zstd")
    data = sink.getvalue()
    at = data.rfind(MARK + ZEROS) + len(MARK)
    return data[:at] + digest_of(data).encode() + data[at + len(ZEROS) :]


def _in_current_words(table: pyarrow.Table) -> pyarrow.Table:
    """The table of a part with current names of columns and outcomes. A part keeps the words of the version that wrote it."""
    names = [current_result(n) for n in table.column_names]
    if names != table.column_names:
        table = table.rename_columns(names).replace_schema_metadata(table.schema.metadata)
    if "outcome" in table.column_names and set(table["outcome"].unique().to_pylist()) & OUTCOMES.keys():
        words = [OUTCOMES.get(word, word) for word in table["outcome"].to_pylist()]
        table = table.set_column(table.column_names.index("outcome"), table.schema.field("outcome"), texts(words))
    return table


def checksummed_bytes(data: bytes, case_range: CaseRange) -> bytes | None:
    """The bytes of a part, made from the bytes of a file that an earlier version wrote without identity and checksum. None if the
    file has a checksum. Raises CorruptPart when the file is not a Parquet file with the rows of these cases."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if MARK in data:
        return None
    try:
        table = pq.read_table(pa.BufferReader(data))
        cases = table["case"].to_pylist()
    except (pa.ArrowException, OSError, KeyError) as e:
        raise CorruptPart(f"it cannot be read: {e}") from e
    if cases != list(range(case_range.start, case_range.stop)):
        raise CorruptPart("the file holds the rows of other cases")
    return part_bytes(table, case_range)


def read_part_bytes(data: bytes, case_range: CaseRange, columns: list[str] | None = None) -> pyarrow.Table:
    """The table in a part. Raises CorruptPart when the bytes are damaged, or belong to other cases."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    found = data.rfind(MARK)
    at = found + len(MARK)
    if found < 0 or data[at : at + len(ZEROS)] != digest_of(data[:at] + ZEROS + data[at + len(ZEROS) :]).encode():
        raise CorruptPart("the checksum does not match the bytes of the file")
    file = pq.ParquetFile(pa.BufferReader(data))  # four times as fast as pyarrow.parquet.read_table
    stored = [n for n in file.schema_arrow.names if columns is None or current_result(n) in columns]
    table = _in_current_words(file.read(stored, use_threads=False))
    told = (table.schema.metadata or {}).get(IDENTITY, b"")
    if told != case_range.text.encode():
        raise CorruptPart("the file holds the rows of other cases")
    return table
