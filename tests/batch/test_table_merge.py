"""Tables of chunks, in any order of arrival, are merged into few tables with the same content."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from trunnion.batch.tables.table_merge import MOST_APART, TableMerge


def test_chunks_that_come_in_any_order_are_gathered_into_few_tables_in_the_order_of_their_cases() -> None:
    sizes = np.random.default_rng(3).integers(1, 9, 40 * MOST_APART)
    starts = np.cumsum(sizes) - sizes
    chunks = [
        pa.table({"case": np.arange(a, a + n), "said": ["done"] * n}) for a, n in zip(starts.tolist(), sizes.tolist(), strict=True)
    ]
    late = np.argsort(np.arange(len(chunks)) + np.random.default_rng(4).uniform(0, 6, len(chunks)))
    gathered, most = TableMerge(), 0
    for k in late.tolist():
        gathered.add(int(starts[k]), chunks[k])
        most = max(most, len(gathered.small))
    whole = gathered.whole()
    assert whole.equals(pa.concat_tables(chunks))
    assert most <= 2 * MOST_APART
    assert whole.column(0).num_chunks < len(chunks) / 8


def test_a_chunk_that_is_missing_or_cut_short_joins_nothing_across_the_gap() -> None:
    gathered = TableMerge()
    for start in range(0, 30 * MOST_APART, 10):
        gathered.add(start, pa.table({"case": np.arange(start, start + (7 if start % 70 == 0 else 10))}))
    cases = gathered.whole().column("case").to_numpy()
    assert np.all(np.diff(cases) > 0)
    assert len(cases) == sum(7 if start % 70 == 0 else 10 for start in range(0, 30 * MOST_APART, 10))
