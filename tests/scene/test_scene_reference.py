"""The page that lists every key is current, complete, and its examples are a scene."""

from __future__ import annotations

import re

from engine.scene import load_scene
from engine.scene.reference import EXAMPLES, LONGEST, PAGE, examples, page_text
from engine.scene.schema import json_schema


def test_the_page_is_current():
    assert PAGE.read_text(encoding="utf-8") == page_text(), "run python -m engine.scene.reference"


def test_every_key_of_every_group_is_on_the_page_with_its_value_and_an_example():
    schema = json_schema()
    groups = {"Scene": schema, **schema["$defs"]}
    found, text = examples(), page_text()
    parts = {p.splitlines()[0]: p for p in text.split("\n## ")[1:]}
    assert set(parts) == set(groups)
    for name, group in groups.items():
        rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", parts[name], re.MULTILINE))
        assert list(rows) == list(group["properties"])
        for key, row in rows.items():
            what, value, _, example = re.split(r"(?<!\\\\) \| ", row)
            assert what, (name, key)
            assert value, (name, key)
            assert 2 < len(example) <= LONGEST + 2, (name, key)
    assert len(found) > 100, f"most examples are of {EXAMPLES.name}"


def test_the_examples_are_one_scene_without_a_problem():
    assert len(load_scene(EXAMPLES).bodies) > 10


def test_links_lead_to_groups():
    text = page_text()
    headings = {h.lower() for h in re.findall(r"^## (\w+)$", text, re.MULTILINE)}
    assert set(re.findall(r"\]\(#(\w+)\)", text)) <= headings
