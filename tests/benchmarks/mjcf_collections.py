"""Every MJCF file of some packages through the door: what becomes of it, and its accelerations beside MuJoCo's.

    python -m tests.benchmarks.mjcf_collections                    # models of PACKAGES, as far as they are installed
    python -m tests.benchmarks.mjcf_collections FOLDER …           # files in folders
    … --write                                          # renews engine/importers/MJCF_MODELS.md

Wants ``pip install mujoco dm-control mujoco-menagerie``, and ``pip install --no-deps`` of the others. MuJoCo's constraints,
contacts, actuators and fluid are switched off, and friction here: what is left is the mechanism, armature, springs and dampers.
Menagerie's models are no part of its package, which fetches each from the web when it is asked for (``python -m mujoco_menagerie
prefetch``); robosuite and metaworld hold many of the same robots.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from tests.importers.mujoco_comparison import Compared, compared
from trunnion.basics.problems import SceneError

PAGE = Path(__file__).resolve().parents[2] / "engine" / "importers" / "MJCF_MODELS.md"
PACKAGES = ("dm_control", "gymnasium", "gymnasium_robotics", "robosuite", "metaworld", "brax")
NOTHING = ("nothing in it moves", "the root element is not <mujoco>")
TITLES = "| model | bodies | freedoms | loops | difference | of inertias | with equal inertias, or why refused |"
HEAD = """# MJCF models tried

`python -m tests.benchmarks.mjcf_collections --write` writes this page. The script imports every MJCF file of the packages below
with `trunnion import`, and compares accelerations with MuJoCo {mujoco} at three random states. Constraints, contacts, actuators and
fluid are switched off in MuJoCo, and friction is switched off here.

The column *difference* is the largest difference of an acceleration, relative to the largest acceleration. The next column is the
largest relative difference of an inertia: MuJoCo rotates inertias of meshes and composed bodies into principal axes, to about 1e-8.
The last column is the difference of accelerations when MuJoCo has the same inertias, or the reason for a refusal. {none} files
hold no mechanism (settings, materials, props that do not move, parts to be included).
{menagerie}

"""


def files() -> Iterator[tuple[str, str, Path]]:
    """(package, model, file)."""
    for given in [a for a in sys.argv[1:] if not a.startswith("-")]:
        root = Path(given).resolve()
        yield from ((root.name, str(f.relative_to(root)), f) for f in sorted(root.rglob("*.xml")))
    if any(not a.startswith("-") for a in sys.argv[1:]):
        return
    for package in PACKAGES:
        found = find_spec(package)
        if found is None or found.origin is None:
            continue
        root = Path(found.origin).parent
        name = f"{package} {version(package.replace('_', '-'))}"
        yield from ((name, str(f.relative_to(root)), f) for f in sorted(root.rglob("*.xml")))
    yield from menagerie()


def menagerie() -> Iterator[tuple[str, str, Path]]:
    """Models of mujoco_menagerie that are in its cache."""
    if find_spec("mujoco_menagerie") is None:
        return
    import mujoco_menagerie

    cache = mujoco_menagerie.Cache()
    for robot in mujoco_menagerie.robots():
        if cache.is_cached(robot):
            root = Path(robot.path(cache))
            name = f"mujoco_menagerie {version('mujoco-menagerie')}"
            yield from ((name, f"{root.name}/{f.relative_to(root)}", f) for f in sorted(root.rglob("*.xml")))


def cached() -> str:
    """The models of mujoco_menagerie that the script can test."""
    if find_spec("mujoco_menagerie") is None:
        return ""
    import mujoco_menagerie

    cache, robots = mujoco_menagerie.Cache(), mujoco_menagerie.robots()
    there = sum(cache.is_cached(robot) for robot in robots)
    where = f"mujoco_menagerie {version('mujoco-menagerie')} downloads robots on request"
    return f"\n{where}: {there} of {len(robots)} were available.\n"


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Suppress MuJoCo's output, and work outside the folder in which it keeps a log."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), tempfile.TemporaryFile() as sink:
        kept = os.dup(2)
        os.dup2(sink.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def line(file: Path) -> str:
    """Cells of a table about a file; "" for a file without a mechanism."""
    try:
        with silent():
            c = compared(file)
    except SceneError as e:
        if any(p.what in NOTHING for p in e.problems):
            return ""
        first = e.problems[0]
        more = f"; {e.total - 1} more" if e.total > 1 else ""
        return f"| | | | | | refused: {first.where}: {first.what}{more} |"
    except ValueError as e:
        return f"| | | | | | MuJoCo refuses it: {str(e).strip().splitlines()[0].rpartition('/')[2][:90]} |"
    return f"| {c.bodies} | {c.freedoms} | {c.loops} | {c.gap:.0e} | {c.inertia:.0e} | {told(c)} |"


def told(c: Compared) -> str:
    """The remaining difference, and features of the mechanism that were left out."""
    fluid = [n for n in c.notes if n.startswith("fluid forces")]
    return "; ".join([f"{c.gap_with:.0e}", *fluid])


def main() -> None:
    rows, none, package = [], 0, ""
    for where, name, file in files():
        found = line(file)
        if not found:
            none += 1
            continue
        if where != package:
            package = where
            rows += [f"\n## {package}\n", TITLES, "|---|---|---|---|---|---|---|"]
        rows.append(f"| {name} {found}")
        print(rows[-1], flush=True)
    if "--write" in sys.argv:
        head = HEAD.format(mujoco=version("mujoco"), none=none, menagerie=cached()).rstrip()
        PAGE.write_text("\n".join([head, *rows, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
