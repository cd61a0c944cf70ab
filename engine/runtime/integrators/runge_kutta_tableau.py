"""Explicit Runge–Kutta methods as data. ``check`` compares the declared properties with the coefficients."""

from __future__ import annotations

import math
from collections.abc import Sequence

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.integrators.order_conditions import PARTS, Elementary, carried

Rows = Sequence[Sequence[float]]
LONGEST = 40.0
"""Upper limit of the search for the real stability interval."""
MARGIN = 0.7
"""Fraction of the real stability interval above which stability, not accuracy, limits the steps."""


def _lagrange(nodes: Sequence[float], through: Sequence[int], j: int, at: float) -> float:
    """Value at ``at`` of the Lagrange polynomial that is 1 at node j and 0 at the other nodes of ``through``."""
    return math.prod((at - nodes[k]) / (nodes[j] - nodes[k]) for k in through if k != j)


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge–Kutta pair with dense output.

    A: rows of the stages (row i has i entries). B: weights. C: nodes. E: one or two error estimators, with an entry for each stage
    and optionally one for the derivative at the end of the step (end derivative). A_dense, C_dense: extra stages of the dense
    output, from the stages, the end derivative and earlier extra stages. D: rows of the dense output beyond cubic Hermite
    interpolation, with an entry for each stage, the end derivative and each extra stage. The end derivative is not listed as a
    stage, because every step computes it.

    Dense output: y(θ) = y₀ + θ(R₀ + (1−θ)(R₁ + θ(R₂ + (1−θ)(D₀ + θ(D₁ + …))))).

    Declared properties: order, error_orders (one for each estimator), dense_order and first_same_as_last. first_same_as_last means
    that an estimator uses the end derivative, which is the first stage of the next step.
    """

    name: str
    about: str
    order: int
    error_orders: tuple[int, ...]
    dense_order: int
    first_same_as_last: bool
    A: Rows
    B: Sequence[float]
    C: Sequence[float]
    E: Rows
    A_dense: Rows = ()
    C_dense: Sequence[float] = ()
    D: Rows = ()
    led: Sequence[Sequence[int]] = ()
    """For each stage: earlier stages at different nodes, from which a polynomial extrapolates friction to the start of Newton's
    method. Empty: the first stage and the last two stages."""

    def __post_init__(self) -> None:
        self._shapes()

    def check(self) -> None:
        """Raises ValueError if the coefficients contradict a declared property. Runs before the method becomes C code."""
        found = self._derived()
        for what, value in found.items():
            if getattr(self, what) != value:
                raise ValueError(f"tableau {self.name}: its coefficients give {what} = {value}, declared: {getattr(self, what)}")

    @property
    def stiff_at(self) -> float:
        """Estimate of h|λ| above which stability limits the steps. The estimate is a fraction of the real stability interval,
        rounded to the nearest half."""
        return round(2 * MARGIN * self.real_interval()) / 2

    @property
    def stages(self) -> int:
        """Number of stages of a step."""
        return len(self.B)

    @property
    def end(self) -> int:
        """Row of K with the derivative at the end of the step."""
        return self.stages

    @property
    def rows(self) -> int:
        """Number of rows of K: stages, the derivative at the end, extra stages."""
        return self.stages + 1 + len(self.A_dense)

    def lead(self) -> list[list[float]]:
        """For each stage, the weights with which its extrapolation uses earlier stages (``led``)."""
        rows = []
        for i in range(self.stages):
            near = {self.C[j]: j for j in (i - 2, i - 1, 0) if 0 <= j < i}  # one stage for each node
            through = self.led[i] if self.led else list(near.values())
            rows.append([_lagrange(self.C, through, j, self.C[i]) if j in through else 0.0 for j in range(self.stages)])
        return rows

    def _shapes(self) -> None:
        """Raise ValueError if the sizes of the coefficients are inconsistent."""

        def refuse(what: str) -> None:
            raise ValueError(f"tableau {self.name}: {what}")

        s = self.stages
        if [len(r) for r in self.A] != list(range(s)) or len(self.C) != s:
            refuse(f"row i of A must have i entries; B and C must have {s}, one for each stage")
        extra = len(self.C_dense)
        if [len(r) for r in self.A_dense] != [s + 1 + i for i in range(extra)]:
            refuse("an extra stage needs a node and an entry for each earlier stage and for the derivative at the end")
        if len(self.E) not in (1, 2) or any(len(e) not in (s, s + 1) for e in self.E):
            refuse("E needs one or two rows, with an entry for each stage and optionally one for the derivative at the end")
        if any(len(d) > self.rows for d in self.D):
            refuse(f"a row of the dense output must have at most {self.rows} entries")
        if s > 1 and tuple(self.A[-1]) == tuple(self.B[:-1]) and self.B[-1] == 0:
            refuse("its last stage is the derivative at the end of the step: remove this stage")
        if self.led and [len({self.C[j] for j in row}) for row in self.led] != [len(row) for row in self.led]:
            refuse("a row of led must list stages at different nodes")
        if self.led and [all(j < i for j in row) for i, row in enumerate(self.led)] != [True] * s:
            refuse("led needs a row for each stage, and a row must list earlier stages only")
        nodes = max(abs(sum(row) - c) for row, c in zip((*self.A, *self.A_dense), (*self.C, *self.C_dense), strict=True))
        if nodes > 1e-13:
            refuse(f"a node differs from the sum of its row by {nodes:.1e}")

    def _derived(self) -> dict[str, object]:
        """The declared properties, computed from the coefficients."""
        n, s = self.rows, self.stages
        full = (*self.A, self.B, *self.A_dense)
        phi = Elementary(full, full)

        def over(row: Sequence[float]) -> list[float]:
            return [*map(float, row), *[0.0] * (n - len(row))]

        b, first, last = over(self.B), over([1.0]), over([0.0] * s + [1.0])
        hermite = zip(b, first, last, strict=True)
        rows = [b, *zip(*((f - w, 2 * w - e - f) for w, f, e in hermite), strict=True), *map(over, self.D)]

        def dense(theta: float) -> list[float]:
            out = [0.0] * n
            for r, row in reversed(list(enumerate(rows))):
                out = [(a + x) * (1 - theta if r % 2 else theta) for a, x in zip(out, row, strict=True)]
            return out

        return {
            "order": phi.order(lambda _: b),
            "error_orders": tuple(phi.order(lambda _, e=e: over(e), exact=False) for e in self.E),  # type: ignore[misc]
            "dense_order": phi.order(dense, PARTS),
            "first_same_as_last": any(len(e) > s and e[s] != 0 for e in self.E),
        }

    def real_interval(self) -> float:
        """Length of the stability interval on the negative real axis: the largest x with |R(−x')| ≤ 1 for all 0 ≤ x' ≤ x. R is the
        stability polynomial."""
        power, coefficients = [1.0] * self.stages, [1.0]
        for _ in range(self.stages):
            coefficients.append(sum(b * p for b, p in zip(self.B, power, strict=True)))
            power = carried(self.A, power)
        x = 0.0
        while abs(sum(c * (-x) ** k for k, c in enumerate(coefficients))) <= 1.0 + 1e-9 and x < LONGEST:
            x += 0.02
        return x
