"""Units of measurement: a table of symbols, a grammar (products, quotients, powers, parentheses), and dimensions as
exponents of the base units.

Angles (rad) and cycles (Hz = cycle/s) are separate dimensions. An angle in place of a length is therefore an error, and hertz are
not taken for radians per second.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.findings.name_suggestions import closest, shown

Dimension = tuple[int, int, int, int, int]
"""Exponents of kg, m, s, rad, cycle."""

NONE: Dimension = (0, 0, 0, 0, 0)
LONGEST = 60
"""Largest number of characters in a unit; this also limits the nesting depth."""


class UnitError(ValueError):
    """An invalid number, unit or expression, or a wrong dimension: ``what`` is the cause, ``hint`` the remedy."""

    def __init__(self, what: str, hint: str = ""):
        super().__init__(what)
        self.what, self.hint = what, hint


@dataclass(frozen=True)
class Unit:
    """A unit with its exact factor to SI, up/down * pi^``pi``; ``dimension`` holds the exponents of the base units."""

    up: int = 1
    down: int = 1
    pi: int = 0
    dimension: Dimension = NONE

    @property
    def factor(self) -> float:
        """The factor that converts a value in this unit to SI."""
        return self.up / self.down * math.pi**self.pi

    def times(self, other: Unit, power: int = 1) -> Unit:
        """This unit times an integer power of another unit."""
        if abs(power) * max(other.up.bit_length(), other.down.bit_length()) > BITS:
            raise OverflowError
        up, down = (other.up, other.down) if power >= 0 else (other.down, other.up)
        a, b, c, d, e = (x + power * y for x, y in zip(self.dimension, other.dimension, strict=True))
        n = abs(power)
        return Unit(self.up * up**n, self.down * down**n, self.pi + power * other.pi, (a, b, c, d, e))

    def value(self, number: str) -> float:
        """SI value of a decimal number in this unit, correctly rounded except for the factor pi: 35 mm is 0.035, 45 deg is pi/4."""
        digits, _, exponent = number.lower().partition("e")
        whole, _, rest = digits.partition(".")
        power = int(exponent[:9] or 0) - len(rest)
        if len(digits) > 60 or abs(power) > 350:
            return float(number) * self.factor
        up, down = int(whole + rest) * self.up, self.down
        up, down = (up * 10**power, down) if power >= 0 else (up, down * 10**-power)
        return up / down * math.pi**self.pi


BITS = 4000
"""Largest size in bits of the factor of a power; a larger factor raises OverflowError."""
_KG, _M, _S = (Unit(dimension=d) for d in ((1, 0, 0, 0, 0), (0, 1, 0, 0, 0), (0, 0, 1, 0, 0)))
_RAD, _HZ, _N = (Unit(dimension=d) for d in ((0, 0, 0, 1, 0), (0, 0, -1, 0, 1), (1, 1, -2, 0, 0)))


def _table() -> dict[str, tuple[str, Unit]]:
    """(name, unit) by symbol. The rows hold factors as decimal text or as a Unit(up, down, power of pi)."""
    rows: list[tuple[str, str, str | Unit, Unit]] = [
        ("m", "metre", "1", _M), ("mm", "millimetre", "1e-3", _M), ("cm", "centimetre", "1e-2", _M),
        ("km", "kilometre", "1e3", _M), ("um", "micrometre", "1e-6", _M), ("in", "inch", "0.0254", _M),
        ("ft", "foot", "0.3048", _M),
        ("rad", "radian", "1", _RAD), ("mrad", "milliradian", "1e-3", _RAD), ("deg", "degree", Unit(1, 180, 1), _RAD),
        ("turn", "turn", Unit(2, 1, 1), _RAD), ("rev", "revolution", Unit(2, 1, 1), _RAD),
        ("s", "second", "1", _S), ("ms", "millisecond", "1e-3", _S), ("us", "microsecond", "1e-6", _S),
        ("min", "minute", "60", _S), ("h", "hour", "3600", _S),
        ("kg", "kilogram", "1", _KG), ("g", "gram", "1e-3", _KG), ("mg", "milligram", "1e-6", _KG),
        ("t", "tonne", "1e3", _KG), ("lb", "pound (mass)", "0.45359237", _KG),
        ("N", "newton", "1", _N), ("mN", "millinewton", "1e-3", _N), ("kN", "kilonewton", "1e3", _N),
        ("MN", "meganewton", "1e6", _N), ("lbf", "pound-force", "4.4482216152605", _N),
        ("J", "joule", "1", _N.times(_M)), ("W", "watt", "1", _N.times(_M).times(_S, -1)),
        ("Hz", "hertz", "1", _HZ), ("kHz", "kilohertz", "1e3", _HZ),
        ("rpm", "revolutions per minute", Unit(1, 30, 1), _RAD.times(_S, -1)),
    ]  # fmt: skip
    return {symbol: (name, _exact(factor).times(base)) for symbol, name, factor, base in rows}


def _exact(factor: str | Unit) -> Unit:
    """The factor of a row as a dimensionless Unit; decimal text becomes a ratio of integers."""
    if isinstance(factor, Unit):
        return factor
    digits, _, exponent = factor.partition("e")
    whole, _, rest = digits.partition(".")
    power = int(exponent or 0) - len(rest)
    return Unit(int(whole + rest) * 10 ** max(power, 0), 10 ** max(-power, 0))


UNITS = _table()
ALIASES = {"°": "deg", "µm": "um", "μm": "um", "µs": "us", "μs": "us", "sec": "s", "degree": "deg", "degrees": "deg", "lbs": "lb"}
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TOKEN = re.compile(r"\s*(?:(\*\*|\^)\s*([+-]?\d)(?!\d)|([⁻]?[¹²³⁴⁵⁶⁷⁸⁹])|([A-Za-zµμ°]+)|(1)(?!\d)|([*·⋅/()]))")
_NUMBER = re.compile(r"\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*", re.ASCII)


@lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Parse a unit ('' is the unit 1). Raises UnitError when ``text`` is not a unit."""
    if not text.strip():
        return Unit()
    if len(text) > LONGEST:
        raise UnitError(f"{shown(text)} is too long for a unit")
    return _Reader(text).read()


class _Reader:
    """Reads a unit by recursive descent: unit = term (('*' | '/' | ' ') term)*; term = (symbol | 1 | '(' unit ')') power?"""

    def __init__(self, text: str):
        self.text = text
        self.tokens = self._split(text.strip())

    def _split(self, text: str) -> list[tuple[str, str]]:
        out, at = [], 0
        while at < len(text):
            m = _TOKEN.match(text, at)
            if not m:
                raise UnitError(f"{shown(self.text)} is not a unit", "units look like m/s^2, N*m/rad, kg*m^2")
            power = m[2] or (m[3] or "").translate(_RAISED)
            out.append(("power", power) if power else ("symbol", m[4] or m[5]) if m[4] or m[5] else ("sign", m[6]))
            at = m.end()
        return out

    def read(self) -> Unit:
        """Parse the whole text."""
        try:
            unit = self.product()
            if unit.factor == 0.0:
                raise OverflowError
        except OverflowError as e:
            raise UnitError(f"{shown(self.text)} is out of range") from e
        if self.tokens:
            raise UnitError(f"{shown(self.text)} is not a unit", f"cannot read it from {self.tokens[0][1]!r} on")
        return unit

    def product(self) -> Unit:
        """A product of terms, from left to right: a/b*c is (a/b)*c."""
        unit = self.term()
        while self.tokens and self.tokens[0] != ("sign", ")"):
            sign = 1
            if self.tokens[0][0] == "sign" and self.tokens[0][1] != "(":
                sign = -1 if self.tokens.pop(0)[1] == "/" else 1
            unit = unit.times(self.term(), sign)
        return unit

    def term(self) -> Unit:
        """One symbol or one expression in parentheses, with its power."""
        kind, word = self.tokens.pop(0) if self.tokens else ("", "")
        if kind == "symbol":
            unit = Unit() if word == "1" else _symbol(word)
        elif word == "(":
            unit = self.product()
            if not self.tokens or self.tokens.pop(0)[1] != ")":
                raise UnitError(f"{shown(self.text)} lacks a closing parenthesis")
        else:
            raise UnitError(f"{shown(self.text)} is not a unit", "a unit symbol is missing")
        if self.tokens and self.tokens[0][0] == "power":
            unit = Unit().times(unit, int(self.tokens.pop(0)[1]))
        return unit


def _symbol(word: str) -> Unit:
    found = UNITS.get(ALIASES.get(word, word))
    if found is None:
        best = closest(word, UNITS)
        raise UnitError(f'unknown unit "{word}"', f'did you mean "{best}"?' if best else "known: " + ", ".join(UNITS))
    return found[1]


def parse(text: str) -> tuple[float, Unit | None, str]:
    """(SI value, unit, text of the unit) of "VALUE" or "VALUE UNIT"; the unit is None for a plain number. Raises UnitError for any
    other text."""
    plain = text.replace("−", "-")
    m = _NUMBER.match(plain)
    if not m:
        raise UnitError(f"{shown(text)} is not a number", 'write a number, or a number with a unit such as "30 mm"')
    written = plain[m.end() :].strip()
    if written[:1] == "," and written[1:2].isdigit():
        pointed = plain.strip().replace(",", "" if "." in plain else ".")
        hint = f"use a point for decimals and no separator for thousands: {shown(pointed)}"
        raise UnitError(f"{shown(text)} has a comma in the number", hint)
    unit = parse_unit(written)
    try:
        value = unit.value(m[1])
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise UnitError(f"{shown(text)} is too large for a number")
    return value, (unit if written else None), written
