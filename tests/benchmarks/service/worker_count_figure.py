"""The figure in service/CAPACITY.md. It shows the share of stepping in the workers' time as a function of the number of workers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib

from tests.benchmarks.service.worker_count_model import Fleet, simulated

WORKERS = (2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000)


def draw(path: Path, fleets: Sequence[Fleet]) -> None:
    """Draw the figure for two fleets with variable numbers of workers: one chunk in a commit, and many chunks in a commit."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
    for exponent, mark in ((6, "o"), (8, "s"), (9, "^")):
        for fleet, line, colour in zip(fleets, ("--", "-"), ("#b3541e", "#1f5a8a"), strict=True):
            share = [simulated(10**exponent, replace(fleet, workers=w)).share for w in WORKERS]
            of = f"up to {fleet.together} pieces" if fleet.together > 1 else "one piece"
            axes.plot(WORKERS, share, line, marker=mark, ms=4, color=colour, label=f"$10^{exponent}$ cases, {of} a commit")
    axes.set(xscale="log", ylim=(0, 1.02), xlabel="workers", ylabel="share of the workers' time that is stepping")
    one, each = fleets[1].cut + fleets[1].land, 2 * fleets[1].each
    told = f"{1e3 * one:.2g} ms for two commits, {1e3 * each:.2g} ms a piece besides"
    axes.set_title(f"{1e3 * fleets[0].case:.2g} ms a case; dispatcher: {told}", fontsize=9)
    axes.grid(alpha=0.3)
    figure.legend(fontsize=8, loc="outside right center", frameon=False)
    figure.savefig(path, dpi=110)
