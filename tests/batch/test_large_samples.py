"""Large samples that are never generated whole: any range of rows can be generated alone, and equals the rows of the whole
sample."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from scipy.stats import qmc

from tests.batch.synthetic_results import MU, scene
from trunnion.basics.errors import SceneError
from trunnion.batch.cases import sample_points
from trunnion.batch.cases.grids_and_samples import sampled
from trunnion.batch.cases.sample_points import BITS, LARGE, _bits, _directions, directions_from_points, latin, points, strips, width

POINTS = 1000


@pytest.mark.parametrize("method", ["random", "sobol", "saltelli"])
@pytest.mark.parametrize("axes", [1, 3])
def test_rows_by_themselves_are_those_of_the_whole_sample(method: str, axes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    count = POINTS * width(method, axes)
    whole = points(POINTS, axes, 7, method, 0, count)
    monkeypatch.setattr(sample_points, "LARGE", 10)
    for start, stop in ((0, count), (count - 1, count), (17, 18), (333, 777), (100, 101)):
        assert np.array_equal(points(POINTS, axes, 7, method, start, stop), whole[start:stop])


@pytest.mark.parametrize("count", [1, 2, 3, 64, 65, 1000, 4097])
def test_strips_of_a_large_latin_sample_are_a_permutation_that_seed_and_axis_decide(count: int) -> None:
    made = [strips(count, seed, axis, np.arange(count)) for seed, axis in ((1, 0), (1, 1), (2, 0))]
    for order in made:
        assert np.array_equal(np.sort(order), np.arange(count))
    assert count < 60 or len({order.tobytes() for order in made}) == 3
    assert np.array_equal(strips(count, 1, 0, np.array([count - 1])), made[0][-1:])


def test_a_large_latin_sample_spreads_as_a_small_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two numbers of a case are independent of each other and of the numbers of the next case: random correlations of n pairs are
    below 4/√n."""
    n = 1 << 14
    monkeypatch.setattr(sample_points, "LARGE", 10)
    x, small = points(n, 2, 3, "latin", 0, n), latin(n, 2, 3)
    for column in x.T:
        assert np.array_equal(np.sort(np.floor(column * n)), np.arange(n)), "one case in every strip"
    for a, b in ((x[:, 0], x[:, 1]), (x[:-1, 0], x[1:, 0]), (small[:, 0], small[:, 1])):
        assert abs(np.corrcoef(a, b)[0, 1]) < 4 / np.sqrt(n)
    assert np.abs(x.mean(axis=0) - 0.5).max() < 1 / n


@pytest.mark.parametrize("method", ["latin", "random"])
def test_a_piece_of_a_thousand_million_cases_takes_the_memory_of_its_rows(method: str) -> None:
    tracemalloc.start()
    rows = points(10**9, 2, 1, method, 987_654_000, 987_655_000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert rows.shape == (1000, 2)
    assert ((rows > 0) & (rows < 1)).all()
    assert peak < 100 * rows.nbytes < 8 * LARGE


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("axes", [1, 2, 7, 300])
@pytest.mark.filterwarnings("ignore:The balance properties")
def test_sobol_points_by_their_numbers_are_those_of_the_sequence_to_the_bit(axes: int) -> None:
    chance = np.random.default_rng(axes)
    starts = [0, 1, 1023, 1024, *chance.integers(0, 1 << 20, 12)]
    starts += [(1 << 26) - 700] if axes < 3 else []  # SciPy's sequence needs a second to reach this point
    for start in sorted(map(int, starts)):
        stop = start + int(chance.choice([1, 2, 1024, 2500]))
        sequence = qmc.Sobol(axes, scramble=False, bits=BITS)
        if start:
            sequence.fast_forward(start)
        assert np.array_equal(_bits(axes, start, stop), sequence.random(stop - start) * (1 << BITS)), (start, stop)
    assert _bits(axes, 5, 5).shape == (0, axes)


def test_directions_are_those_that_the_points_of_the_sequence_name() -> None:
    for axes in (1, 5, 40):
        found = directions_from_points(qmc.Sobol(axes, scramble=False, bits=BITS), 14)
        assert np.array_equal(found, _directions(axes)[:, :14] >> np.uint64(16))


def test_the_last_point_takes_no_longer_than_the_first_and_the_number_of_points_is_limited() -> None:
    assert points(1 << BITS, 2, 1, "sobol", (1 << BITS) - 1, 1 << BITS).shape == (1, 2)
    with pytest.raises(SceneError, match="points of Sobol"):
        sampled(scene(), {MU: (0, 1)}, (1 << BITS) + 1, 0, "sobol")
