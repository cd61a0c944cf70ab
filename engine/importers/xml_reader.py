"""XML reader that records file and line of each element. The reader is safe against malicious files. The reader refuses document
type definitions, so that a file has no entities. The reader limits the numbers of bytes, elements and levels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from pathlib import Path
from xml.parsers import expat

from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.lazy_data_classes import dataclass

LARGEST = 20_000_000
"""Largest size of a file in bytes."""
MOST = 400_000
"""Largest number of elements in a file."""
HUGE = 1e30
"""Largest magnitude of a number. The limit keeps products finite."""
DEEPEST = 300
"""Largest nesting depth of elements."""


@dataclass
class Element:
    """An XML element with attributes, stripped text, children, file and line."""

    tag: str
    attributes: dict[str, str]
    file: str = ""
    line: int = 0
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def get(self, name: str, default: str = "") -> str:
        """The text of an attribute, or ``default``."""
        return self.attributes.get(name, default)

    def all(self, *tags: str) -> list[Element]:
        """Children with one of these tags."""
        return [c for c in self.children if c.tag in tags]

    def first(self, tag: str) -> Element | None:
        """The first child with this tag."""
        return next((c for c in self.children if c.tag == tag), None)

    def within(self, tag: str) -> list[Element]:
        """The children of the first child with this tag; empty if there is no such child."""
        e = self.first(tag)
        return [] if e is None else e.children

    def text_of(self, tag: str) -> str:
        """The text of the first child with this tag; "" if there is no such child."""
        e = self.first(tag)
        return "" if e is None else e.text

    @property
    def title(self) -> str:
        """The text that names the element in messages: its name, or its tag and line."""
        return self.get("name") or f"{self.tag} at line {self.line}"

    def inside(self) -> Iterator[Element]:
        """This element and all elements inside it."""
        yield self
        for c in self.children:
            yield from c.inside()

    def is_off(self) -> bool:
        """Whether an element has no attributes and contains only zeros or "false"."""
        return not self.attributes and is_zero(" ".join(x.text for x in self.inside()))


class Findings:
    """Collected problems and notes of an import."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []
        self.notes: list[str] = []

    def add(self, at: Element, where: str, what: str, hint: str = "") -> None:
        """Add a problem at an element's file and line."""
        self.problems.append(Problem(where, what, hint, at.file, at.line))

    def end(self) -> None:
        """Raise SceneError if there are problems."""
        raise_problems(self.problems)

    def numbers(self, at: Element, name: str, given: str, counts: Sequence[int]) -> list[float] | None:
        """The numbers in the text ``given``, whose count must be in ``counts``. For other text, the result is None and a problem is
        added."""
        try:
            found = [float(x) for x in given.split()]
        except ValueError:
            found = []
        if len(found) in counts and not all(abs(x) <= HUGE for x in found):
            self.add(at, f"{at.tag}.{name}", f"{given[:60]!r}: above {HUGE:g}, or not a number", "no mechanism has such numbers")
            return None
        if len(found) not in counts:
            wanted = " or ".join(map(str, counts)) + (" numbers are" if tuple(counts) != (1,) else " number is")
            self.add(at, f"{at.tag}.{name}", f"{given[:60]!r}: {wanted} expected")
            return None
        return found

    def number(self, at: Element, name: str, given: str | None, default: float) -> float:
        """The number in the text ``given``, or ``default`` if ``given`` is None or invalid."""
        found = self.numbers(at, name, given, (1,)) if given is not None else None
        return default if found is None else found[0]

    def attribute(self, at: Element, name: str, default: float = 0.0) -> float:
        """The number of an attribute, or ``default``."""
        return self.number(at, name, at.attributes.get(name), default)

    def child(self, parent: Element | None, tag: str, default: float) -> float:
        """The number in the text of a child, or ``default``."""
        e = parent.first(tag) if parent is not None else None
        return default if e is None else self.number(e, "text", e.text, default)


def is_zero(text: str) -> bool:
    """Whether a text contains only zeros or "false"."""
    words = text.split()
    return bool(words) and all(w == "false" or not w.strip("0.+-") for w in words)


def existing(file: str | Path) -> Path:
    """The path of a file. SceneError if there is no such file."""
    if not Path(file).is_file():
        raise SceneError([Problem(str(file), "there is no such file")])
    return Path(file)


def is_file(path: Path) -> bool:
    """Whether the file exists. False also for an invalid name."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


class _TreeBuilder:
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
        raise self.refuse("the file declares a document type, and entities are not read", "remove the line with <!DOCTYPE")


def read_xml(path: Path, shown: str = "") -> Element:
    """The root element of a file. SceneError if the file cannot be read. ``shown`` is the name of the file in messages."""
    name = shown or str(path)
    try:
        with path.open("rb") as f:
            content = f.read(LARGEST + 1)
    except (OSError, ValueError) as e:
        raise SceneError([Problem(name, f"cannot be read: {getattr(e, 'strerror', None) or e}")]) from e
    if len(content) > LARGEST:
        raise SceneError([Problem(name, f"is larger than {LARGEST // 1_000_000} MB", "files of mechanisms are smaller")])
    builder = _TreeBuilder(name)
    try:
        builder.parser.Parse(content, True)
    except expat.ExpatError as e:
        what = f"not well-formed XML: {expat.ErrorString(e.code)}"
        raise SceneError([Problem("file", what, "", name, e.lineno)]) from e
    return builder.open[0].children[0]


def read_root(path: Path, tag: str, hint: str) -> tuple[Element, Findings]:
    """The root element of an XML file, and new findings. SceneError if the root element has another tag."""
    root, found = read_xml(path), Findings()
    if root.tag != tag:
        found.add(root, root.tag, f"the root element is not <{tag}>", hint)
        found.end()
    return root, found
