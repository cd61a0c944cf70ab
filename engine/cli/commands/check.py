"""``trunnion check``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from trunnion.cli.options.argument_reader import SCENES, ArgumentReader
from trunnion.cli.options.option_declarations import Changes, Json, Scene, file_option
from trunnion.cli.output.exit_codes_and_errors import DONE, FAILED
from trunnion.cli.output.printed_output import print_answer, print_result, table

if TYPE_CHECKING:
    from pathlib import Path

    from trunnion.scene.data_classes.scene import Scene as SceneData

HOLD = "Check whether friction holds the mechanism at rest in its start pose, and by what margin."
BOUNDS = "With --hold: compute bounds over all force distributions that statics allows, instead of one distribution."
SELF_STRESS = "With --bounds: largest contact force that misaligned joints cause, N."
BUDGET = "With --bounds: limit of the computing time, s."
DRAW = "Draw the assembled mechanism at its start: .png, .svg or .pdf."
MISFIT = "With --bounds: largest misalignment of joints, m."


def command(
    ctx: typer.Context,
    scene: Scene = None,
    *,
    columns: Annotated[bool, typer.Option("--columns", help="List all columns of the scene.")] = False,
    hold: Annotated[bool, typer.Option("--hold", help=HOLD)] = False,
    bounds: Annotated[bool, typer.Option("--bounds", help=BOUNDS)] = False,
    self_stress: Annotated[float | None, typer.Option("--self-stress", metavar="N", help=SELF_STRESS)] = None,
    misfit: Annotated[float | None, typer.Option("--misfit", metavar="M", help=MISFIT)] = None,
    budget: Annotated[
        float | None,
        typer.Option("--budget", metavar="S", help=BUDGET, show_default="no limit"),
    ] = None,
    changes: Changes,
    whole: Annotated[str | None, file_option(".yaml", what="Write the scene with includes and copies expanded")] = None,
    plot: Annotated[str | None, typer.Option("--plot", metavar="FILE", help=DRAW)] = None,
    as_json: Json = False,
) -> int:
    """List the mistakes of a scene. If it has none, list its bodies, joints, degrees of freedom, loops and columns."""
    reader = ArgumentReader()
    picture = reader.picture(plot)
    file = reader.destination(whole, SCENES)
    loaded = reader.scene(scene, ctx, changes)
    if bounds and not hold:
        reader.add("--bounds", "needs --hold", "write --hold --bounds")
    for name, value, metavar in (("--self-stress", self_stress, "N"), ("--misfit", misfit, "M"), ("--budget", budget, "S")):
        if value is not None and not bounds:
            reader.add(name, "needs --bounds", f"write --hold --bounds {name} {metavar}")
    loaded = reader.checked(loaded)
    written = write(loaded, picture, file)
    if bounds:
        return report_bounds(loaded, self_stress, misfit, budget, as_json)
    if hold:
        return report_hold(loaded, as_json)
    from trunnion.cli.output.scene_report import examined, report_lines

    report, every = examined(loaded)
    code = DONE if report["start"]["outcome"] in ("done", "ready") else FAILED
    listed = [{"name": c.name, "unit": c.unit, "description": c.description} for c in every]
    lines = table(("column", "unit", "meaning"), [tuple(c.values()) for c in listed]) if columns else report_lines(report)
    return print_answer(as_json, code, {"problems": []} | report | ({"outputs": listed} if columns else {}), lines, written)


def report_hold(scene: SceneData, as_json: bool) -> int:
    """Report whether friction holds the scene at rest. Returns the exit code."""
    from trunnion.analysis.static_bounds.start_pose_statics import hold
    from trunnion.cli.output.hold_report import hold_document, hold_lines

    report = hold(scene)
    code = DONE if report.holds else FAILED
    document = {"problems": [], "scene": scene.name, "hold": hold_document(report)}
    return print_result(as_json, code, document, hold_lines(scene.name, report))


def report_bounds(scene: SceneData, self_stress: float | None, misfit: float | None, budget: float | None, as_json: bool) -> int:
    """Report bounds over all force distributions that statics allows. Returns the exit code. self_stress: in N. misfit: in m.
    budget: in s."""
    from trunnion.analysis.static_bounds.hold_check import hold
    from trunnion.cli.output.hold_bounds_report import bounds_document, bounds_lines

    report = hold(scene, bounds=True, self_stress=self_stress, misfit=misfit, budget=budget)
    code = DONE if report.holds == "certain" else FAILED
    document = {"problems": [], "scene": scene.name, "hold": bounds_document(report)}
    return print_result(as_json, code, document, bounds_lines(scene.name, report))


def write(scene: SceneData, picture: Path | None, file: Path | None) -> list[Path]:
    """Write the scene and the picture of its assembled start, as requested. SceneError if the start cannot be assembled."""
    from trunnion.basics.atomic_files import writing
    from trunnion.scene.file_format.yaml_writer import scene_to_yaml

    if file is not None:
        with writing(file, SCENES) as work:
            work.write_text(scene_to_yaml(scene), encoding="utf-8")
    if picture is not None:
        from trunnion.plots import mechanism, save_figure
        from trunnion.plots.mechanism_pictures.instant_picture import assemble_start

        save_figure(mechanism(assemble_start(scene, "--plot")), picture)
    return [p for p in (file, picture) if p is not None]
