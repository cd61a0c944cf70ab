"""Completion with the tab key, and the words of registries for help texts."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from trunnion.basics.errors import SceneError

FILES = (".yaml", ".yml", ".json")


def registry_words() -> dict[str, str]:
    """Values of the placeholders ``{methods}``, ``{laws}`` and ``{kernels}`` in help texts."""
    from trunnion.simulation.settings.run_settings import known_words

    return {k: ", ".join(v) for k, v in known_words().items()}


def scenes(incomplete: str) -> list[str]:
    """Bundled models, scene files and folders that begin with the word."""
    from trunnion.scene.library.model_folders import bundled_names

    typed = Path(incomplete)
    folder = typed if incomplete.endswith("/") else typed.parent
    found = sorted(folder.iterdir()) if folder.is_dir() else []
    shown = [f"{p}/" if p.is_dir() else str(p) for p in found if p.is_dir() or p.suffix.lower() in FILES]
    return [*with_prefix(bundled_names(), incomplete), *with_prefix((s for s in shown if not s.startswith(".")), incomplete)]


def parameters(incomplete: str) -> list[str]:
    """Paths of the scene's numbers."""
    built = completed_scene()
    return with_prefix(built.parameters.paths, incomplete) if built is not None else []


def assignments(incomplete: str) -> list[str]:
    """Paths of the scene's numbers, each followed by "="."""
    return [f"{p}=" for p in parameters(incomplete)]


def outputs(incomplete: str) -> list[str]:
    """Columns of the scene."""
    from trunnion.kernel.interface.output_columns import columns

    built = completed_scene()
    return with_prefix((c.name for c in columns(built.system)), incomplete) if built is not None else []


def registered(kind: str) -> Callable[[str], list[str]]:
    """The function that completes a word of a registry: ``methods``, ``laws`` or ``kernels``."""

    def complete(incomplete: str) -> list[str]:
        from trunnion.simulation.settings.run_settings import known_words

        return with_prefix(known_words()[kind], incomplete)

    return complete


def with_prefix(words: Iterable[str], incomplete: str) -> list[str]:
    """Words that begin with the incomplete word."""
    return [w for w in words if w.startswith(incomplete)]


def completed_scene() -> Any:
    """The scene of the command line, built. None if no word names a readable scene. The words are read from the shell's variables,
    because click's parser fails while an option still has no value."""
    from trunnion.scene.scene_loader import load_scene
    from trunnion.system.construction.system_builder import build

    line = os.environ.get("_TYPER_COMPLETE_ARGS") or os.environ.get("COMP_WORDS") or ""
    for word in line.split()[2:-1]:
        with suppress(SceneError):
            if not word.startswith("-"):
                return build(load_scene(word))
    return None
