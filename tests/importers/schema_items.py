"""Names of all elements and attributes of the schemas of URDF, SDF 1.6 to 1.12 and MJCF, as their makers publish them.

    python -m tests.importers.schema_items SDFORMAT URDFDOM      # checkouts of both, and the installed mujoco

writes ``schema_items.txt``. A line is an element with its content: ``@name`` an attribute, ``name(…)`` an element with its content,
``+name`` an element of another line."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

FILE = Path(__file__).with_suffix(".txt")
VERSIONS = range(6, 13)
Items = dict[str, Any]
"""Content of an element: attributes (``@name``), uses (``+name``), and elements with their own content."""


def recorded(name: str) -> Items:
    """The content that ``schema_items.txt`` stores for one format, by root or by file of a schema."""
    out: Items = {}
    for line in FILE.read_text(encoding="utf-8").splitlines():
        if line.startswith(name + " "):
            _read(out, re.findall(r"[^\s()]+\(?|\)", line[len(name) :]))
    return out


def _read(into: Items, words: list[str]) -> None:
    while words and (word := words.pop(0)) != ")":
        own = into.setdefault(word.rstrip("("), {})
        if word.endswith("("):
            _read(own, words)


def _text(items: Items) -> str:
    return " ".join(n + (f"({_text(own)})" if own else "") for n, own in sorted(items.items()))


def mjcf(printed: str) -> Items:
    """Content of the schema that mj_printSchema prints, by root. "body" is also a root."""
    out: Items = {}
    holders: list[Items] = []
    own = out
    for line in printed.splitlines():
        start = re.match(r"^( *)(\(world\)body|[a-z_]+) \(.\) *(.*)$", line)
        if start:
            del holders[len(start[1]) // 3 :]
            own = (holders[-1] if holders else out).setdefault(start[2].removeprefix("(world)"), {})
            holders.append(own)
        own.update({f"@{a}": {} for a in (start[3] if start else line).split()})
    return out | {"body": out["mujoco"].pop("body")}


def sdf(folder: Path) -> Items:
    """Content of the description files of libsdformat, by root. State files before 1.12 have the roots of other files; these roots
    are listed inside the elements that include them."""
    out: Items = {}
    for version in VERSIONS:
        where = folder / "sdf" / f"1.{version}"
        for file in where.glob("*.sdf"):
            root = ElementTree.parse(file).getroot()
            if not (file.stem.endswith("_state") and root.get("name") != file.stem):
                _add_sdf(out, root, where, ())
    reached, left = {"sdf"}, ["sdf"]
    while left:
        for n in _uses(out[left.pop()]) - reached:
            reached.add(n)
            left.append(n)
    return {n: own for n, own in out.items() if n in reached}


def _uses(items: Items) -> set[str]:
    return {n[1:] for n in items if n[0] == "+"}.union(*(_uses(own) for own in items.values()))


def _add_sdf(into: Items, e: ElementTree.Element, where: Path, inside: tuple[str, ...]) -> None:
    name = e.get("name", "")
    if e.get("ref"):
        into.setdefault(name if e.get("ref") != name and name in inside else f"+{name}", {})
        return
    own = into.setdefault(name, {})
    for c in e:
        if c.tag == "attribute":
            own[f"@{c.get('name')}"] = {}
        elif c.tag == "element" and not c.get("copy_data"):
            _add_sdf(own, c, where, (*inside, name))
        elif c.tag == "include":
            other = ElementTree.parse(where / c.get("filename", "")).getroot()
            stem, root = c.get("filename", "").partition(".")[0], other.get("name", "")
            if stem.endswith("_state") and stem != root and (stem, root) not in inside:
                _add_sdf(own, other, where, (*inside, name, stem))
            else:
                own[f"+{root}"] = {}


def urdf(file: Path) -> Items:
    """Content of the XML Schema of urdfdom."""
    root = ElementTree.parse(file).getroot()
    types = {t.get("name", ""): t for t in root if t.tag.endswith("complexType")}

    def content(e: ElementTree.Element) -> Items:
        out: Items = {}
        for c in e:
            kind = c.tag.partition("}")[2]
            if kind == "attribute":
                out[f"@{c.get('name')}"] = {}
            elif kind == "element":
                out[c.get("name", "")] = content(types.get(c.get("type", ""), c))
            elif kind != "any":
                out |= content(c)
        return out

    return {e.get("name", ""): content(e) for e in root if e.tag.endswith("element")}


def main() -> None:
    import mujoco

    sdformat, urdfdom = map(Path, sys.argv[1:])
    found = {"MJCF": mjcf(mujoco.mj_printSchema(False, False)), "SDF": sdf(sdformat), "URDF": urdf(urdfdom / "xsd" / "urdf.xsd")}
    lines = [f"{name} {_text({n: own})}" for name, items in found.items() for n, own in sorted(items.items())]
    FILE.write_text("\n".join([*lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
