"""Page of comparisons: how Trunnion's importer and other readers read the same files, and how engines treat friction.

    python -m tests.benchmarks.other_programs.comparison_page ROWS.json … --write

ROWS.json are outputs of ``other_readers.py`` and ``other_engines.py`` in other environments. This script computes the rows of
Trunnion."""

from __future__ import annotations

import json
import math
import sys
import tempfile
from pathlib import Path

from tests.benchmarks.other_programs.other_engines import CASES, URDF, rest_angle
from tests.benchmarks.other_programs.other_readers import FILES, Row, freedoms, short
from tests.benchmarks.other_programs.other_usd_readers import FILES as USD_FILES
from trunnion import simulate
from trunnion.basics.version import version
from trunnion.importers import scene_of
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.scene_loader import scene_from_dict

PAGE = Path(__file__).resolve().parents[3] / "engine" / "importers" / "OTHER_PROGRAMS.md"
READERS = {
    "friction": "friction 0.7", "damping": "damping 0.3", "mimic": "mimic, ratio 2, offset 0.1",
    "limits": "limits −3 … 3, effort 10",
    "planar": "planar, axis x", "floating": "floating",
}  # fmt: skip
ENGINES = {"settings": "settings", "held": "held, °", "stopped": "stopped, °", "rate": "still turns, °/s"}
HEAD = """# How other programs read the same files

`python -m tests.benchmarks.other_programs.comparison_page ROWS.json … --write` writes this page from runs. `other_readers.py`,
`other_usd_readers.py` and `other_engines.py` in the same folder make the rows of other programs, each in an environment with that
program.

## URDF

The file has two hinges on a massless root link, each with a body of 1 kg. `j` has damping 0.3 N m s/rad and friction 0.7 N m; `k`
follows `j`. The files of the last two columns have one joint each. The table has the numbers in the program's model.

"""
MIDDLE = """
## MJCF

The file has a hinge with damping 0.2, frictionloss 0.5, armature 0.03, stiffness 4 with rest at 0.3, range −1 … 1 and ref 0.1.

"""
USD = """
## OpenUSD physics

The table shows what the program's model contains for twelve files with one joint each
([text of the files](../../tests/benchmarks/other_programs/other_usd_readers.py)). Angles are in radians; "–" means no value. Drives
have stiffness 10 and damping 2 (per degree, if angular), target 5, rate 3, and largest force 7.
PhysX has three numbers for friction: static, dynamic, viscous. Newton reads the files with its default schemas.

"""
USD_VERDICT = """
All three agree on {agreed} of {all} files: hinges and guides with limits, and principal axes. Newton and PhysX also agree on drives
and on `NewtonJointAPI`. No reader converts centimetres. Newton warns, and PhysX computes in centimetres. The converted URDF, whose
unit is the metre, is a hundred times too large. Only Newton changes a target outside the limits. Trunnion does not import OpenUSD,
because readers interpret the same file differently. Robots in OpenUSD are also distributed as [URDF](README.md) or MJCF.
"""
LAST = """
## Friction that holds, friction that stops

The table shows a pendulum of 1 kg at 0.5 m on a hinge after 10 s. *Held*: the friction of 0.342 N m is twice the moment of the
weight. Released at 2°, the pendulum should stay at 2°. *Stopped*: the friction is 0.7 N m. Released at 60°, the pendulum should
stop at {stopped:.4f}°; the energy of each half swing gives this angle.

"""
HOSTS = """
[The table of hosts](../../fmu/HOSTS.md) shows which tools run Trunnion's FMUs.
"""


def reader_row() -> Row:
    """The results of Trunnion's importer for the files."""
    with tempfile.TemporaryDirectory() as folder:
        scenes = {}
        for name, text in FILES.items():
            file = Path(folder) / (f"{name}.xml" if name == "mjcf" else f"{name}.urdf")
            file.write_text(text)
            scenes[name] = scene_to_dict(scene_of(str(file), "m", 1e5)[0])["joints"]
    j, k = scenes["arms"]["j"], scenes["arms"]["k"]
    h = scenes["mjcf"]["j"]
    stops = j["end_stops"]
    return {
        "program": "Trunnion", "version": version(), "friction": short(j["friction"]["torque"]), "damping": short(j["damping"]),
        "mimic": f"ratio {short(k['mimic']['ratio'])}, offset {short(k['mimic']['offset'])}",
        "limits": f"{short([stops['lower'], stops['upper']])} with `--end-stops`, effort left out",
        "planar": f"{freedoms(3)}, turns about {short(scenes['planar']['j']['inboard']['axis'])}",
        "floating": freedoms(6) if scenes["floating"]["j"]["type"] == "free" else scenes["floating"]["j"]["type"],
        "mjcf": f"damping {short(h['damping'])}, friction {short(h['friction']['torque'])}, armature {short(h['rotor_inertia'])}, "
        f"stiffness {short(h['spring']['stiffness'])} rest {short(h['spring']['rest'])} from `ref`, "
        f"limits {short([h['end_stops']['lower'], h['end_stops']['upper']])}",
    }  # fmt: skip


def engine_row() -> Row:
    """The results of Trunnion for both pendulums."""
    found = []
    for start, friction in CASES:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "p.urdf"
            file.write_text(URDF.format(friction=friction))
            data = scene_to_dict(scene_of(str(file), "m", None)[0])
        data["joints"]["j"]["start"] = {"q": math.radians(start)}
        found.append(simulate(scene_from_dict(data), until=10.0))
    held, stopped = (math.degrees(float(r["j.q[1]"][-1])) for r in found)
    rate = math.degrees(float(found[1]["j.qd[1]"][-1]))
    return {
        "program": "Trunnion", "version": version(), "settings": "default", "held": f"{held:.4f}", "stopped": f"{stopped:.4f}",
        "rate": f"{rate:.1e}",
    }  # fmt: skip


def table(rows: list[Row], columns: dict[str, str]) -> str:
    """A table of the rows that have all columns."""
    shown = [r for r in rows if set(columns) <= set(r)]
    head = ["program", *columns.values()]
    lines = [[f"{r['program']} {r['version']}", *(r[c] for c in columns)] for r in shown]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in [head, ["---"] * len(head), *lines])


def usd_table(rows: list[Row]) -> str:
    """The table of OpenUSD files: a line for each file, a column for each reader, and the files on which all agree."""
    found = [r for r in rows if set(USD_FILES) <= set(r)]
    lines = [["file", *(f"{r['program']} {r['version']}" for r in found)], ["---"] * (len(found) + 1)]
    lines += [[name, *(r[name] for r in found)] for name in USD_FILES]
    agreed = sum(len({r[name] for r in found}) == 1 for name in USD_FILES)
    text = "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
    return USD + text + USD_VERDICT.format(agreed=agreed, all=len(USD_FILES)) if found else ""


def page(rows: list[Row]) -> str:
    """The text of the page from the rows of other programs; the rows of Trunnion come last."""
    rows = [*rows, reader_row(), engine_row()]
    stopped = rest_angle(*CASES[1])
    parts = [HEAD, table(rows, READERS), MIDDLE, table(rows, {"mjcf": "what its model holds"}), usd_table(rows)]
    return "".join([*parts, LAST.format(stopped=stopped), table(rows, ENGINES), HOSTS])


def main() -> None:
    files = [Path(a) for a in sys.argv[1:] if not a.startswith("-")]
    rows: dict[tuple[str, ...], Row] = {}
    for row in (r for f in files for r in json.loads(f.read_text())):
        rows.setdefault((row["program"], row.get("settings", "file")), row)  # if there are two versions, the first one counts
    text = page(list(rows.values()))
    if "--write" in sys.argv:
        PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
