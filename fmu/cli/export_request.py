"""Options and arguments that the commands ``export c`` and ``export web`` share: scene, step and folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.cli.options.argument_reader import ArgumentReader

if TYPE_CHECKING:
    from trunnion.scene.data_classes.scene import Scene


def folder_option(name: str) -> Any:
    """The option ``-o`` for a folder. name: the default folder in the help."""
    return typer.Option("-o", "--output", metavar="DIR", help="Folder for the written files.", show_default=name)


CFolder = Annotated[str | None, folder_option("NAME_c")]
WebFolder = Annotated[str | None, folder_option("NAME_web")]


def read_export(
    ctx: typer.Context, scene: str | None, save: str | None, kind: str, changes: Sequence[str], step: str | None
) -> tuple[Scene, dict[str, Any], Path]:
    """The scene, the arguments ``overrides`` and ``step`` (s) of the export, and the folder. SceneError with all mistakes."""
    reader = ArgumentReader()
    values = reader.assignments(changes)
    length = reader.time(step, "--step", zero=True)
    loaded = reader.scene(scene, ctx, ())
    folder = Path(save or (f"{loaded.name}_{kind}" if loaded is not None else kind))
    if folder.exists() and not folder.is_dir():
        reader.add("-o", f"{str(folder)!r} is a file", "give the name of a folder")
    loaded = reader.checked(loaded)
    return loaded, {"overrides": values, "step": length or 0.0}, folder
