"""Statistics merged from pieces equal those of all rows, for any division: exactly where the documentation says so."""

from __future__ import annotations

from dataclasses import fields
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.sampling import sampled, slow
from trunnion.basics.problems import SceneError
from trunnion.batch.cases.grids_and_samples import Cases
from trunnion.batch.sample_statistics import exact_summation, mergeable_statistics
from trunnion.batch.sample_statistics.mergeable_statistics import Tally, indices_in, packed, tally_of, together, unpacked
from trunnion.batch.sample_statistics.sobol_index_sums import Points
from trunnion.batch.sample_statistics.sobol_indices import FAILED, Indices, indices
from trunnion.batch.tables.reductions import Reduction

PATHS = ("a", "b", "c")
WIDE = 2 * len(PATHS) + 2
KEPT = tuple(Reduction("max", n, "m", "") for n in ("one", "two"))
ONE, TWO = (r.name for r in KEPT)


PIECES = [(n, *of) for n in (2, 7, 40, 200) for of in ((0.0, "saltelli"), (0.02, "saltelli"), (0.02, "latin"))]
SOME_PIECES = [(2, 0.0, "saltelli"), (2, 0.02, "latin"), (7, 0.02, "saltelli"), (40, 0.0, "saltelli"), (200, 0.02, "latin")]
"""Combinations in which every number of pieces, share of failures and kind of sampling occurs."""


def cases(count: int, sampling: str = "saltelli") -> Cases:
    return Cases(PATHS, ("1",) * 3, count, lambda start, stop: np.zeros((stop - start, 3)), sampling)


def rows(points: int, seed: int, gaps: float = 0.0, offset: float = 0.0) -> Any:
    """A table of a crossed sample. Some results follow from the numbers, in addition to ``offset``; some are missing."""
    chance = np.random.default_rng(seed)
    both = chance.random((points, 6))
    x = np.repeat(both[:, None, :3], WIDE, axis=1)
    x[:, 4:] = both[:, None, 3:]
    for i in range(3):
        x[:, 1 + i, i], x[:, 4 + i, i] = both[:, 3 + i], both[:, i]
    x = x.reshape(-1, 3)
    n = len(x)
    found = {ONE: offset + x[:, 0] + 2 * x[:, 1] * x[:, 2], TWO: np.exp(5 * x[:, 0]) * 1e-3}
    outcome = np.where(chance.random(n) < gaps, "stuck", "done")
    for name in found:
        found[name][(outcome != "done") | (chance.random(n) < gaps)] = np.nan
    columns = {"case": np.arange(n)} | dict(zip(PATHS, x.T, strict=True)) | {"outcome": outcome} | found
    return pa.table({k: pa.array(v, from_pandas=True) for k, v in columns.items()})


def cut(table: Any, seed: int, pieces: int) -> list[Any]:
    """A table in pieces of any lengths, in any order."""
    chance = np.random.default_rng(seed)
    ends = [0, *np.sort(chance.integers(0, len(table) + 1, pieces - 1)).tolist(), len(table)]
    made = [table.slice(a, b - a) for a, b in pairwise(ends)]
    return [made[i] for i in chance.permutation(len(made))]


def same(a: Tally, b: Tally) -> bool:
    """Whether two tallies are bit-identical, apart from the order of their rows."""

    def alike(x: Any, y: Any) -> bool:
        if isinstance(x, np.ndarray):
            return np.array_equal(x, y)
        if hasattr(x, "sort_by"):
            return bool(x.sort_by("case").equals(y.sort_by("case")))
        if isinstance(x, Points):
            return y is not None and all(alike(getattr(x, f.name), getattr(y, f.name)) for f in fields(x))
        return bool(x == y)

    return all(alike(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))


def of_pieces(table: Any, of: Cases, seed: int, pieces: int) -> Tally:
    """The tally of pieces, merged in any grouping, each stored and read again."""
    made = [unpacked(packed(tally_of(p, of, KEPT))) for p in cut(table, seed, pieces)]
    while len(made) > 1:
        some, made = made[:3], made[3:]
        made.append(unpacked(packed(together(some, of))))
    return made[0]


NUMBERS = st.floats(-1e100, 1e100, allow_subnormal=False)


@given(st.lists(NUMBERS, max_size=40), st.integers(0, 40))
def test_sums_are_exact_and_the_same_however_they_are_cut(numbers: list[float], at: int) -> None:
    whole = exact_summation.expansion(numbers)
    assert sum(map(Fraction, whole), Fraction()) == sum(map(Fraction, numbers), Fraction())
    parts = [exact_summation.padded([exact_summation.expansion(some)]) for some in (numbers[:at], numbers[at:])]
    assert exact_summation.added(parts).tolist() == exact_summation.padded([whole]).tolist()
    assert not whole or whole[0] == float(sum(map(Fraction, numbers), Fraction()))


@given(st.lists(st.lists(st.floats(-1e280, 1e280), min_size=3, max_size=3), max_size=20))
def test_sums_of_columns_are_those_of_their_numbers(rows: list[list[float]]) -> None:
    columns = np.array(rows).reshape(-1, 3)
    assert (
        exact_summation.sums(columns).tolist()
        == exact_summation.padded([exact_summation.expansion(c) for c in columns.T.tolist()]).tolist()
    )


@given(st.floats(-1e100, 1e100), st.floats(-1e100, 1e100))
def test_products_are_exact_with_what_rounding_took(a: float, b: float) -> None:
    got = sum(map(Fraction, exact_summation.products(np.array([[a]]), np.array([[b]])).ravel().tolist()))
    assert abs(got - Fraction(a) * Fraction(b)) <= Fraction(1, 10**290)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("pieces", "gaps", "sampling"), sampled(PIECES, lambda p: p in SOME_PIECES))
def test_the_tally_of_all_is_that_of_the_pieces_to_the_bit(pieces: int, gaps: float, sampling: str) -> None:
    table = rows(60, 1, gaps)
    of = cases(len(table), sampling)
    whole = tally_of(table, of, KEPT)
    for seed in range(3):
        assert same(of_pieces(table, of, seed, pieces), whole)
    other = table.set_column(table.column_names.index(ONE), ONE, pa.array(np.nextafter(table[ONE].to_numpy(), 9)))
    assert not same(tally_of(other, of, KEPT), whole)


def test_least_mean_and_largest_are_those_of_the_rows() -> None:
    table = rows(60, 2, 0.05)
    got = of_pieces(table, cases(len(table), "latin"), 1, 9)
    for name in (*PATHS, ONE, TWO):
        known = [v for v in table[name].to_pylist() if v is not None]
        assert got.ends(name) == (min(known), max(known))
        assert got.mean(name) == float(sum(map(Fraction, known)) / len(known))
        assert got.known[got.names.index(name)] == len(known)
    assert got.cases == len(table)
    empty = tally_of(table.slice(0, 0), cases(len(table)), KEPT)
    assert (empty.ends(ONE), empty.mean(ONE), empty.points) == (None, None, None)


def numbers_of(i: Indices) -> np.ndarray:
    every = (i.mean, i.deviation, *i.first, *i.total, *i.second.values())
    return np.array([[np.nan if v is None else v for v in (e.value, e.low, e.high)] for e in every])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("gaps", [0.0, slow(0.002), 0.2])
def test_indices_from_sums_are_those_of_all_rows(gaps: float) -> None:
    """Both agree up to rounding: sums over 400 points, 17 of them, of products of numbers of similar size."""
    table = rows(400, 3, gaps)
    of = cases(len(table))
    every = indices_in(of_pieces(table, of, 5, 23), of, KEPT, [ONE, TWO])
    expected = indices(table, PATHS, [ONE, TWO], {ONE: "m", TWO: "m"})
    assert len(expected) == (3 if gaps else 2)
    for got, e in zip(every, expected, strict=True):
        assert (got.of, got.unit, got.paths) == (e.of, "1" if e.of == FAILED else e.unit, e.paths)
        assert (got.points, got.cases, got.missing, got.notes) == (e.points, e.cases, e.missing, e.notes)
        assert list(got.second) == list(e.second)
        np.testing.assert_allclose(numbers_of(got), numbers_of(e), rtol=1e-10, atol=1e-12)


def test_sums_do_not_lose_a_small_variance_beside_a_large_mean() -> None:
    """Rounded sums of squares would lose it: the mean is 10⁸ times the deviation."""
    far, near = (rows(400, 3, 0.0, offset) for offset in (2.0**27, 0.0))
    seen = [tally_of(t, cases(len(t)), KEPT).points for t in (far, near)]
    got, expected = (numbers_of(p.document(ONE, "m", PATHS)) for p in seen if p is not None)
    np.testing.assert_allclose(got[2:], expected[2:], atol=1e-6)


def test_what_does_not_vary_or_is_not_there_is_said_in_the_same_words() -> None:
    table = rows(40, 3)
    for values in (np.full(len(table), 2.5), np.full(len(table), np.nan)):
        flat = table.set_column(table.column_names.index(ONE), ONE, pa.array(values, from_pandas=True))
        points = tally_of(flat, cases(len(table)), KEPT).points
        assert points is not None
        got, (expected,) = points.document(ONE, "m", PATHS), indices(flat, PATHS, [ONE], {ONE: "m"})
        assert (got.notes, got.first, got.missing) == (expected.notes, expected.first, expected.missing)
        assert points.document(FAILED, "1", PATHS).notes == ("the result does not vary",)


def test_too_few_points_and_what_was_not_kept_are_refused_as_of_rows() -> None:
    table = rows(31, 4)
    of = cases(len(table))
    for some in (table, table.slice(0, 0)):
        with pytest.raises(SceneError, match="32 are needed"):
            indices_in(tally_of(some, of, KEPT), of, KEPT, [ONE])
    with pytest.raises(SceneError, match="is not in the table"):
        indices_in(tally_of(table, of, KEPT), of, KEPT, ["max:three"])


def test_points_that_are_not_whole_yet_are_kept_until_they_are() -> None:
    table = rows(10, 4)
    of, at = cases(len(table)), 3 * WIDE + 5
    first, rest = tally_of(table.slice(0, at), of, KEPT), tally_of(table.slice(at), of, KEPT)
    assert first.points is not None
    assert int(first.points.whole[0].sum()) == 3
    assert len(first.edges) == 5
    whole = together([rest, first], of)
    assert whole.points is not None
    assert (int(whole.points.whole[0].sum()), len(whole.edges)) == (10, 0)


def test_cases_are_drawn_as_if_by_chance_the_same_ones_in_every_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mergeable_statistics, "DRAWN", 2000)
    n = 100_000
    case = np.arange(n)
    taken = mergeable_statistics.drawn(case, n)
    assert abs(taken.sum() - 2000) < 4 * np.sqrt(2000)
    assert np.array_equal(taken[777:900], mergeable_statistics.drawn(case[777:900], n))
    for every in (2, 8, 1000):  # regularities of a grid or of a point's cases have no effect
        found, expected = np.bincount(case[taken] % every, minlength=every), taken.sum() / every
        assert ((found - expected) ** 2 / expected).sum() < every - 1 + 4 * np.sqrt(2 * every), "as Pearson says"
    assert mergeable_statistics.drawn(case[:2000], 2000).all()
