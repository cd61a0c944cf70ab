"""``trunnion export web``."""

from __future__ import annotations

import typer

from trunnion.cli.options.option_declarations import Changes, Json, Scene
from trunnion.fmu.cli.export_request import WebFolder
from trunnion.fmu.cli.fmu import Step


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    step: Step = None,
    changes: Changes,
    save: WebFolder = None,
    as_json: Json = False,
) -> int:
    """Export a scene as one offline web page that simulates and draws the mechanism (WebAssembly)."""
    from trunnion.cli.output.exit_codes import DONE
    from trunnion.cli.output.printed_output import print_result
    from trunnion.cli.output.progress_bars import ProgressBar
    from trunnion.fmu.c_library.library_files import write_files
    from trunnion.fmu.c_library.wasm_page import web
    from trunnion.fmu.cli.export_request import read_export

    loaded, how, folder = read_export(ctx, scene, save, "web", changes, step)
    with ProgressBar(f"WebAssembly of {loaded.name}") as bar:
        bar.show_part("compiling for wasm32", 0, 1)
        files = web(loaded, how["overrides"], how["step"])
    write_files(folder, files)
    page, module = sorted(files)
    document = {"folder": str(folder), "files": [page, module], "bytes": sum(map(len, files.values()))}
    size = f"{len(files[page]) / 1024:.0f} kB, {len(files[module]) / 1024:.0f} kB of WebAssembly in this file"
    return print_result(as_json, DONE, document, [f"{folder / page}: {size} (open it in a browser; {module} is the module alone)"])
