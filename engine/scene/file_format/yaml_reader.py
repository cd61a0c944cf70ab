"""Reader of YAML and JSON text: plain data, and the line of every key and entry. Syntax errors, duplicate keys and excessive
sizes become findings.

The reader uses the YAML parser's event stream instead of its loader. Therefore scalars follow YAML 1.2 and lines are available. The
reader limits nesting and aliases before it builds data.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import field
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.file_format.yaml_events import Unreadable, events
from trunnion.scene.file_format.yaml_scalars import plain, whole_text
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.library.scene_files import LARGEST

DEEPEST = 50
"""Largest number of nesting levels."""
MOST = 200_000
"""Largest number of values in a file, where an alias counts like the value to which it refers."""


@dataclass
class Document:
    """The result of reading. ``data`` holds nested dicts, lists and scalars, or None when there is no usable content. ``lines``
    maps each path to its line, counted from 1. ``places`` maps the path of each scalar to the positions of its first character and
    of its end, quotes included. ``findings`` are the mistakes."""

    data: Any = None
    lines: dict[Path, int] = field(default_factory=dict)
    places: dict[Path, tuple[int, int]] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)


def read(content: bytes | str, is_json: bool = False) -> Document:
    """Read YAML (or JSON) text. Mistakes in the content raise no error; the result lists them in ``findings``."""
    doc = Document()
    try:
        text = _decoded(content)
        if is_json:
            _check_json(text)
            text = text.replace("\t", " ")
        _Builder(doc).build(events(text))
    except Unreadable as e:
        doc.data = None
        doc.findings.append(e.finding)
    return doc


def _decoded(content: bytes | str) -> str:
    if len(content) > LARGEST:
        raise Unreadable(0, f"the file is larger than {LARGEST // 1_000_000} MB", "scenes with thousands of bodies are smaller")
    if isinstance(content, str):
        return content.removeprefix("\ufeff")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as e:
        line = content[: e.start].count(b"\n") + 1
        raise Unreadable(line, "the file is not UTF-8 text", "save it as UTF-8") from e


def _check_json(text: str) -> None:
    depth = 0
    for c in text:  # deep nesting would overflow the recursive decoder; brackets in strings count, too
        depth += (c in "[{") - (c in "]}")
        if depth > 10 * DEEPEST:
            raise Unreadable(0, f"more than {DEEPEST} levels of nesting")
    try:
        json.loads(text, parse_int=float)
    except json.JSONDecodeError as e:
        raise Unreadable(e.lineno, f"not valid JSON: {e.msg.lower()} in column {e.colno}") from e


@dataclass
class _Open:
    """A group or list during reading. ``key`` is the key whose value comes next; ``skipped`` means that this key is a duplicate
    and its value is dropped. ``entries`` counts the group itself and all values in it so far."""

    value: dict[str, Any] | list[Any]
    path: Path
    anchor: str | None
    key: str | None = None
    skipped: bool = False
    entries: int = 1


class _Builder:
    """Builds plain data from the parser's events, without recursion."""

    def __init__(self, doc: Document):
        self.doc = doc
        self.stack: list[_Open] = []
        self.anchors: dict[str, tuple[Any, int]] = {}
        self.count = 0
        self.documents = 0

    def build(self, stream: Iterator[Any]) -> None:
        """Read all events of a stream."""
        for event in stream:
            kind = type(event).__name__
            line = event.start_mark.line + 1
            if kind == "ScalarEvent":
                self.scalar(event, line)
            elif kind in ("MappingStartEvent", "SequenceStartEvent"):
                self.open({} if kind[0] == "M" else [], event, line)
            elif kind in ("MappingEndEvent", "SequenceEndEvent"):
                self.close()
            elif kind == "AliasEvent":
                self.alias(event.anchor, line)
            elif kind == "DocumentStartEvent":
                self.documents += 1
                if self.documents > 1:
                    raise Unreadable(line, "a second document starts here", "one file holds one scene: remove the ---")

    def scalar(self, event: Any, line: int) -> None:
        """Add a scalar: as a key if the innermost group needs a key next, else as a value."""
        self.refuse_tag(event, line)
        text = whole_text(event.value)
        top = self.stack[-1] if self.stack else None
        if top is not None and isinstance(top.value, dict) and top.key is None:
            self.key(top, text, line)
            return
        self.doc.places[self.place(line)] = event.start_mark.index, event.end_mark.index
        self.put(text if event.style else plain(text), 1, line, event.anchor)

    def key(self, top: _Open, text: str, line: int) -> None:
        """Add a key to the innermost group. A duplicate key is a finding, and its value is dropped."""
        top.key, top.skipped = text, text in top.value
        path = (*top.path, text)
        if top.skipped:
            first = self.doc.lines.get(path, 0)
            self.doc.findings.append(Finding(path, f"{shown(text)} is given twice (first in line {first})", "keep one", line))
        else:
            self.doc.lines[path] = line

    def open(self, value: dict[str, Any] | list[Any], event: Any, line: int) -> None:
        """Begin a group or list."""
        self.refuse_tag(event, line)
        if len(self.stack) >= DEEPEST:
            raise Unreadable(line, f"more than {DEEPEST} levels of nesting", "a scene needs no more than ten")
        top = self.stack[-1] if self.stack else None
        if top is not None and isinstance(top.value, dict) and top.key is None:
            raise Unreadable(line, "a list or group cannot be a key", "keys are plain names", top.path)
        path = self.place(line)
        self.stack.append(_Open(value, path, event.anchor))

    def close(self) -> None:
        """End the innermost group or list."""
        done = self.stack.pop()
        self.put(done.value, done.entries, 0, done.anchor)

    def alias(self, name: str, line: int) -> None:
        """Add the value that an alias refers to."""
        top = self.stack[-1] if self.stack else None
        if name not in self.anchors:
            raise Unreadable(line, f"the alias *{name} has no anchor", f"define &{name} before it")
        if top is not None and isinstance(top.value, dict) and top.key is None:
            raise Unreadable(line, "an alias cannot be a key", "write the key itself", top.path)
        value, size = self.anchors[name]
        self.put(value, size, line, None)

    def place(self, line: int) -> Path:
        """The path of the next value; its line is stored."""
        if not self.stack:
            self.doc.lines[()] = line
            return ()
        top = self.stack[-1]
        if isinstance(top.value, dict):
            return (*top.path, top.key or "")
        path = (*top.path, len(top.value))
        self.doc.lines.setdefault(path, line)
        return path

    def put(self, value: Any, size: int, line: int, anchor: str | None) -> None:
        """Add a complete value to its group or list. ``size`` is the number of values in it; ``line`` is 0 if its line is already
        stored."""
        self.count += size if line else 0
        if line:
            self.place(line)
        if anchor:
            self.anchors[anchor] = (value, size)
        top = self.stack[-1] if self.stack else None
        if top is None:
            self.doc.data = value
            return
        top.entries += size
        if self.count > MOST or top.entries > MOST:
            raise Unreadable(line, f"more than {MOST} values; each alias counts with all values that it stands for", "", top.path)
        if isinstance(top.value, list):
            top.value.append(value)
            return
        if not top.skipped:
            top.value[top.key or ""] = value
        top.key = None

    def refuse_tag(self, event: Any, line: int) -> None:
        """Refuse explicit tags (!!str, !python/…), which scenes do not use."""
        if event.tag is not None:
            raise Unreadable(line, f"the tag {shown(str(event.tag))} is not used in scenes", "remove the tag; put text in quotes")
