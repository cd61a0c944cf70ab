"""Derivatives across an impact of joints that only push (theory, "Batches and hosts").

The impact occurs where the gap g(y, p) is 0. A unit change of the parameters therefore shifts the instant of the impact by dt =
−(g_y S + g_p)/ġ. The impact maps the state by a function h, so S⁺ = h_y (S⁻ + ẏ⁻ dt) + h_p − ẏ⁺ dt. The function h solves one or
more impulse problems, which the run has recorded. Each problem is a step of negligible length. Its multipliers are the impulses
divided by this length, so finite forces are negligible.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trunnion.analysis.sensitivities.derivatives_at_one_state import SensitivityUnit
from trunnion.analysis.sensitivities.step_record import RecordedStep
from trunnion.basics.errors import SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi import PairState
from trunnion.system.structure.bodies_and_joints import Joint, Slider
from trunnion.system.structure.external_value_layout import INSIDE

SHORT = 1e-12
"""Length of the step of an impact, relative to the time scale of the mechanism."""
TOGETHER = 1e-6
"""Contacts count as closing together for all parameters if the derivatives of their instants are nearly equal: within this value,
relative to their size."""
FREE, RATE, IMPULSE, STOP = range(4)
"""Quantity of a contact that a part of an impact prescribes: zero impulse (FREE), the rate after the part (RATE), or the impulse
(IMPULSE). STOP: the part ends where a pair stops sliding."""


@dataclass(frozen=True)
class Phase:
    """A recorded part of an impact. x: external values; impulses: impulses of all multipliers; given: FREE, RATE, IMPULSE or STOP
    for each contact; restitution: coefficient of each contact, or index of the pair that stops."""

    x: np.ndarray
    impulses: np.ndarray
    given: np.ndarray
    restitution: np.ndarray


@dataclass(frozen=True)
class Crossing:
    """The result of an impact. S: the derivatives after the impact; joint: the first contact that closes; shift: derivative of the
    instant by the parameters; unique: whether ``shift`` is the same for all contacts that close."""

    S: np.ndarray
    joint: str
    shift: np.ndarray
    unique: bool


class ImpactTangents:
    """Derivatives across the impact at the end of a step. S: derivatives of states and integrals before the impact ((ny + nquad) ×
    m). dp: derivatives of the unit's parameters (np × m). rate: rate scale of the mechanism, 1/s.

    approach: values and derivatives before the impact. made: [impulses, their derivatives] (nz × (1 + m)) since the start of the
    phase. compression: value of ``made`` at the end of the phase of compression."""

    def __init__(self, unit: SensitivityUnit, step: RecordedStep, S: np.ndarray, dp: np.ndarray, rate: float):
        self.unit, self.step, self.S, self.dp, self.h = unit, step, S, dp, SHORT / rate
        self.n, self.contacts = unit.ny + unit.nquad, unit.system.unilateral
        self.gap = unit.n["values"] - 3 * len(self.contacts)
        self.before = step.impact[1 : 1 + len(step.y1)]

    def cross(self, z: np.ndarray, x0: np.ndarray, x1: np.ndarray) -> Crossing:
        """Compute the derivatives after the impact. z: multipliers before the impact; x0, x1: external values before and after the
        impact."""
        u, n = self.unit, self.n
        f, _ = u.solve(x0, self.before[: u.ny], z)
        df, _ = u.total_derivatives(self.S, self.dp)
        flow = u.total_derivatives(f[:n, None], np.zeros((u.np, 1)), 1.0)[0][:, 0]
        phases = list(self._phases())
        self._refuse_stops_without_derivative(phases)
        at = [c for c in range(len(self.contacts)) if self._closes(c, phases[0], f)]
        shifts = [-df[self.gap + 3 * c] / flow[self.gap + 3 * c] for c in at]
        shift, spread = shifts[0], max(float(np.abs(s - shifts[0]).max(initial=0.0)) for s in shifts)
        self.approach: tuple[np.ndarray, np.ndarray] | None = None
        self.made = self.compression = np.zeros((u.nz, 1 + len(shift)))
        dy, y = self.S + np.outer(f[:n], shift), self.before.copy()
        for phase in phases:
            y, dy, impulses = self._phase(phase, y, dy, shift)
            self.made = self.made + impulses
            if STOP not in phase.given:
                self.compression, self.made = self.made, np.zeros_like(self.made)
        after, _ = u.solve(x1, self.step.y1[: u.ny], np.zeros(u.nz))
        size = max(float(np.abs(shift).max(initial=0.0)), 1e-300)
        return Crossing(dy - np.outer(after[:n], shift), self.contacts[at[0]].name, shift, spread <= TOGETHER * size)

    def _closes(self, c: int, phase: Phase, f: np.ndarray) -> bool:
        """Whether contact c was open before the impact, takes part in the impact, and approaches."""
        contact = self.contacts[c].unilateral
        assert contact is not None
        was_open = self.step.x[self.unit.system.external.stop(contact.flag)] < 0.5
        return bool(was_open and phase.given[c] in (RATE, STOP) and f[self.gap + 3 * c + 1] < 0.0)

    def _refuse_stops_without_derivative(self, phases: list[Phase]) -> None:
        """Raise SimulationError where a pair stops sliding in an impact of several contacts: the derivative of the ratio of their
        impulses is not computed."""
        if any((p.given == STOP).sum() > 1 for p in phases):
            raise SimulationError("no derivative: in an impact of several contacts, a joint stops sliding, and slides on")

    def _phases(self) -> Iterator[Phase]:
        u, log = self.unit, self.step.impact
        nx, count = len(self.step.x), len(self.contacts)
        at, size = 1 + len(self.step.y1), nx + u.nz + 2 * count
        if int(log[0]) * size > len(log) - at:
            raise SimulationError("no derivative: joints stop sliding too often within an impact")
        for k in range(int(log[0])):
            part = log[at + k * size : at + (k + 1) * size]
            given = part[nx + u.nz :].reshape(-1, 2)
            yield Phase(part[:nx].copy(), part[nx : nx + u.nz].copy(), given[:, 0], given[:, 1])

    def _phase(self, phase: Phase, y: np.ndarray, dy: np.ndarray, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(state, its derivatives, [impulses, their derivatives]) after a part of an impact."""
        u, h, a = self.unit, self.h, self.n
        v = slice(u.system.nq, u.system.nq + u.system.nv)
        z = phase.impulses / h
        phase.x[INSIDE] = self.step.x[INSIDE]
        f = u.evaluate(phase.x, y[: u.ny], z).copy()
        seeds = np.zeros((len(shift), u.width))
        seeds[:, : u.ny], seeds[:, u.ny + u.nz : -1], seeds[:, -1] = dy[: u.ny].T, self.dp.T, shift
        df = u.directional_derivatives(seeds)
        residual = df[a : a + u.nz].copy()
        u.Rz = u.multiplier_derivatives()
        if self.approach is None:
            self.approach = f, df
        first, dfirst = self.approach
        poisson = bool(self.contacts[0].unilateral and self.contacts[0].unilateral.poisson)
        for row, k in self._stuck_rows(phase.x):
            residual[row] += df[k] / h
        for c, j in enumerate(self.contacts):
            gap, row = self.gap + 3 * c, u.active.index(j.rows)
            e, de = phase.restitution[c], df[gap + 2] if phase.restitution[c] else 0.0
            if phase.given[c] == RATE:
                residual[row] += df[gap + 1] / h
                if not poisson and first[gap + 1] < 0.0:
                    residual[row] += (de * first[gap + 1] + e * dfirst[gap + 1]) / h
            elif phase.given[c] == STOP:
                Jp, dv = self._rate_of_stopped_pair(int(e), phase.x, (y, f, z), seeds, df)
                u.Rz[a + row], residual[row] = Jp @ u.Rz[v], dv / h
            elif phase.given[c] == IMPULSE:
                u.Rz[a + row] = np.eye(u.nz)[row]
                residual[row] = -(de * self.compression[row, 0] + e * self.compression[row, 1:] - self.made[row, 1:]) / h
        dz = -u._solve(residual)
        change = df[:a] + u.Rz[:a] @ dz
        y, dy = y.copy(), dy.copy()
        y[v], dy[v] = y[v] + h * f[v], dy[v] + h * change[v]
        return y, dy, np.column_stack([phase.impulses, h * dz])

    def _rate_of_stopped_pair(
        self, pair: int, x: np.ndarray, at: tuple[np.ndarray, np.ndarray, np.ndarray], seeds: np.ndarray, df: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(derivatives of the pair's rate after a part by the rates v (nv), its derivatives (m) at given multipliers). at: state
        before the part, values there, and multipliers; seeds, df: of ``directional_derivatives`` before the part."""
        u, (y, f, z), v = self.unit, at, slice(self.unit.system.nq, self.unit.system.nq + self.unit.system.nv)
        row = [first for _, _, first in self._pairs()][pair]
        after, along, each = y[: u.ny].copy(), seeds.copy(), np.zeros((u.system.nv, u.width))
        after[v] += self.h * f[v]
        along[:, v] += self.h * df[v].T
        each[:, v] = np.eye(u.system.nv)
        u.evaluate(x, after, z)
        return u.directional_derivatives(each)[row].copy(), u.directional_derivatives(along)[row].copy()

    def _pairs(self) -> Iterator[tuple[Joint, Slider, int]]:
        """(joint, pair, index among the values of the pair's first rate) of each pair."""
        at = self.unit.n["residuals"] + self.n
        for j in self.unit.system.frictional:
            assert j.friction is not None
            yield from ((j, s, at + s.eta[0] - j.friction.eta[0]) for s in j.friction.sliders)
            at += j.kind.nv

    def _stuck_rows(self, x: np.ndarray) -> Iterator[tuple[int, int]]:
        """(row among the residuals, index of the rate) of each component of a pair that sticks in a phase. Raises SimulationError
        for a pair of several components that slides, because the impact turns the direction of the pair's friction."""
        u = self.unit
        for j, s, first in self._pairs():
            if j.unilateral is not None and x[u.system.external.stop(j.unilateral.flag)] < 0.5:
                continue
            if u.system.external.mode_in(x, s.flag).flag == PairState.STUCK:
                yield from ((u.na + e, first + e - s.eta[0]) for e in s.eta)
            elif len(s.eta) > 1:
                raise SimulationError(f"no derivative: the friction of {j.name} changes its direction in an impact")
