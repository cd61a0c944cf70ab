"""``trunnion check --hold``: whether a scene holds where it starts, with what margin, and what lets go first."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from engine.cli.summary import table
from engine.joints import REGISTRY

if TYPE_CHECKING:
    from engine.simulation.hold import HoldReport, PairHold


def hold_document(report: HoldReport) -> dict[str, Any]:
    """The report as plain data; a law that holds nothing has no share and no margin."""
    pairs = [asdict(p) | {"share": _number(p.share), "margin": _number(p.margin)} for p in report.pairs]
    return asdict(report) | {"pairs": pairs, "moves": list(report.moves), "notes": list(report.notes)}


def _number(x: float) -> float | None:
    return x if math.isfinite(x) else None


def hold_lines(name: str, report: HoldReport) -> list[str]:
    """The report as lines of text."""
    rows = [
        (_pair(p), p.type, "sticks" if p.sticks else "slips", _share(p.share), f"{p.capacity:.6g}", _share(p.margin),
         "" if p.unique else "not unique")
        for p in report.pairs
    ]  # fmt: skip
    lines = [f"{name}, at rest at its start pose, every frictional pair held", ""]
    if rows:
        lines += [*table(("joint", "type", "state", "share needed", "can hold, N", "margin", ""), rows), ""]
    lines += [f"note: {n}" for n in report.notes]
    return [*lines, _verdict(report)]


def _pair(p: PairHold) -> str:
    return p.joint if REGISTRY[p.type].second_axis < 0 else f"{p.joint}, journal {p.part}"


def _share(x: float) -> str:
    return f"{100 * x:.4g} %" if math.isfinite(x) else "–"


def _verdict(report: HoldReport) -> str:
    if report.holds:
        if not report.pairs:
            return "it holds, without any friction"
        tight = max(report.pairs, key=lambda p: -p.margin if math.isfinite(p.margin) else -math.inf)
        return f"it holds: {tight.joint} is nearest to slipping, with a margin of {_share(report.margin)}"
    if report.first in report.moves:
        return f"it does not hold: {report.first} has nothing that holds it and moves off"
    share = max(p.share for p in report.pairs if p.joint == report.first)
    return f"it does not hold: {report.first} lets go first; it would need {_share(share)} of the friction there is"
