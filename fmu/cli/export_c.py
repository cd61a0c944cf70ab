"""``trunnion export c``."""

from __future__ import annotations

import typer

from trunnion.cli.options.option_declarations import Changes, Json, Scene
from trunnion.fmu.cli.export_request import CFolder
from trunnion.fmu.cli.fmu import FmuOutputs, Step


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    step: Step = None,
    changes: Changes,
    outputs: FmuOutputs,
    save: CFolder = None,
    as_json: Json = False,
) -> int:
    """Export a scene as a C99 library that needs no heap and no input or output, with an example and build files."""
    from trunnion.cli.output.exit_codes import DONE
    from trunnion.cli.output.printed_output import print_result
    from trunnion.fmu.c_library.library_files import library, write_files
    from trunnion.fmu.cli.export_request import read_export

    loaded, how, folder = read_export(ctx, scene, save, "c", changes, step)
    made = library(loaded, outputs=outputs or None, **how)
    files = {name: text.encode() for name, text in made.files.items()}
    write_files(folder, files)
    size = sum(map(len, files.values()))
    document = {
        "folder": str(folder), "files": sorted(files), "bytes": size, "state": made.bytes, "variables": len(made.called),
        "operations": made.operations,
    }  # fmt: skip
    lines = [f"{folder}: {size / 1024:.0f} kB of C99, {len(made.called)} variables, {made.bytes / 1024:.1f} kB of state"]
    lines += [f"  {made.promise}"] if made.promise else []
    return print_result(as_json, DONE, document, [*lines, f"  cd {folder} && cc -std=c99 -O2 *.c -lm -o example && ./example"])
