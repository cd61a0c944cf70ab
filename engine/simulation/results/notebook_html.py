"""HTML of a result for notebooks: outcome, cost, main curves and events, without scripts."""

from __future__ import annotations

import html as escape
import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.simulation.results.summary import count_events, main_columns

if TYPE_CHECKING:
    from trunnion.simulation.results.result_data import ResultData

WIDTH, HEIGHT = 300, 84
MOST_POINTS = 300
MOST_CURVES = 6
MOST_EVENTS = 8
INK, LINE, MARK = "#222", "#0072B2", "#9a9a9a"


def html(result: ResultData) -> str:
    """The HTML fragment of a result."""
    tone = "#00734f" if result.outcome.ok else "#b00020"
    parts = [
        f'<div style="font-family:sans-serif;font-size:13px;color:{INK}">',
        f"<b>{escape.escape(result.scene.title or result.scene.name)}</b> "
        f'<span style="color:{tone}">{escape.escape(str(result.outcome))}</span><br/>',
        f"<small>{_cost(result)}</small>",
        *(f"<br/><small>note: {escape.escape(n)}</small>" for n in result.notes),
        '<div style="display:flex;flex-wrap:wrap;gap:10px;margin:6px 0">',
        *(curve(result, n) for n in main_columns(result)[:MOST_CURVES] if n in result and len(result) > 1),
        "</div>",
        _events(result),
        "</div>",
    ]
    return "".join(parts)


def _cost(result: ResultData) -> str:
    s = result.stats
    build = f", built in {s.build_time:.2g} s" if s.build_time else ""
    size = f"{len(result)} rows × {len(result.names)} columns"
    return f"{size}, {s.steps} steps, {s.rhs_evaluations} evaluations, {s.wall_time:.3g} s{build}"


def curve(result: ResultData, name: str) -> str:
    """An inline SVG of a column over time, with the column's extremes and the events of its joint; "" if no value is finite."""
    keep = np.unique(np.linspace(0, len(result) - 1, MOST_POINTS).astype(int))
    t, v = result.time[keep], result[name][keep]
    good = np.isfinite(v)
    if not good.any() or t[-1] <= t[0]:
        return ""
    low, high = float(v[good].min()), float(v[good].max())
    span = high - low or 1.0
    x = 4 + (WIDTH - 8) * (t - t[0]) / (t[-1] - t[0])
    y = 6 + (HEIGHT - 12) * (high - v) / span
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b, ok in zip(x, y, good, strict=True) if ok)
    marks = "".join(_mark(result, e.time) for e in result.events[:60] if name.startswith(f"{e.joint}."))
    label = f"{escape.escape(name)}, {escape.escape(result.units[name])}"
    return (
        f'<figure style="margin:0"><figcaption style="font-size:11px">{label} <span style="color:#777">'
        f"[{low:.4g}, {high:.4g}]</span></figcaption>"
        f'<svg width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">'
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fafafa" stroke="#ddd"/>{marks}'
        f'<polyline points="{points}" fill="none" stroke="{LINE}" stroke-width="1.3"/></svg></figure>'
    )


def _mark(result: ResultData, time: float) -> str:
    t0, t1 = result.time[0], result.time[-1]
    x = 4 + (WIDTH - 8) * (time - t0) / (t1 - t0)
    return f'<line x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{HEIGHT}" stroke="{MARK}" stroke-width="0.6"/>'


def _events(result: ResultData) -> str:
    if not result.events:
        return "<small>no events</small>"
    counts = ", ".join(f"{n} {kind.replace('_', ' ')}" for kind, n in count_events(result.events).items())
    rows = "".join(
        f"<tr><td>{e.time:.6g}</td><td>{escape.escape(e.kind.replace('_', ' '))}{' (marginal)' * e.marginal}</td>"
        f"<td>{escape.escape(e.joint)}</td>"
        f"<td>{', '.join(f'{math.degrees(a):.4g}' for a in e.turn if math.isfinite(a))}</td></tr>"
        for e in result.events[:MOST_EVENTS]
    )
    more = f"<small>and {len(result.events) - MOST_EVENTS} more</small>" if len(result.events) > MOST_EVENTS else ""
    head = "<tr><th>time, s</th><th>event</th><th>joint</th><th>normal turns, °</th></tr>"
    return f'<small>{counts}</small><table style="font-size:12px">{head}{rows}</table>{more}'
