"""Files: YAML 1.2 and JSON, lines of every problem, limits, and no content that leads to anything but a list of problems."""

from __future__ import annotations

import json
import re

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from engine.basics.problems import SceneError
from engine.scene import load_scene, scene_from_text
from engine.scene.dump import yaml_text
from engine.scene.reading import LARGEST, read

from .making import VALID, problems_in


def test_plain_scalars_follow_yaml_1_2():
    text = "{a: 1e-4, b: on, c: 0o17, d: 0x1F, e: ~, f: true, g: .5, h: 1_0, i: 12:30, j: 2012-01-01, k: '1', l: no, m: 1.}"
    assert read(text).data == {
        "a": 1e-4, "b": "on", "c": 15, "d": 31, "e": None, "f": True, "g": 0.5, "h": "1_0", "i": "12:30",
        "j": "2012-01-01", "k": "1", "l": "no", "m": 1.0,
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
        (9, "joints.hinge.axis"),  # needs an axis
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


def test_json_and_yaml_say_the_same():
    as_json = scene_from_text(json.dumps(VALID), is_json=True)
    assert as_json == scene_from_text(json.dumps(VALID)) == scene_from_text(yaml_text(VALID))


FORM = {
    "missing key": ("bodies: {}", "joints", 'the key "joints" is missing'),
    "duplicate key": ("bodies:\n  a: {mass: 1}\n  a: {mass: 2}\njoints: {}", "bodies.a", "given twice (first in line 2)"),
    "no list": ("bodies: {a: {box: 3}}\njoints: {}", "bodies.a.box", "a list of 3 is wanted, not 3"),
    "short list": ("bodies: {a: {box: [1, 2]}}\njoints: {}", "bodies.a.box", "3 entries are wanted, not 2"),
    "long list": ("bodies: {a: {box: [1, 2, 3, 4]}}\njoints: {}", "bodies.a.box", "3 entries are wanted, not 4"),
    "no group": ("bodies: [1]\njoints: {}", "bodies", "a group of keys is wanted, not a list of 1"),
    "no group below": ("bodies: {a: 3}\njoints: {}", "bodies.a", "a group of keys is wanted, not 3"),
    "no number": ("bodies: {a: {mass: [1]}}\njoints: {}", "bodies.a.mass", "a mass is wanted, not a list of 1"),
    "truth for a number": ("bodies: {a: {mass: true}}\njoints: {}", "bodies.a.mass", "a mass is wanted, not true"),
    "no text": ("bodies: {}\njoints: {}\ntitle: 12", "title", "text is wanted, not 12"),
    "no truth": ("bodies: {}\njoints: {j: {type: free, inboard: a, outboard: b, cut: 1}}", "joints.j.cut", "true or false"),
    "no choice": ("bodies: {}\njoints: {}\nfriction: {law: coulom}", "friction.law", 'did you mean "coulomb"?'),
    "wrong schema": ("schema: 2\nbodies: {}\njoints: {}", "schema", "this version reads schema: 1"),
    "wrong form": ("bodies: {}\njoints: {j: {type: free, inboard: 3, outboard: b}}", "joints.j.inboard", "text is wanted"),
    "other wrong form": ("bodies: {}\njoints: {j: {type: free, inboard: [3], outboard: b}}", "joints.j.inboard", '"body.point"'),
    "unknown load": ("bodies: {}\njoints: {}\nforces: {f: {type: forse}}", "forces.f.type", 'did you mean "force"?'),
    "load without type": ("bodies: {}\njoints: {}\nforces: {f: {on: a}}", "forces.f", 'the key "type" is missing'),
    "load that is none": ("bodies: {}\njoints: {}\nforces: {f: 3}", "forces.f", "a group of keys is wanted"),
    "infinite": ("bodies: {a: {mass: .inf}}\njoints: {}", "bodies.a.mass", "not finite"),
    "not a number": ("bodies: {a: {mass: .nan}}\njoints: {}", "bodies.a.mass", "not finite"),
    "huge integer": (f"bodies: {{a: {{mass: {'9' * 5000}}}}}\njoints: {{}}", "bodies.a.mass", "not finite"),
    "merge key": ("bodies: {}\njoints: {}\n<<: {title: x}", "<<", "unknown key"),
}  # fmt: skip


@pytest.mark.parametrize("case", FORM)
def test_a_mistake_of_form_is_said_in_plain_words(case):
    text, where, words = FORM[case]
    found = [str(p) for p in problems_in(text) if p.where == where]
    assert [p for p in found if words in p], found


def test_no_message_speaks_of_the_checkers_own_workings():
    words = re.compile(r"pydantic|dataclass|Input should|validation error|NoneType|Traceback|·|tuple|dict\b|str\b", re.I)
    for text, _, _ in FORM.values():
        for p in problems_in(text):
            assert not words.search(str(p)), p


SYNTAX = {
    "colon": ("a: b: c", 1, "a colon where no key can stand"),
    "tab": ("a: 1\nb:\n\t- 1", 3, "tabs"),
    "bracket": ("a: [1, 2\nb: 3", 2, "bracket"),
    "quotes": ("a: 'x\n", 2, "quotes"),
    "indentation": ("a:\n    b: 1\n  c: 2", 3, "indentation"),
    "control character": ("a: 1\nb: \x07", 2, "character"),
    "bad escape": ('a: "\\q"', 1, "not valid YAML"),
    "code point": ('a: "\\UFFFFFFFF"', 1, "not valid YAML"),
    "undefined alias": ("a: *b", 1, "*b stands for nothing"),
    "alias as key": ("a: &b x\n*b : 1", 2, "alias"),
    "list as key": ("? [a]\n: b", 1, "cannot be a key"),
    "recursive alias": ("a: &b [*b]", 1, "*b stands for nothing"),
    "tag": ("a: !!python/object:os.system x", 1, "tag"),
    "second document": ("a: 1\n---\nb: 2", 2, "second document"),
    "nothing": ("", 0, "empty"),
    "comment alone": ("# nothing", 0, "empty"),
    "a list": ("- a", 1, "a scene is a group of keys"),
    "a word": ("pendulum", 1, "a scene is a group of keys"),
    "too deep": ("[" * 60, 1, "levels of nesting"),
    "alias bomb": ("\n".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9) if i else 1}]" for i in range(12)), 7, "values"),
    "wide alias bomb": (f"a: &a [{'1, ' * 600}1]\nb: [{'*a, ' * 600}1]", 2, "values"),
}  # fmt: skip


@pytest.mark.parametrize("case", SYNTAX)
def test_text_that_is_no_scene_is_refused_with_its_line(case):
    text, line, words = SYNTAX[case]
    (problem,) = problems_in(text)
    assert problem.line == line
    assert words in str(problem)


@pytest.mark.parametrize(
    ("text", "line"), [('{"a": [1,]}', 1), ('{\n"a" 1}', 2), ("", 1), ("[" * 100_000, 0), ('{"a": NaN}', 1), ("a: 1", 1)]
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
    for source in (tmp_path / "no.yaml", tmp_path, "no/such/file", "no.json", "a\0b", "", "x" * 5000, ".."):
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
PIECES = sorted({*re.findall(r"\S+", TEXT), "\n", "  ", "- ", "{", "}", "[", "]", ": ", "&a", "*a", "!!", "%", "|", ">", "'", '"', "\t"})


@given(st.lists(st.tuples(st.integers(0, len(TEXT)), st.integers(0, 12), st.sampled_from(PIECES)), min_size=1, max_size=4))
@settings(max_examples=150, deadline=None)
def test_a_damaged_scene_loads_or_has_problems(damages):
    text = TEXT
    for at, length, piece in damages:
        text = text[:at] + piece + text[at + length :]
    try:
        scene_from_text(text, "s.yaml")
    except SceneError as e:
        assert e.problems
        assert all(p.what and p.where for p in e.problems)
