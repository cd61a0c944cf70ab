"""``trunnion export``: a scene as a C library, or as a page that steps it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu.cli import CHANGES, OUTPUTS, SCENE

if TYPE_CHECKING:
    from engine.scene.model import Scene

FOLDER = typer.Option("-o", "--output", metavar="FOLDER", help="Where the files go (NAME_c, NAME_web).", show_default=False)
STEP = typer.Option(metavar="H", help="Fixed internal step, for real time.", show_default=False)
AS_JSON = typer.Option("--json", help="Print one JSON document instead of text.")
LENIENT = {"ignore_unknown_options": True, "allow_extra_args": True}

export = typer.Typer(add_completion=False, no_args_is_help=True)


@export.callback()
def group() -> None:
    """Export the scene as C that runs anywhere."""


@export.command("c", context_settings=LENIENT)
def c(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    save: Annotated[str | None, FOLDER] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    outputs: Annotated[list[str] | None, OUTPUTS] = None,
    step: Annotated[str | None, STEP] = None,
    as_json: Annotated[bool, AS_JSON] = False,
) -> None:
    """A C99 library: one struct, no heap, no input or output; with an example and how it is built."""
    from fmu.sources.library import library, write_files

    loaded, how, folder = _asked(ctx, scene, save, "c", changes, outputs, step)
    made = library(loaded, **how)
    files = {name: text.encode() for name, text in made.files.items()}
    write_files(folder, files)
    size = sum(map(len, files.values()))
    said = {"folder": str(folder), "files": sorted(files), "bytes": size, "state": made.bytes, "variables": len(made.called),
            "operations": made.operations}
    told = f"{folder}: {size / 1024:.0f} kB of C99, {len(made.called)} variables, {made.bytes / 1024:.1f} kB of state"
    promised = [f"  {made.promise}"] if made.promise else []
    _tell(said, [told, *promised, f"  cd {folder} && cc -std=c99 -O2 *.c -lm -o example && ./example"], as_json)


@export.command("web", context_settings=LENIENT)
def web(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    save: Annotated[str | None, FOLDER] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    step: Annotated[str | None, STEP] = None,
    as_json: Annotated[bool, AS_JSON] = False,
) -> None:
    """WebAssembly, with a page that steps and draws the mechanism while its numbers are changed: one file, offline."""
    from engine.cli.progress import Watch
    from fmu.sources.library import write_files
    from fmu.sources.web import web as page_of

    loaded, how, folder = _asked(ctx, scene, save, "web", changes, None, step)
    with Watch(f"WebAssembly of {loaded.name}") as watch:
        watch.part("compiling for wasm32", 0, 1)
        files = page_of(loaded, how["overrides"], how["step"])
    write_files(folder, files)
    said = {"folder": str(folder), "files": sorted(files), "bytes": sum(map(len, files.values()))}
    page, module = sorted(files)
    size = f"{len(files[page]) / 1024:.0f} kB, {len(files[module]) / 1024:.0f} kB of WebAssembly in it"
    _tell(said, [f"{folder / page}: {size} (open it in a browser; {module} is the module alone)"], as_json)


def _asked(
    ctx: typer.Context,
    scene: str | None,
    save: str | None,
    kind: str,
    changes: list[str] | None,
    outputs: list[str] | None,
    step: str | None,
) -> tuple[Scene, dict[str, Any], Any]:
    """The scene, how it is exported, and the folder that words ask for; SceneError with all that is wrong with them."""
    from pathlib import Path

    from engine.cli import options
    from engine.cli.options import Findings
    from engine.scene import load_scene

    found = Findings()
    source = options.one_scene(options.words_of(scene, ctx), found)
    values = options.assignments(changes or [], found)
    length = options.time(step, "--step", found, zero=True)
    loaded = found.attempt(lambda: load_scene(source)) if source is not None else None
    folder = Path(save or (f"{loaded.name}_{kind}" if loaded is not None else kind))
    if folder.exists() and not folder.is_dir():
        found.add("-o", f"{str(folder)!r} is a file", "give the name of a folder")
    found.end()
    assert loaded is not None
    return loaded, {"overrides": values, "outputs": outputs, "step": length or 0.0}, folder


def _tell(said: dict[str, Any], lines: list[str], as_json: bool) -> None:
    """Say what was written."""
    from engine.cli.running import print_json

    if as_json:
        print_json({"exit_code": 0, **said})
        return
    for line in lines:
        typer.echo(line)
