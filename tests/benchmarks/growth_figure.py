"""The figure of service/GROWTH.md: what share of the workers' time is stepping, over how many workers there are."""

from __future__ import annotations

from pathlib import Path

import matplotlib

from tests.benchmarks.growth import Fleet, simulated

WORKERS = (2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000)


def draw(path: Path, base: dict[str, float]) -> None:
    """Draw it with these constants of ``Fleet``."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
    for exponent, mark in ((6, "o"), (8, "s"), (9, "^")):
        for learns, line, colour in ((False, "--", "#b3541e"), (True, "-", "#1f5a8a")):
            few = WORKERS if learns or exponent < 9 else ()  # a million and a half of pieces
            share = [simulated(10**exponent, Fleet(workers=w, **base), learns).share for w in few]
            by = "by their cost" if learns else "by time alone"
            if few:
                axes.plot(few, share, line, marker=mark, ms=4, color=colour, label=f"$10^{exponent}$ cases, pieces sized {by}")
    axes.set(xscale="log", ylim=(0, 1.02), xlabel="workers", ylabel="share of the workers' time that is stepping")
    cost = 1e3 * (base["cut"] + base["land"])
    axes.set_title(f"Model: {1e3 * base['case']:.2g} ms a case, {cost:.2g} ms of one dispatcher a piece", fontsize=10)
    axes.grid(alpha=0.3)
    figure.legend(fontsize=8, loc="outside right upper", frameon=False)
    figure.savefig(path, dpi=110)
