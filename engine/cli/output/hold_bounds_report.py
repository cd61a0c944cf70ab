"""``trunnion check --hold --bounds``: ranges of force and friction in every joint, and limits of every load."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from trunnion.analysis.static_bounds.bounds_results import to_json_data
from trunnion.cli.output.hold_report import hold_document
from trunnion.cli.output.printed_output import number, table

if TYPE_CHECKING:
    from trunnion.analysis.static_bounds.bounds_results import End, HoldBounds, Interval, LoadBounds, PairBounds

VERDICTS = {
    "certain": "the mechanism holds for every force distribution that statics allows",
    "possible": "the mechanism holds for some force distributions that statics allows, and slips for others",
    "no": "the mechanism does not hold for any force distribution",
}
LARGE = 1e-6
"""Gaps above this value, in the unit of their interval, are printed. Smaller gaps would not be visible, because results are printed
with six digits."""


def bounds_document(b: HoldBounds) -> dict[str, Any]:
    """The report as plain data. An unbounded end is "inf" or "-inf". An end that no state attains has the value None."""
    return {
        "holds": b.holds, "ended": b.ended, "first": list(b.first),
        "open_directions": b.open, "self_stress": b.self_stress, "misfit": b.misfit, "gap": b.gap,
        "pairs": [to_json_data(asdict(p) | {"margin": {"least": p.margins[0], "largest": p.margins[1]}}) for p in b.pairs],
        "loads": [to_json_data(asdict(p)) for p in b.loads],
        "answer": hold_document(b.answer), "notes": list(b.notes),
    }  # fmt: skip


def bounds_lines(name: str, b: HoldBounds) -> list[str]:
    """The report as text."""
    directions = "1 direction" if b.open == 1 else f"{b.open} directions"
    stress = "" if b.self_stress is None else f", self-stress up to {b.self_stress:g} N per contact"
    stress += "" if b.misfit is None else f", self-stress up to a misfit of {b.misfit:g} m"
    lines = [f"{name}, at rest in its start pose: statics does not determine the forces in {directions}{stress}", ""]
    if b.pairs:
        heads = ("joint", "normal force at the limit, N", "friction, N", "share of the friction capacity")
        rows = [(pair_name(p, b), span(p.normal_force), span(p.friction), span(p.share, 100.0, " %")) for p in b.pairs]
        lines += [*table(heads, rows), ""]
    if b.loads:
        names = ("load", "now", "certainly held", "possibly held", "unit", "slips first")
        lines += [*table(names, [load_row(p) for p in b.loads]), ""]
    lines += [f"note: {n}" for n in b.notes]
    if b.gap > LARGE:
        lines.append(
            f"note: values and certified bounds differ by up to {b.gap:.3g}; "
            "with more than four undetermined directions, a search may leave such gaps"
        )
    what = "nearest to slipping" if b.holds == "certain" else "slips first"
    return [*lines, VERDICTS[b.holds] + (f"; {what}: {', '.join(b.first)}" if b.first else "")]


def pair_name(p: PairBounds, b: HoldBounds) -> str:
    """The joint of a friction pair, with the number of the journal if the joint has several."""
    return p.joint if sum(q.joint == p.joint for q in b.pairs) == 1 else f"{p.joint}, journal {p.part}"


def span(i: Interval, unit: float = 1.0, after: str = "") -> str:
    """An interval as text. unit: factor that converts its ends."""
    return f"{end(i.least, unit)} … {end(i.largest, unit)}{after}"


def end(e: End, unit: float = 1.0) -> str:
    """An end of an interval as text."""
    if math.isnan(e.certified):
        return "–"
    if math.isinf(e.certified):
        return "unknown" if e.value is None or math.isfinite(e.value) else "no end"
    return number(round(unit * e.certified, 9))


def load_row(p: LoadBounds) -> tuple[str, ...]:
    """The row of a load: the interval that friction certainly holds, and the interval that friction possibly holds."""
    certain, possible = (" … ".join(end(getattr(w, what)) for w in (p.less, p.more)) for what in ("guaranteed", "possible"))
    first = dict.fromkeys(", ".join(w.joints) or "–" for w in (p.more, p.less))
    return p.name, "–" if p.now is None else number(p.now), certain, possible, p.unit, " / ".join(first)
