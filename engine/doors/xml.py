"""XML of other programs: elements that know their file and line. A file can do no more than be read: no document types, so no
entities, and no more bytes, elements and levels than a mechanism has."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from engine.basics.problems import Problem, SceneError

LARGEST = 20_000_000
"""Bytes in a file, at most."""
MOST = 400_000
"""Elements in a file, at most."""
HUGE = 1e30
"""Numbers are less: what is computed from them then has room."""
DEEPEST = 300
"""Levels of elements, at most."""


@dataclass
class Element:
    """An element: its attributes, its text without the space around it, the elements in it, and where it stands."""

    tag: str
    attributes: dict[str, str]
    file: str = ""
    line: int = 0
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def get(self, name: str, default: str = "") -> str:
        """An attribute."""
        return self.attributes.get(name, default)

    def all(self, *tags: str) -> list[Element]:
        """Elements in it with one of these tags."""
        return [c for c in self.children if c.tag in tags]

    def first(self, tag: str) -> Element | None:
        """The first element in it with this tag."""
        return next((c for c in self.children if c.tag == tag), None)

    def inside(self) -> Iterator[Element]:
        """It and all elements in it, at every level."""
        yield self
        for c in self.children:
            yield from c.inside()


class Findings:
    """Problems, collected, so that all are told at once, and notes on what was left out."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []
        self.notes: list[str] = []

    def add(self, at: Element, where: str, what: str, hint: str = "") -> None:
        """One more, of what an element says."""
        self.problems.append(Problem(where, what, hint, at.file, at.line))

    def end(self) -> None:
        """SceneError if there are any."""
        if self.problems:
            raise SceneError(self.problems)

    def numbers(self, at: Element, name: str, given: str, counts: Sequence[int]) -> list[float] | None:
        """The numbers an attribute or a text consists of; None, and a problem, where it is something else."""
        try:
            found = [float(x) for x in given.split()]
        except ValueError:
            found = []
        if len(found) in counts and not all(abs(x) <= HUGE for x in found):
            self.add(at, f"{at.tag}.{name}", f"{given[:60]!r}: beyond {HUGE:g}, or no number", "no mechanism has such numbers")
            return None
        if len(found) not in counts:
            wanted = " or ".join(map(str, counts)) + (" numbers are" if tuple(counts) != (1,) else " number is")
            self.add(at, f"{at.tag}.{name}", f"{given[:60]!r}: {wanted} wanted")
            return None
        return found

    def number(self, at: Element, name: str, given: str | None, default: float) -> float:
        """A number, or what stands for it where there is none."""
        found = self.numbers(at, name, given, (1,)) if given is not None else None
        return default if found is None else found[0]


def is_file(path: Path) -> bool:
    """Whether there is such a file; there is none of a name that no file system takes."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


class _Builder:
    def __init__(self, file: str):
        self.file, self.open, self.count = file, [Element("", {})], 0
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.close
        self.parser.CharacterDataHandler = self.said
        self.parser.StartDoctypeDeclHandler = self.typed

    def refuse(self, what: str, hint: str = "") -> SceneError:
        return SceneError([Problem("file", what, hint, self.file, self.parser.CurrentLineNumber)])

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if self.count > MOST or len(self.open) > DEEPEST:
            raise self.refuse(f"more than {MOST} elements" if self.count > MOST else f"more than {DEEPEST} levels of elements")
        e = Element(tag, attributes, self.file, self.parser.CurrentLineNumber)
        self.open[-1].children.append(e)
        self.open.append(e)

    def close(self, tag: str) -> None:
        e = self.open.pop()
        e.text = e.text.strip()

    def said(self, text: str) -> None:
        self.open[-1].text += text

    def typed(self, *_: object) -> None:
        raise self.refuse("it declares a document type, whose entities are not read", "remove the line with <!DOCTYPE")


def read_xml(path: Path, shown: str = "") -> Element:
    """The root element of a file. SceneError for one that cannot be read. shown: what the file is called in messages."""
    name = shown or str(path)
    try:
        with path.open("rb") as f:
            content = f.read(LARGEST + 1)
    except (OSError, ValueError) as e:
        raise SceneError([Problem(name, f"cannot be read: {getattr(e, 'strerror', None) or e}")]) from e
    if len(content) > LARGEST:
        raise SceneError([Problem(name, f"is larger than {LARGEST // 1_000_000} MB", "a mechanism takes less")])
    builder = _Builder(name)
    try:
        builder.parser.Parse(content, True)
    except expat.ExpatError as e:
        what = f"not well-formed XML: {expat.ErrorString(e.code)}"
        raise SceneError([Problem("file", what, "", name, e.lineno)]) from e
    return builder.open[0].children[0]
