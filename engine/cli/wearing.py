"""``trunnion wear``: what a run wears off its contacts, as text, JSON, a table and a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json
from engine.cli.simulating import PICTURES, loaded, talk
from engine.cli.summary import table

if TYPE_CHECKING:
    from engine.questions.wear import Wear

COLUMNS = ("contact", "slides, m", "load, J", "worn off, mm³", "deepest, µm", "largest pV, MPa m/s", "energy, J/mm²")
RUNS = "runs to that depth"


@dataclass(frozen=True)
class WearWish:
    """The words and options of the command as they were written."""

    scene: list[str]
    settings: Mapping[str, Any]
    coefficient: str | None
    depth: str | None
    changes: Sequence[str]
    save: str | None
    plot: str | None
    as_json: bool
    verbose: bool


def wear_command(wish: WearWish) -> int:
    """Run, compute the wear, print it, write its table and picture; the exit code."""
    from engine.cli.charting import print_lines
    from engine.questions.wear import wear
    from engine.scene.quantities import Per
    from engine.simulation.run import simulate

    talk(wish.verbose)
    found = Findings()
    source = options.one_scene(wish.scene, found)
    chosen = options.settings("trunnion wear", wish.settings, found)
    law = chosen.pop("law")
    path = options.destination(wish.save, (".csv",), "-o", found)
    picture = options.destination(wish.plot, PICTURES, "--plot", found)
    k = None if wish.coefficient is None else found.attempt(partial(_amount, Per("m^2/N"), wish.coefficient, "-k"))
    depth = None if wish.depth is None else found.attempt(partial(_amount, Per("m"), wish.depth, "--depth"))
    scene = loaded(source, options.assignments(wish.changes, found), law, found)
    found.end()
    assert scene is not None
    result = simulate(scene, outputs=("*",), **chosen)
    worn = wear(result, k)
    files = [str(f) for f in (_table(worn, path), _picture(worn, picture)) if f is not None]
    code = DONE if result.outcome.ok else FAILED
    if wish.as_json:
        contacts = [c.document() | ({"runs": c.cycles(depth)} if depth is not None else {}) for c in worn.contacts]
        print_json({"exit_code": code, "outcome": result.outcome.name, "contacts": contacts, "files": files})
    else:
        print_lines([f"{scene.name}: {result.outcome}", *_lines(worn, depth), *(f"wrote {f}" for f in files)])
    return code


def _table(worn: Wear, path: Path | None) -> Path | None:
    """Write the columns, if asked for."""
    if path is not None:
        import numpy as np

        from engine.cli.asking import write_table
        from engine.questions.inverse import Table

        names, units = tuple(worn.columns), tuple("m^3" if ".volume[" in n else "J" for n in worn.columns)
        write_table(Table(worn.time, names, units, np.array([*worn.columns.values()]).reshape(len(names), -1).T), path)
    return path


def _picture(worn: Wear, path: Path | None) -> Path | None:
    """Draw the contacts that go around, if asked for and if there are any."""
    around = [(f"{c.joint}, contact {c.contact}", c.angles, c.on_pin, c.on_bearing) for c in worn.contacts if c.angles.size]
    if path is None or not around:
        return None
    from engine.plots import worn as pictures
    from engine.plots.files import save_figure

    return save_figure(pictures.worn(around), path)


def _lines(worn: Wear, depth: float | None) -> list[str]:
    rows = []
    for c in worn.contacts:
        row = [f"{c.joint}.contact[{c.contact}]", f"{c.distance:.6g}", f"{c.load:.6g}"]
        row += [_told(c.volume * 1e9), _told(max(c.depth) * 1e6)]
        rows.append([*row, _told(c.pv * 1e-6), _told(c.energy * 1e-6), *([_told(c.cycles(depth))] if depth is not None else [])])
    return table([*COLUMNS, *([RUNS] if depth is not None else [])], rows)


def _amount(read: Any, text: str, where: str) -> float:
    from engine.basics.problems import Problem, SceneError
    from engine.scene.units import UnitError

    try:
        return float(read(text))
    except UnitError as e:
        raise SceneError([Problem(where, e.what, e.hint)]) from e


def _told(x: float) -> str:
    return "" if math.isnan(x) else f"{x:.4g}"
