"""What ``trunnion fit`` tells and draws of a fit, of laws compared and of experiments ranked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from engine.cli.summary import table

if TYPE_CHECKING:
    from engine.fits import Evidence, Fit, Proposal

SHOWN = 12


def lines(name: str, f: Fit, evidence: Evidence | None) -> list[str]:
    """What was found, as text."""
    noise = {c: s for r in f.runs for c, s in r.noise.items()}
    shown = ", ".join(f"{c} {s:.3g}" for c, s in noise.items())
    ended = "" if f.converged else "; the search did NOT come to its end"
    out = [f"{name}: misfit {f.misfit:.6g}, {f.rounds} runs{ended}; noise (standard deviation) {shown}"]
    if evidence is not None:
        out += ["", *evidence_lines(evidence), "", f"{evidence.best.name}:"]
    head = ("parameter", "value", f"{100 * f.level:g} % interval", "local", "unit")
    rows = []
    for n, v in f.values.items():
        i = f.intervals.get(n)
        span = f"{_end(i.low, i.low_end)} … {_end(i.high, i.high_end)}" if i else "–"
        local = f"± {i.local[1] - v:.3g}" if i and math.isfinite(i.local[1]) else "± ∞"
        rows.append((n, f"{v:.6g}", span, local, f.units.get(n, "")))
    out += table(head, rows)
    if any("bound" in (i.low_end, i.high_end) for i in f.intervals.values()):
        out.append("[ ]: the data allow all values up to that bound")
    if any("open" in (i.low_end, i.high_end) for i in f.intervals.values()):
        out.append("?: the data allow all values that were looked at; further out none was")
    return [*out, *(f"note: {n}" for n in (evidence.notes if evidence is not None else f.notes))]


def _end(value: float, kind: str) -> str:
    return f"[{value:.6g}]" if kind == "bound" else f"{value:.6g}{'?' if kind == 'open' else ''}"


def evidence_lines(e: Evidence) -> list[str]:
    """The table of candidates."""
    rows = []
    for c in e.candidates:
        if c.fit is None or c.fit.criteria is None:
            rows.append((c.name, "–", "–", "–", "–", "–", c.why[:60]))
            continue
        k = c.fit.criteria
        numbers = (f"{c.fit.misfit:.4g}", str(k.numbers), f"{k.bic:.1f}", f"{c.worse_by_bic:.1f}", f"{c.worse_by_aicc:.1f}")
        rows.append((c.name, *numbers, f"{c.weight:.3f}"))
    return table(("candidate", "misfit", "numbers", "BIC", "worse by", "AICc worse by", "weight"), rows)


def proposal_lines(ranked: Sequence[Proposal], f: Fit) -> list[str]:
    """The table of experiments that could be made."""
    if not ranked:
        return []
    names = list(next((p.deviation for p in ranked if p.deviation), {}))
    rows = [
        (p.name, f"{p.gain:.2f}" if math.isfinite(p.gain) else "–",
         *(f"{p.deviation[n]:.3g}" if p.deviation else "–" for n in names), p.why[:60])
        for p in ranked[:SHOWN]
    ]  # fmt: skip
    now = ("now", "", *(f"{f.deviation[n]:.3g}" for n in names), "")
    return ["", *table(("experiment", "gain, bits", *(f"± {n}" for n in names), ""), [now, *rows])]


def draw(f: Fit, picture: Path) -> None:
    """Draw the curves, profiles and correlation of a fit."""
    from engine.fits.profile import threshold
    from engine.plots.files import save_figure
    from engine.plots.fitted import Compare, Profile, fitted

    assert f.found is not None
    curves = [
        Compare(f"{r.name}: {c}" if len(f.runs) > 1 else c, f.found.units[c], r.time, v, r.model[c], r.noise[c])
        for r in f.runs for c, v in r.measured.items()
    ]  # fmt: skip
    profiles = [
        Profile(n, f.units[n], f.values[n], f.deviation[n], i.values, i.rises, (i.low, i.high), (i.low_end, i.high_end))
        for n, i in f.intervals.items()
    ]
    rise = threshold(f.level, f.found.objective.nu) ** 2
    save_figure(fitted(curves, profiles, list(f.values), f.correlation, rise, f.level), picture)
