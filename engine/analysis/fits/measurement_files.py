"""Measured runs from files: result tables, or CSV files with a header line of names and optional units in brackets."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from trunnion.analysis.fits.measurements import MeasuredRun
from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.kernel.interface.output_columns import columns
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.units.numbers_with_units import Per
from trunnion.scene.units.unit_parser import UnitError
from trunnion.simulation.results.user_table_reader import read_user_table
from trunnion.system.construction.system_builder import build

HEAD = re.compile(r"^(?P<name>.*\S)\s+[\[(](?P<unit>[^\])]*)[\])]$")
"""A name, a blank and a unit in brackets, such as ``angle [deg]``. ``pivot.q[1]`` is a name without a unit."""


def read_measured_run(
    file: str, scene: Scene, renamed: Mapping[str, str] | None = None, overrides: Mapping[str, Any] | None = None,
    noise: float | Mapping[str, float] | None = None, where: str = "--data",
) -> tuple[MeasuredRun, tuple[str, ...]]:  # fmt: skip
    """(the measured run in a file, the unused columns of the file). The units in the header convert the numbers to SI.

    renamed: {column of the scene: name of the column in the file}; default: both names are equal. SceneError lists every problem.
    """
    heads, numbers = read_user_table(file, where)
    if len(heads) != numbers.shape[1]:
        what = f"{file!r} has {len(heads)} names for {numbers.shape[1]} columns"
        raise SceneError([Problem(where, what, "give one name for each column, separated by commas")])
    units = {c.name: c.unit for c in columns(build(scene).system) if c.quantity.smooth}
    found = {name: (unit, numbers[:, i]) for i, (name, unit) in enumerate(map(_split_unit, heads))}
    wanted = dict(renamed) if renamed else {n: n for n in found if n in units}
    has = f"it has {', '.join(found)}"
    problems = [Problem("--column", f"{file!r} has no column {n!r}", has) for n in wanted.values() if n not in found]
    problems += [Problem("--column", f"{c!r} is not a column of the scene", "see `trunnion check SCENE --columns`")
                 for c in wanted if c not in units]  # fmt: skip
    if "time" not in found:
        problems.append(Problem(where, f"{file!r} has no column time", has))
    if not wanted:
        hint = f"name the file's column for a scene column: --column 'JOINT.q[1]={next((n for n in found if n != 'time'), 'NAME')}'"
        problems.append(Problem(where, f"no column of {file!r} has the name of a column of the scene", hint))
    raise_problems(problems)
    curves = {c: _to_si(found[n], units[c], f"{where}, {n}") for c, n in wanted.items()}
    unused = tuple(n for n in found if n != "time" and n not in wanted.values())
    return MeasuredRun(_to_si(found["time"], "s", f"{where}, time"), curves, dict(overrides or {}), noise), unused


def _split_unit(head: str) -> tuple[str, str]:
    """(name, unit) of a header entry; the unit is "" if there is none."""
    match = HEAD.match(head)
    return (match["name"], match["unit"]) if match else (head, "")


def _to_si(column: tuple[str, np.ndarray], unit: str, where: str) -> np.ndarray:
    written, values = column
    if not written or unit == "1":
        return values
    try:
        return values * float(Per(unit)(f"1 {written}"))
    except UnitError as e:
        raise SceneError([Problem(where, e.what, e.hint)]) from e
