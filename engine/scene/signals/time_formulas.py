"""Formulas of the time t: separation of the constant parts from the parts that depend on t, and derivatives by time.

The constant parts of a formula become numbers of the scene, in the order in which they are written. The rest of the formula is a
tree of tuples: ("time",), ("number", index), or the name of an operation with its operands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeVar

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.scene.expressions.formula_parser import TIME, Call, Name, Node, Number, has_names, nodes, parse_formula
from trunnion.scene.expressions.formula_values_and_dimensions import LARGEST_POWER, value
from trunnion.scene.units.dimension_names import unit_of
from trunnion.scene.units.unit_parser import NONE, UnitError

Tree = tuple[Any, ...]
T = TypeVar("T")
KINKS = ("abs", "min", "max")
PERIODIC = ("sin", "cos")
OPERATIONS = ("+", "-", "*", "/", "neg", "square", "inverse", *PERIODIC, "exp", "log", "tanh", "atan", "sqrt")
"""The operations of a tree."""


@lru_cache(maxsize=256)  # users write the formulas, so the cache is bounded
def separate(formula: str) -> tuple[Tree, tuple[str, ...]]:
    """The tree of a formula, and its constant parts as expressions in braces. Raises UnitError in two cases: the formula cannot be
    read, or a part that depends on time is not a smooth function that the step control can follow."""
    numbers: list[Node] = []
    tree = _separate(parse_formula(formula, timed=True).root, numbers)
    if not any(part == ("time",) for part in parts(tree)):
        raise UnitError("this formula does not depend on the time t", "write a plain number or an expression in braces")
    return tree, tuple("{" + text_of(n) + "}" for n in numbers)


def parts(tree: Tree) -> Iterator[Tree]:
    """The tree and all trees inside it."""
    yield tree
    for inner in tree[1:]:
        if isinstance(inner, tuple):
            yield from parts(inner)


def computed(tree: Tree, number: Callable[[int], T], variable: Callable[..., T], operation: Callable[..., T]) -> T:
    """The result of a tree. Three functions give the results of nodes. number: result of a number, from its index. variable: result
    of the time, or of a coordinate from its index. operation: result of an operation, from its name and the results of its
    operands."""
    if tree[0] == "number":
        return number(tree[1])
    if tree[0] in ("time", "place"):
        return variable(*tree[1:])
    return operation(tree[0], *(computed(inner, number, variable, operation) for inner in tree[1:]))


def rates_of_angles(tree: Tree) -> Iterator[int]:
    """For each sine and cosine: index of the number that is the rate of its angle."""
    for part in parts(tree):
        if part[0] in PERIODIC:
            angle = part[1]
            yield (angle if angle[0] == "*" else angle[1])[1][1]


def _depends_on_time(node: Node) -> bool:
    return Name(TIME) in nodes(node)


def _separate(node: Node, numbers: list[Node]) -> Tree:
    if not _depends_on_time(node):
        numbers.append(node)
        return "number", len(numbers) - 1
    if not isinstance(node, Call):
        return ("time",)
    if node.function == "^":
        return power(node, "time", lambda base: _separate(base, numbers))
    if node.function in PERIODIC:
        return _periodic(node, numbers)
    if node.function in KINKS:
        what = f"{node.function} of the time has a kink, which the step control would not find"
        raise UnitError(what, "write the signal as a ramp, trapezoid or table, or limit a signal")
    if node.function not in OPERATIONS:
        smooth = ", ".join(f for f in OPERATIONS if f.isalpha() and f not in ("neg", "square", "inverse"))
        raise UnitError(f"{node.function} of the time is not allowed", f"functions of the time: {smooth}")
    return node.function, *(_separate(a, numbers) for a in node.arguments)


def power(node: Call, variable: str, separated: Callable[[Node], Tree]) -> Tree:
    """A whole-number power of a part that depends on a variable, as products. separated: function that makes the tree of the
    base."""
    base, exponent = node.arguments
    try:
        n = value(exponent, {})
    except KeyError:
        n = math.nan
    if not float(n).is_integer():
        what = f"a power that depends on the {variable} must have a whole number as exponent"
        raise UnitError(what, "for other exponents, write exp or sqrt")
    if not 1 <= abs(n) <= LARGEST_POWER:
        raise UnitError(f"the exponent of the {variable} must be a whole number from 1 to {LARGEST_POWER}, or its negative")
    of = separated(base)
    out = of
    for digit in bin(int(abs(n)))[3:]:
        out = ("square", out)
        out = ("*", out, of) if digit == "1" else out
    return out if n > 0 else ("inverse", out)


def _periodic(node: Call, numbers: list[Node]) -> Tree:
    """A sine or cosine, whose angle must be a rate times t, plus a constant."""
    found = _linear(node.arguments[0])
    if found is None:
        what = f"the angle of {node.function} must be linear in t: the step control needs a fixed frequency"
        raise UnitError(what, f"such as {node.function}(2*pi*3 Hz*t + 30 deg), or a table")
    rate, phase = found
    numbers.append(rate if rate is not None else Number(0.0))
    angle: Tree = ("*", ("number", len(numbers) - 1), ("time",))
    if phase is not None:
        numbers.append(phase)
        angle = "+", angle, ("number", len(numbers) - 1)
    return node.function, angle


def _linear(node: Node) -> tuple[Node | None, Node | None] | None:
    """(a, b) of a·t + b, where None stands for 0; None if the node is not linear in t."""
    if not _depends_on_time(node):
        return None, node
    if not isinstance(node, Call):
        return Number(1.0), None
    if node.function not in ("+", "-", "*", "/", "neg"):
        return None
    given = [_linear(a) for a in node.arguments]
    if any(g is None for g in given):
        return None
    (a, b), *others = [g for g in given if g is not None]
    if node.function == "neg":
        return _neg(a), _neg(b)
    (c, d) = others[0]
    if node.function in ("+", "-"):
        return _sum(node.function, a, c), _sum(node.function, b, d)
    if node.function == "/" and c is None and d is not None:
        return (None if a is None else Call("/", (a, d))), (None if b is None else Call("/", (b, d)))
    if node.function == "*" and (a is None or c is None):
        (a, b), factor = ((c, d), b) if a is None else ((a, b), d)
        if factor is None:
            return None
        return tuple(None if x is None else Call("*", (factor, x)) for x in (a, b))  # type: ignore[return-value]
    return None


def _neg(node: Node | None) -> Node | None:
    return None if node is None else Call("neg", (node,))


def _sum(sign: str, a: Node | None, b: Node | None) -> Node | None:
    if b is None:
        return a
    if a is None:
        return b if sign == "+" else _neg(b)
    return Call(sign, (a, b))


_BINDS = {"+": 1, "-": 1, "*": 2, "/": 2, "neg": 3, "^": 4}


def text_of(node: Node) -> str:
    """A node without variables as text, with numbers in SI units."""
    if isinstance(node, Number):
        unit = unit_of(node.dimension)
        return f"{node.value!r} {unit}" if unit else f"{node.value!r}" if node.dimension == NONE else f"{node.value!r} SI"
    if isinstance(node, Name):
        return node.name
    own = _BINDS.get(node.function)
    if own is None:
        return f"{node.function}({', '.join(map(text_of, node.arguments))})"
    if node.function == "neg":
        return f"-{_operand(node.arguments[0], own)}"
    first, second = node.arguments
    strict = node.function == "^"
    exponent = f"{value(second, {})!r}" if strict and not has_names(second) else _operand(second, own + 1)
    base = f"({text_of(first)})" if strict else _operand(first, own)
    return f"{base}{node.function}{exponent}"


def _operand(node: Node, least: int) -> str:
    binds = _BINDS.get(node.function, 5) if isinstance(node, Call) else 5
    return text_of(node) if binds >= least else f"({text_of(node)})"


def operate(operation: str, *given: Sequence[SX]) -> list[SX]:
    """The result of an operation. Each operand, and the result, is a list of the value or, in drives, of the value and its first
    two derivatives by time."""
    order, a = len(given[0]), given[0]
    if operation in ("+", "-", "neg"):
        sign = -1 if operation != "+" else 1
        return [sign * x for x in a] if operation == "neg" else [x + sign * y for x, y in zip(*given, strict=True)]
    if operation in ("*", "square"):
        b = given[-1]
        return [a[0] * b[0], *([a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]] if order > 1 else [])]
    if operation == "/":
        b, q = given[1], a[0] / given[1][0]
        if order == 1:
            return [q]
        first = (a[1] - q * b[1]) / b[0]
        return [q, first, (a[2] - q * b[2] - 2 * first * b[1]) / b[0]]
    of, first, second = _FUNCTIONS[operation](a[0])
    return [of, *([first * a[1], second * a[1] * a[1] + first * a[2]] if order > 1 else [])]


_FUNCTIONS: Mapping[str, Callable[[SX], tuple[SX, SX, SX]]] = {
    "sin": lambda x: (ca.sin(x), ca.cos(x), -ca.sin(x)),
    "cos": lambda x: (ca.cos(x), -ca.sin(x), -ca.cos(x)),
    "exp": lambda x: (ca.exp(x), ca.exp(x), ca.exp(x)),
    "log": lambda x: (ca.log(x), 1 / x, -1 / (x * x)),
    "tanh": lambda x: (ca.tanh(x), 1 - ca.tanh(x) ** 2, -2 * ca.tanh(x) * (1 - ca.tanh(x) ** 2)),
    "atan": lambda x: (ca.atan(x), 1 / (1 + x * x), -2 * x / (1 + x * x) ** 2),
    "sqrt": lambda x: (ca.sqrt(x), 1 / (2 * ca.sqrt(x)), -1 / (4 * x * ca.sqrt(x))),
    "inverse": lambda x: (1 / x, -1 / (x * x), 2 / (x * x * x)),
}
"""Value, first and second derivative of each function of one operand."""
