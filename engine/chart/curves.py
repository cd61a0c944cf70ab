"""Points gathered into named curves, for the picture and the page alike."""

from __future__ import annotations

from dataclasses import dataclass

from engine.chart.points import OURS, Point
from engine.chart.study import Study

USABLE = 0.1
"""A run with a relative error beyond this is no solution, and its time is not compared."""


@dataclass(frozen=True)
class Curve:
    """Points of one program, method, law and way of stepping, by falling tolerance or step."""

    program: str
    method: str
    law: str
    v_eps: float
    fixed: bool
    points: tuple[Point, ...]

    @property
    def label(self) -> str:
        """Name in the legend: program (unless it is ours), method, way of stepping."""
        words = [] if self.program == OURS else [self.program]
        return " ".join([*words, self.method, *(["fixed step"] if self.fixed and self.program == OURS else [])])

    @property
    def law_label(self) -> str:
        """Name of the friction law with its v_eps."""
        return f"{self.law}, v_eps {self.v_eps:g}" if self.v_eps else self.law


def curves(points: list[Point]) -> list[Curve]:
    """One curve for each program, method, law, v_eps and way of stepping, in the order they were measured."""
    groups: dict[tuple, list[Point]] = {}
    for p in points:
        groups.setdefault((p.program, p.method, p.law, p.v_eps, p.fixed), []).append(p)
    ordered = {key: tuple(sorted(ps, key=lambda p: (-p.rtol, -p.step))) for key, ps in groups.items()}
    return [Curve(ps[0].program, ps[0].method, ps[0].law, ps[0].v_eps, ps[0].fixed, ps) for ps in ordered.values()]


def verdict(study: Study) -> list[str]:
    """One sentence for every peer: how much faster ours is at the errors it reaches (worst and best), or where it is slower."""
    out = []
    for program in dict.fromkeys(p.program for p in study.theirs()):
        finished = [p for p in study.theirs() if p.program == program and p.ok and p.error == p.error]
        theirs = [p for p in finished if p.error <= USABLE]
        if finished and not theirs:
            out.append(f"{program}: never within {USABLE:.0%} (at best {_least(finished):.2g}): {finished[0].leaves_out}")
        ratios = [r for p in theirs if (r := _advantage(study, p))]
        if not ratios:
            continue
        slow = [r for r in ratios if r[0] < 1.0]
        worst, best = min(ratios), max(ratios)
        text = f"{program}: ours is {worst[0]:.3g} to {best[0]:.3g} times as fast at the errors it reaches"
        text += f" (down to {_least(theirs):.1e})"
        out.append(text + (f"; slower at {len(slow)} of {len(ratios)} settings, first at error {slow[0][1]:.1e}" if slow else ""))
    return out


def _least(points: list[Point]) -> float:
    return min(p.error for p in points)


def _advantage(study: Study, peer: Point) -> tuple[float, float] | None:
    """(the peer's time over our least time at an error no larger, the peer's error); None when none of ours is as accurate.

    An error below twice the reference's own cannot be told from it and counts as that."""
    own = study.references.get(peer.variant)
    floor = own.error if own else 0.0
    good = [p.minimum for p in study.ours() if p.ok and p.variant == peer.variant and p.error <= max(peer.error, 2 * floor)]
    return (peer.minimum / min(good), peer.error) if good else None
