"""Generated page of imported elements and attributes: the tables of the importers give the fate of each of them."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.importers.schema_coverage import FATES, Row, schema

HEAD = """# Items of imported files

This page lists what the importers do with each element and attribute of URDF (the XML Schema of urdfdom), SDF 1.6 to 1.12 and MJCF
(MuJoCo 4.0.0). An item is

* *taken*: the scene contains the item; a file with a value that a scene cannot represent is refused, with the line,
* *noted*: the importer omits the item; a note gives its first line and the number of further lines (no note for 0 or `false`),
* *refused*: the importer refuses the file, and names the line,
* *irrelevant*: the item has no influence on the motion of a scene.

The importers also note elements and attributes that are not in these tables. `<name>` is an element, a name without
brackets an attribute.
"""
TITLES = "| element | taken | noted or refused | irrelevant |\n|---|---|---|---|\n"


def page_text() -> str:
    """The page with a table for each format."""
    return HEAD + "".join(f"\n## {name}\n\n{TITLES}{''.join(_lines(name))}" for name in ("URDF", "SDF", "MJCF"))


def _lines(name: str) -> Iterator[str]:
    """The rows of a format. If all content of an element has the element's fate, the row of the parent lists this element."""
    table = schema(name)

    def line(row: Row, path: str) -> Iterator[str]:
        if _is_uniform(row):
            return
        cells: dict[str, list[str]] = {fate: [] for fate in FATES}
        used = {f"<{n}>": table.margin[n].fate if f == "taken" and n in table.margin else f for n, f in row.uses.items()}
        for item, fate in [*row.attributes.items(), *used.items(), *((f"<{c.tag}>", c.fate) for c in row.children.values())]:
            kind, _, label = fate.partition(":")
            words = table.labels[label].partition(" ; ")[0] if label else ""
            shown = f"{item} ({words})" if words and kind == "noted" else f"{item} (refused)" if kind == "refused" else item
            cells[kind].append(shown)
        remark = f" ({row.remark})" if row.remark else ""
        columns = (cells["taken"], cells["noted"] + cells["refused"], cells["irrelevant"])
        yield f"| `{path}`{remark} | {' | '.join(map(', '.join, columns))} |\n".replace("<", "&lt;")
        for c in row.children.values():
            yield from line(c, f"{path}/{c.tag}")

    for row in table.margin.values():
        yield from line(row, row.tag)


def _is_uniform(row: Row) -> bool:
    """True if an element needs no row: its whole content has the fate of the element, and a taken element has no content."""
    inside = {*row.attributes.values(), *row.uses.values(), *(c.fate for c in row.children.values())}
    same = inside <= {row.fate} and all(_is_uniform(c) for c in row.children.values())
    return same and (row.fate != "taken" or not inside)
