"""``trunnion fmu``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from trunnion.cli.options import completion
from trunnion.cli.options.option_declarations import Changes, Json, Scene, columns_option

if TYPE_CHECKING:
    from trunnion.scene.data_classes.scene import Scene as SceneData

KERNEL = "How the equations are evaluated. compiled gives the fastest runs, parts the fastest export. auto chooses one of these."
PLATFORM = (
    "host, all, linux64, win64, darwin64, aarch64-darwin, aarch64-linux (FMI 2.0: no other platform), aarch64-windows (FMI 3.0)."
)
Platform = Annotated[list[str], typer.Option("--platform", metavar="P", help=PLATFORM, default_factory=list, show_default="host")]
Step = Annotated[
    str | None,
    typer.Option("--step", metavar="H", help="Fixed internal step, s, for real time.", show_default="error control"),
]
FmuOutputs = Annotated[
    list[str], columns_option("Columns that become output variables, such as 'ball.*'.", show_default="the scene's")
]


Save = Annotated[str | None, typer.Option("-o", "--output", metavar="FILE", help="Write this .fmu.", show_default="NAME.fmu")]
FLAVOUR = "native: for any host. python: for a host with a Python interpreter; the export needs pythonfmu."
WHOLE_VECTORS = "Vector components that are 0 in the scene become parameters of the FMU, too."
REFERENCE = "Include results of the scene with their allowed differences, to check importers (FMI-LS-REF)."
VALUES = "Also write the values of all parameters to this .ssv file."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    flavour: Annotated[str, typer.Option(metavar="F", help=FLAVOUR)] = "native",
    fmi: Annotated[int, typer.Option(metavar="N", help="2: FMI 2.0; 3: FMI 3.0, with arrays, event mode and clocks.")] = 2,
    type_: Annotated[str, typer.Option("--type", metavar="T", help="cs: co-simulation; me: model exchange; both.")] = "cs",
    scalars: Annotated[bool, typer.Option("--scalars", help="FMI 3.0 without arrays, for hosts that read only scalars.")] = False,
    platform: Platform,
    step: Step = None,
    kernel: Annotated[str, typer.Option(metavar="K", help=KERNEL, autocompletion=completion.registered("kernels"))] = "auto",
    whole_vectors: Annotated[bool, typer.Option("--whole-vectors", help=WHOLE_VECTORS)] = False,
    parameters: Annotated[str | None, typer.Option("--parameters-file", metavar="FILE", help=VALUES)] = None,
    sources: Annotated[
        bool, typer.Option("--sources", help="Include the C sources, so that other tools can compile the FMU for other platforms.")
    ] = False,
    certify: Annotated[
        bool, typer.Option("--certify", help="Add the parameter solver.errors. If it is 1, each output holds its error estimate.")
    ] = False,
    reference: Annotated[bool, typer.Option("--reference", help=REFERENCE)] = False,
    changes: Changes,
    outputs: FmuOutputs,
    save: Save = None,
    as_json: Json = False,
) -> int:
    """Export a scene as an FMU for co-simulation or model exchange, by FMI 2.0 or 3.0."""
    from trunnion.cli.options.argument_reader import ArgumentReader
    from trunnion.fmu.binaries.platform_builds import chosen
    from trunnion.fmu.export_option_checks import FLAVOURS, STANDARDS, apart
    from trunnion.fmu.variables.model_exchange_states import KINDS
    from trunnion.simulation.settings.run_settings import ALONE

    reader = ArgumentReader()
    how: dict[str, Any] = {
        "flavour": reader.choice(flavour, FLAVOURS, "--flavour"), "kind": reader.choice(type_, tuple(KINDS), "--type"),
        "kernel": reader.choice(kernel, ALONE, "--kernel"), "overrides": reader.assignments(changes), "outputs": outputs or None,
        "step": reader.time(step, "--step", zero=True) or 0.0, "fmi": fmi, "whole_vectors": whole_vectors,
        "parameters": parameters, "sources": sources, "certify": certify,
        "scalars": scalars, "reference": reference,
    }  # fmt: skip
    compiled = how["kernel"] if sources else None
    reader.problems += apart(how["flavour"], fmi, parameters, how["kind"], how["step"], compiled, certify, scalars)
    how["platform"] = reader.attempt(lambda: chosen(platform or ["host"], STANDARDS.get(fmi, "2.0")))
    loaded = reader.scene(scene, ctx, ())
    target = reader.destination(save or (f"{loaded.name}.fmu" if loaded is not None else "scene.fmu"), (".fmu",))
    return export_and_report(reader.checked(loaded), str(target), how, as_json)


def export_and_report(scene: SceneData, target: str, how: dict[str, Any], as_json: bool) -> int:
    """Export with a progress bar, print a summary and return the exit code. how: arguments of ``export``."""
    from dataclasses import asdict

    from trunnion.cli.output.exit_codes_and_errors import DONE
    from trunnion.cli.output.printed_output import print_result
    from trunnion.cli.output.progress_bars import ProgressBar
    from trunnion.fmu.scene_export import export

    with ProgressBar(f"FMU of {scene.name}") as bar:
        made = export(scene, target, **how, progress=bar.show_part)
    v = made.variables
    also = {"cs": "", "me": ", model exchange", "both": ", co-simulation and model exchange"}[how["kind"]]
    lines = [
        f"{made.file}: {made.bytes / 1024:.0f} kB, FMI {how['fmi']}.0, flavour {how['flavour']}{also}, {', '.join(made.platforms)}",
        f"  {v['output']} outputs, {v['local']} local variables, {v['input']} inputs, {v['parameter']} parameters",
        f"  GUID {made.guid}",
        *(f"  {note}" for note in made.notes),
    ]
    return print_result(as_json, DONE, asdict(made) | {"file": str(made.file)}, lines)
