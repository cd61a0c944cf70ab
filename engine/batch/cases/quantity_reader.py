"""Reads values of a scene's numbers and converts them to SI units."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from numbers import Real
from typing import Any

from trunnion.basics.errors import Problem, SceneError
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import parse_path
from trunnion.scene.findings.name_suggestions import shown
from trunnion.scene.overrides import apply
from trunnion.scene.queries.numbers_by_path import unit_of
from trunnion.scene.units.numbers_with_units import agree, parse_quantity
from trunnion.scene.units.unit_parser import UnitError

MOST_REPORTED = 5
"""Largest number of reported mistakes of one path. The values of a grid usually share one mistake."""


class Reader:
    """Converts values of one path to SI numbers. The first mistakes are appended to ``problems``.

    The unit of the path is determined only once. This step needs a scene, and there may be a million values.
    """

    def __init__(self, scene: Scene, path: str, where: str, problems: list[Problem]):
        self.scene, self.path, self.where, self.problems = scene, path, where, problems
        found = number_at(scene, path)
        self.unit = found[1] if found is not None else ""
        self.wrong = self.tried = 0

    @property
    def untold(self) -> int:
        """Number of mistakes that were counted but not reported."""
        return max(0, self.wrong - MOST_REPORTED)

    def complain(self, what: str, hint: str = "") -> None:
        """Report a mistake. After MOST_REPORTED mistakes, further mistakes are only counted."""
        self.wrong += 1
        if self.wrong <= MOST_REPORTED:
            self.problems.append(Problem(self.where, what, hint))

    def _complain_once(self, what: str, hint: str) -> None:
        """Report a mistake that all values of the path share. Only the first call reports the mistake."""
        if Problem(self.where, what, hint) not in self.problems:
            self.complain(what, hint)

    def number(self, value: Any) -> float:
        """SI value of one entry. A number without a unit is in SI units. This function does not report a value that the scene
        rejects. The case with this value fails later."""
        value = _plain(value)
        if isinstance(value, bool) or not isinstance(value, float | str):
            self.complain(f"{shown(value)} is not a number")
            return math.nan
        if isinstance(value, float) and not math.isfinite(value):
            self.complain("is not finite")
            return math.nan
        if not self.unit and self.tried < MOST_REPORTED:
            self.tried += 1
            return self._first(value)
        return value if isinstance(value, float) else self._with_unit(value)

    def _with_unit(self, text: str) -> float:
        """SI value of a number with a unit that fits the path."""
        try:
            value = parse_quantity(text)
            agree(value, self.unit or "1")
        except UnitError as e:
            self.complain(e.what, e.hint)
            return math.nan
        return float(value)

    def _first(self, value: float | str) -> float:
        """SI value of the first value at a path where the scene gives no number. To find the unit of the path, the scene is built
        with this value."""
        try:
            found = number_at(apply(self.scene, {self.path: value}), self.path)
        except SceneError as e:
            for p in e.problems:
                self._complain_once(f"{p.where}: {p.what}" if p.where != self.path else p.what, p.hint)
            return math.nan
        if found is None:
            hint = "give the path of a number, such as joints.ball.friction.mu"
            self._complain_once("is not a single number of the scene", hint)
            return math.nan
        self.unit = found[1]
        return found[0]


def _plain(value: Any) -> Any:
    """A number, or a text that represents a number, as a float. Any other value is unchanged."""
    if isinstance(value, bool) or not isinstance(value, Real | str):
        return value
    try:
        return float(value)
    except ValueError:
        return value
    except OverflowError:
        return math.inf


def number_at(scene: Scene, path: str) -> tuple[float, str] | None:
    """(value, unit) of a number of a scene; None if the path does not lead to a number."""
    place = parse_path(path)
    node: Any = scene
    for i, key in enumerate(place or ()):
        if isinstance(node, float) and place is not None and place[i:] == (0,):
            place = place[:i]  # if the scene gives q as a single number and not as a list, q[1] means q
            break
        node = _part(node, key)
    return (float(node), unit_of(scene, place)) if place and isinstance(node, float) else None


def _part(node: Any, key: str | int) -> Any:
    """The part of a scene at a key or index of another part; None if there is no such part."""
    if isinstance(key, int):
        return node[key] if isinstance(node, tuple) and key < len(node) else None
    if isinstance(node, dict):
        return node.get(key)
    return getattr(node, key, None) if is_dataclass(node) and key in {f.name for f in fields(node)} else None
