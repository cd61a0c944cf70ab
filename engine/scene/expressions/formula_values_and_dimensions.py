"""Evaluation of an expression tree: its dimension, its value, and its exact derivatives with respect to the parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction

from trunnion.scene.expressions.formula_parser import WHATEVER, Call, Name, Node, Number, has_names
from trunnion.scene.units.dimension_names import described
from trunnion.scene.units.unit_parser import NONE, Dimension, UnitError

ANGLE: Dimension = (0, 0, 0, 1, 0)
INVERSE = ("asin", "acos", "atan")
LARGEST_POWER = 20
"""Largest magnitude of an exponent whose base has a unit."""
Gradient = dict[str, float]
"""{parameter: derivative with respect to this parameter}; a missing parameter has the derivative zero."""


def dimension(node: Node, known: Mapping[str, Dimension]) -> Dimension:
    """Dimension of an expression; ``known`` holds the dimensions of its parameters. Raises UnitError when operands do not fit."""
    if isinstance(node, Number):
        return node.dimension
    if isinstance(node, Name):
        return known[node.name]
    given = [dimension(a, known) for a in node.arguments]
    if WHATEVER in given:
        if node.function not in ("+", "-", "min", "max"):
            return _OF_WHATEVER.get(node.function, WHATEVER)
        given = [d for d in given if d != WHATEVER] or [WHATEVER]
    return _RULES[node.function](node, given)


def _same(node: Call, given: list[Dimension]) -> Dimension:
    """Dimension of +, -, min and max: all operands must have this dimension. A radian may be missing in an operand with other
    units."""
    out = given[0]
    for d in given[1:]:
        if d == out:
            continue
        if (*d[:3], d[4]) != (*out[:3], out[4]) or (*d[:3], d[4]) == (0, 0, 0, 0):
            word = {"+": "added to", "-": "subtracted from"}.get(node.function, "compared with")
            first, second = (out, d) if word != "subtracted from" else (d, out)
            hint = "write units with the numbers, such as 5 mm"
            raise UnitError(f"{described(first)} cannot be {word} {described(second)}", hint)
        out = (*out[:3], 0, out[4])
    return out


def _product(node: Call, given: list[Dimension]) -> Dimension:
    sign = 1 if node.function == "*" else -1
    a, b, c, d, e = (x + sign * y for x, y in zip(*given, strict=True))
    return a, b, c, d, e


def _power(node: Call, given: list[Dimension]) -> Dimension:
    base, exponent = given
    if exponent != NONE:
        raise UnitError(f"an exponent is a plain number, not {described(exponent)}")
    if base == NONE:
        return NONE
    if has_names(node.arguments[1]):
        raise UnitError("the exponent of something with a unit cannot depend on a parameter", "write the exponent as a number")
    power = Fraction(value(node.arguments[1], {})).limit_denominator(12)
    if abs(power) > LARGEST_POWER or not math.isclose(power, value(node.arguments[1], {}), rel_tol=1e-12):
        raise UnitError("this exponent is not supported for a base with a unit", "use a small whole number or a simple ratio")
    return _scaled(base, power)


def _scaled(d: Dimension, power: Fraction) -> Dimension:
    a, b, c, e, f = (int(p) if (p := x * power).denominator == 1 else p for x in d)
    return a, b, c, e, f  # type: ignore[return-value]


def _of_angle(node: Call, given: list[Dimension]) -> Dimension:
    if given[0] not in (ANGLE, NONE):
        raise UnitError(f"{node.function} needs an angle, not {described(given[0])}", f"such as {node.function}(30 deg)")
    return NONE


def _of_ratio(node: Call, given: list[Dimension]) -> Dimension:
    if given[0] != NONE:
        raise UnitError(f"{node.function} needs a plain number, not {described(given[0])}", f"such as {node.function}(a/b)")
    return ANGLE if node.function in INVERSE else NONE


def _atan2(node: Call, given: list[Dimension]) -> Dimension:
    _same(node, given)
    return ANGLE


_RULES: dict[str, Callable[[Call, list[Dimension]], Dimension]] = {
    "+": _same, "-": _same, "min": _same, "max": _same, "*": _product, "/": _product, "^": _power, "neg": _same, "abs": _same,
    "sqrt": lambda node, given: _scaled(given[0], Fraction(1, 2)), "atan2": _atan2,
    **dict.fromkeys(("sin", "cos", "tan"), _of_angle), **dict.fromkeys((*INVERSE, "exp", "log", "tanh"), _of_ratio),
}  # fmt: skip

_OF_WHATEVER = {
    **dict.fromkeys(("sin", "cos", "tan", "exp", "log", "tanh"), NONE), **dict.fromkeys((*INVERSE, "atan2"), ANGLE),
}
"""Dimension of a function whose argument is marked "SI". For a function that is not listed here, the result is marked "SI" too
(``WHATEVER``)."""


def value(node: Node, known: Mapping[str, float]) -> float:
    """SI value of an expression. Raises UnitError when the value is undefined: a division by zero, the square root of a negative
    number."""
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Name):
        return known[node.name]
    return _found(node.function, [value(a, known) for a in node.arguments])


def _found(function: str, given: list[float]) -> float:
    try:
        out = _VALUES[function](*given)
    except (ValueError, ZeroDivisionError, OverflowError):
        out = math.nan
    if isinstance(out, complex) or not math.isfinite(out):
        at = ", ".join(f"{x:g}" for x in given)
        said = f"{given[0]:g} {function} {given[1]:g}" if function in "+-*/^" else f"{function}({at})"
        raise UnitError(f"{said} has no value", "change the parameters, or the expression")
    return float(out)


_VALUES: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b, "^": lambda a, b: a**b,
    "neg": lambda a: -a, "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos, "atan": math.atan,
    "atan2": math.atan2, "sqrt": math.sqrt, "abs": abs, "min": min, "max": max, "exp": math.exp, "log": math.log, "tanh": math.tanh,
}  # fmt: skip


def slope(node: Node, known: Mapping[str, float], along: Mapping[str, Gradient]) -> tuple[float, Gradient]:
    """(value, derivatives) of an expression; ``along`` holds the gradient of each of its parameters (chain rule)."""
    if isinstance(node, Number):
        return node.value, {}
    if isinstance(node, Name):
        return known[node.name], along[node.name]
    given = [slope(a, known, along) for a in node.arguments]
    values = [v for v, _ in given]
    out = _found(node.function, values)
    total: Gradient = {}
    if any(g for _, g in given):
        by = _partials(node.function, values, out, [bool(g) for _, g in given])
        for factor, (_, gradient) in zip(by, given, strict=True):
            for name, d in gradient.items():
                total[name] = total.get(name, 0.0) + factor * d
    return out, total


def _partials(function: str, x: list[float], out: float, wanted: list[bool]) -> list[float]:
    """Derivatives of a function with respect to each argument x; ``out`` is the function's value. Only the derivatives marked in
    ``wanted`` need to be correct. Raises UnitError when the function is not differentiable at x."""
    try:
        if function in ("min", "max"):
            return [1.0 if k == x.index(out) else 0.0 for k in range(len(x))]
        if function == "^":
            base = x[1] * x[0] ** (x[1] - 1.0) if wanted[0] and x[1] else 0.0
            return [base, out * math.log(x[0]) if wanted[1] else 0.0]
        return list(_SLOPES[function](*x))
    except (ValueError, ZeroDivisionError, OverflowError) as e:
        raise UnitError(f"{function} has no derivative at {x[0]:g}", "start at other values of the parameters") from e


_SLOPES: dict[str, Callable[..., tuple[float, ...]]] = {
    "+": lambda a, b: (1.0, 1.0), "-": lambda a, b: (1.0, -1.0), "*": lambda a, b: (b, a), "/": lambda a, b: (1 / b, -a / b / b),
    "neg": lambda a: (-1.0,), "sin": lambda a: (math.cos(a),), "cos": lambda a: (-math.sin(a),),
    "tan": lambda a: (1.0 + math.tan(a) ** 2,), "asin": lambda a: (1 / math.sqrt(1.0 - a * a),),
    "acos": lambda a: (-1 / math.sqrt(1.0 - a * a),), "atan": lambda a: (1 / (1.0 + a * a),),
    "atan2": lambda y, x: (x / (x * x + y * y), -y / (x * x + y * y)), "sqrt": lambda a: (0.5 / math.sqrt(a),),
    "abs": lambda a: (a / abs(a),), "exp": lambda a: (math.exp(a),), "log": lambda a: (1 / a,),
    "tanh": lambda a: (1.0 - math.tanh(a) ** 2,),
}  # fmt: skip
