"""If any value of a scene is replaced by another value, the scene either loads or has problems. No other result occurs."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.scene.valid_scene import VALID, problems_of
from trunnion.scene.findings.findings_and_paths import Path


def places(value: Any, path: Path = ()) -> list[Path]:
    """Paths of everything in nested dicts and lists."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(p for k, v in inner for p in places(v, (*path, k)))]


ODD = st.sampled_from([
    None, True, False, 0, -1, 1e308, 3, "x", "", "ground", "arm", "arm.tip", "3 m", "3 deg", "..", "a.b.c", [], {},
    [None], [[[]]], {"a": 1}, {"input": "motor"}, {"·scalar": 1}, {"type": "force"}, {"body": "arm"}, [0, 0, 0],
    [1, 2, 3, 4], "·list", {"constant": {"rate": 1}}, {"type": "fixed", "inboard": "arm", "outboard": "link"},
    float("nan"), 10**400, b"bytes",
])  # fmt: skip
PLACES = places(VALID)[1:]


def put(data: Any, path: Path, value: Any, key: bool) -> None:
    """Replace a value, or add a key beside it, if the place still exists."""
    for k in path[:-1]:
        inside = isinstance(data, dict) and k in data
        listed = isinstance(data, list) and isinstance(k, int) and k < len(data)
        if not (inside or listed):
            return
        data = data[k]
    if isinstance(data, dict):
        data["odd" if key else path[-1]] = value
    elif isinstance(data, list) and isinstance(path[-1], int) and path[-1] < len(data):
        data[path[-1]] = value


def tried(examples: int, drawn: st.SearchStrategy[Any], law: Callable[[Any], None]) -> None:
    """Check a property with this number of examples."""
    settings(max_examples=examples, deadline=None)(given(drawn)(law))()


@pytest.mark.parametrize("examples", [80, pytest.param(400, marks=pytest.mark.slow)])
def test_a_scene_with_odd_values_loads_or_has_problems(examples: int) -> None:
    changes = st.lists(st.tuples(st.sampled_from(PLACES), ODD, st.booleans()), min_size=1, max_size=4)
    tried(examples, changes, a_scene_with_odd_values_loads_or_has_problems)


def a_scene_with_odd_values_loads_or_has_problems(changes: Any) -> None:
    data = copy.deepcopy(VALID)
    for path, value, key in changes:
        put(data, path, copy.deepcopy(value), key and isinstance(path[-1], str))
    assert all(p.what and p.where for p in problems_of(data))


def nested(inner: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """A strategy for lists and groups of something."""
    return st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4)


@pytest.mark.parametrize("data", [{1: 2}, {"bodies": {2: {}}, "joints": {None: 3}}, [], None, 3, {"bodies": {("a",): {}}}])
def test_data_that_no_file_could_hold_has_problems(data):
    assert problems_of(data)


@pytest.mark.parametrize("examples", [25, pytest.param(100, marks=pytest.mark.slow)])
def test_any_data_is_a_scene_or_has_problems(examples: int) -> None:
    tried(examples, st.recursive(ODD, nested), any_data_is_a_scene_or_has_problems)


def any_data_is_a_scene_or_has_problems(data: Any) -> None:
    found = problems_of(data if isinstance(data, dict) else {"bodies": data, "joints": data})
    assert all(p.what and p.where for p in found)
