"""Merges the tables of a sweep's chunks into few large tables. In a small table, the descriptions of the columns take as much
memory as the rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow

MOST_APART = 64
"""Half of the number of small tables at which a merge begins. The merge joins adjacent tables in the first half."""


class TableMerge:
    """Collects tables in any order. Each table is stored by the number of its first case."""

    def __init__(self) -> None:
        self.large: dict[int, pyarrow.Table] = {}
        self.small: dict[int, pyarrow.Table] = {}

    def add(self, start: int, table: pyarrow.Table) -> None:
        """Add a table. start: number of its first case."""
        self.small[start] = table
        if len(self.small) >= 2 * MOST_APART:
            self._merge()

    def _merge(self) -> None:
        """Merge adjacent tables in the first half of the small tables. The second half stays separate, because further tables may
        fall between its tables."""
        import pyarrow as pa

        runs: list[list[int]] = []
        for start in sorted(self.small)[:MOST_APART]:
            follows = bool(runs) and runs[-1][-1] + self.small[runs[-1][-1]].num_rows == start
            runs[-1].append(start) if follows else runs.append([start])
        for run in runs:
            self.large[run[0]] = pa.concat_tables([self.small.pop(start) for start in run]).combine_chunks()

    def whole(self) -> pyarrow.Table:
        """All tables joined in the order of cases."""
        import pyarrow as pa

        both = self.large | self.small
        return pa.concat_tables([both[start] for start in sorted(both)])
