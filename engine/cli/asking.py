"""``trunnion equilibrium``, ``modes`` and ``inverse``: questions besides motion, as text, JSON, pictures and tables."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, print_json
from engine.cli.simulating import PICTURES, loaded, talk, unknown_outputs
from engine.cli.summary import table

if TYPE_CHECKING:
    from engine.questions.inverse import Table
    from engine.questions.modes import Modes
    from engine.scene.model import Scene

SHOWN = 12
"""Modes that are drawn, instants without an answer that are told."""


@dataclass(frozen=True)
class Wish:
    """The words and options that these commands share, as they were written."""

    scene: list[str]
    changes: Sequence[str]
    plot: str | None
    as_json: bool
    verbose: bool

    def read(self, found: Findings) -> tuple[Scene | None, Path | None]:
        """The scene and the file to draw to; mistakes are noted."""
        talk(self.verbose)
        source = options.one_scene(self.scene, found)
        picture = options.destination(self.plot, PICTURES, "--plot", found)
        return loaded(source, options.assignments(self.changes, found), None, found), picture

    def told(self, document: dict[str, Any], lines: Sequence[str], files: Sequence[Path | None]) -> int:
        """Print the answer; the exit code."""
        from engine.cli.charting import print_lines

        wrote = [str(f) for f in files if f is not None]
        if self.as_json:
            print_json({"exit_code": DONE, **document, "files": wrote})
        else:
            print_lines([*lines, *(f"wrote {f}" for f in wrote)])
        return DONE


def equilibrium_command(wish: Wish, along: Sequence[str]) -> int:
    """Find the pose of rest and the bands, and tell them."""
    from engine.questions.equilibrium import equilibrium, started

    found = Findings()
    scene, picture = wish.read(found)
    found.end()
    assert scene is not None
    result = equilibrium(scene, tuple(along) or None)
    if picture:
        import numpy as np

        from engine.plots.files import save_figure
        from engine.plots.mechanism import mechanism

        save_figure(mechanism(started(scene, {n: np.array(v) for n, v in result.q.items()})), picture)
    rows = [(n, ", ".join(f"{x:.9g}" for x in v)) for n, v in result.q.items()]
    lines = [f"{scene.name}: rests here ({result.kind})", *table(("joint", "coordinates"), rows)]
    if result.bands:
        first = [" / ".join(dict.fromkeys(x for x in b.first if x)) for b in result.bands]
        shown = [(b.coordinate, _end(b.low), _end(b.high), f) for b, f in zip(result.bands, first, strict=True)]
        lines += ["", "friction holds it while, the others as above,", *table(("coordinate", "from", "to", "lets go first"), shown)]
    return wish.told(result.document(), lines, [picture])


def _end(x: float | None) -> str:
    return "no end" if x is None else f"{x:.9g}"


def modes_command(wish: Wish, stick: bool, at_start: bool) -> int:
    """Find the modes and tell them."""
    from engine.questions.modes import modes

    found = Findings()
    scene, picture = wish.read(found)
    found.end()
    assert scene is not None
    result = modes(scene, stick, at_start)
    if picture:
        _draw(result, picture)
    rows = [
        (str(i + 1), f"{m.frequency:.9g}", f"{m.damping:.4g}", f"{m.rate:.6g}", _shape(m.shape)) for i, m in enumerate(result.modes)
    ]
    lines = [f"{scene.name}, about its rest" + (f", {', '.join(result.held)} held by friction" if result.held else "")]
    lines += table(("mode", "Hz", "damping ratio", "rate, 1/s", "shape (largest freedoms)"), rows)
    return wish.told(result.document(), lines, [picture])


def _shape(shape: dict[str, complex]) -> str:
    largest = sorted(shape.items(), key=lambda p: -abs(p[1]))[:4]
    return ", ".join(f"{n.removesuffix('[1]').replace('.qd', '')} {x.real:+.3g}" for n, x in largest)


def _draw(result: Modes, picture: Path) -> None:
    from engine.plots.files import save_figure
    from engine.plots.shapes import shapes
    from engine.questions.modes import displaced

    def title(number: int) -> str:
        m = result.modes[number]
        return f"mode {number + 1}: {m.frequency:.4g} Hz" if m.frequency else f"mode {number + 1}: {m.rate:.3g} 1/s"

    drawn = [(title(i), displaced(result, i), displaced(result, i, -0.3)) for i in range(min(SHOWN, len(result.modes)))]
    save_figure(shapes(result.scene, drawn), picture)


@dataclass(frozen=True)
class InverseWish:
    """What ``trunnion inverse`` is asked for besides."""

    motion: str | None
    drive: Sequence[str]
    outputs: Sequence[str] | None
    save: str | None


def inverse_command(wish: Wish, asked: InverseWish) -> int:
    """Compute the efforts, tell their largest, write the table."""
    from engine.questions.inverse import inverse
    from engine.questions.motions import read_motion

    found = Findings()
    scene, _ = wish.read(found)
    path = options.destination(asked.save, (".csv",), "-o", found)
    motion = None
    if asked.motion is None:
        found.add("--motion", "none is given", "--motion FILE, such as a table that trunnion simulate -o wrote")
    elif scene is not None:
        motion = found.attempt(partial(read_motion, asked.motion, scene, tuple(asked.drive)))
        found.problems += unknown_outputs(scene, [p for p in asked.outputs or () if ".drive." not in p])
    found.end()
    assert scene is not None
    assert motion is not None
    result = inverse(scene, motion[0], motion[1], asked.outputs or None)
    if path:
        write_table(result, path)
    extremes = [(f"{min(x):.6g}", f"{max(x):.6g}") for x in ([v for v in result[n] if v == v] for n in result.names)]
    rows = [(n, u, *both) for n, u, both in zip(result.names, result.units, extremes, strict=True)]
    lines = [f"{scene.name}, {len(result.time)} instants", *table(("column", "unit", "least", "largest"), rows)]
    lines += result.missing[:SHOWN]
    return wish.told(result.document(), lines, [path])


def write_table(result: Table, path: Path) -> None:
    """Write a CSV table with a column for time."""
    from engine.basics.files import writing

    with writing(path, (".csv",)) as work, work.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["time", *result.names])
        for t, row in zip(result.time, result.values, strict=True):
            out.writerow([repr(float(x)) for x in (t, *row)])
