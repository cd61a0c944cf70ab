"""The variational equation Ṡ = f_y S + f_p along a recorded run, integrated in C with the run's own Runge–Kutta steps, with jumps
at events.

S is the derivative of the state y by the parameters p, and f = ẏ. If ẏ jumps at an event g(y, p) = 0, a unit change of the
parameters shifts the event's time by dt = −(g_y S + g_p)/ġ. Then S jumps: S⁺ = S⁻ + (ẏ⁻ − ẏ⁺) dt. Kinks of a continuous friction
law cause no jump. A release causes a jump only if static friction exceeds sliding friction.
"""

from __future__ import annotations

import math

import numpy as np

from trunnion.analysis.sensitivities.derivatives_at_one_state import MOST_ITERATIONS, RANK, SensitivityUnit
from trunnion.analysis.sensitivities.impact_tangents import ImpactTangents
from trunnion.analysis.sensitivities.initial_data_derivatives import InitialDerivatives
from trunnion.analysis.sensitivities.step_record import RecordedStep, StepRecord, Tick
from trunnion.analysis.sensitivities.tangent_integration import TangentMarch
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.runtime.abi import PairState
from trunnion.simulation.runtime_interface.simulation_block import Block
from trunnion.system.structure.bodies_and_joints import Joint, Slider, System
from trunnion.system.structure.external_value_layout import INSIDE

COMPONENTS = 3
"""Largest number of components of a pair."""
JUMP = 1e-9
"""ẏ counts as continuous at an event if its relative change is below this value."""
AT_REST = 1e-6
"""A sliding speed at an event counts as zero below this multiple of the largest speed of the joint in the run so far."""
AT_CAPACITY = 1e-7
"""Several pairs count as released together if the scaled residuals of their joint release are below this multiple of the largest
multiplier."""
LET_GO = 1e-9
"""A hook releases where its event function (m, rad, or a fraction of its release signal) is below this value."""
SLIP_SPEED = 1e-10
"""Speed, relative to the run's rate scale, that replaces the zero speed of a pair at the instant at which its sliding begins or
ends. The error of derivatives is about ten times this value. At lower speeds, round-off disturbs the direction."""


@dataclass(frozen=True)
class EventShift:
    """An event whose time depends on the parameters. time: s; shift: dt/dp (m), s per parameter unit."""

    time: float
    joint: str
    shift: np.ndarray


class SensitivityIntegrator:
    """Integrates derivatives along a recorded run.

    Attributes:
        march: the integration between events, with the present derivatives ``S``.
        events: the event shifts found so far.
    """

    def __init__(self, unit: SensitivityUnit, block: Block, start: InitialDerivatives, run: StepRecord):
        self.unit, self.block, self.start = unit, block, start
        self.breaks = np.array(block.numbers.breaks, float).reshape(-1, 2)
        self.moved = bool(np.any(start.breaks))
        self.at = unit.system.external
        self.events: list[EventShift] = []
        self.notes: list[str] = []
        self.speeds = np.zeros(unit.n["rates"])
        self.slow = SLIP_SPEED * block.numbers.rate
        self.turning = _directional_pairs(unit.system)
        self.march = TangentMarch(self, run)
        if unit.system.unilateral:
            unit.keep_size(run.stages)

    def complete(self, k: int, step: RecordedStep) -> None:
        """Update S for the event and the kinks at the end of step k."""
        kinks = np.flatnonzero(self._kinks_at(step.t1))
        if step.impact[0]:
            self._cross_impact(step)
        elif len(kinks):
            self._cross_kinks(k, step, kinks)
        elif step.changes_mode:
            self._cross_event(k, step)

    def kinks_of(self, run: StepRecord) -> np.ndarray:
        """For each step of a run: whether the step ends at a kink of a signal. False for all steps if no time of a kink depends on
        a parameter."""
        return np.logical_and(self.moved, np.logical_or.reduce(self._kinks_at(run.time[1:, None]), axis=1))

    def _kinks_at(self, t: np.ndarray | float) -> np.ndarray:
        """Whether each kink occurs at time t (times × kinks)."""
        first, period = self.breaks.T
        at = first + period * self._occurrence(t)
        return np.asarray(np.abs(at - t) <= 1e-12 * np.maximum(1.0, np.abs(at)))

    def _occurrence(self, t: np.ndarray | float) -> np.ndarray:
        """For each kink, the number (from 0) of the kink's occurrence closest to t."""
        first, period = self.breaks.T
        since = t - first
        number = np.divide(since, period, out=np.zeros(since.shape), where=period > 0.0)
        return np.maximum(np.round(number), 0.0)

    def _cross_event(self, k: int, step: RecordedStep) -> None:
        n, x, x1 = self.unit.ny + self.unit.nquad, step.x.copy(), step.x1.copy()
        x[INSIDE] = 0.5 * (step.t0 + step.t1)
        x1[INSIDE] = step.t1 + (step.t1 - step.t0) * 1e-6
        f, df, flow, after = self.march.cross(k, x, x1)
        change = f[:n] - after
        if np.abs(change).max(initial=0.0) <= JUMP * max(np.abs(f[:n]).max(initial=0.0), 1e-300):
            return
        self.block.signals(step.t1, x)
        cause = self._find_cause(step, f, df, flow, x)
        if cause is None and self._only_stops_change(step):
            return
        if cause is None:
            self.notes.append(
                f"t = {step.t1:.6g} s: the motion jumped for an unknown cause; derivatives after this time are not reliable"
            )
            return
        joint, dg, gdot = cause
        shift = -dg / gdot
        self.march.S += np.outer(change, shift)
        self.events.append(EventShift(step.t1, joint, shift))

    def _cross_impact(self, step: RecordedStep) -> None:
        """Update S for an impact of joints that only push."""
        x, x1 = step.x.copy(), step.x1.copy()
        x[INSIDE] = 0.5 * (step.t0 + step.t1)
        x1[INSIDE] = step.t1 + (step.t1 - step.t0) * 1e-6
        for side in (x, x1):
            self.block.signals(step.t1, side[: len(x)])
        made = ImpactTangents(self.unit, step, self.march.S, self.start.p, self.block.numbers.rate).cross(self.march.z, x, x1)
        self.march.S[:] = made.S
        self.events.append(EventShift(step.t1, made.joint, made.shift))
        if not made.unique:
            self.notes.append(
                f"t = {step.t1:.6g} s: several contacts close at this instant; if a parameter changes, they close one after another"
            )

    def _only_stops_change(self, step: RecordedStep) -> bool:
        """Whether an event at the step's end belongs only to end stops and to contacts that open. The forces of both are
        continuous at these events. If ẏ jumps at such an event, the jump is only the error of the event's location times a
        stop's stiffness."""
        changed = step.x != step.x1
        for j in self.unit.system.frictional:
            assert j.friction is not None
            for s in j.friction.sliders if self._is_open(j, step.x1) else ():
                changed[self.at.mode(s.flag) : self.at.mode(s.flag + 1)] = False
        return not changed[self.at.stop(self.unit.system.stops - self.unit.system.latches) :].any()

    def _is_open(self, j: Joint, x: np.ndarray) -> bool:
        """Whether a joint only pushes and is open."""
        return j.unilateral is not None and x[self.at.stop(j.unilateral.flag)] < 0.5

    def _find_lifted_hook(self, step: RecordedStep, f: np.ndarray) -> tuple[int, str] | None:
        """A hook that releases at the step's end: (row of the hook's event function, joint)."""
        u, system = self.unit, self.unit.system
        first = u.ny + u.nquad + u.n["residuals"] + u.n["rates"] + u.n["holds"]
        for j in system.joints:
            for d in j.devices:
                if d.latch is None:
                    continue
                flag = self.at.stop(system.hook(d.latch.hook))
                if step.x[flag] > 0.5 and step.x1[flag] < step.x[flag] and abs(f[first + d.latch.hook]) <= LET_GO:
                    return first + d.latch.hook, j.name
        return None

    def _find_passed_end(self, step: RecordedStep) -> tuple[int, str] | None:
        """A closed contact that passes a free end of its wall at the step's end: (row of the distance inside the ends, joint)."""
        u, system = self.unit, self.unit.system
        first = u.ny + u.nquad + u.n["residuals"] + u.n["rates"] + u.n["holds"] + system.latches
        for i, j in enumerate(system.with_free_ends):
            assert j.unilateral is not None
            flag = self.at.stop(j.unilateral.inside)
            if step.x[flag] != step.x1[flag] and not self._is_open(j, step.x):
                return first + i, j.name
        return None

    def _cross_kinks(self, k: int, step: RecordedStep, kinks: np.ndarray) -> None:
        """Update S at kinks of signals. An event at the end of the step is a consequence of the kinks, and has their time."""
        shifts = self.start.breaks[kinks, 0] + self._occurrence(step.t1)[kinks, None] * self.start.breaks[kinks, 1]
        shift = next((x for x in shifts if x.any()), None)
        if shift is None:
            return
        run, n, sides = self.march.run, self.unit.ny + self.unit.nquad, []
        if k + 1 == len(run.x):
            return  # step k is the last step of the run
        after = run.step(k + 1)
        for x, inside in ((step.x, 0.5 * (step.t0 + step.t1)), (after.x, 0.5 * (after.t0 + after.t1))):
            side = x.copy()
            side[INSIDE] = inside
            sides.append(self.march.evaluate(step.t1, step.y1, side)[0][:n])
        self.march.S += np.outer(sides[0] - sides[1], shift)
        for j in self.unit.system.frictional:
            assert j.friction is not None
            modes = [[self.at.mode_in(x, s.flag).flag for s in j.friction.sliders] for x in (step.x, after.x)]
            if modes[0] != modes[1]:
                self.events.append(EventShift(step.t1, j.name, shift))

    def _find_cause(
        self, step: RecordedStep, f: np.ndarray, df: np.ndarray, flow: np.ndarray, x: np.ndarray
    ) -> tuple[str, np.ndarray, float] | None:
        """(joint, dg, ġ) of the event function g that is zero at the step's end; None if no hook, free end of a wall or friction
        pair causes the event.

        For a hook, g is the distance from its release. For a free end, g is the distance from the end. For a pair that came to
        rest, g is its speed. For a released pair, g is its friction ratio minus one. For pairs released together,
        ``_release_together`` combines these functions.

        dg and ġ are taken just before the event. f, df, flow: as in ``TangentMarch.cross``; x: external values before the event.
        """
        u = self.unit
        n, rates = u.ny + u.nquad, u.ny + u.nquad + u.n["residuals"]
        if passed := self._find_lifted_hook(step, f) or self._find_passed_end(step):
            row, joint = passed
            return (joint, df[row], float(flow[row])) if flow[row] else None
        at = 0
        found: list[tuple[float, str, np.ndarray, float]] = []
        released: list[tuple[str, Slider]] = []
        for j in u.system.frictional:
            assert j.friction is not None
            first = j.friction.eta[0]
            for s in j.friction.sliders if not self._is_open(j, step.x1) else ():
                mode, new = self.at.mode_in(step.x, s.flag), self.at.mode_in(step.x1, s.flag)
                rows = [rates + at + e - first for e in s.eta]
                d = mode.direction[: len(rows)]
                size = math.sqrt(d @ d)
                if mode.flag != PairState.STUCK and size > 0:
                    d = d / size
                    speed = abs(d @ f[rows]) / max(self.speeds[[r - rates for r in rows]].max(), 1e-300)
                    if speed < AT_REST:
                        found.append((speed, j.name, d @ df[rows], float(d @ flow[rows])))
                elif mode.flag == PairState.STUCK != new.flag and u.n["holds"]:
                    released.append((j.name, s))
            at += j.kind.nv
        if len(released) > 1:
            return self._release_together(released, f[:n], step.y1, x, self.march.z)
        for name, s in released:
            row = rates + u.n["rates"] + s.flag
            found.append((abs(f[row]), name, df[row], float(flow[row])))
        usable = [c for c in found if c[3] != 0.0]
        return min(usable, key=lambda c: c[0])[1:] if usable else None

    def _release_together(
        self, released: list[tuple[str, Slider]], flow: np.ndarray, y: np.ndarray, x: np.ndarray, z: np.ndarray
    ) -> tuple[str, np.ndarray, float] | None:
        """(first joint, dg, ġ) of pairs that are released together; None if no multipliers bring each pair to its capacity.

        At rest, the equations leave the distribution of load among the pairs open. At release each pair is at its capacity, so this
        distribution is unique. The vector r(z, t, p) holds the residuals, and each friction ratio minus one. The system r = 0 has
        one more equation than unknowns z. So g = nᵀ r is an event function for any n with nᵀ ∂r/∂z = 0. Redundant rows add further
        vectors n, along which r does not change. z: initial guess of the multipliers.
        """
        u = self.unit
        a = u.ny + u.nquad
        if any(len(s.eta) > 1 for _, s in released):
            return None
        rows = [*range(a, a + u.nz), *(a + u.n["residuals"] + u.n["rates"] + s.flag for _, s in released)]
        for _ in range(MOST_ITERATIONS):
            r = u.evaluate(x, y, z)[rows].copy()
            by_z = u.multiplier_derivatives()[rows]
            if not (np.isfinite(r).all() and np.isfinite(by_z).all()):
                return None  # Newton's method diverges
            scale = np.maximum(np.abs(by_z).max(axis=1), 1e-300)
            change = np.linalg.lstsq(by_z / scale[:, None], -r / scale, rcond=RANK)[0]
            z = z + change
            if np.abs(change).max() <= 1e-12 * np.abs(z).max():
                break
        r = u.evaluate(x, y, z)[rows] / scale
        if not np.abs(r).max() <= AT_CAPACITY * np.abs(z).max():
            return None
        left, sizes, _ = np.linalg.svd(u.multiplier_derivatives()[rows] / scale[:, None])
        normal = left[:, np.count_nonzero(sizes > RANK * sizes[0]) :].T
        S, dp = self.march.S, self.start.p
        seeds = np.zeros((dp.shape[1] + 1, u.width))
        seeds[:-1, : u.ny], seeds[:-1, u.ny + u.nz : -1] = S[: u.ny].T, dp.T
        seeds[-1, : u.ny], seeds[-1, -1] = flow[: u.ny], 1.0
        d = normal @ (u.directional_derivatives(seeds)[rows] / scale[:, None])
        rate = d[:, -1]
        size = float(rate @ rate)
        return (released[0][0], rate @ d[:, :-1], size) if size > 0.0 else None


def _directional_pairs(system: System) -> np.ndarray:
    """The integers ``tr_tangents.turn`` of each pair of several components whose friction has a frozen direction. The integers are
    the index of the pair's mode among the external values, the number of components, and the state indices of the pair's rates
    (padded with zeros)."""
    found: list[list[int]] = []
    for j in system.frictional:
        assert j.friction is not None
        if not j.cut and len(j.free) == j.kind.nv and LAWS[j.friction.law].sets:
            first = j.friction.eta[0]
            for s in (s for s in j.friction.sliders if len(s.eta) > 1):
                places = [system.nq + j.v0 + e - first for e in s.eta]
                found.append([system.external.mode(s.flag), len(places), *places, *[0] * (COMPONENTS - len(places))])
    return np.array(found, np.intc).reshape(-1, 2 + COMPONENTS)


def integrate_sensitivities(
    unit: SensitivityUnit, block: Block, start: InitialDerivatives, run: StepRecord, tick: Tick
) -> tuple[np.ndarray, np.ndarray, SensitivityIntegrator]:
    """Integrate along a whole run. Returns the unit's values (samples × columns), the derivatives (samples × columns × m) and the
    integrator."""
    integrator, next_step = SensitivityIntegrator(unit, block, start, run), 0
    march = integrator.march
    march.append(*_columns(integrator, 0.0, run.y[0], run.after[0]))
    while next_step < len(run.x):
        tick()
        next_step, left = march.advance(next_step)
        if left:
            step = run.step(next_step - 1)
            integrator.complete(next_step - 1, step)
            if step.sample:
                march.append(*_columns(integrator, step.t1, step.y1, step.x1))
    return march.values, march.derivatives.transpose(0, 2, 1), integrator


def _columns(integrator: SensitivityIntegrator, t: float, y: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (columns) and derivatives (columns × m) of the chosen columns at a state."""
    u, x = integrator.unit, x.copy()
    x[INSIDE] = t + 1e-12
    f, df, dz = integrator.march.evaluate(t, y, x)
    y, seeds = np.ascontiguousarray(y[: u.ny + u.nquad]), (integrator.march.S, dz, df, integrator.start.p)
    return u.outputs(x, y, integrator.march.z, f, np.zeros(u.n["extra"] + 1), seeds)
