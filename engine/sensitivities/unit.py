"""The sensitivity unit at one state: the motion's values, its multipliers, and derivatives along given directions."""

from __future__ import annotations

import ctypes
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from engine.abi.header import header
from engine.basics.extras import brought
from engine.basics.problems import SimulationError
from engine.kernel import cache, compiler
from engine.kernel.columns import Column, needs_quadratures
from engine.kernel.library import Kernel
from engine.parts.derived import Sensitivities
from engine.parts.kernel import PartsKernel
from engine.simulation.run import Model
from engine.system.external import NOW

lapack = brought("scipy.linalg.lapack", "analysis", "what differentiates runs")
NEWTON = 20
RANK = 1e-9
"""Singular values below this part of the largest (rows and columns scaled) belong to redundant constraints."""
REGULAR = 1e-4
"""Pivots above this part of the largest say that none are: then triangular factors do, which take a third of the time."""
FUNCTIONS = {"s_prepare": 2, "s_point": 6, "s_along": 7, "so_prepare": 2, "so_point": 8, "so_along": 9}
"""The unit's functions, which take arrays alone, and how many."""


class Unit:
    """The functions of one structure, with one set of parameter values.

    Its values f are [F; R; V; H] (``kernel.parameter_unit``): F has the rates of the ny states and nquad integrals. Other sizes:
    na active constraint rows, ne friction multipliers, np run-time numbers (those of the kernel, then the external inputs).
    """

    def __init__(self, model: Model, chosen: list[Column]):
        self.system, self.chosen = model.system, chosen
        kernel = model.kernel
        parts = isinstance(kernel, PartsKernel)
        self.functions: Compiled | Sensitivities = _of_parts(kernel, chosen) if parts else Compiled(model, chosen)
        self.n = self.functions.sizes
        self.ny, self.nquad, self.na, self.ne = self.n["states"], self.n["powers"], self.n["active"], kernel.sizes["neta"]
        self.active = kernel.facts["active_rows"] if self.na < self.system.rows else list(range(self.system.rows))
        self.np = len(model.built.parameters.values) + len(self.system.inputs)
        self.c, self.co = np.zeros(self.n["constants"] + 1), np.zeros(self.n["o_constants"] + 1)
        self.w, self.f = np.zeros(self.n["point"] + 1), np.zeros(self.n["values"] + 1)
        self.wo = np.zeros(self.n["o_point"] + 1)
        self.nz = self.na + self.ne
        self.width = self.ny + self.nz + self.np + 1
        self._by_each = np.zeros((self.nz, self.width))  # the directions along which the multipliers change one by one
        self._by_each[:, self.ny : self.ny + self.nz] = np.eye(self.nz)
        self._by_z_rows = np.empty((self.nz, self.n["values"] + 1))  # where derivatives along these are written, again and again
        self._factored: tuple[Any, ...] | None = None
        self._places = tuple(map(_at, (self.c, self.w, self.f)))
        self.prepare(np.array(model.built.parameters.values, float))

    def prepare(self, p: np.ndarray) -> None:
        """Compute the constants that depend on the parameter values p alone."""
        self.p = np.ascontiguousarray(p)
        self.functions.prepare(_at(self.p), _at(self.c), _at(self.co))

    def point(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """All values f at (x, y, z). Later derivatives are taken at this point, until the next call."""
        c, w, f = self._places
        self._now = (_at(x), _at(y), c, _at(z), w)
        self._keep = (x, y, z)
        self.functions.point(*self._now, f)
        return self.f[: self.n["values"]]

    def along(self, seeds: np.ndarray) -> np.ndarray:
        """Derivatives of f along the rows of ``seeds`` (k × [y | z | p | t]): a matrix of values × k."""
        out = np.empty((len(seeds), self.n["values"] + 1))
        self.functions.along(self._now, seeds, out)
        return out[:, : self.n["values"]].T

    def solve(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(f, z) where the residuals are zero, found from z as a guess. SimulationError when there is no root nearby."""
        if self.nz == 0:
            return self.point(x, y, z).copy(), z
        a = self.ny + self.nquad
        for _ in range(NEWTON):
            f = self.point(x, y, z)
            self.Rz = self._by_z()
            step = self._solve(f[a : a + self.nz])
            most = np.maximum.reduce(np.abs(step))
            size = max(np.maximum.reduce(np.abs(z)), most, 1e-300)
            z = z - step
            if most <= 1e-13 * size or most < 1e-200:  # so small a step moves f along its slope; the slopes stay what they are
                return f - self.Rz @ step, z
        if not most <= 1e-9 * size:
            raise SimulationError(f"no multipliers at t = {x[NOW]:.6g} s: no derivative")
        f = self.point(x, y, z).copy()
        self.Rz = self._by_z()
        return f, z

    def _by_z(self) -> np.ndarray:
        """Derivatives of f by the multipliers (values × nz), until the next call."""
        self._factored = None
        self.functions.along(self._now, self._by_each, self._by_z_rows)
        return self._by_z_rows[:, : self.n["values"]].T

    def _solve(self, b: np.ndarray) -> np.ndarray:
        """A⁺ b, A the derivatives of the residuals by the multipliers, scaled: the solution of least norm where constraints are
        redundant."""
        A, rows, columns, lu, pivots = self._factors()
        if len(A) == 1:
            return b / rows[0] / A[0, 0]
        b = (b.T / rows).T
        if lu is not None:
            return (lapack.dgetrs(lu, pivots, b)[0].T / columns).T
        try:
            found = np.linalg.lstsq(A, b, rcond=RANK)[0]
        except np.linalg.LinAlgError as e:
            raise SimulationError(f"the multipliers of a state have no derivative: {e}") from e
        return (found.T / columns).T

    def _factors(self) -> tuple[Any, ...]:
        """A as it is now, its rows and columns divided by these scales, and its triangular factors where it is clearly regular."""
        if self._factored is None:
            a = self.ny + self.nquad
            A = self.Rz[a : a + self.nz]
            rows = np.maximum.reduce(np.abs(A), axis=1)
            rows[rows == 0] = 1.0
            A = A / rows[:, None]
            columns = np.sqrt(np.add.reduce(A * A, axis=0)) if len(A) > 1 else np.ones(1)
            columns[columns == 0] = 1.0
            A = A / columns
            lu, pivots, failed = lapack.dgetrf(A)
            size = np.abs(lu.diagonal())
            regular = not failed and np.minimum.reduce(size) > REGULAR * np.maximum.reduce(size)
            self._factored = A, rows, columns, *((lu, pivots) if regular else (None, None))
        return self._factored

    def total(self, S: np.ndarray, dp: np.ndarray, dt: np.ndarray | float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """(df, dz): how f and the multipliers change when y moves by S (ny × m), p by dp (np × m) and time by dt, at the point
        last solved."""
        m = S.shape[1]
        seeds = np.zeros((m, self.width))
        seeds[:, : self.ny] = S[: self.ny].T
        seeds[:, self.ny + self.nz : -1] = dp.T
        seeds[:, -1] = dt
        df = self.along(seeds)
        if self.nz == 0:
            return df, np.zeros((0, m))
        a = self.ny + self.nquad
        dz = -self._solve(df[a : a + self.nz])
        return df + self.Rz @ dz, dz

    def outputs(
        self, x: np.ndarray, y: np.ndarray, z: np.ndarray, rate: np.ndarray, extra: np.ndarray, seeds: tuple[np.ndarray, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Values (columns) of the chosen outputs and their derivatives (columns × m). y: states and integrals; rate: their
        rates F, with v̇; seeds: derivatives (rows × m) of y, of the multipliers z, of F, and of p."""
        S, dz, dF, dp = seeds
        rows, m, v = self.system.rows, S.shape[1], slice(self.system.nq, self.system.nq + self.system.nv)
        full = np.zeros(rows + self.ne)
        full[self.active] = z[: self.na]
        full[rows:] = z[self.na :]
        lam = np.zeros((rows + self.ne, m))
        lam[self.active] = dz[: self.na]
        lam[rows:] = dz[self.na :]
        acc = np.ascontiguousarray(rate[v])
        at = tuple(map(_at, (x, y, self.co, full, acc, extra)))
        value, out = np.zeros(len(self.chosen) + 1), np.zeros((m, len(self.chosen) + 1))
        self.functions.output_point(*at, _at(self.wo), _at(value))
        seeds_ = np.vstack([S, lam, dF[v], dp, np.zeros((1, m))]).T.copy()
        self.functions.outputs_along((*at, _at(self.wo)), seeds_, out)
        return value[:-1], out[:, :-1].T


class Compiled:
    """The functions of a unit that is compiled for the scene."""

    def __init__(self, model: Model, chosen: list[Column]):
        folder, _ = cache.entry(f"sensitivity-{model.kernel.key}", lambda f: _build(f, model, chosen))
        lib = ctypes.CDLL(str(folder / f"sensitivity{compiler.library_suffix()}"))
        for name, arguments in FUNCTIONS.items():
            getattr(lib, name).argtypes = [ctypes.c_void_p] * arguments
        self.sizes: dict[str, int] = json.loads((folder / "sizes.json").read_text())
        self.lib, self.point, self.output_point = lib, lib.s_point, lib.so_point

    def prepare(self, p: int, c: int, co: int) -> None:
        """Constants from parameters."""
        self.lib.s_prepare(p, c)
        self.lib.so_prepare(p, co)

    def along(self, now: Sequence[int], seeds: np.ndarray, out: np.ndarray) -> None:
        """Derivatives of the motion's values along the rows of ``seeds``, into the rows of ``out``."""
        for s, o in zip(_rows(seeds), _rows(out), strict=True):
            self.lib.s_along(*now, s, o)

    def outputs_along(self, now: Sequence[int], seeds: np.ndarray, out: np.ndarray) -> None:
        """The same of the columns."""
        for s, o in zip(_rows(seeds), _rows(out), strict=True):
            self.lib.so_along(*now, s, o)


def _of_parts(kernel: Kernel, chosen: list[Column]) -> Sensitivities:
    """The functions of a unit that is made of parts."""
    system, parameters, quadratures, redundant = kernel.structure
    active = list(range(system.rows)) if redundant else kernel.facts["active_rows"]
    return Sensitivities(system, parameters, active, chosen, quadratures and needs_quadratures(chosen))


def _at(a: np.ndarray) -> int:
    """Address of an array (contiguous, writable). A march asks for millions: ``a.ctypes`` would take half of its time."""
    return ctypes.addressof(ctypes.c_char.from_buffer(cast(Any, a))) if a.size else 0


def _rows(a: np.ndarray) -> list[int]:
    """Addresses of the rows of a matrix."""
    first, stride = _at(a), a.strides[0]
    return [first + k * stride for k in range(len(a))]


def _build(folder: Path, model: Model, chosen: list[Column]) -> None:
    """Write and compile the unit in a new folder of the cache."""
    compiler.needed("derivatives by parameters", "those of the scene's equations")
    from engine.kernel.parameter_unit import parameter_unit

    system, parameters, quadratures, redundant = model.kernel.structure
    unit = parameter_unit(system, parameters, chosen, quadratures and needs_quadratures(chosen), redundant)
    file = folder / "sensitivity.c"
    file.write_text(unit.text)
    (folder / "tr_abi.h").write_text(header())
    (folder / "sizes.json").write_text(json.dumps(unit.sizes))
    library, flags = folder / f"sensitivity{compiler.library_suffix()}", compiler.unit_flags("sensitivity", unit.text)
    compiler.build_library([file], library, [folder], cache.cache_folder(), flags)
