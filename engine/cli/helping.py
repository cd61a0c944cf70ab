"""What the registries hold, where the command line names it: in the help texts, and when a word is completed with the tab key.

Help texts say ``{methods}`` and ``{laws}``; they are filled in when a command's help is asked for, so that the list of commands
waits for nothing heavy.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from typer.core import TyperCommand

from engine.basics.problems import SceneError

FILES = (".yaml", ".yml", ".json")


def named() -> dict[str, str]:
    """What the placeholders in help texts stand for."""
    from engine.simulation.settings import known_words

    return {k: ", ".join(v) for k, v in known_words().items()}


class Listed(TyperCommand):
    """A command whose help names what the registries hold."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help with its placeholders filled in."""
        for p in self.params:
            text = getattr(p, "help", None)
            if text and "{" in text:
                p.help = text.format_map(named())  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)


# -- The tab key ----------------------------------------------------------------------------------------------------------------


def scenes(incomplete: str) -> list[str]:
    """Bundled models, scene files and folders that begin with the word."""
    from engine.scene.library import bundled_names

    typed = Path(incomplete)
    folder = typed if incomplete.endswith("/") else typed.parent
    found = sorted(folder.iterdir()) if folder.is_dir() else []
    shown = [f"{p}/" if p.is_dir() else str(p) for p in found if p.is_dir() or p.suffix.lower() in FILES]
    return [*_beginning(bundled_names(), incomplete), *_beginning((s for s in shown if not s.startswith(".")), incomplete)]


def parameters(incomplete: str) -> list[str]:
    """Paths of the scene's numbers."""
    built = _built()
    return _beginning(built.parameters.paths, incomplete) if built is not None else []


def assignments(incomplete: str) -> list[str]:
    """Paths of the scene's numbers with "=", to be followed by a value."""
    return [f"{p}=" for p in parameters(incomplete)]


def outputs(incomplete: str) -> list[str]:
    """Columns the scene can give."""
    from engine.kernel.columns import columns

    built = _built()
    return _beginning((c.name for c in columns(built.system)), incomplete) if built is not None else []


def methods(incomplete: str) -> list[str]:
    """Integration methods that begin with the word."""
    from engine.integrators import METHODS

    return _beginning(METHODS, incomplete)


def laws(incomplete: str) -> list[str]:
    """Friction laws that begin with the word."""
    from engine.cli import options

    return _beginning(options.laws(), incomplete)


def kernels(incomplete: str) -> list[str]:
    """Kinds of kernels that begin with the word."""
    from engine.simulation.settings import KERNELS

    return _beginning(KERNELS, incomplete)


def _beginning(words: Iterable[str], incomplete: str) -> list[str]:
    return [w for w in words if w.startswith(incomplete)]


def _built() -> Any:
    """The scene that stands on the line, made ready; None where no word of it can be read as one. The line comes from the shell:
    the parser gives up at the option that still has no value."""
    from engine.scene.load import load_scene
    from engine.system.build import build

    line = os.environ.get("_TYPER_COMPLETE_ARGS") or os.environ.get("COMP_WORDS") or ""
    for word in line.split()[2:-1]:
        with suppress(SceneError):
            if not word.startswith("-"):
                return build(load_scene(word))
    return None
