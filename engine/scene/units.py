"""Units of measurement: a table, a small grammar (products, quotients, powers, parentheses) and dimensions as exponents.

Angles (rad) and cycles (Hz) count as dimensions of their own, so that an angle given where a number of metres is wanted is
noticed, and hertz are never taken for radians per second.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache

from engine.scene.suggest import closest, shown

Dimension = tuple[int, int, int, int, int]
"""Exponents of kg, m, s, rad, cycle."""

NONE: Dimension = (0, 0, 0, 0, 0)
LONGEST = 60
"""Characters in a unit, at most: longer text is no unit (and cannot nest deeply)."""


class UnitError(ValueError):
    """Text that is no number with a unit, or has the wrong unit. ``hint``: what to write instead."""

    def __init__(self, what: str, hint: str = ""):
        super().__init__(what)
        self.what, self.hint = what, hint


@dataclass(frozen=True)
class Unit:
    """``factor``: SI units in one of it; ``dimension``: exponents."""

    factor: float
    dimension: Dimension = NONE

    def times(self, other: Unit, power: int = 1) -> Unit:
        """This unit times another one to an integer power."""
        mixed = [a + power * b for a, b in zip(self.dimension, other.dimension, strict=True)]
        return Unit(self.factor * other.factor**power, (mixed[0], mixed[1], mixed[2], mixed[3], mixed[4]))


_KG, _M, _S = Unit(1.0, (1, 0, 0, 0, 0)), Unit(1.0, (0, 1, 0, 0, 0)), Unit(1.0, (0, 0, 1, 0, 0))
_RAD, _HZ = Unit(1.0, (0, 0, 0, 1, 0)), Unit(1.0, (0, 0, -1, 0, 1))
_N = Unit(1.0, (1, 1, -2, 0, 0))


def _table() -> dict[str, tuple[str, Unit]]:
    """Symbol → (name, unit)."""
    rows: list[tuple[str, str, float, Unit]] = [
        ("m", "metre", 1.0, _M), ("mm", "millimetre", 1e-3, _M), ("cm", "centimetre", 1e-2, _M), ("km", "kilometre", 1e3, _M),
        ("um", "micrometre", 1e-6, _M), ("in", "inch", 0.0254, _M), ("ft", "foot", 0.3048, _M),
        ("rad", "radian", 1.0, _RAD), ("mrad", "milliradian", 1e-3, _RAD), ("deg", "degree", math.pi / 180, _RAD),
        ("turn", "turn", 2 * math.pi, _RAD), ("rev", "revolution", 2 * math.pi, _RAD),
        ("s", "second", 1.0, _S), ("ms", "millisecond", 1e-3, _S), ("us", "microsecond", 1e-6, _S),
        ("min", "minute", 60.0, _S), ("h", "hour", 3600.0, _S),
        ("kg", "kilogram", 1.0, _KG), ("g", "gram", 1e-3, _KG), ("mg", "milligram", 1e-6, _KG), ("t", "tonne", 1e3, _KG),
        ("lb", "pound (mass)", 0.45359237, _KG),
        ("N", "newton", 1.0, _N), ("mN", "millinewton", 1e-3, _N), ("kN", "kilonewton", 1e3, _N),
        ("MN", "meganewton", 1e6, _N), ("lbf", "pound-force", 4.4482216152605, _N),
        ("J", "joule", 1.0, _N.times(_M)), ("W", "watt", 1.0, _N.times(_M).times(_S, -1)),
        ("Hz", "hertz", 1.0, _HZ), ("kHz", "kilohertz", 1e3, _HZ),
        ("rpm", "revolutions per minute", math.pi / 30, _RAD.times(_S, -1)),
    ]  # fmt: skip
    return {symbol: (name, Unit(factor * base.factor, base.dimension)) for symbol, name, factor, base in rows}


UNITS = _table()
_ALIASES = {"°": "deg", "µm": "um", "μm": "um", "µs": "us", "μs": "us", "sec": "s", "degree": "deg", "degrees": "deg", "lbs": "lb"}
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TOKEN = re.compile(r"\s*(?:(\*\*|\^)\s*([+-]?\d)(?!\d)|([⁻]?[¹²³⁴⁵⁶⁷⁸⁹])|([A-Za-zµμ°]+)|(1)(?!\d)|([*·⋅/()]))")
_NUMBER = re.compile(r"\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*", re.ASCII)


@lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """The unit written as ``text`` ('' is 1). UnitError when it is none."""
    if not text.strip():
        return Unit(1.0)
    if len(text) > LONGEST:
        raise UnitError(f"{shown(text)} is too long for a unit")
    return _Reader(text).read()


class _Reader:
    """Recursive descent: unit = term (('*' | '/' | ' ') term)*; term = (symbol | 1 | '(' unit ')') power?"""

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
        """The whole text."""
        try:
            unit = self.product()
        except ArithmeticError as e:
            raise UnitError(f"{shown(self.text)} is out of range") from e
        if self.tokens:
            raise UnitError(f"{shown(self.text)} is not a unit", f"cannot read it from {self.tokens[0][1]!r} on")
        if not math.isfinite(unit.factor) or unit.factor == 0.0:
            raise UnitError(f"{shown(self.text)} is out of range")
        return unit

    def product(self) -> Unit:
        """Factors from left to right; a/b*c is (a/b)*c."""
        unit = self.term()
        while self.tokens and self.tokens[0] != ("sign", ")"):
            sign = 1
            if self.tokens[0][0] == "sign" and self.tokens[0][1] != "(":
                sign = -1 if self.tokens.pop(0)[1] == "/" else 1
            unit = unit.times(self.term(), sign)
        return unit

    def term(self) -> Unit:
        """One symbol or a parenthesis, with its power."""
        kind, word = self.tokens.pop(0) if self.tokens else ("", "")
        if kind == "symbol":
            unit = Unit(1.0) if word == "1" else _symbol(word)
        elif word == "(":
            unit = self.product()
            if not self.tokens or self.tokens.pop(0)[1] != ")":
                raise UnitError(f"{shown(self.text)} lacks a closing parenthesis")
        else:
            raise UnitError(f"{shown(self.text)} is not a unit", "a unit symbol is missing")
        if self.tokens and self.tokens[0][0] == "power":
            unit = Unit(1.0).times(unit, int(self.tokens.pop(0)[1]))
        return unit


def _symbol(word: str) -> Unit:
    found = UNITS.get(_ALIASES.get(word, word))
    if found is None:
        best = closest(word, UNITS)
        raise UnitError(f'unknown unit "{word}"', f'did you mean "{best}"?' if best else "known: " + ", ".join(UNITS))
    return found[1]


def parse(text: str) -> tuple[float, Unit | None, str]:
    """(SI value, unit or None for a plain number, unit as written) of "VALUE UNIT". UnitError when it is neither."""
    plain = text.replace("−", "-")
    m = _NUMBER.match(plain)
    if not m:
        raise UnitError(f"{shown(text)} is not a number", 'write a number, or a number with a unit such as "30 mm"')
    written = plain[m.end() :].strip()
    unit = parse_unit(written)
    value = float(m[1]) * unit.factor
    if not math.isfinite(value):
        raise UnitError(f"{shown(text)} is too large for a number")
    return value, (unit if written else None), written


def fits(given: Dimension, wanted: Dimension) -> bool:
    """Whether a unit may stand where another is wanted: the same, or the same but for an unspoken rad or cycle (1/s for
    rad/s, N*m for N*m/rad)."""
    return given == wanted or (given[:3] == wanted[:3] and given[3:] == (0, 0) and given != NONE)


def unit_table() -> list[tuple[str, str, float, str]]:
    """(symbol, name, factor, SI unit) of every unit, for display."""
    return [(symbol, name, unit.factor, si_text(unit.dimension)) for symbol, (name, unit) in UNITS.items()]


QUANTITIES: dict[str, tuple[str, str]] = {
    "1": ("a plain number", "0.3"), "m": ("a length", "30 mm"), "rad": ("an angle", "45 deg"), "s": ("a time", "10 ms"),
    "kg": ("a mass", "2 kg"), "m/s": ("a velocity", "1e-4 m/s"), "rad/s": ("an angular velocity", "60 rpm"),
    "m/s^2": ("an acceleration", "9.81 m/s^2"), "rad/s^2": ("an angular acceleration", "3 rad/s^2"),
    "kg/m^3": ("a density", "7.8 g/cm^3"), "kg*m^2": ("a moment of inertia", "0.2 kg*m^2"), "N": ("a force", "2 kN"),
    "N*m": ("a torque", "5 N*m"), "N/m": ("a stiffness", "2 kN/m"), "N*m/rad": ("a rotational stiffness", "3 N*m/rad"),
    "N*s/m": ("a damping", "20 N*s/m"), "N*m*s/rad": ("a rotational damping", "0.1 N*m*s/rad"), "Hz": ("a frequency", "2 Hz"),
    "s/m": ("a time per length", "0.2 s/m"), "s/rad": ("a time per angle", "0.2 s/rad"), "1/s": ("a rate", "2 1/s"),
    "m^2": ("an area", "4 mm^2"), "m^3": ("a volume", "2 cm^3"), "W": ("a power", "10 W"),
}  # fmt: skip
"""SI unit → (what it measures, an example)."""

_NAMED = {parse_unit(unit if unit != "1" else "").dimension: unit for unit in QUANTITIES}


def si_text(dimension: Dimension) -> str:
    """The SI unit of a dimension as text."""
    if dimension in _NAMED:
        return _NAMED[dimension]
    parts = [f"{b}^{e}" if e != 1 else b for b, e in zip(("kg", "m", "s", "rad", "cycle"), dimension, strict=True) if e]
    return "*".join(parts)


def described(dimension: Dimension) -> str:
    """What a dimension measures: "a length", or its unit."""
    unit = si_text(dimension)
    return QUANTITIES[unit][0] if unit in QUANTITIES else f"a quantity in {unit}"
