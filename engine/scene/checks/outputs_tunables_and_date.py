"""Checks of the requested outputs, of the tunable numbers, and of the scene's date."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date

from trunnion.basics.name_patterns import MOST_WILD, is_wild
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import Nearest, shown
from trunnion.scene.queries.body_references import GROUND

SECTIONS = ("bodies", "joints", "forces", "gravity", "friction", GROUND)


def check(scene: Scene) -> Iterator[Finding]:
    """All findings about date, outputs and tunable numbers."""
    owners = (*scene.bodies, *scene.joints, *scene.forces, *scene.inputs, GROUND, "time", "energy", "audit", "events")
    if scene.date and not _is_date(scene.date):
        yield Finding(("date",), f"{shown(scene.date)} is not a date", "year, month and day, such as 2026-11-23")
    yield from _patterns(("outputs",), scene.outputs, owners, "nothing has the name")
    yield from _patterns(("tunable",), scene.tunable, SECTIONS, "no part of a scene is called")


def _is_date(text: str) -> bool:
    """Whether a text is a valid date in ISO 8601 form."""
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def _patterns(path: Path, patterns: tuple[str, ...], known: tuple[str, ...], what: str) -> Iterator[Finding]:
    """Findings for patterns whose first word has no wild card and is not in ``known``."""
    names = frozenset(known)
    wild = sum(map(is_wild, patterns))
    if wild > MOST_WILD:
        yield Finding(path, f"{wild} patterns with wild cards; {MOST_WILD} at most", "combine them into fewer patterns with *")
    for i, pattern in enumerate(patterns):
        head = pattern.partition(".")[0].partition("[")[0]
        if head and head not in names and "*" not in head and "?" not in head:
            about = tuple((s, head) for s in ("bodies", "joints", "forces", "inputs"))
            yield Finding((*path, i), f"{what} {shown(head)}", Nearest(head, known), about=about)
