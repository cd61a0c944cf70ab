"""Formulas of a position x, y, z: separation of the constant parts from the parts that depend on the position.

As in formulas of time (``time_formulas``), the constant parts become numbers of the scene. The rest of the formula is a tree of
tuples: ("place", index of the coordinate), ("number", index), or the name of an operation with its operands."""

from __future__ import annotations

from functools import lru_cache

from trunnion.scene.expressions.formula_parser import Call, Name, Node, parse_formula
from trunnion.scene.signals.time_formulas import KINKS, OPERATIONS, Tree, power, text_of
from trunnion.scene.units.unit_parser import UnitError

PLACE = ("x", "y", "z")
"""The coordinates in a formula."""


@lru_cache(maxsize=256)  # users write the formulas, so the cache is bounded
def separate(formula: str) -> tuple[Tree, tuple[str, ...]]:
    """The tree of a formula, and its constant parts as expressions in braces. Raises UnitError if the formula cannot be read, or if
    a part that depends on the position is not smooth."""
    numbers: list[Node] = []
    tree = _separate(parse_formula(formula).root, numbers)
    return tree, tuple("{" + text_of(n) + "}" for n in numbers)


def depends_on_place(node: Node) -> bool:
    """Whether a coordinate occurs in a formula."""
    if isinstance(node, Call):
        return any(map(depends_on_place, node.arguments))
    return isinstance(node, Name) and node.name in PLACE


def is_polynomial(tree: Tree) -> bool:
    """Whether a separated formula only adds and multiplies. Such a formula has no narrow part."""
    if tree[0] in ("place", "number"):
        return True
    return tree[0] in ("+", "-", "*", "neg", "square") and all(map(is_polynomial, tree[1:]))


def _separate(node: Node, numbers: list[Node]) -> Tree:
    if not depends_on_place(node):
        numbers.append(node)
        return "number", len(numbers) - 1
    if isinstance(node, Name):
        return "place", PLACE.index(node.name)
    assert isinstance(node, Call)
    if node.function == "^":
        return power(node, "position", lambda base: _separate(base, numbers))
    if node.function in KINKS or node.function not in OPERATIONS:
        smooth = ", ".join(f for f in OPERATIONS if f.isalpha() and f not in ("neg", "square", "inverse"))
        kink = f"{node.function} of the position {'has a kink' if node.function in KINKS else 'is not allowed'}"
        raise UnitError(kink, f"smooth functions: {smooth}; a whole number as exponent; sqrt(x^2) for abs(x) away from 0")
    return node.function, *(_separate(a, numbers) for a in node.arguments)
