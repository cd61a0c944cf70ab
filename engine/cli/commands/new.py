"""``trunnion new``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes import DONE, print_json


def command(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the scene and of its folder.")],
    folder: Annotated[str, typer.Option("--dir", metavar="DIR", help="Folder in which the scene's folder is created.")] = ".",
    as_json: Json = False,
) -> int:
    """Write a commented scene to start from."""
    from trunnion.scene.library.starter_scene import write_starter

    written = write_starter(name, folder)
    if as_json:
        print_json({"exit_code": DONE, "folder": str(written), "files": [str(f) for f in sorted(written.iterdir())]})
    else:
        print(f"wrote {written}: edit scene.yaml there, then\n  trunnion simulate {written} --plot {name}.png")
    return DONE
