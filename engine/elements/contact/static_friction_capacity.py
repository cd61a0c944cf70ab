"""Static friction capacity of pairs, as sums of norms of linear functions of reactions (theory, "Bounds at rest").

A journal holds μ_s/√(1+μ_s²) ½(|F + Y| + |F − Y|), a ball μ_s/√(1+μ_s²) |f|, a sleeve sums of absolute values that depend on the
sense of friction. Each contact element declares its own (``rests``)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rubs:
    """Numbers of a joint with friction. contact: its element. needs: reaction components of the forms. eta: multipliers. sizes:
    numbers of contact and law. sense: −1 where the outboard part carries the pin."""

    joint: str
    contact: str
    needs: tuple[str, ...]
    eta: tuple[int, ...]
    sizes: dict[str, float]
    sense: float
    adams: bool

    @property
    def static(self) -> float:
        """Coefficient of friction at rest."""
        return self.sizes.get("mu_static", self.sizes.get("mu", 0.0))

    @property
    def adams_forces(self) -> tuple[str, ...]:
        """Force components in Adams' form."""
        return tuple(n for n in self.needs if n.startswith("f"))

    def row(self, **parts: float) -> np.ndarray:
        """A linear function of the reaction components."""
        return np.array([parts.get(n, 0.0) for n in self.needs])

    def rows(self, names: tuple[str, ...]) -> np.ndarray:
        """These components, a row each."""
        return np.array([self.row(**{n: 1.0}) for n in names])

    def constant(self, size: float, weight: float) -> Norm:
        """A force independent of the load, N."""
        return Norm(np.zeros((1, len(self.needs))), weight, 0.0, size)

    def preload(self, mu: float, label: str = "preload") -> tuple[Norm, ...]:
        """The preload; none where the joint has none."""
        return (self.constant(self.sizes[label], mu),) if self.sizes.get(label) else ()

    def ends(self, across: tuple[str, str], about: tuple[str, str], c: float, mu: float) -> tuple[Norm, ...]:
        """F ± Y of a journal: F = f3 + i f2, Y = (m2 − i m3)/c. across: names of f2, f3; about: names of m2, m3."""
        (f2, f3), (m2, m3) = across, about
        return tuple(
            Norm(np.array([self.row(**{f3: 1.0, m2: s / c}), self.row(**{f2: 1.0, m3: -s / c})]), 0.5 * sine(mu), 0.5)
            for s in (1.0, -1.0)
        )


@dataclass(frozen=True)
class Norm:
    """weight · |rows · f + fixed + own · friction|, f the needed reaction components; rows in N per component's unit. contact: part
    of |rows · f| that is the force of one contact (0: of none). fixed: added to the first row, N. own: factor of the friction of a
    pair with one direction (at the surface) in the first row."""

    rows: np.ndarray
    weight: float
    contact: float = 1.0
    fixed: float = 0.0
    own: float = 0.0

    @property
    def added(self) -> np.ndarray:
        """Constant added to rows · f, N."""
        return np.append(self.fixed, np.zeros(len(self.rows) - 1))


@dataclass(frozen=True)
class Capacity:
    """Largest friction of a pair, N at the surface: the sum of its norms. sense: of the friction, +1 or −1; 0: any. exact: False
    for an upper bound (the load of a shaft depends on the direction of friction). least: then the weights of a lower bound."""

    norms: tuple[Norm, ...]
    sense: int = 0
    exact: bool = True
    least: tuple[float, ...] = ()


@dataclass(frozen=True)
class Pair:
    """A friction pair at rest. friction: rows that turn multipliers into forces at the surface (1/r, or 1). static: μ_s. across:
    rows of the force about which it holds no torque (ball), else None. along: capacity against a given sliding direction (unit
    vector of surface velocities), where it differs from ``capacities``."""

    joint: str
    part: int
    eta: tuple[int, ...]
    friction: np.ndarray
    capacities: tuple[Capacity, ...]
    static: float
    across: np.ndarray | None = None
    along: Callable[[np.ndarray], Capacity] | None = None

    def against(self, direction: np.ndarray) -> Capacity:
        """Capacity against sliding in a direction, N at the surface along it."""
        if self.along is not None:
            return self.along(direction)
        return next(c for c in self.capacities if c.sense * direction[0] >= 0.0)


def sine(mu: float) -> float:
    """μ/√(1 + μ²): friction over the whole force of a contact."""
    return mu / float(np.hypot(1.0, mu))
