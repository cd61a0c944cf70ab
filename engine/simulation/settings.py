"""Settings of a run as they are given, by whomever: read with their units, held to their bounds, told in one set of words."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, TypeVar

from engine.basics.problems import Problem, SceneError
from engine.basics.settings import Setting, offered
from engine.friction import REGISTRY as LAWS
from engine.integrators import METHODS
from engine.scene.given import Amounts
from engine.scene.model import Scene
from engine.simulation.bounded import method_of

F = TypeVar("F", bound=Callable[..., Any])
KERNELS = ("auto", "compiled", "lanes", "parts")
"""What evaluates a scene, the usual one first: by the structure and the request (``choosing``)."""
ALONE = tuple(k for k in KERNELS if k != "lanes")
"""Those that step one case: an FMU has no others beside it."""


@dataclass(frozen=True)
class Run:
    """Settings given for a run, or for all runs of a batch; None where a scene's own holds. until, every: s. patience: processor
    seconds a case may take, steps: how many of the solver's it may; None: any number."""

    until: float | None = None
    every: float | None = None
    rtol: float | None = None
    method: str | None = None
    kernel: str | None = None
    patience: float | None = None
    steps: float | None = None

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
    """What the registries hold, by the names that settings have for it."""
    return {"methods": tuple(METHODS), "laws": tuple(LAWS), "kernels": KERNELS}


def told(setting: Setting, who: str) -> str:
    """What a setting is, in sentences, for one of those who offer it."""
    return setting.told(who).format_map({k: ", ".join(v) for k, v in known_words().items()})


def described(who: str) -> Callable[[F], F]:
    """Decorate a function that offers settings: its documentation ends with what each of them is."""

    def add(function: F) -> F:
        lines = [f"    {s.name}: {told(s, who)}" for s in offered(who)]
        function.__doc__ = "\n".join([inspect.cleandoc(function.__doc__ or ""), "", "Settings:", *lines])
        return function

    return add


def settings_read(
    who: str, given: Mapping[str, Any], where: Callable[[str], str] = str
) -> tuple[dict[str, Any], list[Problem]]:
    """(SI values of all settings that ``who`` offers, None where none is given or it is wrong; everything that is wrong). given:
    numbers or texts by name, others are left alone; where: how a user is told which one."""
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
    """The values of the settings; SceneError with everything that is wrong with them."""
    values, problems = settings_read(who, given)
    if problems:
        raise SceneError(problems)
    return values


def _read(s: Setting, who: str, given: Any, where: str, problems: list[Problem]) -> Any:
    """One value of a setting; None for a mistake, which is noted."""
    if s.words:
        known = known_words()[s.words]
        if given in known:
            return given
        near = get_close_matches(str(given).lower()[:80], known, 1)
        hint = f"did you mean {near[0]}?" if near else f"one of {', '.join(known)}"
        problems.append(Problem(where, f"{given!r} is unknown", hint))
        return None
    read, bound = Amounts(), s.bound_at(who)
    value = read.number(given, where, s.unit)
    problems += read.problems
    if not read.problems and not bound.holds(value):
        problems.append(Problem(where, bound.refusal(s.name, value), bound.advice))
    return value if not read.problems and bound.holds(value) else None
