"""Commands of other packages: entry points of the group ``trunnion.commands``, loaded only when invoked."""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from engine.basics.extras import Missing, brings, extra_of, remedy
from engine.basics.problems import Problem, SceneError

GROUP = "trunnion.commands"
EXTRAS = {
    "fmu": ("fmu", "export the scene as an FMU"),
    "ssp": ("fmu", "write a system of FMUs as an SSP file"),
    "export": ("fmu", "export the scene as a C library or a page"),
    "serve": ("service", "serve simulations over HTTP"),
    "jobs": ("service", "submit and follow jobs on a server"),
}
"""Commands that come with an extra: name → (extra, what it does)."""


@lru_cache(maxsize=1)
def registered() -> dict[str, EntryPoint]:
    """Entry points of commands, by name."""
    return {e.name: e for e in entry_points(group=GROUP)}


class Commands(TyperGroup):
    """The engine's own commands, then those registered by other packages."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names for the help text."""
        own = super().list_commands(ctx)
        return [*own, *sorted(n for n in registered() if n not in own)]

    def get_command(self, ctx: Any, name: str) -> Any:
        """A command by name; another package's is not loaded, but described as far as the help text needs."""
        own = super().get_command(ctx, name)
        if own is not None or name not in registered():
            return own
        return TyperCommand(
            name, help=EXTRAS[name][1].capitalize() + "." if name in EXTRAS else f"From {registered()[name].value}."
        )

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command to invoke: another package's is loaded now; SceneError with the pip line when it is missing."""
        name = args[0] if args else ""
        if super().get_command(ctx, name) is None:
            if name in registered():
                return name, loaded(name), args[1:]
            if name in EXTRAS:
                raise SceneError([missing(name)])
        return super().resolve_command(ctx, args)


def missing(name: str) -> Problem:
    """What to say about a command whose extra is not installed."""
    extra, what = EXTRAS[name]
    return Problem(f"trunnion {name}", f"is not installed (it would {what})", remedy(extra))


def lacking(error: ImportError, words: list[str]) -> Problem | None:
    """What to say when a command finds a package missing that an extra would bring; None when none would: then it is a defect."""
    command = next((w for w in words if not w.startswith("-")), "")
    own, module = EXTRAS.get(command, ("", ""))[0], error.name or ""
    extra = own if brings(own, module) else error.extra if isinstance(error, Missing) else extra_of(module)
    if not extra:
        return None
    package = (error.name or "").partition(".")[0]
    return Problem(f"trunnion {command}".rstrip(), f"needs the package {package}, which is not installed", remedy(extra))


def loaded(name: str) -> Any:
    """The command behind an entry point: a typer app, a ready command, or a function that becomes one."""
    try:
        found = registered()[name].load()
    except ImportError as e:
        hint = missing(name).hint if name in EXTRAS else f"repair the package of {registered()[name].value}"
        raise SceneError([Problem(f"trunnion {name}", f"cannot be loaded: {e}", hint)]) from e
    if isinstance(found, typer.Typer):
        return typer.main.get_command(found)
    if hasattr(found, "make_context"):
        return found
    app = typer.Typer(add_completion=False)
    app.command(name)(found)
    return typer.main.get_command(app)
