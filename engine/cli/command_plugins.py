"""Commands of other packages: entry points of the group ``trunnion.commands``, loaded when they are invoked."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import typer

from trunnion.basics.problems import Problem, SceneError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "trunnion.commands"


@lru_cache(maxsize=1)
def registered() -> dict[str, EntryPoint]:
    """Entry points of commands, by name. They are read from the metadata of all installed packages, which takes longer than to find
    a command of Trunnion."""
    from importlib.metadata import entry_points

    return {e.name: e for e in entry_points(group=GROUP)}


def loaded(name: str) -> Any:
    """The command behind an entry point: a typer app, a click command, or a function that becomes a command. SceneError if the
    import fails."""
    try:
        found = registered()[name].load()
    except ImportError as e:
        hint = f"repair the package of {registered()[name].value}"
        raise SceneError([Problem(f"trunnion {name}", f"cannot be loaded: {e}", hint)]) from e
    if isinstance(found, typer.Typer):
        return typer.main.get_command(found)
    if hasattr(found, "make_context"):
        return found
    app = typer.Typer(add_completion=False)
    app.command(name)(found)
    return typer.main.get_command(app)
