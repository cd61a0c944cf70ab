"""``trunnion check --hold``: whether friction holds a scene at rest, by what margin, and which joint slips first."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from trunnion.cli.output.printed_output import number, table
from trunnion.elements.joints import REGISTRY

if TYPE_CHECKING:
    from trunnion.analysis.static_bounds.start_pose_statics import HoldReport, PairHold


def hold_document(report: HoldReport) -> dict[str, Any]:
    """The report as plain data. Share and margin are None for a law without friction at rest."""
    pairs = [asdict(p) | {"share": finite_or_none(p.share), "margin": finite_or_none(p.margin)} for p in report.pairs]
    return asdict(report) | {"pairs": pairs, "moves": list(report.moves), "notes": list(report.notes)}


def finite_or_none(x: float) -> float | None:
    """The number; None for NaN and infinities, which JSON does not have."""
    return x if math.isfinite(x) else None


def hold_lines(name: str, report: HoldReport) -> list[str]:
    """The report as text."""
    rows = [
        (pair_name(p), p.type, "sticks" if p.sticks else "slips", percent(p.share), f"{number(p.capacity)} N", percent(p.margin),
         "" if p.unique else "not unique")
        for p in report.pairs
    ]  # fmt: skip
    lines = [f"{name}, at rest in its start pose, with all frictional pairs held", ""]
    if rows:
        lines += [*table(("joint", "type", "state", "share needed", "can hold", "margin", ""), rows), ""]
    return [*lines, *(f"note: {n}" for n in report.notes), verdict(report)]


def pair_name(p: PairHold) -> str:
    """The joint of a friction pair, with the number of the journal if the joint has two."""
    return p.joint if REGISTRY[p.type].second_axis < 0 else f"{p.joint}, journal {p.part}"


def percent(x: float) -> str:
    """A share in percent. A share that is not finite is shown as a dash."""
    return f"{100 * x:.4g} %" if math.isfinite(x) else "–"


def verdict(report: HoldReport) -> str:
    """Whether friction holds the scene, and the joint that slips first or is nearest to slipping."""
    if report.holds:
        if not report.pairs:
            return "the mechanism holds, even without friction"
        tight = max(report.pairs, key=lambda p: -p.margin if math.isfinite(p.margin) else -math.inf)
        return f"the mechanism holds: {tight.joint} is nearest to slipping, with a margin of {percent(report.margin)}"
    if report.first in report.moves:
        return f"the mechanism does not hold: nothing holds {report.first}, which starts to move"
    share = max(p.share for p in report.pairs if p.joint == report.first)
    return f"the mechanism does not hold: {report.first} slips first; this joint needs {percent(share)} of the available friction"
