"""Options of commands that set a run, made from the table of settings."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

from engine.basics.settings import Setting, offered
from engine.cli import helping

Words = dict[str, Any]
"""What was written for each setting of a command, by name; None where nothing was."""


def with_settings(who: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of all settings that it offers; its function gets their words by name as ``settings``."""

    def add(work: Callable[..., None]) -> Callable[..., None]:
        options = {s.name: _parameter(s, who) for s in offered(who)}
        own = inspect.signature(work, eval_str=True)
        first, *others = (p for p in own.parameters.values() if p.name != "settings")

        @wraps(work)
        def called(**given: Any) -> None:
            work(settings={n: given.pop(n) for n in options}, **given)

        at = 1 if others and others[0].name == "scene" else 0
        parameters = [first, *others[:at], *options.values(), *others[at:]]
        plain = [p.replace(kind=inspect.Parameter.POSITIONAL_OR_KEYWORD) for p in parameters]
        del called.__wrapped__  # type: ignore[attr-defined]
        called.__signature__ = own.replace(parameters=plain)  # type: ignore[attr-defined]
        called.__annotations__ = {p.name: p.annotation for p in plain}
        return called

    return add


def _parameter(s: Setting, who: str) -> inspect.Parameter:
    complete = getattr(helping, s.words) if s.words else None
    option = typer.Option(f"--{s.name}", metavar=s.metavar, help=s.told(who), show_default=False, autocompletion=complete)
    kind: Any = list[str] | None if who in s.several else str | None
    return inspect.Parameter(s.name, inspect.Parameter.POSITIONAL_OR_KEYWORD, default=None, annotation=Annotated[kind, option])
