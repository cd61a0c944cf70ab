"""Selection of the cases of a parametrised test that run by default. The other cases run with the slow tests (``pytest -m slow``).

The mark ``default_cases(n)`` over a parametrised test keeps n of its cases. ``sampled`` and ``crossed`` choose among parameters."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable
from itertools import combinations, product
from typing import Any

import pytest


def sampled(values: Iterable[Any], keep: int | Collection[Any] | Callable[[Any], bool]) -> list[Any]:
    """Parameters of a test. ``keep`` selects the values that run by default: a number of first values, a collection of values, or a
    function that is true for them."""
    every = list(values)
    kept = every[:keep] if isinstance(keep, int) else [v for v in every if (keep(v) if callable(keep) else v in keep)]
    assert kept, "some run by default"
    return [v if v in kept else slow(v) for v in every]


def crossed(*axes: Iterable[Any]) -> list[Any]:
    """Every combination of one value from each axis, as parameters of a test. By default only a subset runs, in which every two
    values of different axes meet at least once."""
    every = list(product(*(list(enumerate(a)) for a in axes)))
    kept = _pairwise([tuple(k for k, _ in case) for case in every])
    given = [tuple(v for _, v in case) for case in every]
    return [v if tuple(k for k, _ in case) in kept else slow(v) for v, case in zip(given, every, strict=True)]


def slow(value: Any) -> Any:
    """A parameter, or several as a tuple, that makes a test slow."""
    values = value if isinstance(value, tuple) else (value,)
    return pytest.param(*values, marks=pytest.mark.slow)


def _pairwise(cases: list[tuple[int, ...]]) -> set[tuple[int, ...]]:
    """Cases in which every pair of values occurs. The cases are chosen one after the other. The next case is the first case with
    the largest number of new pairs."""
    met: set[tuple[tuple[int, int], ...]] = set()
    kept = set()
    while True:
        best = max(cases, key=lambda c: len(_pairs(c) - met))
        if not _pairs(best) - met:
            return kept
        kept.add(best)
        met |= _pairs(best)


def _pairs(case: tuple[int, ...]) -> set[tuple[tuple[int, int], ...]]:
    return set(combinations(enumerate(case), min(2, len(case))))


def keep_default_cases(tests: Iterable[pytest.Item]) -> None:
    """Of each test with the mark ``default_cases(n)``, keep n cases and make the other cases slow. Cases that are slow already are
    not counted."""
    laws: dict[str, list[pytest.Item]] = defaultdict(list)
    for test in tests:
        if test.get_closest_marker("default_cases") and not test.get_closest_marker("slow"):
            laws[test.nodeid.partition("[")[0]].append(test)
    for cases in laws.values():
        (keep,) = cases[0].get_closest_marker("default_cases").args
        for case in _most_varied(cases, keep)[1]:
            case.add_marker(pytest.mark.slow)


def _most_varied(cases: list[pytest.Item], keep: int) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """(kept, others). Kept cases are chosen one after the other. The next case is the first case with the largest number of
    parameter values that no kept case has."""
    met: set[tuple[str, Any]] = set()
    kept, others = [], list(cases)
    while others and len(kept) < keep:
        best = max(others, key=lambda c: len(_values(c) - met))
        others.remove(best)
        kept.append(best)
        met |= _values(best)
    return kept, others


def _values(case: pytest.Item) -> set[tuple[str, Any]]:
    """The values of a case's parameters, with their names. Two objects that are not numbers or words count as different unless they
    are one object. The indices that pytest 9.2 gives to parameters count cases, not values."""
    plain = (str, int, float, type(None))
    return {(name, value if isinstance(value, plain) else id(value)) for name, value in case.callspec.params.items()}
