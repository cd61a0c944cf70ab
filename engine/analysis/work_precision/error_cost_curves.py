"""Measured points as named curves, and the comparison of the engine with each reference solver."""

from __future__ import annotations

from trunnion.analysis.work_precision.measurement_points import ENGINE, Measurement
from trunnion.analysis.work_precision.request_and_results import WorkPrecision
from trunnion.basics.lazy_data_classes import dataclass

USABLE = 0.1
"""Runs with a relative error above this value are not compared in time."""


@dataclass(frozen=True)
class Curve:
    """The points of one program, method and friction law, either with error control or with fixed steps. Points are sorted by
    decreasing tolerance or step."""

    program: str
    method: str
    law: str
    v_eps: float
    fixed: bool
    points: tuple[Measurement, ...]

    @property
    def label(self) -> str:
        """Name in the legend: the program (if it is not the engine), the method, and "fixed step" where it applies."""
        words = [] if self.program == ENGINE else [self.program]
        return " ".join([*words, self.method, *(["fixed step"] if self.fixed and self.program == ENGINE else [])])

    @property
    def law_label(self) -> str:
        """Name of the friction law with its v_eps."""
        return f"{self.law}, v_eps {self.v_eps:g}" if self.v_eps else self.law


def group_into_curves(points: list[Measurement]) -> list[Curve]:
    """One curve for each program, method, law, v_eps and step control, in the order of measurement."""
    groups: dict[tuple, list[Measurement]] = {}
    for p in points:
        groups.setdefault((p.program, p.method, p.law, p.v_eps, p.fixed), []).append(p)
    ordered = {key: tuple(sorted(ps, key=lambda p: (-p.rtol, -p.step))) for key, ps in groups.items()}
    return [Curve(ps[0].program, ps[0].method, ps[0].law, ps[0].v_eps, ps[0].fixed, ps) for ps in ordered.values()]


def compare_with_solvers(study: WorkPrecision) -> list[str]:
    """A sentence for every reference solver: how much faster the engine is at equal errors, or at which settings the engine is
    slower."""
    out = []
    for program in dict.fromkeys(p.program for p in study.solver_points()):
        finished = [p for p in study.solver_points() if p.program == program and p.ok and p.error == p.error]
        theirs = [p for p in finished if p.error <= USABLE]
        if finished and not theirs:
            out.append(
                f"{program}: no error below {USABLE:.0%} (smallest error {_smallest_error(finished):.2g}): {finished[0].leaves_out}"
            )
        ratios = [r for p in theirs if (r := _speed_ratio(study, p))]
        if not ratios:
            continue
        slow = [r for r in ratios if r[0] < 1.0]
        worst, best = min(ratios), max(ratios)
        factors = " to ".join(f"{float(f'{r[0]:.3g}'):g}" for r in (worst, best))
        text = f"{program}: at equal errors Trunnion is {factors} times as fast"
        text += f" (smallest error of the program: {_smallest_error(theirs):.1e})"
        out.append(text + (f"; slower at {len(slow)} of {len(ratios)} settings, first at error {slow[0][1]:.1e}" if slow else ""))
    return out


def _smallest_error(points: list[Measurement]) -> float:
    return min(p.error for p in points)


def _speed_ratio(study: WorkPrecision, peer: Measurement) -> tuple[float, float] | None:
    """(ratio of the solver's time to the least time in which the engine reaches the solver's error, solver's error). None if the
    engine never reaches this error.

    Errors below twice the reference's own error cannot be distinguished. A smaller error of a solver is replaced by this limit.
    """
    own = study.references.get(peer.variant)
    floor = own.error if own else 0.0
    good = [
        p.minimum for p in study.engine_points() if p.ok and p.variant == peer.variant and p.error <= max(peer.error, 2 * floor)
    ]
    return (peer.minimum / min(good), peer.error) if good else None
