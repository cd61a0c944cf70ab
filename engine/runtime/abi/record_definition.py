"""Declarations that C and Python share: enumerations and records, with their C text and Python readers.

A record's fields are written once, one per line, as ``C declaration : meaning``. The C struct, the ``ctypes`` structure, the NumPy
type and the checks of names are derived from these lines.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterable
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from trunnion.basics.lazy_data_classes import dataclass

if TYPE_CHECKING:
    import numpy as np

PLAIN: dict[str, Any] = {"int": ctypes.c_int, "long": ctypes.c_long, "size_t": ctypes.c_size_t, "double": ctypes.c_double}
NUMPY = {"int": "intc", "double": "float64"}
KNOWN: dict[str, Record] = {}
"""Records by C name. Fields of other records refer to these names."""


class Named(IntEnum):
    """An enumeration whose members have meanings: ``MEMBER = number, "meaning"``. The names of its members in C begin with
    ``prefix``."""

    about: str
    prefix: ClassVar[str]

    def __init_subclass__(cls, prefix: str = "TR_", **more: Any) -> None:
        super().__init_subclass__(**more)
        cls.prefix = prefix

    def __new__(cls, number: int, about: str = "") -> Named:
        member = int.__new__(cls, number)
        member._value_ = number
        member.about = about
        return member

    @classmethod
    def c_text(cls) -> str:
        """The C definition of the enumeration."""
        named = cls.__members__.items()  # aliases included
        lines = [f"  {cls.prefix}{name} = {m.value}," + (f" /* {m.about} */" if m.about else "") for name, m in named]
        return "\n".join([f"/* {one_line(cls.__doc__)} */", "enum {", *lines, "};\n"])


@dataclass(frozen=True)
class Field:
    """A field of a record: C declaration, name, base type ("*" for a pointer), number of entries, meaning."""

    declaration: str
    name: str
    base: str
    count: int
    about: str


class Record:
    """A C struct, declared in C text and read in Python. tag: its name; about: its meaning; lines: its fields, one per line."""

    def __init__(self, tag: str, about: str, lines: str):
        self.tag, self.about = tag, one_line(about)
        self.fields = tuple(_field(line) for line in lines.strip().splitlines())
        self.names = tuple(f.name for f in self.fields)
        KNOWN[tag] = self

    @cached_property
    def ctype(self) -> Any:
        """The ``ctypes`` structure with these fields."""
        places = [(f.name, _ctype(f)) for f in self.fields]
        return type(self.tag, (ctypes.Structure,), {"_fields_": places})

    @cached_property
    def dtype(self) -> np.dtype:
        """The NumPy type of the record, which must not have pointers."""
        import numpy as np

        places: list[Any] = []
        for f in self.fields:
            base: Any = KNOWN[f.base].dtype if f.base in KNOWN else NUMPY[f.base]
            places.append((f.name, base, (f.count,)) if f.count > 1 else (f.name, base))
        return np.dtype(places, align=True)

    @property
    def numbers(self) -> int:
        """Number of doubles of the record, which must contain only doubles."""
        return self.dtype.itemsize // 8

    def at(self, name: str) -> int:
        """Index of a field's first double in the record, which must contain only doubles."""
        found = self.dtype.fields
        assert found is not None
        return found[name][1] // 8

    @property
    def integers(self) -> tuple[str, ...]:
        """Names of those fields that are single integers."""
        return tuple(f.name for f in self.fields if f.base == "int" and "*" not in f.declaration)

    def c_text(self) -> str:
        """The C definition of the struct."""
        lines = [f"  {f.declaration};" + (f" /* {f.about} */" if f.about else "") for f in self.fields]
        return "\n".join([f"/* {self.about} */", f"typedef struct {self.tag} {{", *lines, f"}} {self.tag};\n"])

    def row(self, **values: Any) -> tuple[Any, ...]:
        """The values of all fields in the order of the record. Raises TypeError unless ``values`` names exactly the fields."""
        if values.keys() != set(self.names):
            raise TypeError(f"{self.tag}: fields that do not match: {', '.join(sorted(set(values) ^ set(self.names)))}")
        return tuple(map(values.__getitem__, self.names))

    def doubles(self, **values: Any) -> list[float]:
        """The values of all fields in order, as doubles. The record must contain only doubles."""
        row = self.row(**values)
        return [float(x) for value in row for x in (value if isinstance(value, tuple) else (value,))]

    def initialiser(self, name: str, **values: Any) -> str:
        """C definition of a constant ``name`` of this struct, with an initialiser for every named field."""
        self.row(**values)
        return f"const {self.tag} {name}={{{','.join(f'.{n}={values[n]}' for n in self.names)}}};\n"

    def table(self, name: str, rows: Iterable[tuple[Any, ...]]) -> str:
        """C definition of a constant array of records. If ``rows`` is empty, the array has one zero record, because C allows no
        empty array."""
        body = ",".join("{" + ",".join(map(str, r)) + "}" for r in rows) or "{0}"
        return f"static const {self.tag} {name}[]={{{body}}};\n"


def _field(line: str) -> Field:
    """The Field declared by a line such as ``const double *p : meaning``."""
    declaration, _, about = line.partition(" : ")
    declaration = declaration.strip()
    if "(*" in declaration:
        pointer = re.search(r"\(\*+(\w+)\)", declaration)
        assert pointer, line
        return Field(declaration, pointer.group(1), "*", 1, about.strip())
    base, _, last = declaration.rpartition(" ")
    name, _, count = last.lstrip("*").removesuffix("]").partition("[")
    assert name.isidentifier(), line
    assert base, line
    return Field(declaration, name, "*" if "*" in declaration else base, int(count or 1), about.strip())


def _ctype(f: Field) -> Any:
    base = ctypes.c_void_p if f.base == "*" else KNOWN[f.base].ctype if f.base in KNOWN else PLAIN[f.base]
    return base * f.count if f.count > 1 else base


def one_line(text: str | None) -> str:
    """The words of a docstring on one line."""
    return " ".join((text or "").split())
