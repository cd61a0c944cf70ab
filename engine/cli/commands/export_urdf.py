"""``trunnion export urdf``."""

from __future__ import annotations

from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Scene, file_option
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import print_result

SUFFIXES = (".urdf",)


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    changes: Changes,
    save: Annotated[str | None, file_option(".urdf", what="Write the file instead of printing it")] = None,
    as_json: Json = False,
) -> int:
    """Export a scene as URDF, and list the keys that URDF cannot express."""
    from trunnion.basics.atomic_files import writing
    from trunnion.importers.urdf_export import urdf_of_scene

    reader = ArgumentReader()
    path = reader.destination(save, SUFFIXES)
    text, notes = urdf_of_scene(reader.checked(reader.scene(scene, ctx, changes)))
    if path:
        with writing(path, SUFFIXES) as work:
            work.write_text(text, encoding="utf-8")
    lines = [f"wrote {path}" if path else text.removesuffix("\n"), *(f"note: {note}" for note in notes)]
    return print_result(as_json, DONE, {"urdf": text, "notes": notes, "file": save}, lines)
