"""``trunnion import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from trunnion.cli.options.argument_reader import SCENES, ArgumentReader
from trunnion.cli.options.option_declarations import Json, file_option
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import print_result

MESHES = (".stl", ".obj", ".ply")
FILE = "A mechanism (URDF, MJCF, SDF, ASMT) or a mesh (STL, OBJ, PLY)."


def command(
    file: Annotated[str, typer.Argument(metavar="FILE", help=FILE)],
    density: Annotated[str, typer.Option(metavar="D", help="Density of the solid body inside a mesh.")] = "7800 kg/m^3",
    unit: Annotated[str, typer.Option(metavar="U", help="Unit of length of a mesh or an ASMT file: m, cm, mm, in.")] = "mm",
    end_stops: Annotated[
        str | None,
        typer.Option(
            metavar="K", help="Stiffness of the end stops that replace joint limits, N/m or N*m/rad.", show_default="no end stops"
        ),
    ] = None,
    save: Annotated[str | None, file_option(".yaml", what="Write the scene to this file instead of printing it")] = None,
    as_json: Json = False,
) -> int:
    """Import a mechanism of another program as a scene, or a mesh as a body with mass properties."""
    from trunnion.basics.atomic_files import writing
    from trunnion.importers import body_of_mesh, scene_of
    from trunnion.importers.format_detection import SUFFIXES
    from trunnion.scene.file_format.yaml_writer import scene_to_dict, yaml_text

    reader = ArgumentReader()
    path = reader.destination(save, SCENES)
    kilograms = reader.quantity(density, "kg/m^3", "--density") or 0.0
    suffix = Path(file).suffix.lower()
    if suffix not in (*SUFFIXES, *MESHES):
        reader.add("FILE", f"{file!r} is neither a mechanism nor a mesh", f"one of {', '.join((*SUFFIXES, *MESHES))}")
    stiffness = stiffness_of(end_stops, reader) if end_stops is not None else None
    reader.end()
    notes: list[str] = []
    if suffix in SUFFIXES:
        scene, notes = scene_of(file, unit, stiffness)
        data = scene_to_dict(scene)
    else:
        data = {"bodies": {Path(file).stem: body_of_mesh(file, kilograms, unit, notes)}}
    text = yaml_text(data)
    if path:
        with writing(path, SCENES) as work:
            work.write_text(text, encoding="utf-8")
    lines = [f"wrote {path}" if path else text.removesuffix("\n"), *(f"note: {note}" for note in notes)]
    return print_result(as_json, DONE, {"scene": data, "notes": notes, "file": save}, lines)


def stiffness_of(text: str, reader: ArgumentReader) -> float:
    """A stiffness, in N/m for translations and N*m/rad for rotations. The text has no unit, because one number serves for
    translations and rotations."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        reader.add(
            "--end-stops", f"{text!r} is not a stiffness", "write a positive number (N/m and N*m/rad), for example --end-stops 1e5"
        )
    return value
