"""Measured runs from files: CSV with a line of names (units in brackets are heeded), or tables of results."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from engine.basics.problems import Problem, SceneError
from engine.fits.measured import Measured
from engine.kernel.columns import columns
from engine.scene.model import Scene
from engine.scene.quantities import Per
from engine.scene.units import UnitError
from engine.simulation.measured_tables import columns_of
from engine.system.build import build

HEAD = re.compile(r"^(?P<name>.*\S)\s+[\[(](?P<unit>[^\])]*)[\])]$")
"""A name and a unit in brackets, with a blank between: ``angle [deg]``; ``pivot.q[1]`` is a name alone."""


def read_measured(
    file: str, scene: Scene, renamed: Mapping[str, str] | None = None, overrides: Mapping[str, Any] | None = None,
    noise: float | Mapping[str, float] | None = None, where: str = "--data",
) -> tuple[Measured, tuple[str, ...]]:  # fmt: skip
    """(the run that a file holds, the file's columns that are not used). renamed: {column of the scene: its name in the file};
    where none is given, those that are called as the scene's are taken. Numbers are converted to SI by the units in the file's
    names. SceneError for what cannot be read."""
    heads, numbers = columns_of(file, where)
    if len(heads) != numbers.shape[1]:
        what = f"{file!r} has {len(heads)} names for {numbers.shape[1]} columns"
        raise SceneError([Problem(where, what, "one name for each column, commas between them")])
    units = {c.name: c.unit for c in columns(build(scene).system) if c.quantity.smooth}
    found = {name: (unit, numbers[:, i]) for i, (name, unit) in enumerate(map(_named, heads))}
    wanted = dict(renamed) if renamed else {n: n for n in found if n in units}
    has = f"it has {', '.join(found)}"
    problems = [Problem("--column", f"{file!r} has no column {n!r}", has) for n in wanted.values() if n not in found]
    problems += [Problem("--column", f"{c!r} is no column of the scene", "see `trunnion check SCENE --outputs`")
                 for c in wanted if c not in units]  # fmt: skip
    if "time" not in found:
        problems.append(Problem(where, f"{file!r} has no column time", has))
    if not wanted:
        hint = f"say which is what: --column 'JOINT.q[1]={next((n for n in found if n != 'time'), 'NAME')}'"
        problems.append(Problem(where, f"{file!r} has no column that is called as one of the scene's", hint))
    if problems:
        raise SceneError(problems)
    curves = {c: _si(found[n], units[c], f"{where}, {n}") for c, n in wanted.items()}
    unused = tuple(n for n in found if n != "time" and n not in wanted.values())
    return Measured(_si(found["time"], "s", f"{where}, time"), curves, dict(overrides or {}), noise), unused


def _named(head: str) -> tuple[str, str]:
    """(name, unit) of a head; no unit where none is written."""
    match = HEAD.match(head)
    return (match["name"], match["unit"]) if match else (head, "")


def _si(column: tuple[str, np.ndarray], unit: str, where: str) -> np.ndarray:
    written, values = column
    if not written or unit == "1":
        return values
    try:
        return values * float(Per(unit)(f"1 {written}"))
    except UnitError as e:
        raise SceneError([Problem(where, e.what, e.hint)]) from e
