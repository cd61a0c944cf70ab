"""Reference numbers of a bundled model (reference.yaml): required values of a result's column, or of an expression of columns."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Any

from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.findings.findings_and_paths import Finding, error_of
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.library.model_folders import model_folder

FILE = "reference.yaml"
FUNCTIONS: dict[str, Callable[..., float]] = {
    "atan2": math.atan2,
    "degrees": math.degrees,
    "hypot": math.hypot,
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
}
_OPERATIONS: dict[type, Callable[[float, float], float]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
}


@dataclass(frozen=True)
class Expected:
    """One reference number.

    expect, tolerance  the number and the largest difference allowed, in the unit of the value.
    origin             source of the number: PUB published, REF computed independently, EXACT closed form.
    at, value          time (s) and a column name or an expression of columns; without them see ``compute``.
    compute            a measure in words, if columns do not hold the quantity at one time.
    set                changes to the scene for this number (as for ``overrides.apply``).
    note               what the number means.
    """

    expect: float
    tolerance: float
    origin: str
    at: float | None = None
    value: str = ""
    compute: str = ""
    set: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""


@cache
def expected(model: str) -> list[Expected]:
    """The reference numbers of a bundled model or design; an empty list without a reference file."""
    file = model_folder(model) / FILE
    return load_expected(file) if file.is_file() else []


def load_expected(file: Path) -> list[Expected]:
    """The reference numbers in a file; SceneError with the line of every invalid entry."""
    doc = read(file.read_bytes())
    known, out = {f.name for f in fields(Expected)}, []
    wrong = list(doc.findings)
    for i, entry in enumerate(doc.data if isinstance(doc.data, list) else ()):
        keys = set(entry) if isinstance(entry, dict) else set()
        if not {"expect", "tolerance", "origin"} <= keys <= known or ("compute" in keys) == ({"at", "value"} <= keys):
            wrong.append(Finding((i,), "not a reference number", f"keys: {', '.join(sorted(known))}"))
        else:
            out.append(Expected(**entry))
    if wrong:
        raise error_of(wrong, doc.lines, str(file))
    return out


def columns_of(expression: str) -> list[str]:
    """The names of the columns that an expression uses, in their order in the expression."""
    names: list[str] = []

    def noted(name: str) -> float:
        names.append(name)
        return 1.0

    evaluate(expression, noted)
    return names


def evaluate(expression: str, column: Callable[[str], float]) -> float:
    """Value of an expression, in which ``column`` gives the value of a column. ValueError if the text is not an expression of
    columns."""
    try:
        tree = ast.parse(expression, mode="eval")
    except SyntaxError as e:
        raise ValueError(f"{shown(expression)} is not an expression of columns") from e
    return _value(tree.body, column)


def _value(node: ast.expr, column: Callable[[str], float]) -> float:
    """Value of a part of an expression. A part may contain only sums, products, a few functions, numbers and columns."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.UnaryOp(op=ast.USub()):
            return -_value(node.operand, column)
        case ast.BinOp() if type(node.op) in _OPERATIONS:
            return _OPERATIONS[type(node.op)](_value(node.left, column), _value(node.right, column))
        case ast.Call(func=ast.Name(id=name)) if name in FUNCTIONS and not node.keywords:
            return FUNCTIONS[name](*(_value(a, column) for a in node.args))
        case ast.Attribute() | ast.Subscript() | ast.Name():
            return column(_name(node))
    raise ValueError(f"{shown(ast.unparse(node))} is not an expression of columns")


def _name(node: ast.expr) -> str:
    """The name of a column as written, for example body.point.position[1]."""
    match node:
        case ast.Name():
            return node.id
        case ast.Attribute():
            return f"{_name(node.value)}.{node.attr}"
        case ast.Subscript(slice=ast.Constant(value=int(index))):
            return f"{_name(node.value)}[{index}]"
    raise ValueError(f"{shown(ast.unparse(node))} is not a column")
