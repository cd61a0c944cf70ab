"""Evaluates a scene's sensitivity unit at one state: its values, the multipliers, and their directional derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from trunnion.basics.errors import SimulationError
from trunnion.basics.optional_packages import Later
from trunnion.kernel.interface.output_columns import Column, needs_quadratures
from trunnion.parts.kernels.derivative_units import Sensitivities, address_of
from trunnion.simulation.run import Model
from trunnion.system.structure.external_value_layout import NOW

lapack = Later("scipy.linalg.lapack", "analysis", "sensitivity analysis")
MOST_ITERATIONS = 20
RANK = 1e-9
"""A singular value of the scaled matrix counts as zero (a redundant constraint) if it is below this multiple of the largest
singular value."""
REGULAR = 1e-4
"""A matrix counts as regular if its smallest pivot exceeds this multiple of its largest pivot. Solving by triangular factors then
takes a third of the time of least squares."""
OPENING = 1e-3
"""A step of Newton's method is compared with the size of the multipliers or, if larger, with this multiple of the run's largest
multiplier. Where contacts open, all multipliers may be 0."""
MOST_KEPT = 8
"""Number of units whose functions are kept for further requests."""
_kept: dict[tuple[Any, ...], Sensitivities] = {}


class SensitivityUnit:
    """The functions of one structure, with one set of parameter values.

    The unit returns the values f = [F; R; V; H; L; G] (``motion`` in ``parts.derivatives.linear_and_sensitivity_units``). F holds
    the rates of the ny states and of the nquad integrals. Other sizes: na active constraint rows, ne friction multipliers, np
    parameters (the kernel's, then the external inputs).
    """

    def __init__(self, model: Model, chosen: list[Column]):
        self.system, self.chosen = model.system, chosen
        kernel = model.kernel
        self.functions = _functions(model, chosen)
        self.n = self.functions.sizes
        self.ny, self.nquad, self.na, self.ne = self.n["states"], self.n["powers"], self.n["active"], kernel.sizes["neta"]
        self.active = kernel.facts["active_rows"]
        self.np = len(model.built.parameters.values) + len(self.system.inputs)
        self.c, self.co = np.zeros(self.n["constants"] + 1), np.zeros(self.n["o_constants"] + 1)
        self.w, self.f = np.zeros(self.n["point"] + 1), np.zeros(self.n["values"] + 1)
        self.wo = np.zeros(self.n["o_point"] + 1)
        self.nz = self.na + self.ne
        self.width = self.ny + self.nz + self.np + 1
        self._by_each = np.zeros((self.nz, self.width))  # one seed for a unit change of each multiplier
        self._by_each[:, self.ny : self.ny + self.nz] = np.eye(self.nz)
        self._by_z_rows = np.empty((self.nz, self.n["values"] + 1))  # memory for the derivatives along the seeds ``_by_each``
        self._factored: tuple[Any, ...] | None = None
        self.by_loads = bool(kernel.structure[3])
        """Whether friction may depend on reactions that redundant constraints leave open."""
        self.least = 1e-300
        self._places = tuple(map(address_of, (self.c, self.w, self.f)))
        self.prepare(np.array(model.built.parameters.values, float))

    def prepare(self, p: np.ndarray) -> None:
        """Compute the unit's constants from the values p of the kernel's parameters."""
        self.p = np.ascontiguousarray(p)
        self.functions.prepare(address_of(self.p), address_of(self.c), address_of(self.co))

    def evaluate(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """All values f at external values x, state y and multipliers z. Later derivatives refer to this point."""
        c, w, f = self._places
        self._now = (address_of(x), address_of(y), c, address_of(z), w)
        self._keep = (x, y, z)
        self.functions.point(*self._now, f)
        return self.f[: self.n["values"]]

    def directional_derivatives(self, seeds: np.ndarray) -> np.ndarray:
        """Derivatives of f (values × k) along the k rows of ``seeds``, each of the form [y | z | p | t]."""
        out = np.empty((len(seeds), self.n["values"] + 1))
        self.functions.along(self._now, seeds, out)
        return out[:, : self.n["values"]].T

    def solve(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Solve the residuals for the multipliers by Newton's method from the guess z; returns (f, z). Raises SimulationError if
        Newton's method does not converge."""
        if self.nz == 0:
            return self.evaluate(x, y, z).copy(), z
        a = self.ny + self.nquad
        for _ in range(MOST_ITERATIONS):
            f = self.evaluate(x, y, z)
            self.Rz = self.multiplier_derivatives()
            step = self._solve(f[a : a + self.nz])
            most = np.maximum.reduce(np.abs(step))
            size = max(np.maximum.reduce(np.abs(z)), most, self.least)
            z = z - step
            if most <= 1e-13 * size or most < 1e-200:  # a smaller step changes the Jacobian only by round-off
                return f - self.Rz @ step, z
        if not most <= 1e-9 * size:
            raise SimulationError(f"no derivative: the multipliers have no solution at t = {x[NOW]:.6g} s")
        f = self.evaluate(x, y, z).copy()
        self.Rz = self.multiplier_derivatives()
        return f, z

    def keep_size(self, z: np.ndarray) -> None:
        """In later calls of ``solve``, judge convergence relative to at least OPENING times the largest multiplier in z."""
        self.least = max(self.least, OPENING * float(np.abs(z).max(initial=0.0)))

    def multiplier_derivatives(self) -> np.ndarray:
        """Derivatives of f by the multipliers (values × nz) at the point of the last ``evaluate``. The next call overwrites this
        array."""
        self._factored = None
        self.functions.along(self._now, self._by_each, self._by_z_rows)
        return self._by_z_rows[:, : self.n["values"]].T

    def _solve(self, b: np.ndarray) -> np.ndarray:
        """Solve ∂R/∂z Δz = b for Δz. With redundant constraints, the result is the solution of least (scaled) norm."""
        if self.nz == 1:
            return b / self.Rz[self.ny + self.nquad, 0]
        rows, columns, solved = self._factorise()
        found = solved(b.reshape(len(b), -1) / rows[:, None])
        return (found / columns[:, None]).reshape(b.shape)

    def _factorise(self) -> tuple[Any, ...]:
        """(row scales, column scales, function that solves A x = b), where A is ∂R/∂z scaled. All right-hand sides of one matrix
        use the same factors: triangular factors if the matrix is clearly regular, else singular values."""
        if self._factored is None:
            a = self.ny + self.nquad
            A = self.Rz[a : a + self.nz]
            rows = np.maximum.reduce(np.abs(A), axis=1)
            rows[rows == 0] = 1.0
            A = A / rows[:, None]
            columns = np.sqrt(np.add.reduce(A * A, axis=0))
            columns[columns == 0] = 1.0
            A = A / columns
            lu, pivots, failed = lapack.dgetrf(A)
            size = np.abs(lu.diagonal())
            regular = not failed and np.minimum.reduce(size) > REGULAR * np.maximum.reduce(size)
            solved = _by_factors(lu, pivots) if regular else _least_squares(A, self.by_loads)
            self._factored = rows, columns, solved
        return self._factored

    def total_derivatives(self, S: np.ndarray, dp: np.ndarray, dt: np.ndarray | float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Total derivatives (df, dz) of f and of the multipliers. Seeds: S of y (ny × m), dp of p (np × m), dt of time.

        The derivatives are taken at the point of the last ``solve``.
        """
        m = S.shape[1]
        seeds = np.zeros((m, self.width))
        seeds[:, : self.ny] = S[: self.ny].T
        seeds[:, self.ny + self.nz : -1] = dp.T
        seeds[:, -1] = dt
        df = self.directional_derivatives(seeds)
        if self.nz == 0:
            return df, np.zeros((0, m))
        a = self.ny + self.nquad
        dz = -self._solve(df[a : a + self.nz])
        return df + self.Rz @ dz, dz

    def outputs(
        self, x: np.ndarray, y: np.ndarray, z: np.ndarray, rate: np.ndarray, extra: np.ndarray, seeds: tuple[np.ndarray, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Values (columns) of the chosen outputs and their derivatives (columns × m).

        y: states and integrals; rate: F, the rates of y; seeds: derivatives (rows × m) of y, z, F and p, in this order.
        """
        S, dz, dF, dp = seeds
        rows, m, v = self.system.rows, S.shape[1], slice(self.system.nq, self.system.nq + self.system.nv)
        full = np.zeros(rows + self.ne)
        full[self.active] = z[: self.na]
        full[rows:] = z[self.na :]
        lam = np.zeros((rows + self.ne, m))
        lam[self.active] = dz[: self.na]
        lam[rows:] = dz[self.na :]
        acc = np.ascontiguousarray(rate[v])
        at = tuple(map(address_of, (x, y, self.co, full, acc, extra)))
        value, out = np.zeros(len(self.chosen) + 1), np.zeros((m, len(self.chosen) + 1))
        self.functions.output_point(*at, address_of(self.wo), address_of(value))
        seeds_ = np.vstack([S, lam, dF[v], dp, np.zeros((1, m))]).T.copy()
        self.functions.outputs_along((*at, address_of(self.wo)), seeds_, out)
        return value[:-1], out[:, :-1].T


def _by_factors(lu: np.ndarray, pivots: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """A function that solves A x = b by the triangular factors of A, one right-hand side at a time. With several at once, LAPACK
    starts threads and takes much longer."""
    return lambda b: np.array([lapack.dgetrs(lu, pivots, right)[0] for right in b.T]).T


def _least_squares(A: np.ndarray, unique: bool) -> Callable[[np.ndarray], np.ndarray]:
    """A function that gives the least-norm solution of A x = b, by singular values above RANK. If the solution has to be unique but
    is not, the function raises SimulationError."""
    try:
        U, size, V = np.linalg.svd(A, full_matrices=False)
    except np.linalg.LinAlgError as e:
        raise SimulationError(f"the multipliers of a state have no derivative: {e}") from e
    kept = size > RANK * size[0]
    if unique and not kept.all():
        raise SimulationError("no derivative: friction depends on reactions that redundant constraints do not determine")
    left, right = U[:, kept].T / size[kept, None], V[kept].T
    return lambda b: right @ (left @ b)


def _functions(model: Model, chosen: list[Column]) -> Sensitivities:
    """The unit's functions, which the bytecode of the scene evaluates. The cache keeps the last MOST_KEPT units, because later
    requests often have the same structure. Units have no state, so several requests can share a unit."""
    system, parameters, quadratures, _ = model.kernel.structure
    key = (model.kernel.key, *(c.name for c in chosen))
    found = _kept.pop(key, None)
    if found is None:
        wanted = quadratures and needs_quadratures(chosen)
        found = Sensitivities(system, parameters, model.kernel.facts["active_rows"], chosen, wanted)
    while len(_kept) >= MOST_KEPT:
        _kept.pop(next(iter(_kept)), None)
    _kept[key] = found
    return found
