"""``trunnion check --hold --bounds``: what every joint may carry and hold, and up to which load."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from engine.bounds.report import plain
from engine.cli.holding import hold_document
from engine.cli.summary import table

if TYPE_CHECKING:
    from engine.bounds.report import Breakaway, End, HoldBounds, Interval, LoadBounds, PairBounds

VERDICTS = {
    "certain": "it holds, whatever is left open",
    "possible": "it may hold, and it may not: that depends on what is left open",
    "no": "it does not hold: no state does",
}


def bounds_document(b: HoldBounds) -> dict[str, Any]:
    """The report as plain data; an end that is not there is "inf" or "-inf", one that nothing attains has the value null."""
    return {
        "holds": b.holds, "ended": b.ended, "first": list(b.first),
        "open_directions": b.open, "self_stress": b.self_stress, "misfit": b.misfit, "gap": b.gap,
        "pairs": [plain(asdict(p) | {"margin": {"least": p.margins[0], "largest": p.margins[1]}}) for p in b.pairs],
        "loads": [plain(asdict(p)) for p in b.loads],
        "answer": hold_document(b.answer), "notes": list(b.notes),
    }  # fmt: skip


def bounds_lines(name: str, b: HoldBounds) -> list[str]:
    """The report as lines of text."""
    open_ = "1 direction" if b.open == 1 else f"{b.open} directions"
    stress = "" if b.self_stress is None else f", self-stress up to {b.self_stress:g} N a contact"
    stress += "" if b.misfit is None else f", self-stress up to a misfit of {b.misfit:g} m"
    lines = [f"{name}, at rest at its start pose: equilibrium leaves {open_} open{stress}", ""]
    if b.pairs:
        heads = ("joint", "normal force at the limit, N", "friction, N", "share of what it can hold")
        rows = [(_name(p, b), _span(p.normal_force), _span(p.friction), _span(p.share, 100.0, " %")) for p in b.pairs]
        lines += [*table(heads, rows), ""]
    if b.loads:
        names = ("load", "now", "sure to be held", "may be held", "lets go first")
        lines += [*table(names, [_load(p) for p in b.loads]), ""]
    lines += [f"note: {n}" for n in b.notes]
    if b.gap > LARGE:
        lines.append(f"note: the ends are certified up to a gap of {b.gap:.3g}; more than four open directions may keep one")
    what = "nearest to letting go" if b.holds == "certain" else "lets go first"
    return [*lines, VERDICTS[b.holds] + (f"; {what}: {', '.join(b.first)}" if b.first else "")]


LARGE = 1e-6
"""A gap above this, in the unit of its end, is worth a line: printed are six digits."""


def _name(p: PairBounds, b: HoldBounds) -> str:
    return p.joint if sum(q.joint == p.joint for q in b.pairs) == 1 else f"{p.joint}, journal {p.part}"


def _span(i: Interval, unit: float = 1.0, after: str = "") -> str:
    return f"{_number(i.least, unit)} … {_number(i.largest, unit)}{after}"


def _number(e: End, unit: float = 1.0) -> str:
    if math.isnan(e.certified):
        return "–"
    if math.isinf(e.certified):
        return "not known" if e.value is None or math.isfinite(e.value) else "no end"
    return f"{round(unit * e.certified, 9) + 0.0:.6g}"


def _load(p: LoadBounds) -> tuple[str, str, str, str, str]:
    now = "–" if p.now is None else f"{p.now:.6g} {p.unit}"
    ways = [", ".join(w.joints) or "–" for w in (p.more, p.less)]
    return p.name, now, _reach(p, "guaranteed"), _reach(p, "possible"), " / ".join(dict.fromkeys(ways))


def _reach(p: LoadBounds, what: str) -> str:
    """The interval of a load from what holds as it falls to what holds as it grows."""
    ends: list[Breakaway] = [p.less, p.more]
    return " … ".join(_number(getattr(w, what)) for w in ends)
