"""Bins over batches agree with counts over all rows at once. The division of the rows into pieces has no effect."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trunnion.batch.sample_statistics.bin_statistics import MOST_BINS, Axis, Bins, Span, Within, binned, picked

OUTCOMES = np.array(["done", "jammed", "out_of_time"])


def table(seed: int, n: int, few: bool) -> pa.Table:
    """A table of random cases: x with few or many different numbers, y and v with gaps, and outcomes."""
    r = np.random.default_rng(seed)
    x = r.integers(0, 7, n) / 8 if few else r.normal(0, 3, n)
    y, v = (np.where(r.random(n) < 0.1, np.nan, r.normal(5, 1, n)) for _ in range(2))
    numbers = {name: pa.array(c, from_pandas=True) for name, c in (("x", x), ("y", y), ("v", v))}
    return pa.table({"case": np.arange(n), **numbers, "outcome": OUTCOMES[r.integers(0, 3, n)]})


def counted(pieces: list[pa.Table], within: tuple[Within, ...], bins: tuple[int, int]) -> Bins:
    parts = [picked(t, ("x", "y", "v"), within) for t in pieces]
    out = Bins(*binned((cases for cases, _, _ in parts), "x", "y", bins), "v")
    for cases, outcome, _ in parts:
        out.add(cases, outcome)
    return out


@given(st.integers(0, 10**6), st.integers(1, 300), st.booleans(), st.integers(1, 5), st.integers(1, 40))
def test_bins_are_those_of_the_whole_table_however_it_is_cut(seed: int, n: int, few: bool, cuts: int, most: int) -> None:
    whole = table(seed, n, few)
    step = -(-n // cuts)
    got = counted([whole.slice(k, step) for k in range(0, n, step)], (), (most, most))
    x, y, v = (whole[c].to_numpy(zero_copy_only=False).astype(float) for c in ("x", "y", "v"))
    there = np.isfinite(y)
    assert got.y is not None
    expected, _, _ = np.histogram2d(x[there], y[there], [got.x.edges, got.y.edges])
    assert (got.count.reshape(expected.shape) == expected).all()  # numpy's histogram with these edges has the same counts
    cells = got.cells()
    for i, j, cases, first, known, least, mean, most_ in zip(
        *(cells[k] for k in ("x", "y", "cases", "first", "known", "least", "mean", "most")), strict=True
    ):
        inside = there & (got.x.place(x) == i) & (got.y.place(np.where(there, y, 0.0)) == j)
        values = v[inside & np.isfinite(v)]
        assert (cases, first, known) == (inside.sum(), np.flatnonzero(inside)[0], len(values))
        if known:
            assert (least, most_) == (values.min(), values.max())
            assert mean == pytest.approx(values.mean(), rel=1e-12)  # the sums are computed in a different order
        else:
            assert (least, mean, most_) == (None, None, None)
    outcome = whole["outcome"].to_numpy(zero_copy_only=False)
    assert {n: sum(c) for n, c in cells["outcomes"].items()} == {n: (outcome[there] == n).sum() for n in set(outcome[there])}
    assert got.missing == {n: (outcome[~there] == n).sum() for n in set(outcome[~there])}


@given(st.integers(0, 10**6), st.floats(-3, 3), st.floats(0, 4))
def test_conditions_leave_out_exactly_the_cases_that_violate_them(seed: int, low: float, wide: float) -> None:
    whole = table(seed, 120, few=False)
    within = (Within("x", low, low + wide), Within("outcome", words=("done", "jammed")))
    cases, outcome, left_out = picked(whole, ("y",), within)
    x, words = (whole[c].to_numpy(zero_copy_only=False) for c in ("x", "outcome"))
    keep = (x >= low) & (x <= low + wide) & (words != "out_of_time")
    assert (cases["case"] == np.flatnonzero(keep)).all()
    assert (outcome == words[keep]).all()
    assert left_out == 120 - keep.sum()


@pytest.mark.parametrize("count", [1, 2, MOST_BINS, MOST_BINS + 1])
def test_few_numbers_have_a_bin_each_and_many_have_equal_ones(count: int) -> None:
    values = np.linspace(-1.0, 2.0, count) ** 3
    span = Span("x")
    for piece in np.array_split(np.repeat(values, 2), 3):
        span.see(piece)
    axis = span.axis(MOST_BINS)
    assert len(axis.edges) - 1 == min(count, MOST_BINS)
    if count <= MOST_BINS:
        assert axis.values is not None
        assert (axis.place(values) == np.arange(count)).all()
    else:
        assert axis.values is None
        assert np.ptp(np.diff(axis.edges)) < 1e-12
        assert (axis.edges[0], axis.edges[-1]) == (values[0], values[-1])


def test_an_empty_column_and_a_single_number_have_an_axis() -> None:
    empty = Span("x").axis(10)
    assert empty.edges[0] < empty.edges[-1]
    assert (Axis("x", empty.edges, None).place(np.array([np.nan, np.inf])) == -1).all()
    one = Span("x")
    one.see(np.array([0.0, np.nan]))
    assert one.axis(10).place(np.zeros(1)) == 0
