"""What is said of a mechanism at rest: intervals, the states that attain their ends, loads at which something lets go."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from engine.simulation.hold import HoldReport


@dataclass(frozen=True)
class JointState:
    """A joint with friction in one state. reaction: the components its contacts follow from, by name (N, N m; NOTATION, "Reactions,
    friction and contacts"); friction: along each freedom on the inboard part (N or N m); shares: of what each pair can hold."""

    reaction: dict[str, float]
    friction: tuple[float, ...]
    shares: tuple[float, ...]


@dataclass(frozen=True)
class State:
    """A state that attains an end. endless: it is a direction instead, a self-stress of unit contact forces, along which
    the asked quantity goes on without end. drives, loads: efforts of drives and the asked load (N or N m), by name."""

    joints: dict[str, JointState]
    drives: dict[str, float]
    loads: dict[str, float]
    endless: bool = False


@dataclass(frozen=True)
class End:
    """An end of an interval. value: attained by ``state`` (infinite where that is endless; None: none was found); certified:
    nothing is beyond it; cells: what finding out took."""

    value: float | None
    certified: float
    state: State | None
    cells: int

    @property
    def gap(self) -> float:
        """What is left between what is attained and what is certified; 0 where there is no end, or nothing is attained."""
        return abs(self.certified - self.value) if self.value is not None and math.isfinite(self.value) else 0.0


@dataclass(frozen=True)
class Interval:
    """Least and largest value over all admissible states."""

    least: End
    largest: End

    def contains(self, x: float, tolerance: float = 1e-9) -> bool:
        """Whether a value lies between what is certified, up to this, relative and absolute."""
        slack = tolerance * max(1.0, abs(x))
        return self.least.certified - slack <= x <= self.largest.certified + slack


@dataclass(frozen=True)
class PairBounds:
    """A frictional pair. normal_force: the sum of its contacts' normal forces with its friction at the limit, N (the most friction
    is μ_s times it); friction: at the surface, N (with its sign for pairs of one freedom, else its size); share: friction over the
    most the pair holds; exact: whether what it holds is an exact form (a shaft's is an upper bound)."""

    joint: str
    part: int
    type: str
    normal_force: Interval
    friction: Interval
    share: Interval
    exact: bool

    @property
    def margins(self) -> tuple[float, float]:
        """(least, largest) of 1 − share, certified."""
        return 1.0 - self.share.largest.certified, 1.0 - self.share.least.certified


@dataclass(frozen=True)
class Breakaway:
    """Letting go as a load changes one way. guaranteed: up to there no state lets a motion begin (NaN: it does not hold as it is);
    possible: beyond it no state holds; joints: which slide in the motion that begins first."""

    guaranteed: End
    possible: End
    joints: tuple[str, ...]


@dataclass(frozen=True)
class LoadBounds:
    """A load. now: its amount at the start (None: the effort of a drive, which is whatever holds it)."""

    name: str
    unit: str
    now: float | None
    more: Breakaway
    less: Breakaway


@dataclass(frozen=True)
class HoldBounds:
    """All of what a scene at rest can do. holds: "certain" (no admissible state lets a motion begin), "possible" (some states hold,
    and some let one begin) or "no" (none holds); first: joints that slide in the motion that can begin, or that is nearest to it;
    open: how many directions equilibrium leaves open; self_stress, misfit: bound on it, N or m (None: none); answer: that of
    ``hold``; ended: "done", or with searches cut short by the "budget" or "stopped" by Ctrl-C: an end without value is then what is
    certified."""

    holds: str
    first: tuple[str, ...]
    open: int
    self_stress: float | None
    pairs: tuple[PairBounds, ...]
    loads: tuple[LoadBounds, ...]
    answer: HoldReport
    notes: tuple[str, ...]
    ended: str = "done"
    misfit: float | None = None

    def __getitem__(self, name: str) -> PairBounds:
        """The first pair of a joint."""
        return next(p for p in self.pairs if p.joint == name)

    def load(self, name: str) -> LoadBounds:
        """A load by name."""
        return next(p for p in self.loads if p.name == name)

    @property
    def gap(self) -> float:
        """The largest gap left at any end."""
        ends = [e for p in self.pairs for i in (p.normal_force, p.friction, p.share) for e in (i.least, i.largest)]
        ends += [e for p in self.loads for b in (p.more, p.less) for e in (b.guaranteed, b.possible)]
        return max((e.gap for e in ends), default=0.0)


def plain(x: Any) -> Any:
    """Data classes, tuples and numbers as JSON has them: without end is "inf" or "-inf", nothing is null."""
    if isinstance(x, float):
        return x if math.isfinite(x) else None if math.isnan(x) else str(x)
    if isinstance(x, dict):
        return {k: plain(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [plain(v) for v in x]
    return x
