"""Integrates tangents along recorded steps in C (``runtime/hosts/tangents.c``). Events, and steps without a clear solution of the
multipliers, are left to Python."""

from __future__ import annotations

import ctypes
from typing import Any, Protocol

import numpy as np

from trunnion.analysis.sensitivities.directional_derivatives import SensitivityUnit
from trunnion.analysis.sensitivities.initial_derivatives import InitialDerivatives
from trunnion.analysis.sensitivities.step_record import STEPS_PER_CALL, StepRecord
from trunnion.runtime.abi.tangent_records import TANGENTS
from trunnion.simulation.runtime_interface.simulation_block import Block
from trunnion.system.structure.external_value_layout import External

COMPONENTS = 3
"""Largest number of components of a pair."""


class Integrator(Protocol):
    """The members of ``SensitivityIntegrator`` that the march uses."""

    unit: SensitivityUnit
    block: Block
    start: InitialDerivatives
    at: External
    m: int
    S: np.ndarray
    z: np.ndarray
    speeds: np.ndarray
    slow: float
    turning: list[tuple[int, list[int]]]

    def kinks_of(self, run: StepRecord) -> np.ndarray: ...


class TangentMarch:
    """The integration of one run's tangents in C.

    Attributes:
        values: the unit's columns at the sample times that C passed (samples × columns).
        derivatives: their derivatives (samples × m × columns).
        count: number of these samples so far.
    """

    def __init__(self, integrator: Integrator, run: StepRecord):
        self.integrator, self.run, self.count = integrator, run, 0
        u: SensitivityUnit = integrator.unit
        self.unit, self.block, self.m = u, integrator.block, integrator.m
        samples, columns = int(run.sample.sum()) + 1, len(u.chosen)
        self.values, self.derivatives = np.zeros((samples, columns)), np.zeros((samples, self.m, columns))
        self._S, self._z = np.zeros((self.m, u.ny + u.nquad)), np.zeros(u.nz)
        self._stops = np.ascontiguousarray(run.changes_mode | integrator.kinks_of(run), np.intc)
        self._keep = {
            "dp": np.ascontiguousarray(integrator.start.p.T), "extra": np.zeros(u.n["extra"] + 1), "c": u.c, "co": u.co, "w": u.w,
            "wo": u.wo, "z": self._z, "S": self._S, "speeds": integrator.speeds, "place": _places(u), "turn": _turning(integrator),
        }  # fmt: skip
        self._table = self._record()

    def _record(self) -> Any:
        """The record ``tr_tangents``."""
        u, system = self.unit, self.unit.system
        n, turning = u.ny + u.nquad, self._keep["turn"]
        numbers = {
            "ny": u.ny, "n": n, "nq": system.nq, "nv": system.nv, "nx": self.run.x.shape[1], "nz": u.nz,
            "nall": system.rows + u.ne, "np": u.np, "m": self.integrator.m, "nf": u.n["values"], "residual": n,
            "rates": n + u.n["residuals"], "nrates": u.n["rates"], "columns": len(u.chosen), "turning": len(turning),
            "slow": self.integrator.slow,
        }  # fmt: skip
        table = TANGENTS.ctype(**numbers, **{k: a.ctypes.data for k, a in self._keep.items()}, **u.functions.addresses())
        self._work = np.zeros(self.block.lib.tr_tangents_work(ctypes.addressof(table)))
        table.work = self._work.ctypes.data
        return table

    def advance(self, first: int) -> tuple[int, bool]:
        """Integrate from step ``first`` on, by at most STEPS_PER_CALL steps. Returns (k, whether Python must complete the end of
        step k − 1). Step k is the next step to integrate; if k is ``first``, Python must integrate it."""
        run, own = self.run, self.integrator
        count = min(STEPS_PER_CALL, len(run.x) - first)
        self._S[:], self._z[:] = own.S.T, own.z
        places = [_row(a, first) for a in (run.x, run.after, self._stops, run.sample)]
        out = [_row(a, self.count) for a in (self.values, self.derivatives)]
        made = self.block.lib.tr_march_tangents(
            self.block.at, ctypes.addressof(self._table), count, _row(run.time, first), _row(run.y, first), run.y.shape[1],
            *places, *out,
        )  # fmt: skip
        own.S, own.z = self._S.T.copy(), self._z.copy()
        done, left = divmod(made, 2)
        upto = first + done
        self.count += int(run.sample[first:upto].sum())
        return upto + left, bool(left)

    def evaluate(self, t: float, y: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """The result of ``SensitivityIntegrator._evaluate`` with the integrator's S, computed in C. None if C finds no clear
        solution of the multipliers."""
        own, u, n = self.integrator, self.unit, self.unit.ny + self.unit.nquad
        f, df = np.zeros(u.n["values"]), np.zeros((self.m, u.n["values"]))
        y, x = np.ascontiguousarray(y), np.ascontiguousarray(x)
        self._S[:], self._z[:] = own.S.T, own.z
        places = [a.ctypes.data for a in (y, x, f, df)]
        if not self.block.lib.tr_evaluate_tangents(self.block.at, ctypes.addressof(self._table), t, *places):
            return None
        own.z = self._z.copy()
        return f, df.T, df[:, n : n + u.nz].T

    def append(self, values: np.ndarray, derivatives: np.ndarray) -> None:
        """Append the columns (columns) and derivatives (columns × m) of a sample that Python evaluated."""
        self.values[self.count], self.derivatives[self.count] = values, derivatives.T
        self.count += 1


def _row(a: np.ndarray, k: int) -> int:
    """Address of row k of a contiguous array."""
    return a.ctypes.data + k * a.strides[0]


def _places(u: SensitivityUnit) -> np.ndarray:
    """Index of each of the unit's multipliers among those of all rows and of friction."""
    rows = u.system.rows
    return np.array([*u.active[: u.na], *range(rows, rows + u.ne)], np.intc)


def _turning(integrator: Integrator) -> np.ndarray:
    """Five integers for each pair whose friction has a frozen direction (``tr_tangents.turn``)."""
    at = integrator.at
    found = [[at.mode(flag), len(places), *places, *[0] * (COMPONENTS - len(places))] for flag, places in integrator.turning]
    return np.array(found, np.intc).reshape(-1, 2 + COMPONENTS)
