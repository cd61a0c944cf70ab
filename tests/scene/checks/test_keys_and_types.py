"""Mistakes of form (keys, types, units) are reported in plain words, with their place."""

from __future__ import annotations

import re
from typing import get_type_hints

import pytest

from tests.scene.valid_scene import problems_in
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.data_classes.type_tree import hints, members, step

FORM = {
    "missing key": ("bodies: {}", "joints", 'the key "joints" is missing'),
    "duplicate key": (
        "bodies:\n  a: {mass: 1}\n  a: {mass: 2}\njoints: {}",
        "bodies.a",
        "given twice (first in line 2)",
    ),
    "no list": ("bodies: {a: {box: 3}}\njoints: {}", "bodies.a.box", "a list of 3 is expected, not 3"),
    "short list": ("bodies: {a: {box: [1, 2]}}\njoints: {}", "bodies.a.box", "3 entries are expected, not 2"),
    "long list": ("bodies: {a: {box: [1, 2, 3, 4]}}\njoints: {}", "bodies.a.box", "3 entries are expected, not 4"),
    "no group": ("bodies: [1]\njoints: {}", "bodies", "a group of keys is expected, not a list of 1"),
    "no group below": ("bodies: {a: 3}\njoints: {}", "bodies.a", "a group of keys is expected, not 3"),
    "no number": ("bodies: {a: {mass: [1]}}\njoints: {}", "bodies.a.mass", "a mass is expected, not a list of 1"),
    "truth for a number": ("bodies: {a: {mass: true}}\njoints: {}", "bodies.a.mass", "a mass is expected, not true"),
    "no text": ("bodies: {}\njoints: {}\ntitle: 12", "title", "text is expected, not 12"),
    "no truth": (
        "bodies: {}\njoints: {j: {type: free, inboard: a, outboard: b, cut: 1}}",
        "joints.j.cut",
        "true or false",
    ),
    "no choice": ("bodies: {}\njoints: {}\nfriction: {law: coulom}", "friction.law", 'did you mean "coulomb"?'),
    "wrong schema": ("schema: 2\nbodies: {}\njoints: {}", "schema", "this version reads schema: 1"),
    "wrong form": (
        "bodies: {}\njoints: {j: {type: free, inboard: 3, outboard: b}}",
        "joints.j.inboard",
        "text is expected",
    ),
    "other wrong form": (
        "bodies: {}\njoints: {j: {type: free, inboard: [3], outboard: b}}",
        "joints.j.inboard",
        '"body.point"',
    ),
    "unknown load": ("bodies: {}\njoints: {}\nforces: {f: {type: forse}}", "forces.f.type", 'did you mean "force"?'),
    "load without type": ("bodies: {}\njoints: {}\nforces: {f: {on: a}}", "forces.f", 'the key "type" is missing'),
    "load that is none": ("bodies: {}\njoints: {}\nforces: {f: 3}", "forces.f", "a group of keys is expected"),
    "infinite": ("bodies: {a: {mass: .inf}}\njoints: {}", "bodies.a.mass", "not finite"),
    "not a number": ("bodies: {a: {mass: .nan}}\njoints: {}", "bodies.a.mass", "not finite"),
    "huge integer": (f"bodies: {{a: {{mass: {'9' * 5000}}}}}\njoints: {{}}", "bodies.a.mass", "not finite"),
    "merge key": ("bodies: {}\njoints: {}\n<<: {title: x}", "<<", "unknown key"),
}


@pytest.mark.parametrize("case", FORM)
def test_a_mistake_of_form_is_reported_in_plain_words(case):
    text, where, words = FORM[case]
    found = [str(p) for p in problems_in(text) if p.where == where]
    assert [p for p in found if words in p], found


def test_no_message_speaks_of_the_checkers_own_workings():
    words = re.compile(r"pydantic|dataclass|Input should|validation error|NoneType|Traceback|·|tuple|dict\b|str\b", re.I)
    for text, _, _ in FORM.values():
        for p in problems_in(text):
            assert not words.search(str(p)), p


def test_the_tree_of_types_has_the_annotations_of_the_classes():
    seen: set[type] = set()
    left = [Scene]
    while left:
        cls = left.pop()
        seen.add(cls)
        assert hints(cls) == get_type_hints(cls, include_extras=True), cls
        found = [a for annotation in hints(cls).values() for a, _ in members(annotation)]
        inner = [below for a in found for key in ("any name", 0) for below in step(a, key)]
        found += [a for annotation in inner for a, _ in members(annotation)]
        left += {a for a in found if isinstance(a, type) and hasattr(a, "__pydantic_fields__")} - seen
    assert len(seen) > 40
