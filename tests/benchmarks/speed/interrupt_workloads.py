"""The work that ``interrupt_latency.py`` ends at random instants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import casadi  # noqa: F401  # imported here, so that no fork has to import it
import numpy as np
import pyarrow.csv
import pyarrow.parquet  # noqa: F401

import trunnion
from tests.analysis.static_bounds.hand_calculation_scenes import four_bar
from tests.engine.mechanisms.friction_chains import balls
from tests.engine.mechanisms.scissor_lift import scissor
from tests.engine.mechanisms.stewart_platform import stewart
from trunnion.cli import main as run_command
from trunnion.cli.requests.run_request import RunRequest, write_files
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.results.csv_and_parquet import load_result_table
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Settings

WISHBONE = Path(__file__).resolve().parents[3] / "models" / "stability" / "26_wishbone.yaml"
LONG = 3.0
"""Seconds of longer work that the measurement uses."""
Work = Callable[[Path], int]
"""A function that works in a separate folder and returns the exit code."""


@dataclass(frozen=True)
class Place:
    """Work to interrupt. first: work that is done before. told: function of a folder that describes the kept results. fresh:
    whether the work has its own kernel cache. most: seconds of the work in which it is interrupted (0: all). budget: the work with
    a time budget, given in seconds."""

    work: Work
    first: Callable[[], object] = lambda: None
    told: Callable[[Path], str] = lambda folder: ""
    fresh: bool = False
    most: float = 0.0
    budget: Callable[[Path, float], int] | None = None


def build(folder: Path) -> int:
    """Build a kernel of thirteen bodies in loops."""
    return int(not trunnion.simulate(stewart(6), until=1e-3).outcome.ok)


def batch(folder: Path) -> int:
    """Build a kernel in a thread of a batch."""
    return int(trunnion.sweep(stewart(3), {"joints.u0.friction.mu": [0.1, 0.2]}, until=1e-3).cancelled)


def half_made(folder: Path) -> str:
    """Words for whether a build left an incomplete file in the cache."""
    return "left half made" if any(p.name.startswith(".") for p in (folder / "cache").iterdir()) else "nothing half made"


def open_scissor() -> Model:
    """A scissor lift with a bar that is far too long. No position closes its loops, and the search tries many positions."""
    given = scissor(3)
    free = {n: replace(j, start=sm.Start()) if n[-1] in "12" else j for n, j in given.joints.items()}
    model = Model(apply(replace(given, joints=free), {"bodies.b2.points.low": [-100.0, 0.0, 0.0]}), "guide.q[*]")
    model.block.configure(Settings())
    return model


def assembly(folder: Path) -> int:
    """Assemble the scissor lift fifty times."""
    model = open_scissor()
    return sum(model.block.assemble() for _ in range(50))


def decisions(count: int, seeds: int, folder: Path) -> int:
    """Start chains of ``count`` balls at rest."""
    for seed in range(seeds):
        model = Model(balls(count, seed), ("*.q[*]",), "parts")
        model.block.configure(Settings())
        model.block.assemble()
        model.begin(Settings(), 0.0, 1.0, 0.1, np.zeros(model.block.width))
    return 0


def stepping(scene: Callable[[], Any], until: float, outputs: str, kernel: str | None, folder: Path) -> int:
    """Run a scene and write its table."""
    result = trunnion.simulate(scene(), until=until, outputs=outputs, kernel=kernel)
    result.save(folder / "rows.csv")
    return int(not result.outcome.ok)


def command(folder: Path) -> int:
    """Run the command ``trunnion simulate``, which writes a table."""
    return run_command(["simulate", "double_pendulum", "--until", "100", "--every", "0.05", "-o", str(folder / "rows.csv")])


def rows(folder: Path) -> str:
    """The outcome that a table records."""
    found = [load_result_table(f) for f in folder.glob("rows.*") if f.suffix in (".csv", ".parquet")]
    return ", ".join(f"table {t.outcome.name}, {'to its end' if len(t.time) else 'empty'}" for t in found) or "no table"


@lru_cache(maxsize=1)
def result() -> Result:
    """Fifty thousand rows of 65 columns."""
    return trunnion.simulate("spherical_pendulum", until=500.0, every=0.01)


def written(kind: str, suffix: str, folder: Path) -> int:
    """Write the rows of ``result`` to a file."""
    found = result()
    return int(bool(write_files(found, RunRequest(found.scene, {}, ("*",), {kind: folder / f"rows.{suffix}"}))[1]))


def bounds(scene: Any, folder: Path, budget: float | None = None) -> int:
    """Compute all loads that a mechanism can carry at rest."""
    return int(trunnion.hold(scene, bounds=True, budget=budget).ended != "done")


def holding(scene: Any, most: float) -> Place:
    """The computation of bounds of a scene, interrupted by Ctrl-C and by a budget."""
    return Place(partial(bounds, scene), lambda: bounds(scene, Path(), 1e-3), most=most, budget=partial(bounds, scene))


def chains(count: int) -> Place:
    """The decision of modes at the starts of chains of balls."""
    return Place(partial(decisions, count, 10), lambda: decisions(count, 1, Path()))


def run_of(scene: Callable[[], Any], until: float, outputs: str, kernel: str | None, most: float) -> Place:
    """The run of a scene."""
    first = partial(trunnion.simulate, scene(), until=1e-9, outputs=outputs, kernel=kernel)
    return Place(partial(stepping, scene, until, outputs, kernel), first, rows, most=most)


PLACES = {
    "build": Place(build, told=half_made, fresh=True),
    "build of a batch": Place(batch, told=half_made, fresh=True),
    "assembly": Place(assembly, open_scissor),
    "decisions, 30 balls": chains(30),
    "decisions, 100 balls": chains(100),
    "stepping": Place(command, lambda: trunnion.simulate("double_pendulum", until=1e-3), rows),
    "stepping, 30 balls": run_of(partial(balls, 30, 0), 0.1, "j0.q[*]", "parts", LONG),
    "stepping, Stewart": run_of(partial(stewart, 6), 2.0, "platform.position[*]", None, 0.0),
    "csv": Place(partial(written, "table", "csv"), result, rows),
    "parquet": Place(partial(written, "table", "parquet"), result, rows),
    "png": Place(partial(written, "plot", "png"), result),
    "html": Place(partial(written, "animation", "html"), result),
    "bounds, four-bar": holding(four_bar(), 0.0),
    "bounds, four open directions": holding(four_bar(cross=True), LONG),
    "bounds, wishbone": holding(WISHBONE, LONG),
}
