"""The work of reading and checking is proportional to the size of the text, whatever its mistakes. Endless structures are
refused."""

from __future__ import annotations

import difflib
import json
from itertools import pairwise

import pytest

from tests.scene.checks.call_counts import LINEAR, SCENES, TEXTS, calls, extended, growth
from tests.scene.valid_scene import VALID, edited, problems_of
from trunnion.basics.errors import MOST, Problem, SceneError, rest
from trunnion.batch.cases.grids_and_samples import grid, listed
from trunnion.batch.tables.reductions import reductions
from trunnion.kernel.interface.output_columns import columns
from trunnion.scene import load_scene, scene_from_dict, scene_from_text
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.overrides import apply
from trunnion.simulation.run import pattern_problems
from trunnion.system.construction.system_builder import build


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kind", SCENES)
def test_the_work_of_checking_grows_in_proportion_to_the_scene(kind):
    assert growth(SCENES[kind], scene_from_dict) <= LINEAR


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", TEXTS)
def test_the_work_of_reading_grows_in_proportion_to_the_text(kind):
    assert growth(TEXTS[kind], read) <= LINEAR


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("path", ["joints.j{i}.strt.q", "bodies.c{i}.mass", "masss{i}", "bodies.b{i}.mass"])
def test_the_work_of_changing_a_scene_grows_in_proportion_to_the_changes(path):
    def changes(n):
        return scene_from_dict(extended(n)), {path.format(i=i): 2 for i in range(n)}

    assert growth(changes, lambda given: apply(*given)) <= LINEAR


A_VALUE = 600
"""Largest number of calls to read a value, including the search for the intended unit; building this scene takes 15,000 calls."""
VALUES = {"words": "x", "texts with a unit": "5 N", "texts with the right unit": "0.5 1", "half numbers": "0.5 x", "numbers": 0.5}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", VALUES)
def test_values_of_a_sweep_do_not_build_a_scene_each(kind):
    scene = scene_from_dict(VALID)
    paths = ("joints.hinge.friction.mu", "joints.socket.friction.mu", "joints.cross.friction.mu")
    assert calls(lambda: grid(scene, {p: [VALUES[kind]] * 1000 for p in paths})) < 3_000 * A_VALUE
    assert calls(lambda: listed(scene, [dict.fromkeys(paths, VALUES[kind])] * 1000)) < 3_000 * A_VALUE


def test_paths_of_a_sweep_do_not_walk_the_whole_scene_each():
    def over(n):
        return scene_from_dict(extended(n)), {f"bodies.b{i}.mass": [1, 2] for i in range(n)}

    assert growth(over, lambda given: grid(*given)) <= LINEAR


@pytest.mark.slow
def test_the_work_of_choosing_columns_grows_in_proportion_to_the_names():
    everything = columns(build(load_scene("spherical_pendulum")).system)
    names = [c.name for c in everything]
    for made in (lambda n: (names * n)[:n], lambda n: [f"nothing{i}.q[1]" for i in range(n)]):
        assert growth(made, lambda patterns: pattern_problems(everything, tuple(patterns))) <= LINEAR
        assert growth(made, lambda patterns: reductions([f"max:{p}" for p in patterns], everything)) <= LINEAR


def test_more_patterns_with_wild_cards_than_anyone_needs_are_refused():
    everything = columns(build(load_scene("spherical_pendulum")).system)
    wild = [f"ball.*{i}*" for i in range(1001)]
    (problem,) = pattern_problems(everything, tuple(wild))
    assert "1001 patterns" in problem.what
    assert any("1001 patterns" in p.what for p in problems_of(edited({"outputs": wild})))
    with pytest.raises(SceneError, match="1001 patterns"):
        reductions([f"max:{p}" for p in wild], everything)


# -- many problems ----------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_first_problems_are_reported_and_the_others_counted():
    with pytest.raises(SceneError) as e:
        scene_from_text(json.dumps(edited({f"bodies.arm.masss{i}": 1 for i in range(4000)}), indent=1))
    told = e.value.problems
    assert (len(told), e.value.total) == (MOST + 1, 4000)
    assert str(e.value).splitlines()[-1] == "and 3900 more: not listed (mend these first)"
    assert all(a.line < b.line for a, b in pairwise(told[:MOST]))


@pytest.mark.parametrize("place", ["", "bodies.arm."])
def test_the_meaning_of_no_more_unknown_keys_is_searched_than_problems_are_listed(place: str, monkeypatch: pytest.MonkeyPatch):
    """The search for the meaning of unknown keys takes 0.05 s of processor time, of 0.25 s in all. A search for all 4,000 keys
    would take 2 s."""
    searched, search = [], difflib.get_close_matches
    monkeypatch.setattr(difflib, "get_close_matches", lambda *given, **named: searched.append(given) or search(*given, **named))
    with pytest.raises(SceneError) as e:
        scene_from_dict(edited({f"{place}mass_of_{i}": 1 for i in range(1000)}))
    assert e.value.total == 1000
    assert 0 < len(searched) <= 2 * MOST


def test_a_hundred_problems_are_all_reported():
    with pytest.raises(SceneError) as e:
        scene_from_dict(edited({f"masss{i}": 1 for i in range(MOST)}))
    assert len(e.value.problems) == e.value.total == MOST


def test_problems_of_several_errors_are_counted_together():
    first = SceneError([Problem("a", "x")] * 150)
    both = SceneError([*first.problems, Problem("b", "y"), rest(7)])
    assert (first.total, both.total, len(both.problems)) == (150, 158, MOST + 1)
    assert both.problems[-1] == rest(58)


def test_a_wrong_entry_of_a_list_takes_away_no_more_than_that_list():
    wrong = {"joints.rail.drive.table.time": ["x", "y", "z", "u"], "joints.rail.friction.mu": -1}
    assert {p.where for p in problems_of(edited(wrong))} == {
        *(f"joints.rail.drive.table.time[{k}]" for k in (1, 2, 3, 4)), "joints.rail.friction.mu",
    }  # fmt: skip


# -- endless nesting and very long texts -------------------------------------------------------------------------------------------


def nested(depth, value=1.0):
    for _ in range(depth):
        value = {"a": value} if depth % 2 else [value]
    return value


ENDLESS: dict = {"a": 1}
ENDLESS["b"] = ENDLESS
DEEP = {"groups": lambda: nested(100_001), "lists": lambda: nested(100_000), "a group in itself": lambda: ENDLESS}
"""The test creates this data itself. Otherwise Python's search for unused objects would visit the data repeatedly in every test
process."""


@pytest.mark.parametrize("kind", DEEP)
def test_endless_nesting_is_a_problem(kind):
    deep = DEEP[kind]()
    for data in (deep, {"bodies": deep}, {**VALID, "extra": deep}):
        if isinstance(data, dict):
            assert problems_of(data)
    scene = scene_from_dict(VALID)
    for path in ("gravity", "bodies.arm.points", "joints.hinge.friction.mu", "inputs"):
        with pytest.raises(SceneError):
            apply(scene, {path: deep})


LONG = {
    "a word": "x" * 1_000_000,
    "a number": "1" * 1_000_000,
    "a unit": "1 " + "m" * 1_000_000,
    "a path": "joints" + ".a" * 500_000,
    "brackets": "joints" + "[1]" * 300_000,
    "a power": "1e" + "9" * 1_000_000,
}


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("kind", LONG)
def test_long_text_is_shortened_in_every_message(kind):
    text = LONG[kind]
    scene = scene_from_dict(VALID)
    found = problems_of(edited({"bodies.arm.density": text, "joints.hinge.inboard": text})) + problems_of({**VALID, text: 1})
    for changes in ({"bodies.arm.density": text}, {text: 1}, {"bodies.arm.color" + text: 1}):
        with pytest.raises(SceneError) as e:
            apply(scene, changes)
        found += e.value.problems
    with pytest.raises(SceneError) as e:
        grid(scene, {"joints.hinge.friction.mu": [text], text: [1]})
    assert all(len(str(p)) < 1000 for p in [*found, *e.value.problems])
