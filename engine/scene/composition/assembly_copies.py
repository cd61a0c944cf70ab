"""The copies of an assembly, and the transformations of the copies (mirror, rotate, line)."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.composition.data_with_source_lines import Level
from trunnion.scene.composition.part_transformations import AXES, Transformation, move_about, shift_by
from trunnion.scene.expressions.expression_arithmetic import Term, is_number, source, three, times
from trunnion.scene.expressions.parameter_evaluation import Parameters, is_expression
from trunnion.scene.findings.findings_and_paths import Path
from trunnion.scene.findings.name_suggestions import did_you_mean, shown
from trunnion.scene.units.numbers_with_units import Computed, Per
from trunnion.scene.units.unit_parser import UnitError

MOST = 1000
"""Largest number of copies of one assembly."""
EXACT = {
    Fraction(0): 1.0, Fraction(1, 6): 0.5, Fraction(1, 4): 0.0, Fraction(1, 3): -0.5, Fraction(1, 2): -1.0,
    Fraction(2, 3): -0.5, Fraction(3, 4): 0.0, Fraction(5, 6): 0.5,
}  # fmt: skip
"""Exact cosines of some angles; the keys are fractions of a turn (1/6 is 60°)."""


@dataclass(frozen=True)
class Copy:
    """One copy. ``suffix`` is appended to the assembly's name. ``number`` counts the copies from 1, and is 0 for an assembly
    without copies. ``moves`` are applied in order to the assembly as written."""

    suffix: str = ""
    number: int = 0
    moves: tuple[Transformation, ...] = ()


def copies(level: Level, path: Path, spec: dict[str, Any]) -> list[Copy]:
    """All copies of an assembly; the function adds mistakes to the findings of ``level``."""
    try:
        last = (*_turns(spec.get("orientation")), *([shift_by(spec["position"])] if spec.get("position") is not None else []))
    except UnitError as e:
        level.add_problem(path, e.what, e.hint)
        last = ()
    given = spec.get("copies")
    if given is None:
        return [Copy(moves=last)]
    if not isinstance(given, dict) or len(given) != 1 or next(iter(given)) not in _KINDS:
        what = f"one of {', '.join(_KINDS)} is expected"
        level.add_problem((*path, "copies"), what, "for example copies: {rotate: {times: 6, axis: z}}")
        return []
    kind, how = next(iter(given.items()))
    try:
        moves = _KINDS[kind](how)
    except UnitError as e:
        level.add_problem((*path, "copies", kind), e.what, e.hint)
        return []
    return [Copy(str(n + 1), n + 1, (*m, *last)) for n, m in enumerate(moves)]


def _turns(given: Any) -> list[Transformation]:
    """The turns in the ``orientation`` of an assembly, about its origin."""
    out = []
    for t in given if isinstance(given, list) else [] if given is None else [given]:
        if not isinstance(t, dict) or t.get("axis") not in AXES or "angle" not in t or len(t) != 2:
            raise UnitError("an assembly is turned by angles about x, y or z", "orientation: {axis: z, angle: 30 deg}")
        out.append(turn_about(t["axis"], t["angle"], [0, 0, 0]))
    return out


def turn_about(axis: str, angle: Term, through: Any) -> Transformation:
    """A turn about x, y or z by an angle, which may be an expression."""
    cosine: Term
    sine: Term
    known = Parameters().computed(angle) if is_expression(angle) else None
    if known is None or isinstance(known, Computed):
        whole = float(known) if known is not None else Per("rad")(angle)
        cosine, sine = (0.0 if abs(f(whole)) < 1e-15 else f(whole) for f in (math.cos, math.sin))
    else:  # the angle is an expression of parameters
        cosine, sine = f"{{cos{source(angle)}}}", f"{{sin{source(angle)}}}"
    return move_about(_matrix(AXES.index(axis), cosine, sine), through, (axis, angle))


def _matrix(k: int, cosine: Term, sine: Term) -> tuple[tuple[Term, ...], ...]:
    rows: list[list[Term]] = [[1.0 if i == j else 0.0 for j in range(3)] for i in range(3)]
    a, b = (k + 1) % 3, (k + 2) % 3
    rows[a][a] = rows[b][b] = cosine
    rows[b][a], rows[a][b] = sine, times(-1.0, sine)
    return tuple(map(tuple, rows))


def _checked_keys(how: Any, known: tuple[str, ...], needed: tuple[str, ...]) -> dict[str, Any]:
    """The group ``how``. Raises UnitError when a key is not in ``known``, a key of ``needed`` is missing, or ``how`` is not a
    group."""
    if not isinstance(how, dict):
        raise UnitError(f"a group of keys is expected, not {shown(how)}", f"keys: {', '.join(known)}")
    for key in how:
        if key not in known:
            raise UnitError(f"unknown key {shown(key)}", did_you_mean(key, known, "known keys"))
    for key in needed:
        if key not in how:
            raise UnitError(f'the key "{key}" is missing', f"needed here: {', '.join(needed)}")
    if how.get("axis", "x") not in AXES:
        raise UnitError(f"{shown(how['axis'])} is not an axis", "x, y or z")
    return how


def _copy_count(how: dict[str, Any]) -> int:
    n = how["times"]
    if not is_number(n) or n != int(n) or not 1 <= n <= MOST:
        raise UnitError(f"times must be a whole number from 1 to {MOST}, not {shown(n)}", "it cannot depend on parameters")
    return int(n)


def _mirror(how: Any) -> list[tuple[Transformation, ...]]:
    group = _checked_keys({"axis": how} if isinstance(how, str) else how, ("axis", "through"), ("axis",))
    k = AXES.index(group["axis"])
    matrix = tuple(tuple((-1.0 if i == k else 1.0) if i == j else 0.0 for j in range(3)) for i in range(3))
    return [(), (move_about(matrix, group.get("through", [0, 0, 0]), None, k),)]


def _rotate(how: Any) -> list[tuple[Transformation, ...]]:
    group = _checked_keys(how, ("times", "axis", "by", "through"), ("times",))
    n, axis, by, through = _copy_count(group), group.get("axis", "z"), group.get("by"), group.get("through", [0, 0, 0])
    if by is not None:
        return [(), *((turn_about(axis, times(float(i), by), through),) for i in range(1, n))]
    out: list[tuple[Transformation, ...]] = [()]
    for part in (Fraction(i, n) for i in range(1, n)):
        sign = 1.0 if part < Fraction(1, 2) else -1.0
        cosine = EXACT.get(part, math.cos(2 * math.pi * part))
        sine = EXACT.get((Fraction(1, 4) - part) % 1, math.sin(2 * math.pi * part))
        if part in EXACT and sine not in (0.0, 1.0, -1.0, 0.5, -0.5):
            sine = sign * math.sqrt(3.0) / 2
        degrees = 360 * part
        angle = f"{degrees} deg" if degrees.denominator == 1 else f"{{{degrees.numerator} deg/{degrees.denominator}}}"
        out.append((move_about(_matrix(AXES.index(axis), cosine, sine), through, (axis, angle)),))
    return out


def _line(how: Any) -> list[tuple[Transformation, ...]]:
    group = _checked_keys(how, ("times", "step"), ("times", "step"))
    return [(), *((shift_by([times(float(i), c) for c in three(group["step"])]),) for i in range(1, _copy_count(group)))]


_KINDS: dict[str, Callable[[Any], list[tuple[Transformation, ...]]]] = {"mirror": _mirror, "rotate": _rotate, "line": _line}
