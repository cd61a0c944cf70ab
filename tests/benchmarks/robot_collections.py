"""Imports every MJCF and URDF file of some packages, and records whether the importer accepts it. Accelerations at 100 random
states are compared with MuJoCo (MJCF) or Pinocchio (URDF).

    python -m tests.benchmarks.robot_collections                 # models of PACKAGES, as far as they are installed
    python -m tests.benchmarks.robot_collections FOLDER …        # each subfolder is a package; NAME-VERSION.dist-info its version
    … --write                                          # renews engine/importers/TESTED_MODELS.md

Needs ``pip install mujoco pin``, and ``pip install --no-deps`` (or ``--target FOLDER``) of the packages. Constraints, contacts,
actuators and fluid are switched off in MuJoCo, friction and couplings in Trunnion. Armature, springs and dampers remain.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from unittest import mock

from tests.importers import mujoco_comparison, pinocchio_comparison
from tests.importers.mujoco_comparison import Compared
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.importers.mjcf import bodies
from trunnion.importers.visual_meshes import MeshReader

PAGE = Path(__file__).resolve().parents[2] / "engine" / "importers" / "TESTED_MODELS.md"
PACKAGES = ("dm_control", "gymnasium", "gymnasium_robotics", "robosuite", "metaworld", "brax", "mujoco_playground", "pybullet_data")
NOTHING = ("nothing in it moves", "the root element is not <", "the scene has no bodies", "0 roots", 'pattern "*.qdd')
STATES = 100
EXACT = 1e-9
"""Allowed relative difference of accelerations."""
HEAD = """# Models of robots tried

`python -m tests.benchmarks.robot_collections --write` writes this page. The script imports every MJCF and URDF file of the packages
below with `trunnion import`, and compares accelerations at {states} random states with MuJoCo {mujoco} (MJCF) or Pinocchio {pin}
(URDF). In MuJoCo, constraints, contacts, actuators and fluid are switched off. In Trunnion, friction and couplings are
switched off.

*Same* counts models whose largest difference, relative to the largest acceleration of all states, is at most 1e-9. MuJoCo uses
Trunnion's inertias, because its own rotation into principal axes is accurate to about 1e-8 only. *Worst* is the largest difference
of these models. *No mechanism* counts files with settings, materials, objects that do not move, or parts for other files. *Not
compared* counts files that the other program refuses.

Three models are *different*. MuJoCo reads the vertices of `.obj` meshes in single precision. In the two files of robosuite, this
rounding changes masses by 6e-9 and 1.2e-8. With mass and mass centre from Trunnion, MuJoCo's accelerations differ by less than
1e-15. In the file of brax, a free body has its mass centre 2.9e-9 m from its joint. MuJoCo treats these two points as one,
and keeps a diagonal mass matrix. The inertias from Trunnion do not fit this matrix. With MuJoCo's own inertias, the difference is
1.6e-9.

| package | files | no mechanism | same | worst | differ | refused | not compared |
|---|---|---|---|---|---|---|---|
"""


def files() -> Iterator[tuple[str, str, Path]]:
    """(package, model, file)."""
    folders = [Path(a).resolve() for a in sys.argv[1:] if not a.startswith("-")]
    tops = [(f, top) for f in folders for top in sorted(f.iterdir()) if top.is_dir() and top.suffix != ".dist-info"]
    roots = [(_versioned(f, top.name), top) for f, top in tops]
    for package in PACKAGES if not folders else ():
        found = find_spec(package)
        if found is not None and found.origin is not None:
            roots.append((f"{package} {version(package.replace('_', '-'))}", Path(found.origin).parent))
    for name, root in roots:
        every = (f for f in sorted(root.rglob("*")) if f.suffix in (".xml", ".urdf") and f.is_file())
        yield from ((name, str(f.relative_to(root)), f) for f in every if _is_robot(f))


def _versioned(folder: Path, name: str) -> str:
    """Name and version of a package in a folder of packages."""
    known = [f.name.removesuffix(".dist-info").rpartition("-") for f in folder.glob("*.dist-info")]
    return next((f"{name} {v}" for n, _, v in known if n.replace("-", "_").lower() == name.lower()), name)


def _is_robot(file: Path) -> bool:
    """Whether a file begins with the root element of MJCF or URDF."""
    start = re.sub(rb"<!--.*?-->|<\?.*?\?>", b"", file.read_bytes()[:20000], flags=re.DOTALL).lstrip(b"\xef\xbb\xbf \r\n\t")
    return start.startswith((b"<mujoco>", b"<mujoco ", b"<robot>", b"<robot ", b"<robot\n"))


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Suppress the programs' output, and work outside the folder in which MuJoCo keeps a log."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), tempfile.TemporaryFile() as sink:
        kept = os.dup(2)
        os.dup2(sink.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def result(file: Path) -> tuple[str, str, Compared | None]:
    """(column of the table, reason, comparison) of a file. Pictures take most of the time and are left out."""
    program = mujoco_comparison if b"<mujoco" in file.read_bytes()[:20000] else pinocchio_comparison
    try:
        no_meshes = mock.patch.object(MeshReader, "solids", return_value=[])
        no_shapes = mock.patch.object(bodies, "drawn", return_value={})
        with silent(), no_meshes, no_shapes:
            c = program.compared(file, STATES)
    except SceneError as e:
        if any(p.what.startswith(NOTHING) for p in e.problems):
            return "none", "", None
        first = e.problems[0]
        return "refused", f"{first.where}: {first.what}" + (f"; {e.total - 1} more" if e.total > 1 else ""), None
    except SimulationError as e:
        return "refused", str(e), None
    except ValueError as e:
        return "other", str(e).strip().splitlines()[0].rpartition("/")[2][:90], None
    return ("same", "", c) if c.gap_with <= EXACT else ("differ", f"{c.gap_with:.0e} with {c.freedoms} freedoms", c)


def main() -> None:
    counts: dict[str, Counter[str]] = {}
    worst: dict[str, float] = {}
    told: list[tuple[str, str, str, str]] = []
    for package, name, file in files():
        kind, why, c = result(file)
        counts.setdefault(package, Counter())[kind] += 1
        if kind == "same" and c is not None:
            worst[package] = max(worst.get(package, 0.0), c.gap_with)
        elif why:
            told.append((package, name, kind, why))
        print(package, name, kind, why or (f"{c.gap:.0e} {c.gap_with:.0e}" if c else ""), flush=True)
    counts["all"] = sum(counts.values(), Counter())
    worst["all"] = max(worst.values(), default=0.0)
    kinds = ("differ", "refused", "other")
    rows = [
        f"| {p} | {n.total()} | {n['none']} | {n['same']} | {worst.get(p, 0.0):.0e} | {' | '.join(str(n[k]) for k in kinds)} |"
        for p, n in counts.items()
    ]
    if "--write" in sys.argv:
        head = HEAD.format(states=STATES, mujoco=version("mujoco"), pin=version("pin"))
        PAGE.write_text(head + "\n".join([*rows, *_told(told), ""]), encoding="utf-8")
    print("\n".join(rows))


def _told(told: list[tuple[str, str, str, str]]) -> Iterator[str]:
    """Lists of differences, of refused items, and of items without comparison. Files with the same reason are in one row."""
    titles = {"differ": "Different", "refused": "Refused", "other": "Not compared"}
    for kind, title in titles.items():
        same: dict[tuple[str, str], list[str]] = {}
        for package, name, k, why in told:
            if k == kind:
                same.setdefault((package, why), []).append(name)
        if same:
            yield from (f"\n## {title}\n", "| package | file | reason |", "|---|---|---|")
        for (package, why), names in same.items():
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            yield f"| {package} | {names[0]}{more} | {why.replace('|', '')} |"


if __name__ == "__main__":
    main()
