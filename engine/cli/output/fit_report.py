"""Text and picture of a fit, of compared laws and of ranked experiments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.cli.output.printed_output import table

if TYPE_CHECKING:
    from trunnion.analysis.fits.experiment_design import RankedExperiment
    from trunnion.analysis.fits.model_comparison import ModelComparison
    from trunnion.analysis.fits.parameter_estimation import Fit

SHOWN = 12


def lines(name: str, f: Fit, evidence: ModelComparison | None) -> list[str]:
    """Parameters, intervals and noise, as text."""
    noise = {c: s for r in f.runs for c, s in r.noise.items()}
    shown = ", ".join(f"{c} {s:.3g}" for c, s in noise.items())
    ended = "" if f.converged else "; the search did NOT converge"
    out = [f"{name}: misfit {f.misfit:.6g}, {f.rounds} runs{ended}; noise (standard deviation) {shown}"]
    if evidence is not None:
        out += ["", *evidence_lines(evidence), "", f"{evidence.best.name}:"]
    head = ("parameter", "value", f"{100 * f.level:g} % interval", "local", "unit")
    rows = []
    for n, v in f.values.items():
        i = f.intervals.get(n)
        span = f"{interval_end(i.low, i.low_end)} … {interval_end(i.high, i.high_end)}" if i else "–"
        local = f"± {i.local[1] - v:.3g}" if i and math.isfinite(i.local[1]) else "± ∞"
        rows.append((n, f"{v:.6g}", span, local, f.units.get(n, "")))
    out += table(head, rows)
    if any("bound" in (i.low_end, i.high_end) for i in f.intervals.values()):
        out.append("[ ]: the data do not exclude any value up to this bound")
    if any("open" in (i.low_end, i.high_end) for i in f.intervals.values()):
        out.append("?: the data do not exclude any value up to the last value tried")
    return [*out, *(f"note: {n}" for n in (evidence.notes if evidence is not None else f.notes))]


def interval_end(value: float, kind: str) -> str:
    """An end of an interval as text. [ ] marks a bound; ? marks an open end."""
    return f"[{value:.6g}]" if kind == "bound" else f"{value:.6g}{'?' if kind == 'open' else ''}"


def evidence_lines(e: ModelComparison) -> list[str]:
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


def proposal_lines(ranked: Sequence[RankedExperiment], f: Fit) -> list[str]:
    """The table of possible experiments."""
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
    from trunnion.analysis.fits.profile_likelihood import threshold
    from trunnion.plots.analysis.fit_curves_and_profiles import Compare, Profile, draw_fit
    from trunnion.plots.style.figure_files import save_figure

    assert f.solution is not None
    curves = [
        Compare(f"{r.name}: {c}" if len(f.runs) > 1 else c, f.solution.units[c], r.time, v, r.model[c], r.noise[c])
        for r in f.runs for c, v in r.measured.items()
    ]  # fmt: skip
    profiles = [
        Profile(n, f.units[n], f.values[n], f.deviation[n], i.values, i.rises, (i.low, i.high), (i.low_end, i.high_end))
        for n, i in f.intervals.items()
    ]
    rise = threshold(f.level, f.solution.objective.nu) ** 2
    save_figure(draw_fit(curves, profiles, list(f.values), f.correlation, rise, f.level), picture)
