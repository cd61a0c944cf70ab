"""Growth of the cost with the number of bodies, friction joints, loops and cases. Each of these quantities has a family of scenes
and an exponent. ``-o DIR`` writes the figures and their chart."""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tests.scalable_mechanisms import n_four_bar, revolute_chain
from trunnion.analysis.work_precision.benchmark_model import exact_law, time_repeats
from trunnion.analysis.work_precision.machine_description import describe_machine, pin_to_one_core
from trunnion.basics.atomic_files import writing
from trunnion.plots.style.palette import GRID, INK, color
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STEP, STEPS = 1e-3, 200
CHAIN = 16
"""Number of bodies of the chain in the family "friction joints"."""


@dataclass(frozen=True)
class Size:
    """A member of a family. n: its size; minimum, median: time of one unit of work, s; build: time to build the scene, s."""

    n: int
    minimum: float
    median: float
    build: float


@dataclass(frozen=True)
class Family:
    """A family of scenes. name: the quantity that grows; what: the unit of work that is measured."""

    name: str
    what: str
    sizes: tuple[Size, ...]

    @property
    def exponent(self) -> float:
        """Exponent of cost ∝ n^exponent over the upper half of the sizes."""
        return growth_exponent([(s.n, s.minimum) for s in self.sizes])

    @property
    def build_exponent(self) -> float:
        """Exponent of the build time; NaN if fewer than two sizes were built."""
        return growth_exponent([(s.n, s.build) for s in self.sizes if s.build > 0])


def growth_exponent(values: Sequence[tuple[float, float]]) -> float:
    """Slope of log(cost) over log(n), fitted to the larger half of the (n, cost) pairs, and to at least three pairs."""
    upper = values[-max(3, (len(values) + 1) // 2) :]
    if len(upper) < 2:
        return math.nan
    x, y = np.log([v[0] for v in upper]), np.log([v[1] for v in upper])
    return float(np.polyfit(x, y, 1)[0])


def measure_cost_growth(repeats: int = 7, largest: int = 64) -> list[Family]:
    """Measure all families. largest: number of bodies of the longest chain; the largest number of loops is a quarter of this
    number."""
    bodies = _powers_of_two(1, largest)
    frictional = _powers_of_two(1, CHAIN)
    loops = _powers_of_two(1, max(2, largest // 4))
    cases = _powers_of_two(1, 256)
    each = "one step of rk5 (6 evaluations)"
    return [
        Family("bodies", f"chain of revolutes: {each}", tuple(_measure_step(n, revolute_chain(n), repeats) for n in bodies)),
        Family(
            "friction joints",
            f"{CHAIN} bodies, n with friction: {each}",
            tuple(_measure_step(n, frictional_chain(n), repeats) for n in frictional),
        ),
        Family("loops", f"N-four-bar: {each}", tuple(_measure_step(n, n_four_bar(n), repeats) for n in loops)),
        Family(
            "cases", "runs of example 8.1 (1 s), one after another, friction changed between them", _measure_cases(cases, repeats)
        ),
    ]


def _powers_of_two(first: int, last: int) -> list[int]:
    return [first * 2**k for k in range(int(math.log2(last / first)) + 1)]


def frictional_chain(n: int) -> sm.Scene:
    """A chain of CHAIN bodies whose first n joints are journal bearings with the exact friction law."""
    scene = revolute_chain(CHAIN)
    friction = sm.Friction(mu=0.1, radius=0.01, half_length=0.05)
    joints = {k: replace(j, friction=friction) if i < n else j for i, (k, j) in enumerate(scene.joints.items())}
    title = f"chain of {CHAIN} revolutes, {n} of them with friction"
    return apply(replace(scene, joints=joints, title=title), {"friction.law": exact_law(scene)})


def _measure_step(n: int, scene: sm.Scene, repeats: int) -> Size:
    """Measure the time of one step of fixed size."""
    model = Model(scene, [next(iter(scene.joints)) + ".q[1]"], runs=math.inf)
    settings = Settings(method="rk5", step=STEP)

    def once() -> float:
        result = run(model, STEP * STEPS, STEP * STEPS, settings)
        return result.stats.wall_time / max(1, result.stats.steps)

    low, middle, _ = time_repeats(once, repeats)
    facts = model.kernel.facts
    return Size(n, low, middle, float(facts["symbolic_seconds"]) + float(facts["compile_seconds"]))


def _measure_cases(counts: Sequence[int], repeats: int) -> tuple[Size, ...]:
    """For each count n, the time of n runs of one structure with different friction coefficients. Nothing is compiled or built
    between the runs."""
    from trunnion.scene import load_scene

    scene = load_scene("spherical_pendulum")
    model = Model(apply(scene, {"friction.law": exact_law(scene)}), ["ball.q*"], runs=math.inf)
    place = model.built.parameters.paths.index("joints.ball.friction.mu")
    settings = Settings(rtol=1e-6)
    out = []
    for n in counts:
        values = np.linspace(0.2, 0.8, n)

        def once(values: np.ndarray = values) -> float:
            started = time.perf_counter()
            for mu in values:
                model.block.parameters[place] = mu
                model.block.prepare()
                run(model, 1.0, 0.1, settings)
            return time.perf_counter() - started

        low, middle, _ = time_repeats(once, repeats)
        out.append(Size(n, low, middle, 0.0))
    return tuple(out)


def write_cost_growth(families: Sequence[Family], folder: Path) -> list[Path]:
    """Write ``scaling.svg``, ``scaling.png`` and ``scaling.csv`` into the folder; returns the paths of the files."""
    from trunnion.plots.style.figure_files import reduce_colours, save_figure

    drawn = draw_cost_growth(families)
    out = [save_figure(drawn, folder / "scaling.svg"), reduce_colours(save_figure(drawn, folder / "scaling.png", dpi=90))]
    with writing(folder / "scaling.csv", (".csv",)) as work, work.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {', '.join(f'{k}: {v}' for k, v in describe_machine().items())}, one core\n")
        for f in families:
            built = f", building n^{f.build_exponent:.3f}" if not math.isnan(f.build_exponent) else ""
            file.write(f"# {f.name}: {f.what}; cost n^{f.exponent:.3f}{built}\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["family", "n", "minimum [s]", "median [s]", "build [s]"])
        table.writerows([f.name, s.n, f"{s.minimum:.6g}", f"{s.median:.6g}", f"{s.build:.6g}"] for f in families for s in f.sizes)
    return [*out, folder / "scaling.csv"]


def draw_cost_growth(families: Sequence[Family]) -> Figure:
    """A figure with one panel for each family: the cost, and the build time on a second axis."""
    from matplotlib.figure import Figure

    fig = Figure(figsize=(11, 8), facecolor="white")
    fig.suptitle("cost against size", x=0.06, ha="left", size=13, weight="bold", color=INK)
    fig.text(0.06, 0.935, f"{describe_machine()['processor']}, one core, minimum of the repeats", size=8, color="#555555")
    for k, f in enumerate(families):
        axes = fig.add_axes((0.075 + 0.5 * (k % 2), 0.56 - 0.48 * (k // 2), 0.35, 0.33))
        _panel(axes, f)
    return fig


def _panel(axes: Axes, f: Family) -> None:
    from matplotlib.ticker import FuncFormatter

    n = [s.n for s in f.sizes]
    axes.loglog(n, [1e6 * s.minimum for s in f.sizes], "o-", ms=4, color=color(0), label=f"cost, ∝ n^{f.exponent:.2f}")
    axes.set_ylabel("µs", size=8.5)
    if any(s.build > 0 for s in f.sizes):
        other = axes.twinx()
        other.semilogx(n, [s.build for s in f.sizes], "s--", ms=3.5, lw=1, color=color(1))
        other.set_ylabel("s, to build once", size=8.5, color=color(1))
        other.tick_params(which="both", labelsize=8)
        other.set_ylim(bottom=0)
        axes.plot([], [], "s--", ms=3.5, lw=1, color=color(1), label=f"building, ∝ n^{f.build_exponent:.2f}")
    axes.set_title(f.name, size=10, loc="left", color=INK)
    axes.set_xlabel("n\n" + f.what, size=8)
    axes.grid(True, which="major", color=GRID, lw=0.6)
    axes.tick_params(which="both", labelsize=8)
    axes.set_xticks(n, [str(x) for x in n])
    axes.minorticks_off()
    axes.yaxis.set_major_formatter(FuncFormatter(lambda t, _: f"{t:g}"))
    axes.legend(fontsize=7.5, loc="upper left")


def main() -> None:
    """Print a line for each family and size, and write the chart."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", dest="folder", type=Path)
    parser.add_argument("--repeat", type=int, default=7)
    given = parser.parse_args()
    with pin_to_one_core():
        families = measure_cost_growth(given.repeat)
    for f in families:
        print(f"{f.name}: {f.what}; cost n^{f.exponent:.2f}")
        for s in f.sizes:
            print(f"{s.n:5d}  {1e6 * s.minimum:.3g} ({1e6 * s.median:.3g}) µs, built in {s.build:.2f} s")
    if given.folder:
        given.folder.mkdir(parents=True, exist_ok=True)
        write_cost_growth(families, given.folder)


if __name__ == "__main__":
    main()
