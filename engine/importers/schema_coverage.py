"""Tables of all elements and attributes in the schemas of the formats. The tables state what the importer does with each element
and attribute (its fate). The tables are files in the folder ``schemas``.

A line names elements, then segments. The line is indented below the line of the element that holds these elements. A segment is a
fate, followed by the attributes and elements with this fate. A segment without a fate has the fate of the element. The first
segment is for the element itself.

    contacts = contacts                             a label with the words of its notes; of refusals, also ; and a remedy
    joint | taken name +pose | noted:contacts gap   +pose: the element ``pose`` of the table's margin; +any: any content
      parent child | taken link -- a remark         a line that begins with | continues the line above

taken       read, or refused by the reader for a value that a scene cannot represent
noted       left out, with a note; with its content, unless that has fates of its own
refused     refused with a label by this table, without one by the reader
irrelevant  without influence on the motion of the scene
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import field
from functools import cache
from pathlib import Path

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.importers.xml_reader import Element, Findings, is_zero

FATES = ("taken", "noted", "refused", "irrelevant")
FILES = {"URDF": "urdf.txt", "SDF": "sdf.txt", "MJCF": "mjcf.txt"}
"""Table of each format, in the folder ``schemas``."""
ANY, UNKNOWN = "any", "unknown:"


@dataclass
class Row:
    """An element of a schema. attributes: fates of its attributes. uses: fates of the elements at the margin that it may hold.
    children: its own elements. A fate may have a label, as in ``noted:contacts``."""

    tag: str
    fate: str
    attributes: dict[str, str] = field(default_factory=dict)
    uses: dict[str, str] = field(default_factory=dict)
    children: dict[str, Row] = field(default_factory=dict)
    remark: str = ""


@dataclass
class Table:
    """The table of a format. margin: the rows of the lines without indentation. labels: the words of the labels."""

    name: str
    margin: dict[str, Row]
    labels: dict[str, str]

    def child(self, row: Row, tag: str) -> tuple[Row, str] | None:
        """(row, fate) of an element with the tag ``tag`` inside the element of ``row``. None if the schema has no such element. The
        fate is "" if the fate of the found row applies. Any other fate applies to all content of the element, too."""
        if tag in row.children:
            return row.children[tag], ""
        if tag not in row.uses:
            return None
        return self.margin[tag], row.uses[tag].replace("taken", "")

    def tell(self, root: Element, found: Findings) -> None:
        """Add a note for each label, and for each item that the schema lacks. Add a problem for each item that the table
        refuses."""
        told: dict[str, list[tuple[Element, str]]] = {}
        for e, shown, fate in self._walk(root, self.margin[root.tag], ""):
            kind, _, label = fate.partition(":")
            if kind == "refused":
                what, _, hint = self.labels[label].partition(" ; ")
                found.add(e, e.get("name") or e.tag, f"<{shown}> {what}", hint)
            else:
                told.setdefault(label and self.labels[label], []).append((e, shown))
        for what, items in told.items():
            named = [f"<{shown}> in line {e.line}" + (f" of {e.file}" if e.file != root.file else "") for e, shown in items]
            if not what:
                found.notes += [f"unknown in {self.name}, left out: {n}" for n in _first_of_each(items, named)]
                continue
            found.notes.append(f"{what} left out: {named[0]}" + (f" and {len(items) - 1} more" if len(items) > 1 else ""))

    def _walk(self, e: Element, row: Row, all_content: str) -> Iterator[tuple[Element, str, str]]:
        """(element, item, fate) of the items inside an element whose label differs from the element's label, or that are unknown.
        If the importer takes nothing from an element, unknown content is left out with the element. ``all_content`` is a fate that
        applies to all content; "" if the table's rows apply."""
        own = all_content or row.fate
        open_end = ANY in row.uses or (own != "taken" and (bool(all_content) or "taken" not in row.attributes.values()))
        for name, text in e.attributes.items():
            fate = all_content or row.attributes.get(name, UNKNOWN)
            if fate == UNKNOWN:
                if not (open_end or name.startswith("xmlns")):
                    yield e, f"{e.tag} {name}", UNKNOWN
            elif ":" in fate and fate != own and not is_zero(text):
                yield e, f"{e.tag} {name}", fate
        for c in e.children:
            known = self.child(row, c.tag)
            if known is None:
                if not open_end:
                    yield c, c.tag, UNKNOWN
                continue
            below, fate = all_content or known[1], known[0].fate
            if ":" in (below or fate) and (below or fate) != own and not c.is_off():
                yield c, c.tag, below or fate
            yield from self._walk(c, known[0], below)


def _first_of_each(items: list[tuple[Element, str]], named: list[str]) -> list[str]:
    """The first of ``named`` for each item, and the number of its further occurrences."""
    count = Counter(shown for _, shown in items)
    first = dict(zip(reversed([shown for _, shown in items]), reversed(named), strict=True))
    return [first[shown] + (f" and {n - 1} more" if n > 1 else "") for shown, n in count.items()]


@cache
def schema(name: str) -> Table:
    """The table of a format: URDF, SDF or MJCF."""
    table, above = Table(name, {}, {}), list[tuple[int, list[Row]]]()
    for line in (Path(__file__).parent / "schemas" / FILES[name]).read_text(encoding="utf-8").splitlines():
        text, depth = line.strip(), len(line) - len(line.lstrip())
        label, is_label, words = text.partition(" = ")
        if not text or text[0] == "#":
            continue
        if is_label:
            table.labels[label] = words
            continue
        content, _, remark = text.partition(" -- ")
        tags, *segments = (s.split() for s in content.split("|"))
        while tags and above and above[-1][0] >= depth:
            above.pop()
        holders = above[-1][1] if above and tags else []
        inherited = holders[0].fate if holders else ""
        if not tags:
            _read_segments(above[-1][1], segments, above[-1][1][0].fate)
            continue
        made = [Row(tag, inherited, remark=remark) for tag in tags]
        if segments and segments[0] and segments[0][0].partition(":")[0] in FATES:
            for row in made:
                row.fate = segments[0][0]
        _read_segments(made, segments, made[0].fate)
        for where in [h.children for h in holders] or [table.margin]:
            where.update({row.tag: row for row in made})
        above.append((depth, made))
    return table


def _read_segments(rows: list[Row], segments: list[list[str]], inherited: str) -> None:
    """Add the attributes and uses of segments to the rows of a line."""
    for words in segments:
        has_fate = bool(words) and words[0].partition(":")[0] in FATES
        fate = words[0] if has_fate else inherited
        for row in rows:
            row.attributes |= {w: fate for w in words[has_fate:] if w[0] != "+"}
            row.uses |= {w[1:]: fate for w in words if w[0] == "+"}
