"""Integrates tangents along recorded steps in C (``runtime/hosts/tangent_integration.c``). If C finds no clear solution for the
multipliers of a state, Python computes them. The caller treats events."""

from __future__ import annotations

import ctypes
from typing import Any, Protocol

import numpy as np

from trunnion.analysis.sensitivities.derivatives_at_one_state import REGULAR, SensitivityUnit
from trunnion.analysis.sensitivities.initial_data_derivatives import InitialDerivatives
from trunnion.analysis.sensitivities.step_record import STEPS_PER_CALL, StepRecord
from trunnion.basics.errors import SimulationError
from trunnion.runtime.abi.tangent_records import TANGENTS
from trunnion.runtime.integrators.rk8 import RK8
from trunnion.simulation.runtime_interface.simulation_block import Block

BY_HOST = 2
"""Return value of a C function if ``HostSolver`` found the solution."""
HOST = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 6)
"""Type of ``tr_tangents.host``."""


class Integrator(Protocol):
    """The members of ``SensitivityIntegrator`` that ``TangentMarch`` uses."""

    unit: SensitivityUnit
    block: Block
    start: InitialDerivatives
    speeds: np.ndarray
    slow: float
    turning: np.ndarray

    def kinks_of(self, run: StepRecord) -> np.ndarray: ...


class HostSolver:
    """The function ``tr_tangents.host``. If the multipliers are not unique, the function finds those of least norm.

    Attributes:
        function: the function for C.
        failure: the exception that ended the function. An exception cannot pass through C, so the caller raises it.
    """

    def __init__(self, unit: SensitivityUnit, dp: np.ndarray, nx: int):
        n, m = unit.ny + unit.nquad, dp.shape[1]
        self.unit, self.dp, self.n, self.m = unit, dp, n, m
        self.lengths = (nx, n, m * n, unit.nz, unit.n["values"], m * unit.n["values"])
        self.failure: BaseException = SimulationError("the derivatives grow without bound, or a state does not close the loops")
        self.function = HOST(self.solve)

    def solve(self, *places: int) -> int:
        """Solve at (x, y, S, z), and write z, f and df. The arguments are addresses. Returns 0 on failure."""
        u, n = self.unit, self.n
        x, y, S, z, f, df = (_view(p, k) for p, k in zip(places, self.lengths, strict=True))
        try:
            f[:], z[:] = u.solve(x, y[: u.ny], z.copy())
            by_parameters, dz = u.total_derivatives(S.reshape(self.m, n).T, self.dp)
        except BaseException as e:  # noqa: BLE001  # raised by the caller
            self.failure = e
            return 0
        by_parameters[n : n + u.nz] = dz
        df[:] = by_parameters.T.ravel()
        return 1


class TangentMarch:
    """The integration of one run's tangents in C.

    Attributes:
        S: derivatives of states and integrals by the parameters ((ny + nquad) × m).
        z: multipliers of the last evaluation.
        values: the unit's columns at the sample times that C passed (samples × columns).
        derivatives: their derivatives (samples × m × columns).
        count: number of these samples so far.
    """

    def __init__(self, integrator: Integrator, run: StepRecord):
        u, self.run, self.count = integrator.unit, run, 0
        self.unit, self.block, self.m = u, integrator.block, integrator.start.p.shape[1]
        samples, columns = len(run.samples), len(u.chosen)
        self.values, self.derivatives = np.zeros((samples, columns)), np.zeros((samples, self.m, columns))
        rows, self.z = np.zeros((self.m, u.ny + u.nquad)), np.zeros(u.nz)
        rows[:, : u.ny], self.S = integrator.start.y.T, rows.T
        stops, inside = run.changes_mode | integrator.kinks_of(run), np.diff(run.passed) - run.sample
        solved = run.solved * (u.nz == len(u.active) + u.ne == run.stages.shape[1] // RK8.rows)
        self._marks = np.ascontiguousarray(np.column_stack([stops, inside, run.sample, solved]), np.intc)
        self._keep = {
            "dp": np.ascontiguousarray(integrator.start.p.T), "magnitude": integrator.start.magnitudes,
            "extra": np.zeros(u.n["extra"] + 1), "c": u.c, "co": u.co, "w": u.w, "wo": u.wo, "z": self.z, "S": rows,
            "speeds": integrator.speeds, "place": _places(u), "turn": integrator.turning,
        }  # fmt: skip
        self.host = HostSolver(u, integrator.start.p, run.x.shape[1])
        self._table = self._record(integrator.slow)

    def _record(self, slow: float) -> Any:
        """The record ``tr_tangents``."""
        u, system = self.unit, self.unit.system
        n, turning = u.ny + u.nquad, self._keep["turn"]
        numbers = {
            "ny": u.ny, "n": n, "nq": system.nq, "nv": system.nv, "nx": self.run.x.shape[1], "nz": u.nz,
            "nall": system.rows + u.ne, "np": u.np, "m": self.m, "nf": u.n["values"], "residual": n,
            "rates": n + u.n["residuals"], "nrates": u.n["rates"], "columns": len(u.chosen), "turning": len(turning),
            "slow": slow, "regular": REGULAR,
        }  # fmt: skip
        addresses = {k: a.ctypes.data for k, a in self._keep.items()} | u.functions.addresses()
        table = TANGENTS.ctype(**numbers, **addresses, host=ctypes.cast(self.host.function, ctypes.c_void_p).value)
        self._work = np.zeros(self.block.lib.tr_tangents_work(ctypes.addressof(table)))
        table.work = self._work.ctypes.data
        return table

    def advance(self, first: int) -> tuple[int, bool]:
        """Integrate from step ``first`` on, by at most STEPS_PER_CALL steps. Returns (next step to integrate, whether the end of
        the last step must be completed)."""
        run = self.run
        count = min(STEPS_PER_CALL, len(run.x) - first)
        places = [_row(a, first) for a in (run.x, run.after, run.stages, self._marks)]
        out = [_row(a, self.count) for a in (run.samples, self.values, self.derivatives)]
        made = self.block.lib.tr_march_tangents(
            self.block.at, ctypes.addressof(self._table), count, _row(run.time, first), _row(run.y, first), run.y.shape[1],
            *places, *out,
        )  # fmt: skip
        if made < 0:
            raise self.host.failure
        made += first
        left = bool(self._marks[made - 1, 0])
        self.count = int(run.passed[made]) - (left and bool(run.sample[made - 1]))
        return made, left

    def evaluate(self, t: float, y: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(f, df, dz) at a state with the present S. f: the unit's values. df, dz: derivatives of f and of the multipliers by the
        parameters."""
        u, n = self.unit, self.unit.ny + self.unit.nquad
        f, df = np.zeros(u.n["values"]), np.zeros((self.m, u.n["values"]))
        y, x = np.ascontiguousarray(y), np.ascontiguousarray(x)
        places = [a.ctypes.data for a in (y, x, f, df)]
        if not self.block.lib.tr_evaluate_tangents(self.block.at, ctypes.addressof(self._table), t, *places):
            raise self.host.failure
        return f, df.T, df[:, n : n + u.nz].T

    def cross(self, k: int, x: np.ndarray, x1: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(f, df, flow, after) at an event at the end of step k. f: the unit's values just before the event, with external values
        x. df, flow: derivatives of f by the parameters, and by time along the motion. after: the rates just after the event, with
        external values x1."""
        u, run, n = self.unit, self.run, self.unit.ny + self.unit.nquad
        f, df, flow, after = (np.zeros(size) for size in (u.n["values"], (self.m, u.n["values"]), u.n["values"], n))
        known = k + 1 < len(run.x) and self._marks[k + 1, 3]
        z1 = _row(run.stages, k + 1) if known else 0
        places = [_row(run.y, k + 1), x.ctypes.data, x1.ctypes.data, z1, *(a.ctypes.data for a in (f, df, flow, after))]
        found = self.block.lib.tr_cross_event(self.block.at, ctypes.addressof(self._table), run.time[k + 1], *places)
        if not found:
            raise self.host.failure
        if found == BY_HOST:
            flow = u.total_derivatives(f[:n, None], np.zeros((u.np, 1)), 1.0)[0][:, 0]
        return f, df.T, flow, after

    def append(self, values: np.ndarray, derivatives: np.ndarray) -> None:
        """Append the columns (columns) and derivatives (columns × m) of a sample that Python evaluated."""
        self.values[self.count], self.derivatives[self.count] = values, derivatives.T
        self.count += 1


def _view(place: int, length: int) -> np.ndarray:
    """The doubles at an address."""
    return np.ctypeslib.as_array((ctypes.c_double * length).from_address(place)) if length else np.zeros(0)


def _row(a: np.ndarray, k: int) -> int:
    """Address of row k of a contiguous array."""
    return a.ctypes.data + k * a.strides[0]


def _places(u: SensitivityUnit) -> np.ndarray:
    """For each multiplier of the unit, its index among the multipliers of all constraint rows and of friction."""
    rows = u.system.rows
    return np.array([*u.active[: u.na], *range(rows, rows + u.ne)], np.intc)
