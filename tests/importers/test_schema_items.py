"""The tables in ``engine/importers/schemas`` list every element and attribute of the schemas of URDF, SDF 1.6 to 1.12 and MJCF. The
importers treat each item as its table says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.importers.schema_examples import MJCF, REFUSED, SDF, URDF
from tests.importers.schema_items import Items, mjcf, recorded
from trunnion.basics.errors import SceneError
from trunnion.importers import intermediate_linkage, xml_reader
from trunnion.importers.format_detection import scene_of
from trunnion.importers.schema_coverage import ANY, Row, Table, schema
from trunnion.importers.xml_reader import Element

EXAMPLES = {"URDF": URDF, "SDF": SDF, "MJCF": MJCF}
TETRA = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {height}\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
PART = """<sdf version="1.7"><model name="part"><frame name="foot"><pose>0 0 2 0 0 0</pose></frame><link name="p"/></model></sdf>"""


def unlisted(table: Table, row: Row, items: Items, path: str) -> Iterator[str]:
    for name, own in items.items():
        at = f"{path}/{name}"
        if name[0] == "@":
            if name[1:] not in row.attributes:
                yield at
        elif name[0] == "+":
            if name[1:] not in row.uses and name[1:] not in row.children:
                yield at
        elif (found := table.child(row, name)) is None:
            if ANY not in row.uses:
                yield at
        else:
            yield from unlisted(table, found[0], own, at)


def all_unlisted(name: str, items: Items) -> list[str]:
    table = schema(name)
    assert items.keys() <= table.margin.keys()
    return [u for root, own in items.items() for u in unlisted(table, table.margin[root], own, root)]


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_table_lists_every_item_of_the_schema(name: str) -> None:
    assert all_unlisted(name, recorded(name)) == []


def test_the_table_lists_every_item_that_the_installed_mujoco_prints() -> None:
    mujoco = pytest.importorskip("mujoco")
    assert all_unlisted("MJCF", mjcf(mujoco.mj_printSchema(False, False))) == []


def outcome(text: str, folder: Path) -> tuple[Any, ...]:
    """The result of an import: the scene as data or the problems, and the notes."""
    file = folder / "model.xml"
    file.write_text(text)
    try:
        scene, notes = scene_of(file, stops=100.0)
    except SceneError as e:
        return ("refused", [(p.where, p.what) for p in e.problems])
    return scene, notes


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with the files that the examples name. Scenes stay data and are not checked."""
    monkeypatch.setattr(intermediate_linkage, "scene_from_dict", lambda data: data)
    for height, name in enumerate(("part.obj", "meshes/part.obj", "meshes/away/part.obj")):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(TETRA.format(height=2 + height))
    (tmp_path / "part").mkdir()
    (tmp_path / "part" / "model.sdf").write_text(PART)
    return tmp_path


def read(text: str, folder: Path) -> Element:
    (folder / "example.xml").write_text(text)
    return xml_reader.read_xml(folder / "example.xml")


def text_of(e: Element) -> str:
    """An element as XML. Line breaks inside tags are lost."""
    attributes = "".join(f' {n}="{x}"' for n, x in e.attributes.items())
    return f"<{e.tag}{attributes}>{e.text}{''.join(map(text_of, e.children))}</{e.tag}>"


def rows(e: Element, table: Table, row: Row, taken: bool = True) -> Iterator[tuple[Element, Row]]:
    """Each element that has its own row in the table, with this row."""
    yield e, row
    for c in e.children:
        found = table.child(row, c.tag)
        if found is not None and not found[1]:
            yield from rows(c, table, found[0])


def taken_items(name: str) -> dict[tuple[int, str], str]:
    """The items that the table takes: (row, item) → name of the item. Rows that only contain other rows are left out."""
    table, out = schema(name), {}

    def add(row: Row, path: str) -> None:
        used = {n: fate for n, fate in row.uses.items() if n in table.margin and table.margin[n].fate == "taken"}
        for kind, items in (("@", row.attributes), ("+", used)):
            out.update({(id(row), kind + n): f"{path}{kind}{n}" for n, fate in items.items() if fate == "taken"})
        for c in row.children.values():
            if c.fate == "taken":
                out[(id(row), "+" + c.tag)] = f"{path}/{c.tag}"
            add(c, f"{path}/{c.tag}")

    for row in table.margin.values():
        add(row, row.tag)
    return out


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_item_that_the_table_takes_changes_the_scene(name: str, folder: Path) -> None:
    """If an item that the table takes is removed, the outcome of an example changes."""
    table, wanted = schema(name), taken_items(name)
    for text in EXAMPLES[name]:
        root = read(text, folder)
        whole = outcome(text_of(root), folder)
        for e, row in list(rows(root, table, table.margin[root.tag])):
            before = dict(e.attributes), list(e.children)
            for item, left in removals(e, row):
                if item in wanted:
                    e.attributes, e.children = left
                    if outcome(text_of(root), folder) != whole:
                        del wanted[item]
            e.attributes, e.children = before
    assert sorted(wanted.values()) == []


def removals(e: Element, row: Row) -> Iterator[tuple[tuple[int, str], tuple[dict[str, str], list[Element]]]]:
    """Each item of an element, with the remaining attributes and children after its removal."""
    attributes, children = dict(e.attributes), list(e.children)
    for n in attributes:
        yield (id(row), f"@{n}"), ({k: x for k, x in attributes.items() if k != n}, children)
    for c in children:
        yield (id(row), f"+{c.tag}"), (attributes, [x for x in children if x is not c])


def add_items(e: Element, table: Table, row: Row, wanted: str) -> None:
    """Add each item whose fate is ``wanted`` to an element and its content: attributes and elements with nonsense."""
    for c in e.children:
        found = table.child(row, c.tag)
        if found is not None and not found[1]:
            add_items(c, table, found[0], wanted)
    e.attributes |= {n: "?" for n, fate in row.attributes.items() if fate.startswith(wanted) and n not in e.attributes}
    used = {n: table.margin[n].fate if fate == "taken" else fate for n, fate in row.uses.items() if n in table.margin}
    for tag, fate in {**used, **{c.tag: c.fate for c in row.children.values()}}.items():
        below = row.children.get(tag) or table.margin[tag]
        inside = {*below.attributes.values(), *(c.fate for c in below.children.values())}
        if fate.startswith(wanted) and "taken" not in inside:
            e.children.append(Element(tag, {n: "?" for n, f in below.attributes.items() if f == fate}, text="?"))


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("fate", ["irrelevant", "noted"])
def test_items_that_the_table_does_not_take_leave_the_scene_unchanged(fate: str, name: str, folder: Path) -> None:
    table, new = schema(name), ""
    for text in EXAMPLES[name]:
        root = read(text, folder)
        scene, _ = outcome(text_of(root), folder)
        if scene == "refused":
            continue
        add_items(root, table, table.margin[root.tag], fate)
        more, notes = outcome(text_of(root), folder)
        assert more == scene
        new += "\n".join(["", *notes])
    fates = {f for row in every_row(table) for f in (row.fate, *row.attributes.values()) if f.startswith("noted:")}
    for label in fates if fate == "noted" else ():
        assert re.search(rf"\n{re.escape(table.labels[label[6:]])} left out: <\S+( \S+)?> in line \d+", new), label


def refused_items(name: str) -> set[str]:
    """The items that the table refuses, without the content of refused elements."""
    out: set[str] = set()
    is_refused = lambda fate: fate.startswith("refused")  # noqa: E731

    def add(row: Row, path: str) -> None:
        own = {c.tag: c.fate for c in row.children.values()}
        for kind, items in (("@", row.attributes), ("+", row.uses), ("/", own)):
            out.update(f"{path}{kind}{n}" for n, fate in items.items() if is_refused(fate) and not is_refused(row.fate))
        for c in row.children.values():
            if not is_refused(c.fate):
                add(c, f"{path}/{c.tag}")

    for row in schema(name).margin.values():
        out.update([row.tag] if is_refused(row.fate) else [])
        add(row, row.tag)
    return out


@pytest.mark.parametrize("name", ["SDF", "MJCF"])
def test_items_that_the_table_refuses_are_refused_with_their_line(name: str, folder: Path) -> None:
    assert refused_items(name) == {item for items in REFUSED[name] for item in items.split()}
    for text in REFUSED[name].values():
        (folder / "model.xml").write_text(text)
        with pytest.raises(SceneError) as error:
            scene_of(folder / "model.xml")
        assert {p.line for p in error.value.problems} == {i for i, line in enumerate(text.splitlines(), 1) if "!" in line}, text


def every_row(table: Table) -> Iterator[Row]:
    left = list(table.margin.values())
    while left:
        row = left.pop()
        yield row
        left += row.children.values()


@pytest.mark.parametrize("name", EXAMPLES)
def test_items_that_no_schema_lists_have_a_note_with_their_line(name: str, folder: Path) -> None:
    root = read(EXAMPLES[name][0], folder)
    scene, _ = outcome(text_of(root), folder)
    last = root.children[-1]
    last.attributes["odd"] = "1"
    root.children += [Element("new", {}), Element("new", {})]
    more, notes = outcome(text_of(root), folder)
    assert more == scene
    text = text_of(root)
    lines = [text[: text.index(start)].count("\n") + 1 for start in (' odd="', "<new>")]
    assert [n.removeprefix(f"unknown in {name}, left out: ") for n in notes if n.startswith("unknown")] == [
        f"<{last.tag} odd> in line {lines[0]}", f"<new> in line {lines[1]} and 1 more",
    ]  # fmt: skip
