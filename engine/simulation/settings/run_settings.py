"""Settings of runs as any interface receives them: conversion of units, checks of bounds, descriptions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from trunnion.basics.errors import Problem, raise_problems
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.name_patterns import suggestion
from trunnion.basics.setting_declarations import Setting, offered
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.runtime.integrators import METHODS
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.units.python_arguments import Amounts
from trunnion.simulation.settings.realtime_steps import method_of

F = TypeVar("F", bound=Callable[..., Any])
KERNELS = ("auto", "compiled", "lanes", "parts")
"""Kinds of kernels. "auto" chooses the kind by structure and request (``kernel_choice``)."""
ALONE = tuple(k for k in KERNELS if k != "lanes")
"""Kinds of kernels for a single run, as in an FMU."""


@dataclass(frozen=True)
class Run:
    """Settings of a run, or of all runs of a batch. None: the value in the scene.

    Attributes:
        until: end time, s.
        every: spacing of rows, s.
        rtol: relative tolerance.
        method: integration method.
        kernel: kind of kernel.
        cpu_limit: largest processor time of a case, s; None: no limit.
        max_steps: largest number of steps of the solver; None: no limit.
    """

    until: float | None = None
    every: float | None = None
    rtol: float | None = None
    method: str | None = None
    kernel: str | None = None
    cpu_limit: float | None = None
    max_steps: float | None = None

    def of(self, scene: Scene) -> tuple[float, float, float]:
        """(until, s; every, s; rtol) of a run of this scene."""
        sim = scene.simulation
        until = float(sim.until if self.until is None else self.until)
        every = sim.every if self.every is None else self.every
        return until, until / 1000.0 if every is None else float(every), float(sim.rtol if self.rtol is None else self.rtol)

    def method_of(self, scene: Scene) -> str:
        """The method of a run of this scene."""
        return method_of(scene, self.method or scene.simulation.method)


def known_words() -> dict[str, tuple[str, ...]]:
    """{name of a registry, as in ``Setting.words``: names in this registry}."""
    return {"methods": tuple(METHODS), "laws": tuple(LAWS), "kernels": KERNELS}


def describe_setting(setting: Setting, who: str) -> str:
    """The description of a setting for one interface. who: name of the interface."""
    return setting.told(who).format_map({k: ", ".join(v) for k, v in known_words().items()})


def with_setting_docs(who: str) -> Callable[[F], F]:
    """A decorator that appends the descriptions of an interface's settings to the function's docstring. who: name of the
    interface."""

    def add(function: F) -> F:
        lines = [f"    {s.name}: {describe_setting(s, who)}" for s in offered(who)]
        function.__doc__ = "\n".join([inspect.cleandoc(function.__doc__ or ""), "", "Settings:", *lines])
        return function

    return add


def settings_read(
    who: str, given: Mapping[str, Any], where: Callable[[str], str] = str
) -> tuple[dict[str, Any], list[Problem]]:
    """(SI values of all settings of an interface, with None for missing or wrong values; list of all problems).

    who: name of the interface. given: numbers or texts by name of the setting; unknown names are ignored. where: function from the
    name of a setting to the place that a problem reports."""
    values: dict[str, Any] = {}
    problems: list[Problem] = []
    for s in offered(who):
        asked = given.get(s.name)
        if who in s.several:
            read = [_read(s, who, x, where(s.name), problems) for x in asked or ()]
            values[s.name] = tuple(x for x in read if x is not None)
        else:
            values[s.name] = None if asked is None else _read(s, who, asked, where(s.name), problems)
    return values, problems


def settings_given(who: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """SI values of the settings of an interface. Raises SceneError with all problems if a value is wrong."""
    values, problems = settings_read(who, given)
    raise_problems(problems)
    return values


def _read(s: Setting, who: str, given: Any, where: str, problems: list[Problem]) -> Any:
    """The value of a setting in SI units. For a wrong value, a problem is appended and the result is None."""
    if s.words:
        known = known_words()[s.words]
        if given in known:
            return given
        hint = suggestion(str(given).lower()[:80], known, f"one of {', '.join(known)}")
        problems.append(Problem(where, f"{given!r} is unknown", hint))
        return None
    read, bound = Amounts(), s.bound_at(who)
    value = read.number(given, where, s.unit)
    problems += read.problems
    if not read.problems and not bound.holds(value):
        problems.append(Problem(where, bound.refusal(s.name, value), bound.advice))
    return value if not read.problems and bound.holds(value) else None
