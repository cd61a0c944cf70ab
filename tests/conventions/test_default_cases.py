"""Of a test with many cases, the default selection has as many different values as possible."""

from __future__ import annotations

from itertools import product
from types import SimpleNamespace
from typing import Any

import pytest

from tests.default_case_selection import keep_default_cases


class Case:
    """A case of a test as pytest collects it. For direct parameters, pytest stores the index of the case in place of the value."""

    def __init__(self, number: int, values: dict[str, Any], keep: int):
        self.nodeid, self.marks = f"file.py::law[{number}]", {"default_cases": SimpleNamespace(args=(keep,))}
        self.callspec = SimpleNamespace(params=values, indices=dict.fromkeys(values, number))

    def get_closest_marker(self, name: str) -> Any:
        return self.marks.get(name)

    def add_marker(self, mark: Any) -> None:
        self.marks[mark.name] = mark

    @property
    def is_default(self) -> bool:
        return "slow" not in self.marks


@pytest.mark.parametrize("keep", [1, 4, 5])
def test_default_cases_have_every_value_once_before_any_value_twice(keep: int) -> None:
    rows, tellings = [object() for _ in range(4)], ("as written", "turned", "in millimetres")
    cases = [Case(k, {"row": r, "telling": t}, keep) for k, (r, t) in enumerate(product(rows, tellings))]
    keep_default_cases(cases)  # type: ignore[arg-type]
    kept = [c for c in cases if c.is_default]
    assert len(kept) == keep
    assert len({id(c.callspec.params["row"]) for c in kept}) == min(keep, len(rows))
    assert len({c.callspec.params["telling"] for c in kept}) == min(keep, len(tellings))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("one", [0, 1])
@pytest.mark.parametrize("other", [0, 1])
def test_values_are_found_where_pytest_keeps_them(one: int, other: int, request: pytest.FixtureRequest) -> None:
    """Two of the four cases run by default: two cases without a common value."""
    assert (one == other) == (request.node.get_closest_marker("slow") is None)
