"""``trunnion new``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import print_result


def command(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the scene and of its folder.")],
    folder: Annotated[str, typer.Option("--dir", metavar="DIR", help="Folder in which the scene's folder is created.")] = ".",
    as_json: Json = False,
) -> int:
    """Write a commented scene to start from."""
    from trunnion.scene.library.starter_scene import write_starter

    written = write_starter(name, folder)
    document = {"folder": str(written), "files": [str(f) for f in sorted(written.iterdir())]}
    lines = [f"wrote {written}: edit scene.yaml there, then", f"  trunnion simulate {written} --plot {name}.png"]
    return print_result(as_json, DONE, document, lines)
