"""Files in YAML 1.2 and JSON: lines of every problem, and limits. Any wrong content gives a list of problems and no other
result."""

from __future__ import annotations

import json
import re

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.scene.valid_scene import VALID, problems_in
from trunnion.basics.errors import SceneError
from trunnion.scene import load_scene, scene_from_text
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.file_format.yaml_writer import yaml_text
from trunnion.scene.library.scene_files import LARGEST


def test_plain_scalars_follow_yaml_1_2():
    text = "{a: 1e-4, b: on, c: 0o17, d: 0x1F, e: ~, f: true, g: .5, h: 1_0, i: 12:30, j: 2012-01-01, k: '1', m: 1.}"
    assert read(text).data == {
        "a": 1e-4, "b": "on", "c": 15, "d": 31, "e": None, "f": True, "g": 0.5, "h": "1_0", "i": "12:30",
        "j": "2012-01-01", "k": "1", "m": 1.0,
    }  # fmt: skip


def test_keys_are_text_whatever_they_look_like():
    assert read("{1: a, on: b, true: c, ~: d, 1.0: e}").data == {"1": "a", "on": "b", "true": "c", "~": "d", "1.0": "e"}


def test_an_alias_stands_for_a_copy():
    assert read("a: &x {p: [1, 2]}\nb: *x").data == {"a": {"p": [1, 2]}, "b": {"p": [1, 2]}}


SCENE = """\
schema: 1
bodies:
  arm:
    box: [1, 0.1, 0.1]
    density: 30 deg
    color: red
    colour: red
joints:
  hinge:
    type: revolute
    inboard: ground

    outboard: amr
    start:
      q:
        - 1
        - 2 parsec
gravity:
  - 0
  - 0
  - fast
"""


def test_every_problem_has_the_line_it_stands_in():
    found = {(p.line, p.where) for p in problems_in(SCENE)}
    assert found == {
        (5, "bodies.arm.density"),
        (7, "bodies.arm.colour"),
        (9, "joints.hinge.axis"),  # the joint needs an axis
        (13, "joints.hinge.outboard"),
        (17, "joints.hinge.start.q[2]"),
        (21, "gravity[3]"),
    }


def test_a_problem_is_printed_as_file_line_path_cause_and_hint():
    text = str(problems_in(SCENE, "first.yaml")[1])
    assert text == 'first.yaml:7: bodies.arm.colour: unknown key "colour" (did you mean "color"?)'


def test_json_files_have_lines_too():
    text = json.dumps({"schema": 1, "bodies": {}, "joints": {}, "gravitation": 3}, indent="\t")
    found = {(p.line, p.where) for p in problems_in(text, "s.json", is_json=True)}
    assert found == {(3, "bodies"), (5, "gravitation")}


def test_json_and_yaml_give_the_same_scene():
    as_json = scene_from_text(json.dumps(VALID), is_json=True)
    assert as_json == scene_from_text(json.dumps(VALID)) == scene_from_text(yaml_text(VALID))


BOMB = "\n".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9) if i else 1}]" for i in range(12))
SYNTAX = {
    "colon": ("a: b: c", 1, "a colon where YAML allows no key"),
    "tab": ("a: 1\nb:\n\t- 1", 3, "tabs"),
    "bracket": ("a: [1, 2\nb: 3", 2, "bracket"),
    "quotes": ("a: 'x\n", 2, "quotes"),
    "indentation": ("a:\n    b: 1\n  c: 2", 3, "indentation"),
    "control character": ("a: 1\nb: \x07", 2, "character"),
    "bad escape": ('a: "\\q"', 1, "not valid YAML"),
    "code point": ('a: "\\UFFFFFFFF"', 1, "not valid YAML"),
    "undefined alias": ("a: *b", 1, "the alias *b has no anchor"),
    "alias as key": ("a: &b x\n*b : 1", 2, "alias"),
    "list as key": ("? [a]\n: b", 1, "cannot be a key"),
    "recursive alias": ("a: &b [*b]", 1, "the alias *b has no anchor"),
    "tag": ("a: !!python/object:os.system x", 1, "tag"),
    "second document": ("a: 1\n---\nb: 2", 2, "second document"),
    "nothing": ("", 0, "empty"),
    "comment alone": ("# nothing", 0, "empty"),
    "a list": ("- a", 1, "a scene is a group of keys"),
    "a word": ("pendulum", 1, "a scene is a group of keys"),
    "too deep": ("[" * 60, 1, "levels of nesting"),
    "alias bomb": (BOMB, 7, "values"),
    "wide alias bomb": (f"a: &a [{'1, ' * 600}1]\nb: [{'*a, ' * 600}1]", 2, "values"),
}


@pytest.mark.parametrize("case", SYNTAX)
def test_text_that_is_no_scene_is_refused_with_its_line(case):
    text, line, words = SYNTAX[case]
    (problem,) = problems_in(text)
    assert problem.line == line
    assert words in str(problem)


@pytest.mark.parametrize(
    ("text", "line"),
    [('{"a": [1,]}', 1), ('{\n"a" 1}', 2), ("", 1), ("[" * 100_000, 0), ('{"a": NaN}', 1), ("a: 1", 1)],
)
def test_json_that_is_no_scene_is_refused_with_its_line(text, line):
    (problem, *_) = problems_in(text, is_json=True)
    assert problem.line in (line, 1)


def test_bytes_that_are_no_utf_8_are_refused_with_their_line():
    (problem,) = problems_in(b"a: 1\nb: \xff\xfe")
    assert (problem.line, problem.what) == (2, "the file is not UTF-8 text")


def test_a_byte_order_mark_is_no_mistake():
    assert scene_from_text(b"\xef\xbb\xbf" + yaml_text(VALID).encode()).name == "one_of_everything"


def test_a_file_of_many_megabytes_is_not_read(tmp_path):
    big = tmp_path / "big.yaml"
    big.write_bytes(b" " * (LARGEST + 1))
    with pytest.raises(SceneError, match="larger than 5 MB"):
        load_scene(big)
    (problem,) = problems_in(b" " * (LARGEST + 1))
    assert "larger than 5 MB" in problem.what


def test_missing_files_folders_and_odd_names_are_problems_not_exceptions(tmp_path):
    for source in (
        "/dev/zero",
        tmp_path / "no.yaml",
        tmp_path,
        "no/such/file",
        "no.json",
        "a\0b",
        "",
        "x" * 5000,
        "..",
    ):
        with pytest.raises(SceneError):
            load_scene(source)


def test_a_scene_without_name_is_called_after_its_file_or_folder(tmp_path):
    data = {k: v for k, v in VALID.items() if k != "name"}
    (tmp_path / "pump").mkdir()
    for file, name in ((tmp_path / "crane.yaml", "crane"), (tmp_path / "pump" / "scene.yaml", "pump")):
        file.write_text(yaml_text(data))
        assert load_scene(file).name == name
    assert load_scene(tmp_path / "pump").name == "pump"
    (tmp_path / "lift.json").write_text(json.dumps(data))
    assert load_scene(str(tmp_path / "lift.json")).name == "lift"


@given(st.binary(max_size=300), st.booleans())
@example(b"&a [*a]", False)
@example(b"%YAML 9.9\n---\n", False)
@example(b"? ? ? :", False)
@example(b'"\\ud800"', True)
@settings(max_examples=300, deadline=None)
def test_random_bytes_are_problems_and_nothing_else(content, is_json):
    assert problems_in(content, is_json=is_json)


TEXT = yaml_text(VALID)
MARKS = ["\n", "  ", "- ", "{", "}", "[", "]", ": ", "&a", "*a", "!!", "%", "|", ">", "'", '"', "\t"]
PIECES = sorted({*re.findall(r"\S+", TEXT), *MARKS})
DAMAGE = st.tuples(st.integers(0, len(TEXT)), st.integers(0, 12), st.sampled_from(PIECES))


@given(st.lists(DAMAGE, min_size=1, max_size=4))
@settings(max_examples=150, deadline=None)
def test_a_damaged_scene_loads_or_has_problems(damages):
    text = TEXT
    for at, length, piece in damages:
        text = text[:at] + piece + text[at + length :]
    assert all(p.what and p.where for p in problems_in(text))


def test_a_parser_without_libyaml_reads_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "a: [1, 'two', 3.0]\nb: &x {c: null, \"d\": 0x1f}\ne: *x\n"
    fast = read(text)
    monkeypatch.delattr("yaml.CSafeLoader", raising=False)
    slow = read(text)
    assert fast.data == {"a": [1, "two", 3.0], "b": {"c": None, "d": 31}, "e": {"c": None, "d": 31}}
    assert (slow.data, slow.lines) == (fast.data, fast.lines)
