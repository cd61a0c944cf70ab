"""``trunnion fmu``: words to an export, its files, what it says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from engine.cli import helping

if TYPE_CHECKING:
    from engine.scene.model import Scene

KERNEL = typer.Option(
    metavar="K", help="compiled: steps fastest; parts: is written soonest; auto.", autocompletion=helping.kernels
)
OUTPUTS = typer.Option(
    metavar="PATTERN", help="Columns wanted as outputs, such as 'ball.*' (repeatable).", autocompletion=helping.outputs
)
CHANGES = typer.Option(
    "--set", metavar="PATH=VALUE", help="Change a number of the scene (repeatable).", autocompletion=helping.assignments
)
PARAMETERS = typer.Option("--parameters-file", metavar="FILE", help="Write the parameters' values there, too (.ssv).")
PLATFORM = "host (default), all, linux64, win64, darwin64, aarch64-darwin; of FMI 3.0 also aarch64-linux."
SCENE = typer.Argument(
    metavar="SCENE",
    help="A scene file, a folder with a scene.yaml, or a bundled model.",
    show_default=False,
    autocompletion=helping.scenes,
)


def command(
    ctx: typer.Context,
    scene: Annotated[str | None, SCENE] = None,
    save: Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="The .fmu to write (NAME.fmu).")] = None,
    flavour: Annotated[str, typer.Option(metavar="F", help="native: needs nothing on the host; python: pythonfmu.")] = "native",
    fmi: Annotated[int, typer.Option(metavar="N", help="2: FMI 2.0; 3: FMI 3.0, with arrays, event mode and clocks.")] = 2,
    type_: Annotated[str, typer.Option("--type", metavar="T", help="cs: co-simulation; me: model exchange; both.")] = "cs",
    platform: Annotated[list[str] | None, typer.Option(metavar="P", help=PLATFORM)] = None,
    changes: Annotated[list[str] | None, CHANGES] = None,
    outputs: Annotated[list[str] | None, OUTPUTS] = None,
    step: Annotated[str | None, typer.Option(metavar="H", help="Fixed internal step, for real time.")] = None,
    kernel: Annotated[str, KERNEL] = "auto",
    whole_vectors: Annotated[bool, typer.Option("--whole-vectors", help="Components written as 0 are parameters too.")] = False,
    parameters: Annotated[str | None, PARAMETERS] = None,
    sources: Annotated[bool, typer.Option("--sources", help="Its C sources go into it too, for other platforms.")] = False,
    certify: Annotated[bool, typer.Option("--certify", help="With solver.errors = 1 outputs are their own errors.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document instead of text.")] = False,
) -> None:
    """Export the scene as an FMU (co-simulation or model exchange; FMI 2.0, or 3.0 with --fmi 3)."""
    from engine.cli import options
    from engine.cli.options import Findings
    from engine.scene import load_scene
    from engine.simulation.settings import ALONE
    from fmu.asking import FLAVOURS, STANDARDS, apart
    from fmu.exchange import KINDS
    from fmu.platforms import chosen

    found = Findings()
    source = options.one_scene(options.words_of(scene, ctx), found)
    chosen_flavour = options.choice(flavour, FLAVOURS, "--flavour", found)
    kind = options.choice(type_, tuple(KINDS), "--type", found)
    made_of = options.choice(kernel, ALONE, "--kernel", found)
    values = options.assignments(changes or [], found)
    length = options.time(step, "--step", found, zero=True)
    found.problems += apart(chosen_flavour, fmi, parameters, kind, length or 0.0, made_of if sources else None, certify)
    names = found.attempt(lambda: chosen(platform or ["host"], STANDARDS.get(fmi, "2.0")))
    loaded = found.attempt(lambda: load_scene(source)) if source is not None else None
    file = save or (f"{loaded.name}.fmu" if loaded is not None else "scene.fmu")
    target = options.destination(file, (".fmu",), "-o", found)
    found.end()
    assert loaded is not None
    how: dict[str, Any] = {"fmi": fmi, "kind": kind, "flavour": chosen_flavour, "platform": names or [], "overrides": values}
    how |= {"outputs": outputs, "step": length or 0.0, "kernel": made_of, "whole_vectors": whole_vectors}
    _write(loaded, str(target), how | {"parameters": parameters, "sources": sources, "certify": certify}, as_json)


def _write(
    scene: Scene,
    target: str,
    how: dict[str, Any],
    as_json: bool,
) -> None:
    """Export with a progress bar, and print what was written. how: as ``export`` is asked."""
    from dataclasses import asdict

    from engine.cli.progress import Watch
    from engine.cli.running import print_json
    from fmu.export import export

    with Watch(f"FMU of {scene.name}") as watch:
        made = export(scene, target, **how, progress=watch.part)
    if as_json:
        print_json({"exit_code": 0, **asdict(made), "file": str(made.file)})
        return
    v = made.variables
    also = {"cs": "", "me": ", model exchange", "both": ", co-simulation and model exchange"}[how["kind"]]
    kind = f"FMI {how['fmi']}.0, flavour {how['flavour']}{also}"
    typer.echo(f"{made.file}: {made.bytes / 1024:.0f} kB, {kind}, {', '.join(made.platforms)}")
    count = f"{v['output']} outputs, {v['local']} local variables, {v['input']} inputs, {v['parameter']} parameters"
    typer.echo(f"  {count}, GUID {made.guid}")
    for note in made.notes:
        typer.echo(f"  {note}")


def app() -> typer.Typer:
    """The typer app of the sub-command ``trunnion fmu``."""
    made = typer.Typer(add_completion=False)
    made.command("fmu", context_settings={"ignore_unknown_options": True, "allow_extra_args": True})(command)
    return made


fmu = app()
