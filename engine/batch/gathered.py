"""The tables of a sweep's chunks, kept as few large ones: each small one takes as much memory for its columns as for its rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow

MOST_APART = 64
"""So many tables are kept as they came before those that follow each other are put together."""


class Gathered:
    """Tables by the number of their first case; they may come in any order."""

    def __init__(self) -> None:
        self.large: dict[int, pyarrow.Table] = {}
        self.small: dict[int, pyarrow.Table] = {}

    def add(self, start: int, table: pyarrow.Table) -> None:
        """One more, whose first case has this number."""
        self.small[start] = table
        if len(self.small) >= 2 * MOST_APART:
            self._put_together()

    def _put_together(self) -> None:
        """Make one of each run of small tables that follow each other; the newest stay, since others may come between them."""
        import pyarrow as pa

        runs: list[list[int]] = []
        for start in sorted(self.small)[:MOST_APART]:
            follows = bool(runs) and runs[-1][-1] + self.small[runs[-1][-1]].num_rows == start
            runs[-1].append(start) if follows else runs.append([start])
        for run in runs:
            self.large[run[0]] = pa.concat_tables([self.small.pop(start) for start in run]).combine_chunks()

    def whole(self) -> pyarrow.Table:
        """All of them, in the order of their cases."""
        import pyarrow as pa

        both = self.large | self.small
        return pa.concat_tables([both[start] for start in sorted(both)])
