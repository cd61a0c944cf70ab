"""The blocks that a page prints for its reader to run, in their order on the page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

FENCED = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?<=\n\n)((?:    (?:trunnion|python3?|pip) .*\n)+)")
INSTALL = re.compile(r"`((?:\.venv/bin/)?pip\s+install\s[^`]*(?:\.|trunnion)\[(?!bench)\w+\][^`]*)`")
"""A sentence that installs this project with an extra. The extra ``bench`` is left out: it installs other programs for comparison,
which pages do not need."""
KINDS = ("bash", "python", "yaml", "bat")
SHOWN = "text"
"""Blocks of this kind are read, not run."""
PLAIN = (".git", ".venv", "__pycache__")


@dataclass(frozen=True)
class Step:
    """A step to run. kind: one of ``KINDS``; line: its place on the page; text: as printed."""

    kind: str
    line: int
    text: str


def steps(page: Path) -> list[Step]:
    """Fenced blocks, indented commands, and installation commands inside sentences."""
    text = page.read_text(encoding="utf-8")
    found = [Step(m[1], text.count("\n", 0, m.start()) + 2, m[2]) for m in FENCED.finditer(text) if m[1] != SHOWN]
    prose = FENCED.sub(lambda m: "\n" * m.group().count("\n"), text)
    for pattern in (INDENTED, INSTALL):
        for m in pattern.finditer(prose):
            lines = [x.strip() for x in m[1].splitlines()] if pattern is INDENTED else [" ".join(m[1].split())]
            found.append(Step("bash", prose.count("\n", 0, m.start()) + 1, "\n".join(lines) + "\n"))
    unknown = {s.kind for s in found} - set(KINDS)
    assert not unknown, f"{page}: nobody runs blocks of {unknown}"
    return sorted(found, key=lambda s: s.line)


def pages(root: Path) -> Iterator[Path]:
    """Every page of the checkout with steps to run."""
    for page in sorted(root.rglob("*.md")):
        hidden = any(part.startswith(".") or part in PLAIN for part in page.relative_to(root).parts)
        if not hidden and steps(page):
            yield page
