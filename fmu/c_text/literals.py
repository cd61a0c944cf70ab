"""C literals of numbers and texts."""

from __future__ import annotations

import math
from collections.abc import Iterable


def number(x: float) -> str:
    """A C literal that has exactly the value of the double x."""
    return repr(float(x)) if math.isfinite(x) else "INFINITY" if x > 0 else "-INFINITY"


def string(text: str) -> str:
    """The text as a C string literal, in which line breaks become spaces."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
    return f'"{escaped}"'


def strings(name: str, values: Iterable[str]) -> str:
    """A constant C array of strings. Without values, the array holds one empty string, because C has no empty arrays."""
    return f"static const char *const {name}[]={{{','.join(map(string, values)) or string('')}}};\n"


def doubles(name: str, values: Iterable[float]) -> str:
    """A constant C array of doubles. Without values, the array holds one zero, because C has no empty arrays."""
    return f"static const double {name}[]={{{','.join(map(number, values)) or '0'}}};\n"


def integers(name: str, values: Iterable[int]) -> str:
    """A constant C array of integers. Without values, the array holds one zero, because C has no empty arrays."""
    return f"static const int {name}[]={{{','.join(map(str, values)) or '0'}}};\n"
