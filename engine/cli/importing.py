"""``trunnion import``: a scene from URDF, MJCF, SDF or ASMT, a body from a mesh."""

from __future__ import annotations

from pathlib import Path

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, print_json

MESHES = (".stl", ".obj", ".ply")


def import_command(file: str, save: str | None, density: str, unit: str, stops: str | None, as_json: bool) -> int:
    """Read the file, then write the scene or print it; the exit code."""
    from engine.basics.files import writing
    from engine.doors import body_of_mesh, scene_of
    from engine.doors.opening import SUFFIXES
    from engine.scene.dump import scene_to_dict, yaml_text

    found = Findings()
    path = options.destination(save, (".yaml", ".yml"), "-o", found)
    kilograms = options.quantity(density, "kg/m^3", "--density", found) or 0.0
    suffix = Path(file).suffix.lower()
    if suffix not in (*SUFFIXES, *MESHES):
        found.add("FILE", f"{file!r} is neither a mechanism nor a mesh", f"one of {', '.join((*SUFFIXES, *MESHES))}")
    stiffness = _stiffness(stops, found) if stops is not None else None
    found.end()
    notes: list[str] = []
    if suffix in SUFFIXES:
        scene, notes = scene_of(file, unit, stiffness)
        data = scene_to_dict(scene)
    else:
        data = {"bodies": {Path(file).stem: body_of_mesh(file, kilograms, unit)}}
    text = yaml_text(data)
    if path:
        with writing(path, (".yaml", ".yml")) as work:
            work.write_text(text, encoding="utf-8")
    if as_json:
        print_json({"exit_code": DONE, "scene": data, "notes": notes, "file": save})
        return DONE
    print(f"wrote {path}" if path else text, end="\n" if path else "")
    for note in notes:
        print(f"note: {note}")
    return DONE




def _stiffness(text: str, found: Findings) -> float:
    """That of limits, N/m and N m/rad: a number without a unit, for it has two."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        found.add("--stops", f"{text!r} is no stiffness", "a number above zero, N/m or N*m/rad: --stops 1e5")
    return value
