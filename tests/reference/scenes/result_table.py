"""Results as one flat table. With the table, tests compare two formulations, and invert transformations. Keys are (body or joint,
quantity), and ("energy", "kinetic"). Quantities: qdd, reaction.force, reaction.torque, friction, normal_force, normal, angle,
drive.effort (one entry per freedom, NaN where not driven), acceleration, angular_acceleration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.reference.dynamics import Result
from tests.reference.scenes.random_scenes import Case

Table = dict[tuple[str, str], np.ndarray]


@dataclass(frozen=True)
class Moved:
    """A case that differs only in its description. ``back`` maps a table of its results to a table of the original case."""

    case: Case
    back: Callable[[Table], Table]


def table(result: Result) -> Table:
    """The quantities of a Result that are independent of the reference's method of solution."""
    out: Table = {("energy", "kinetic"): np.array(result.kinetic)}
    for name, (force, torque) in result.reaction.items():
        out[name, "qdd"] = result.qdd[name]
        out[name, "reaction.force"], out[name, "reaction.torque"] = force, torque
    for name, friction in result.friction.items():
        out[name, "friction"] = friction
        out[name, "normal_force"] = np.array([c.normal_force for c in result.contacts[name]])
        out[name, "normal"] = np.array([c.normal for c in result.contacts[name]])
        out[name, "angle"] = np.array([c.angle for c in result.contacts[name]])
    for name, efforts in result.drive_effort.items():
        out[name, "drive.effort"] = np.array([efforts.get(k, np.nan) for k in range(len(result.qdd[name]))])
    for body in result.acceleration:
        out[body, "acceleration"], out[body, "angular_acceleration"] = result.acceleration[body], result.angular[body]
    return out


def largest_difference(a: Table, b: Table) -> tuple[float, tuple[str, str] | None]:
    """Largest difference of two tables over their common keys, relative to the largest entry of the quantity, and its place.

    Angles are compared by their sine and cosine; NaN equals NaN.
    """
    worst, where = 0.0, None
    for key in a.keys() & b.keys():
        x, y = np.asarray(a[key], float), np.asarray(b[key], float)
        if key[1] == "angle":
            x, y = np.exp(1j * x), np.exp(1j * y)
        scale = max([1.0, *(np.nanmax(np.abs(a[k]), initial=0.0) for k in a if k[1] == key[1] and a[k].size)])
        gap = float(np.max(np.where(np.isnan(x) & np.isnan(y), 0.0, np.abs(x - y)), initial=0.0)) / scale
        if not gap <= worst:
            worst, where = gap, key
    return worst, where
