"""Properties of columns for error estimates: columns with errors, with jumps at events, angles, components of quaternions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.kernel.interface.output_columns import Column
from trunnion.system.construction.start_values_and_scales import Numbers

SMOOTH = ("position", "velocity", "orientation", "omega", "point", "q", "qd", "kinetic", "potential", "bristle")
"""Quantities that are continuous at events. Integrals of powers are continuous too."""
COORDINATES = ("q", "qd")
"""Quantities of the state."""


@dataclass(frozen=True)
class Kinds:
    """Kinds of n columns.

    Attributes:
        errs: whether each column has an error (n).
        jumps: whether the column may jump at events (n).
        wraps: whether the column is an angle modulo 2π (n).
        group: index of the vector to which the column belongs (n).
        scale: natural size of the column's unit in the scene (n).
        states: whether the column is a coordinate or a rate of a joint (n).
        quaternions: indices of the four columns of each quaternion.
    """

    errs: np.ndarray
    jumps: np.ndarray
    wraps: np.ndarray
    group: np.ndarray
    scale: np.ndarray
    states: np.ndarray
    quaternions: tuple[tuple[int, ...], ...]


def kinds(columns: Sequence[Column], numbers: Numbers) -> Kinds:
    """The kinds of the given columns. numbers: scales of the scene."""
    what = [c.quantity for c in columns]
    owners = [c.name.rpartition("[")[0] or c.name for c in columns]
    named = [o + c.unit if q.vector else c.name for o, c, q in zip(owners, columns, what, strict=True)]
    turns = [o for o, c, q in zip(owners, columns, what, strict=True) if c.unit == "1" and q.name in ("q", "orientation")]
    four = {o: tuple(i for i, x in enumerate(owners) if x == o and columns[i].unit == "1") for o in dict.fromkeys(turns)}
    return Kinds(
        np.array([not (q.steps or q.runtime or q.name == "residual") for q in what], bool),
        np.array([not (q.name in SMOOTH or q.integral) for q in what], bool),
        np.array([c.key[0] == "contact" and c.key[-1] == "angle" for c in columns], bool),
        np.unique(named, return_inverse=True)[1] if named else np.zeros(0, int),
        np.array([unit_scale(c.unit, numbers) for c in columns], float),
        np.array([q.name in COORDINATES for q in what], bool),
        tuple(places for places in four.values() if len(places) == 4),
    )


def unit_scale(unit: str, n: Numbers) -> float:
    """The natural size of a quantity with this unit, from the scene's length, rate and energy."""
    length, rate = n.length, n.rate
    return {
        "m": length, "m/s": length * rate, "m/s^2": length * rate**2, "rad/s": rate, "rad/s^2": rate**2,
        "N": n.energy / length, "N*m": n.energy, "J": n.energy, "W": n.energy * rate,
    }.get(unit, 1.0)  # fmt: skip


def differences(a: np.ndarray, b: np.ndarray, k: Kinds) -> np.ndarray:
    """|a − b| of two tables (rows × n). Angles are compared modulo 2π, quaternions up to their sign."""
    b = b.copy()
    for four in k.quaternions:
        places = list(four)
        b[:, places] *= np.where(np.einsum("ij,ij->i", a[:, places], b[:, places]) < 0.0, -1.0, 1.0)[:, None]
    out = np.abs(a - b)
    turned = np.mod(out[:, k.wraps], 2.0 * np.pi)
    out[:, k.wraps] = np.minimum(turned, 2.0 * np.pi - turned)
    return out
