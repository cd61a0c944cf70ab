"""What a pair can hold, as sums of norms of linear functions of the reactions (METHOD, "Bounds at rest").

The contact forms say it in closed form: a journal holds μ_s/√(1+μ_s²) ½(|F + Y| + |F − Y|), a ball μ_s/√(1+μ_s²) |f|, a sleeve
sums of absolute values that depend on the sense of friction. Every contact element declares its own (``rests``), with what is here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rubs:
    """A joint with friction, as numbers. contact: its element; needs: the reaction components its forms use; eta: its multipliers;
    sizes: numbers of its contact and its law; sense: −1 where the outboard part carries the pin."""

    joint: str
    contact: str
    needs: tuple[str, ...]
    eta: tuple[int, ...]
    sizes: dict[str, float]
    sense: float
    adams: bool


@dataclass(frozen=True)
class Norm:
    """weight · |rows · f|, f the reaction components the element's forms use; rows in N per component's unit. contact: the part of
    |rows · f| that is the force of one contact (0: it is none of its own). fixed: what is added to rows · f, N (its first row)."""

    rows: np.ndarray
    weight: float
    contact: float = 1.0
    fixed: float = 0.0

    @property
    def added(self) -> np.ndarray:
        """What is added to rows · f, N (a number a row)."""
        return np.append(self.fixed, np.zeros(len(self.rows) - 1))


@dataclass(frozen=True)
class Capacity:
    """The most friction a pair holds, N at the surface: the sum of its norms. sense: of friction for which that holds, +1 or −1; 0:
    for every one. exact: else it is an upper bound (a shaft, whose load follows the direction of friction). least: the weights
    of a lower bound then, one for each norm."""

    norms: tuple[Norm, ...]
    sense: int = 0
    exact: bool = True
    least: tuple[float, ...] = ()


@dataclass(frozen=True)
class Pair:
    """A sliding pair at rest. friction: rows by which its multipliers become forces at the surface (1/r, or 1); capacities: what it
    holds; static: μ_s; across: rows of the force about which it holds no torque (a ball), else None; along: what it holds against a
    given direction of sliding (unit vector of surface velocities), where that differs from ``capacities``."""

    joint: str
    part: int
    eta: tuple[int, ...]
    friction: np.ndarray
    capacities: tuple[Capacity, ...]
    static: float
    across: np.ndarray | None = None
    along: Callable[[np.ndarray], Capacity] | None = None

    def against(self, direction: np.ndarray) -> Capacity:
        """What it holds against sliding in a direction, N at the surface along it."""
        if self.along is not None:
            return self.along(direction)
        return next(c for c in self.capacities if c.sense * direction[0] >= 0.0)


def static(j: Rubs) -> float:
    """The coefficient that counts at rest."""
    return j.sizes.get("mu_static", j.sizes.get("mu", 0.0))


def row(j: Rubs, **parts: float) -> np.ndarray:
    """A linear function of the components the element uses."""
    return np.array([parts.get(n, 0.0) for n in j.needs])


def sine(mu: float) -> float:
    """μ/√(1 + μ²): friction over the whole force of a contact."""
    return mu / float(np.hypot(1.0, mu))


def given(j: Rubs, size: float, weight: float) -> Norm:
    """A force that presses whatever the load is, N."""
    return Norm(np.zeros((1, len(j.needs))), weight, 0.0, size)


def preload(j: Rubs, mu: float, label: str = "preload") -> tuple[Norm, ...]:
    """A joint's preload, if it has one."""
    return (given(j, j.sizes[label], mu),) if j.sizes.get(label) else ()


def whole(j: Rubs, names: tuple[str, ...]) -> np.ndarray:
    """These components, each as it is."""
    return np.array([row(j, **{n: 1.0}) for n in names])


def adams_forces(j: Rubs) -> tuple[str, ...]:
    """The forces of whose size Adams' forms ask."""
    return tuple(n for n in j.needs if n.startswith("f"))


def ends_of(j: Rubs, across: tuple[str, str], about: tuple[str, str], c: float, mu: float) -> tuple[Norm, ...]:
    """F ± Y of a journal: F = f3 + i f2, Y = (m2 − i m3)/c, with the names (f2, f3) and (m2, m3) have in it."""
    f2, f3 = across
    m2, m3 = about
    return tuple(
        Norm(np.array([row(j, **{f3: 1.0, m2: s / c}), row(j, **{f2: 1.0, m3: -s / c})]), 0.5 * sine(mu), 0.5)
        for s in (1.0, -1.0)
    )
