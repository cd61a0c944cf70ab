"""Every key of a scene has an example, and the checker accepts each example."""

from __future__ import annotations

import re
from copy import deepcopy
from functools import cache
from typing import Any

import pytest

from tests.documentation.reference_generators.scene_keys_pages import EXAMPLES, LONGEST, PAGES, examples, groups_of_keys, page_text
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.scene_loader import Source, load_scene, scene_of, source_of_file

KEYS = {f"{name}.{key}": (name, key) for name, group in groups_of_keys().items() for key in group["properties"]}


@cache
def as_read() -> dict[str, Any]:
    """The data of the scene of examples; tests copy them before they change them."""
    return source_of_file(EXAMPLES).data


@cache
def loaded() -> Scene:
    """The scene of examples. Tests only read it."""
    return load_scene(EXAMPLES)


def replaced(key: str) -> Scene:
    """The scene of examples, in which the text of one key's example replaces the key's value."""
    example = examples()[KEYS[key]]
    data = deepcopy(as_read())
    node: Any = data
    *above, last = example.path
    for step in above:
        node = node[step] if isinstance(step, int) else node.setdefault(step, {})
    value = read(f"a: {example.text}").data["a"]
    node |= example.beside
    node[last] = {**node.get(last, {}), **value} if example.named else value
    return scene_of(Source(data, folder=EXAMPLES))


@pytest.mark.default_cases(15)
@pytest.mark.parametrize("key", KEYS)
def test_the_checker_accepts_the_example_of_every_key(key):
    assert KEYS[key] in examples(), f"no example in {EXAMPLES.name}"
    assert "…" not in examples()[KEYS[key]].text
    assert len(examples()[KEYS[key]].text) <= LONGEST
    assert replaced(key).bodies == loaded().bodies


def test_every_group_is_on_one_page_with_all_its_keys():
    groups = groups_of_keys()
    assert sorted(g for _, *names in PAGES.values() for g in names) == sorted(groups)
    for page, (_, *names) in PAGES.items():
        parts = page_text(page).split("\n## ")[1:]
        assert [p.splitlines()[0] for p in parts] == names
        for name, part in zip(names, parts, strict=True):
            rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", part, re.MULTILINE))
            assert list(rows) == list(groups[name]["properties"])
            for key, row in rows.items():
                meaning, value, default, example = re.split(r"(?<!\\) \| ", row)
                assert all((meaning, value, default, example)), (name, key)


def test_links_of_the_pages_lead_to_groups():
    for page in PAGES:
        for target, heading in re.findall(r"\]\((\w+)\.md#(\w+)\)", page_text(page)):
            assert heading in {g.lower() for g in PAGES[target][1:]}
