"""``trunnion export c`` and ``trunnion export web``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.cli.options.argument_reader import ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Scene
from trunnion.fmu.cli.fmu import FmuOutputs, Step

if TYPE_CHECKING:
    from trunnion.scene.data_classes.scene import Scene as SceneData


def folder_option(name: str) -> Any:
    """The command-line option ``-o`` for a folder. name: the default folder, as the help shows it."""
    return typer.Option("-o", "--output", metavar="DIR", help="Folder for the written files.", show_default=name)


CFolder = Annotated[str | None, folder_option("NAME_c")]
WebFolder = Annotated[str | None, folder_option("NAME_web")]


def read_export(
    ctx: typer.Context, scene: str | None, save: str | None, kind: str, changes: Sequence[str], step: str | None
) -> tuple[SceneData, dict[str, Any], Path]:
    """The scene, the arguments ``overrides`` and ``step`` (s) of the export, and the folder. Raises SceneError with all
    mistakes."""
    reader = ArgumentReader()
    values = reader.assignments(changes)
    length = reader.time(step, "--step", zero=True)
    loaded = reader.scene(scene, ctx, ())
    folder = Path(save or (f"{loaded.name}_{kind}" if loaded is not None else kind))
    if folder.exists() and not folder.is_dir():
        reader.add("-o", f"{str(folder)!r} is a file", "give the name of a folder")
    loaded = reader.checked(loaded)
    return loaded, {"overrides": values, "step": length or 0.0}, folder


def export_c(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    step: Step = None,
    changes: Changes,
    outputs: FmuOutputs,
    save: CFolder = None,
    as_json: Json = False,
) -> int:
    """Export a scene as a C99 library with an example and build files. The library needs no heap and no input or output."""
    from trunnion.cli.output.exit_codes_and_errors import DONE
    from trunnion.cli.output.printed_output import print_result
    from trunnion.fmu.c_library.library_files import library, write_files

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


def export_web(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    step: Step = None,
    changes: Changes,
    save: WebFolder = None,
    as_json: Json = False,
) -> int:
    """Export a scene as one offline web page that simulates and draws the mechanism (WebAssembly)."""
    from trunnion.cli.output.exit_codes_and_errors import DONE
    from trunnion.cli.output.printed_output import print_result
    from trunnion.cli.output.progress_bars import ProgressBar
    from trunnion.fmu.c_library.library_files import write_files
    from trunnion.fmu.c_library.wasm_page import web

    loaded, how, folder = read_export(ctx, scene, save, "web", changes, step)
    with ProgressBar(f"WebAssembly of {loaded.name}") as bar:
        bar.show_part("compiling for wasm32", 0, 1)
        files = web(loaded, how["overrides"], how["step"])
    write_files(folder, files)
    page, module = sorted(files)
    document = {"folder": str(folder), "files": [page, module], "bytes": sum(map(len, files.values()))}
    size = f"{len(files[page]) / 1024:.0f} kB, {len(files[module]) / 1024:.0f} kB of WebAssembly in this file"
    return print_result(as_json, DONE, document, [f"{folder / page}: {size} (open it in a browser; {module} is the module alone)"])
