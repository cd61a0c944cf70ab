"""Static friction capacity of pairs, as sums of norms of linear functions of reactions (theory, "Bounds at rest").

The capacity of a journal is μ_s/√(1+μ_s²) ½(|F + Y| + |F − Y|). The capacity of a ball is μ_s/√(1+μ_s²) |f|. The capacity of a
sleeve is a sum of absolute values, which depends on the sense of friction. Each contact element declares its capacities
(``rests``)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass


@dataclass(frozen=True)
class Rubs:
    """Data of a joint with friction.

    contact  name of its contact element
    needs    names of the reaction components that the closed forms use
    eta      indices of its friction multipliers
    sizes    numbers of contact element and law
    sense    −1 if the outboard part carries the pin, else +1
    adams    whether Adams' form applies
    """

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
        """Names of the force components that Adams' form needs."""
        return tuple(n for n in self.needs if n.startswith("f"))

    def row(self, **parts: float) -> np.ndarray:
        """The row vector of a linear function of the reaction components, from coefficients by name."""
        return np.array([parts.get(n, 0.0) for n in self.needs])

    def rows(self, names: tuple[str, ...]) -> np.ndarray:
        """The matrix that selects the named components, one per row."""
        return np.array([self.row(**{n: 1.0}) for n in names])

    def constant(self, size: float, weight: float) -> Norm:
        """The term of a constant force ``size`` (N), times ``weight``."""
        return Norm(np.zeros((1, len(self.needs))), weight, 0.0, size)

    def driving(self, static: float) -> Norm:
        """The term of teeth with the pressure angle α: their force is the driving force divided by cos α."""
        return Norm(np.zeros((1, len(self.needs))), static, drives=1.0 / np.cos(self.sizes["pressure_angle"]))

    def preload(self, mu: float, label: str = "preload") -> tuple[Norm, ...]:
        """The term of the preload. The tuple is empty for a joint without preload."""
        return (self.constant(self.sizes[label], mu),) if self.sizes.get(label) else ()

    def ends(self, across: tuple[str, str], about: tuple[str, str], c: float, mu: float) -> tuple[Norm, ...]:
        """The terms |F ± Y| of a journal with F = f3 + i f2 and Y = (m2 − i m3)/c. ``across``: the names of f2 and f3. ``about``:
        the names of m2 and m3."""
        (f2, f3), (m2, m3) = across, about
        return tuple(
            Norm(np.array([self.row(**{f3: 1.0, m2: s / c}), self.row(**{f2: 1.0, m3: -s / c})]), 0.5 * sine(mu), 0.5)
            for s in (1.0, -1.0)
        )


@dataclass(frozen=True)
class Norm:
    """The term weight · |rows · f + fixed + own · friction + drives · driving force|; f: the needed reaction components.

    rows     matrix, N per unit of each component
    contact  fraction of |rows · f| that is the force of one contact; 0 if the term is not a contact force
    fixed    constant added to the first row, N
    own      factor of the pair's own friction (a scalar force at the surface), added to the first row
    drives   factor of the driving force of teeth, added to the first row
    """

    rows: np.ndarray
    weight: float
    contact: float = 1.0
    fixed: float = 0.0
    own: float = 0.0
    drives: float = 0.0

    @property
    def added(self) -> np.ndarray:
        """The constant vector that is added to rows · f, N."""
        return np.append(self.fixed, np.zeros(len(self.rows) - 1))


@dataclass(frozen=True)
class Capacity:
    """Largest friction of a pair, as a force at the surface, N: the sum of its norms.

    sense  sense of friction for which the capacity is valid, +1 or −1; 0 for both
    exact  False for an upper bound (the load of a shaft depends on the direction of friction)
    least  for an upper bound, the weights of a lower bound
    """

    norms: tuple[Norm, ...]
    sense: int = 0
    exact: bool = True
    least: tuple[float, ...] = ()


@dataclass(frozen=True)
class AtLimit:
    """Capacity of a pair whose friction is at its limit, for one sense of friction: weight · load + constant, where load = rows · f
    + fixed ≥ 0. This capacity is used for shares and normal forces. The capacity at the present friction (``Capacity``) decides
    whether a state is admissible. Both capacities are equal where the friction is at its limit."""

    sense: int
    rows: np.ndarray
    fixed: float
    weight: float
    constant: float


@dataclass(frozen=True)
class Pair:
    """A friction pair at rest.

    part        number of the pair in its joint, from 1
    eta         indices of its multipliers
    friction    matrix from multipliers to forces at the surface (entries 1/r or 1)
    static      μ_s
    across      for a ball, the rows of the force: the ball holds no torque about the force; else None
    along       function from a sliding direction (unit vector of surface velocities) to the capacity; only if ``capacities`` is
                empty
    limits      if ``capacities`` depend on the present friction: the capacities with friction at its limit; else empty
    """

    joint: str
    part: int
    eta: tuple[int, ...]
    friction: np.ndarray
    capacities: tuple[Capacity, ...]
    static: float
    across: np.ndarray | None = None
    along: Callable[[np.ndarray], Capacity] | None = None
    limits: tuple[AtLimit, ...] = ()

    def against(self, direction: np.ndarray) -> Capacity:
        """Capacity for sliding in a given direction: the friction force at the surface in this direction, N."""
        if self.along is not None:
            return self.along(direction)
        return next(c for c in self.capacities if c.sense * direction[0] >= 0.0)


def sine(mu: float) -> float:
    """μ/√(1 + μ²): ratio of friction to the total force of a contact."""
    return mu / float(np.hypot(1.0, mu))
