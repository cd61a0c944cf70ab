"""Results of bounds at rest: intervals, the states that attain the ends of the intervals, and the loads at which sliding
begins."""

from __future__ import annotations

import math
from typing import Any

from trunnion.analysis.static_bounds.start_pose_statics import HoldReport
from trunnion.basics.lazy_data_classes import dataclass


@dataclass(frozen=True)
class JointState:
    """A joint with friction in one state.

    Attributes:
        reaction: reaction components by name, N or N m (notation, "Reactions, friction and contacts").
        friction: friction on the inboard part along each freedom, N or N m.
        shares: friction of each pair divided by its capacity.
    """

    reaction: dict[str, float]
    friction: tuple[float, ...]
    shares: tuple[float, ...]


@dataclass(frozen=True)
class State:
    """A state that attains an end of an interval.

    Attributes:
        joints: the joints with friction.
        drives: efforts of drives, N or N m, by name.
        loads: amount of the examined load, N or N m, by name.
        endless: whether the state is a direction in which forces can grow without bound: a self-stress of unit contact forces.
    """

    joints: dict[str, JointState]
    drives: dict[str, float]
    loads: dict[str, float]
    endless: bool = False


@dataclass(frozen=True)
class End:
    """An end of an interval.

    Attributes:
        value: value that ``state`` attains; infinite for an endless state, None where no state was found.
        certified: value beyond which certainly no state exists.
        state: the state that attains ``value``.
        cells: number of cells that the search examined.
    """

    value: float | None
    certified: float
    state: State | None
    cells: int

    @property
    def gap(self) -> float:
        """Distance between the attained and the certified value; 0 if the end is infinite or if no state was found."""
        return abs(self.certified - self.value) if self.value is not None and math.isfinite(self.value) else 0.0


@dataclass(frozen=True)
class Interval:
    """Least and largest value over all admissible states."""

    least: End
    largest: End

    def contains(self, x: float, tolerance: float = 1e-9) -> bool:
        """Whether a value lies between the certified ends, within ``tolerance`` (relative, and absolute for values below 1)."""
        slack = tolerance * max(1.0, abs(x))
        return self.least.certified - slack <= x <= self.largest.certified + slack


@dataclass(frozen=True)
class PairBounds:
    """Bounds of a frictional pair.

    Attributes:
        joint: name of the joint.
        part: number of the pair in the joint.
        type: type of the joint.
        normal_force: sum of the contacts' normal forces with friction at the limit, N; the capacity is μ_s times this sum.
        friction: friction at the surface, N; signed for pairs of one freedom, otherwise the magnitude.
        share: friction divided by capacity.
        exact: whether the capacity is exact. For a shaft with several states of equilibrium, only bounds of the capacity are known.
    """

    joint: str
    part: int
    type: str
    normal_force: Interval
    friction: Interval
    share: Interval
    exact: bool

    @property
    def margins(self) -> tuple[float, float]:
        """The certified least and largest value of 1 − share."""
        return 1.0 - self.share.largest.certified, 1.0 - self.share.least.certified


@dataclass(frozen=True)
class Breakaway:
    """The onset of sliding while a load increases, or while it decreases.

    Attributes:
        guaranteed: amount up to which no motion can begin; NaN if the present load is not held.
        possible: amount beyond which no state of equilibrium exists.
        joints: joints that slide in the first motion.
    """

    guaranteed: End
    possible: End
    joints: tuple[str, ...]


@dataclass(frozen=True)
class LoadBounds:
    """Bounds of a load.

    Attributes:
        name: path of the load in the scene.
        unit: unit of the load.
        now: amount of the load at the start; None for the effort of a drive.
        more: onset of sliding as the load increases.
        less: onset of sliding as the load decreases.
    """

    name: str
    unit: str
    now: float | None
    more: Breakaway
    less: Breakaway


@dataclass(frozen=True)
class HoldBounds:
    """Bounds over all admissible states of a scene at rest.

    Attributes:
        holds: "certain" (no motion can begin), "possible" (some states hold, in others a motion begins) or "no".
        first: joints that slide in the first motion; if no motion can begin, the joint nearest to its limit.
        open: number of directions that equilibrium does not determine.
        self_stress: bound on self-stress, N; None means no bound.
        pairs: bounds of every pair.
        loads: bounds of every load, input and drive.
        answer: the ``HoldReport`` of one state.
        notes: limits of the results.
        ended: "done", "budget" (out of time) or "cancelled" (Ctrl-C). If not "done", some ends may have only a certified value.
        misfit: bound on the misalignment, m; None means no bound.
    """

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
        """The bounds of the first pair of a joint."""
        return next(p for p in self.pairs if p.joint == name)

    def load(self, name: str) -> LoadBounds:
        """The bounds of the load with this name."""
        return next(p for p in self.loads if p.name == name)

    @property
    def gap(self) -> float:
        """The largest difference between value and certified bound over all ends."""
        ends = [e for p in self.pairs for i in (p.normal_force, p.friction, p.share) for e in (i.least, i.largest)]
        ends += [e for p in self.loads for b in (p.more, p.less) for e in (b.guaranteed, b.possible)]
        return max((e.gap for e in ends), default=0.0)


def to_json_data(x: Any) -> Any:
    """Nested data for JSON: infinite numbers become "inf" or "-inf", NaN becomes null."""
    if isinstance(x, float):
        return x if math.isfinite(x) else None if math.isnan(x) else str(x)
    if isinstance(x, dict):
        return {k: to_json_data(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [to_json_data(v) for v in x]
    return x
