"""The variational equation Ṡ = f_y S + f_p along a recorded run: the same Runge–Kutta steps, jumps at events.

At an event g(y, p) = 0 that makes ẏ jump, its time depends on the parameters: dt = −(g_y S + g_p)/ġ, and S⁺ = S⁻ + (ẏ⁻ − ẏ⁺) dt.
Kinks of a continuous law change nothing; nor does release, unless static friction is larger than sliding friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.abi import PairState
from engine.friction import REGISTRY as LAWS
from engine.integrators.rk8 import RK8
from engine.sensitivities.record import Leg, Record, Tick
from engine.sensitivities.start import Start
from engine.sensitivities.unit import Unit
from engine.simulation.block import Block
from engine.system.external import INSIDE
from engine.system.structure import System

A = [np.array(row, float) for row in RK8.A]
B = np.array(RK8.B, float)
C = np.array(RK8.C, float)
JUMP = 1e-9
"""Change of ẏ at an event, relative to the size of ẏ, below which ẏ counts as continuous there."""
AT_REST = 1e-6
"""Sliding speed at an event, relative to the speeds of the run, that counts as zero."""
HAIR = 1e-7
"""Speed given to a pair at the instant it starts or stops sliding, as a part of the run's rate scale."""


@dataclass(frozen=True)
class EventShift:
    """An event whose time moves with the parameters: its time, s; its joint; shift: dt/dp, one entry for each parameter."""

    time: float
    joint: str
    shift: np.ndarray


class March:
    """The state carried along a run. S: derivatives of states and integrals by the parameters ((ny + nquad) × m); z: the
    multipliers; events: the shifts of event times so far."""

    def __init__(self, unit: Unit, block: Block, start: Start):
        self.unit, self.block, self.start, self.breaks = unit, block, start, block.numbers.breaks
        self.at = unit.system.external
        self.m = start.p.shape[1]
        self.S = np.vstack([start.y, np.zeros((unit.nquad, self.m))])
        self.z = np.zeros(unit.nz)
        self.events: list[EventShift] = []
        self.notes: list[str] = []
        self.speeds = np.zeros(unit.n["rates"])
        self.rate = block.numbers.rate
        self.turning = _turning(unit.system)

    def _evaluate(self, t: float, y: np.ndarray, S: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(f, df, dz) at a state: the unit's values, and the derivatives by the parameters of these and of the multipliers."""
        self.block.signals(t, x)
        y, S = self._moving(y, S, x)
        f, self.z = self.unit.solve(x, y, self.z)
        df, dz = self.unit.total(S, self.start.p)
        return f, df, dz

    def _moving(self, y: np.ndarray, S: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(y, S) with a hair of speed along the frozen direction for those pairs of several components that slide but stand
        still at this very instant, at the end or onset of sliding: there the direction of friction has a limit, but no
        derivative. Velocities across that direction die out as the speed goes to zero (friction turns against them), and so do
        their derivatives."""
        y = np.array(y)
        for flag, places in self.turning:
            mode = self.at.mode_in(x, flag)
            d = mode.direction[: len(places)]
            size = np.linalg.norm(d)
            slides = mode.flag != PairState.STUCK and size > 0
            if slides and np.linalg.norm(y[places]) < HAIR * self.rate:
                d = d / size
                y[places] = HAIR * self.rate * d
                S = S.copy()
                S[places] = np.outer(d, d @ S[places])
        return y, S

    def step(self, leg: Leg) -> None:
        """Carry S over one leg of the run, and across the event at its end if there is one."""
        n, h, x = self.unit.ny + self.unit.nquad, leg.t1 - leg.t0, leg.x.copy()
        x[INSIDE] = 0.5 * (leg.t0 + leg.t1)
        K, KS = np.zeros((len(B), n)), np.zeros((len(B), n, self.m))
        y0, flat = leg.y0[:n], KS.reshape(len(B), n * self.m)
        for i in range(len(B)):
            y = y0 + h * (A[i] @ K[:i]) if i else y0
            S = self.S + h * (A[i] @ flat[:i]).reshape(n, self.m) if i else self.S
            f, df, _ = self._evaluate(leg.t0 + C[i] * h, y, S, x)
            K[i], KS[i] = f[:n], df[:n]
        self.S = self.S + h * (B @ flat).reshape(n, self.m)
        self._rates(f)
        if leg.changed:
            self._event(leg, x)
        for k, at in enumerate(self.breaks):
            if abs(at - leg.t1) <= 1e-12 * max(1.0, abs(at)) and np.any(self.start.breaks[k]):
                self._kink(leg, k)

    def _rates(self, f: np.ndarray) -> None:
        a = self.unit.ny + self.unit.nquad + self.unit.n["residuals"]
        self.speeds = np.maximum(self.speeds, np.abs(f[a : a + self.unit.n["rates"]]))

    def _event(self, leg: Leg, x: np.ndarray) -> None:
        n, y = self.unit.ny + self.unit.nquad, leg.y1
        x1 = leg.x1.copy()
        x1[INSIDE] = leg.t1 + (leg.t1 - leg.t0) * 1e-6
        after = self._evaluate(leg.t1, y, self.S, x1)[0][:n]
        f, df, _ = self._evaluate(leg.t1, y, self.S, x)
        change = f[:n] - after
        if np.abs(change).max() <= JUMP * max(np.abs(f[:n]).max(), 1e-300):
            return
        cause = self._cause(leg, f, df)
        if cause is None:
            self.notes.append(f"t = {leg.t1:.6g} s: what made the motion jump is not known; derivatives after it are not reliable")
            return
        joint, dg, gdot = cause
        shift = -dg / gdot
        self.S = self.S + np.outer(change, shift)
        self.events.append(EventShift(leg.t1, joint, shift))

    def _kink(self, leg: Leg, k: int) -> None:
        """Carry S across kink k of a signal, whose time depends on a parameter."""
        n, sides = self.unit.ny + self.unit.nquad, []
        for side in (-1e-9, 1e-9):
            x = leg.x1.copy()
            x[INSIDE] = leg.t1 + side * max(1.0, abs(leg.t1))
            sides.append(self._evaluate(leg.t1, leg.y1, self.S, x)[0][:n])
        self.S = self.S + np.outer(sides[0] - sides[1], self.start.breaks[k])

    def _cause(self, leg: Leg, f: np.ndarray, df: np.ndarray) -> tuple[str, np.ndarray, float] | None:
        """(joint, dg, ġ) of the event function g that reached zero at the leg's end: the speed of a pair that came to rest, or
        the friction ratio of a pair that was released. ġ is taken along the motion before the event, where f was last
        evaluated. None when there is no such pair."""
        u = self.unit
        n, rates = u.ny + u.nquad, u.ny + u.nquad + u.n["residuals"]
        flow, _ = u.total(f[:n, None], np.zeros((u.np, 1)), 1.0)
        at = 0
        found: list[tuple[float, str, np.ndarray, float]] = []
        for j in u.system.frictional:
            assert j.friction is not None
            first = j.friction.eta[0]
            for s in j.friction.sliders:
                mode, new = self.at.mode_in(leg.x, s.flag), self.at.mode_in(leg.x1, s.flag)
                rows = [rates + at + e - first for e in s.eta]
                d = mode.direction[: len(rows)]
                size = np.linalg.norm(d)
                if mode.flag != PairState.STUCK and size > 0:
                    d = d / size
                    speed = abs(d @ f[rows]) / max(self.speeds[[r - rates for r in rows]].max(), 1e-300)
                    if speed < AT_REST:
                        found.append((speed, j.name, d @ df[rows], float(d @ flow[rows, 0])))
                elif mode.flag == PairState.STUCK != new.flag and u.n["holds"]:
                    row = rates + u.n["rates"] + s.flag
                    found.append((abs(f[row]), j.name, df[row], float(flow[row, 0])))
            at += j.kind.nv
        usable = [c for c in found if c[3] != 0.0]
        return min(usable, key=lambda c: c[0])[1:] if usable else None


def _turning(system: System) -> list[tuple[int, list[int]]]:
    """The pairs of several components whose friction has a direction to freeze: the number of each, and where its rates are in the
    state."""
    found = []
    for j in system.frictional:
        assert j.friction is not None
        if not j.cut and len(j.free) == j.kind.nv and LAWS[j.friction.law].sets:
            first = j.friction.eta[0]
            found += [(s.flag, [system.nq + j.v0 + e - first for e in s.eta]) for s in j.friction.sliders if len(s.eta) > 1]
    return found


def marched(
    unit: Unit, block: Block, start: Start, run: Record, tick: Tick
) -> tuple[np.ndarray, np.ndarray, March]:
    """March along a whole run. (values as the unit computes them, samples × columns; derivatives, samples × columns × m; the
    march)."""
    march = March(unit, block, start)
    out = [_columns(march, 0.0, run.y0, run.x0)]
    for leg in run.legs:
        tick()
        march.step(leg)
        if leg.sample:
            out.append(_columns(march, leg.t1, leg.y1, leg.x1))
    return np.array([v for v, _ in out]), np.array([d for _, d in out]), march


def _columns(march: March, t: float, y: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (columns) and derivatives (columns × m) of the chosen columns at a state."""
    u, x = march.unit, x.copy()
    x[INSIDE] = t + 1e-12
    f, df, dz = march._evaluate(t, y, march.S, x)
    n = u.ny + u.nquad
    return u.outputs(x, np.ascontiguousarray(y[:n]), march.z, f, np.zeros(u.n["extra"] + 1), (march.S, dz, df, march.start.p))
