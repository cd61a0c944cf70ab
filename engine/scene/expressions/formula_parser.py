"""Parser of expressions. The grammar has only numbers, names, + - * / ^ and a few functions; the result is a tree.

    sum     = product (("+" | "-") product)*
    product = sign (("*" | "/") sign)*
    sign    = ("-" | "+") sign | power
    power   = atom (("^" | "**") sign)?
    atom    = number (unit | "SI")? | name | function "(" sum ("," sum)* ")" | "(" sum ")"

A unit follows its number ("2.5 kN/m") and has the same grammar as outside expressions. "0.3 SI" is 0.3 in the SI unit that the
number's place requires. Trunnion itself writes "SI" when it turns plain numbers into expressions.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from functools import cache

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.findings.name_suggestions import did_you_mean, shown
from trunnion.scene.units.unit_parser import ALIASES, NONE, UNITS, Dimension, UnitError, parse

LONGEST = 2000
"""Largest number of characters in an expression."""
DEEPEST = 40
"""Largest nesting depth of parentheses, signs and powers."""
_WORDS = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "abs", "min", "max")
FUNCTIONS = (*_WORDS, "exp", "log", "tanh")
CONSTANTS = {"pi": math.pi}
TIME = "t"
"""The time, in formulas of the time."""
WHATEVER: Dimension = (99, 99, 99, 99, 99)
"""Marks a number written with "SI": it has the dimension that its place requires."""
RESERVED = {*UNITS, *ALIASES, *_WORDS, *CONSTANTS, "SI"}
"""Words that cannot name a parameter, because an expression must have one meaning. Some functions are not among these words,
because existing scenes have parameters with such names."""
_COUNTS = {"atan2": (2, 2), "min": (1, 99), "max": (1, 99)}
_POWER = r"(?:\s*(?:\*\*|\^)\s*[+-]?\d(?![\d.]))?"
_SI = re.compile(r"\s*SI(?![A-Za-z0-9_(])")
_NUMBER = re.compile(r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
_SIGN = re.compile(r"\*\*|[-+*/^(),]")


@cache
def _units(timed: bool) -> re.Pattern[str]:
    """The pattern of a unit behind a number. The pattern contains all units four times, so its compilation takes long. timed:
    whether t is the time instead of the unit tonne."""
    known = {*UNITS, *ALIASES} - ({TIME} if timed else set())
    symbol = "(?:" + "|".join(sorted(map(re.escape, known), key=len, reverse=True)) + ")(?![A-Za-z0-9_(])"
    return re.compile(rf"\s*{symbol}{_POWER}(?:\s*[*/]\s*{symbol}{_POWER})*")


@dataclass(frozen=True)
class Number:
    """A number in SI units, with the dimension of its unit in the text."""

    value: float
    dimension: Dimension = NONE


@dataclass(frozen=True)
class Name:
    """A parameter."""

    name: str


@dataclass(frozen=True)
class Call:
    """An operator ("+", "-", "*", "/", "^", "neg") or a function, with the operands."""

    function: str
    arguments: tuple[Node, ...]


Node = Number | Name | Call


def nodes(node: Node) -> Iterator[Node]:
    """A node and all nodes inside it."""
    yield node
    for inner in node.arguments if isinstance(node, Call) else ():
        yield from nodes(inner)


def has_names(node: Node) -> bool:
    """Whether a node contains names."""
    return any(isinstance(n, Name) for n in nodes(node))


@dataclass(frozen=True)
class Formula:
    """A parsed expression. ``names`` are its parameters. ``plain``: whether the expression has neither parameters nor units; such
    an expression counts as a number without a unit."""

    text: str
    root: Node
    names: frozenset[str]
    plain: bool


def parse_formula(text: str, timed: bool = False) -> Formula:
    """Parse the text of an expression (without braces). timed: whether the name t is the time. UnitError describes a syntax
    error."""
    if len(text) > LONGEST:
        raise UnitError(f"an expression of more than {LONGEST} characters", "give parts of it names, as parameters")
    reader = _Reader(text, timed)
    root = reader.whole()
    return Formula(text, root, frozenset(reader.names), not reader.names and not reader.united)


class _Reader:
    """Reads an expression by recursive descent."""

    def __init__(self, text: str, timed: bool):
        self.timed = timed
        self.text = text.replace("−", "-").replace("·", "*")
        self.at, self.depth, self.united = 0, 0, False
        self.names: set[str] = set()

    def whole(self) -> Node:
        """The tree of the whole text."""
        root = self.sum()
        if self.at < len(self.text):
            self.refuse()
        return root

    def refuse(self) -> None:
        """Raise UnitError about the text at the current position."""
        rest = self.text[self.at :].strip()
        what = f"cannot read {shown(self.text.strip())}" + (f" from {shown(rest, 20)} on" if rest else ": it ends too early")
        raise UnitError(what, "expressions look like {a/2 + 5 mm}, {2*r*sin(angle)}")

    def sign(self) -> str:
        """The next token if it is an operator, parenthesis or comma; '' when it is a number or a name."""
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1
        m = _SIGN.match(self.text, self.at)
        return m[0] if m else ""

    def take(self, sign: str) -> None:
        """Advance past ``sign``. Any other token here is a syntax error."""
        if self.sign() != sign:
            self.refuse()
        self.at += len(sign)

    def sum(self) -> Node:
        """Products added and subtracted, from left to right."""
        return self.chain(("+", "-"), self.product)

    def product(self) -> Node:
        """Factors multiplied and divided, from left to right."""
        return self.chain(("*", "/"), self.signed)

    def chain(self, signs: tuple[str, str], operand: Callable[[], Node]) -> Node:
        """Operands joined by these signs, from left to right."""
        node = operand()
        while (sign := self.sign()) in signs:
            self.take(sign)
            node = Call(sign, (node, operand()))
        return node

    def signed(self) -> Node:
        """A factor with its sign: -a^2 is -(a^2)."""
        self.depth += 1
        if self.depth > DEEPEST:
            raise UnitError(f"{shown(self.text)} is nested more than {DEEPEST} deep", "give parts of it names, as parameters")
        sign = self.sign()
        if sign in ("-", "+"):
            self.take(sign)
            node = self.signed()
            node = Call("neg", (node,)) if sign == "-" else node
        else:
            node = self.power()
        self.depth -= 1
        return node

    def power(self) -> Node:
        """An atom and its exponent."""
        node = self.atom()
        sign = self.sign()
        if sign in ("^", "**"):
            self.take(sign)
            node = Call("^", (node, self.signed()))
        return node

    def atom(self) -> Node:
        """A number with its unit, a name, a function call, or a sum in parentheses."""
        if self.sign() == "(":
            self.take("(")
            node = self.sum()
            self.take(")")
            return node
        if m := _NUMBER.match(self.text, self.at):
            return self.number(m)
        m = _NAME.match(self.text, self.at)
        if not m:
            self.refuse()
        assert m is not None
        self.at = m.end()
        return self.call(m[0]) if self.sign() == "(" else self.named(m[0])

    def number(self, m: re.Match[str]) -> Node:
        """A number and the unit that follows it."""
        if whatever := _SI.match(self.text, m.end()):
            self.at = whatever.end()
            return Number(float(m[0]), WHATEVER)
        unit = _units(self.timed).match(self.text, m.end())
        self.at = unit.end() if unit else m.end()
        if (odd := re.compile(r"\s*([A-Za-z_]\w*)").match(self.text, self.at)) is not None:
            raise UnitError(f'unknown unit "{odd[1]}" behind {m[0]}', f"a product is written {m[0]}*{odd[1]}")
        value, given, _ = parse(self.text[m.start() : self.at])
        self.united |= given is not None
        return Number(value, given.dimension if given is not None else NONE)

    def named(self, word: str) -> Node:
        """A constant or parameter."""
        if word in CONSTANTS:
            return Number(CONSTANTS[word])
        if word in RESERVED and not (self.timed and word == TIME):
            hint = f"1 {word}" if word not in FUNCTIONS else f"{word}(…)"
            raise UnitError(f'"{word}" alone is not a number', f"write {hint}")
        self.names.add(word)
        return Name(word)

    def call(self, word: str) -> Node:
        """A function call. The name is already read; the parentheses come next."""
        if word not in FUNCTIONS:
            raise UnitError(f'there is no function "{word}"', did_you_mean(word, FUNCTIONS, "functions"))
        self.take("(")
        arguments = [self.sum()]
        while self.sign() == ",":
            self.take(",")
            arguments.append(self.sum())
        self.take(")")
        least, most = _COUNTS.get(word, (1, 1))
        if not least <= len(arguments) <= most:
            raise UnitError(f"{word}: {least} argument(s), not {len(arguments)}" if least == most else f"{word}: at most {most}")
        return Call(word, tuple(arguments))


def rename_names(text: str, names: dict[str, str]) -> str:
    """Rename parameters in the text of an expression: ``names`` maps each old name to its new name."""
    return re.sub(r"(?<![A-Za-z0-9_.])[A-Za-z_][A-Za-z0-9_]*", lambda m: names.get(m[0], m[0]), text)
