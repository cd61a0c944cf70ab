"""Cost against size: bodies, friction joints, loops, cases; each a family of scenes, with the exponent of its growth."""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from engine.basics.files import writing
from engine.chart.machine import describe
from engine.chart.runs import exact_law, repeated
from engine.plots.palette import GRID, INK, color
from engine.scene import model as sm
from engine.scene.generate import n_four_bar, revolute_chain
from engine.scene.overrides import apply
from engine.simulation.block import Settings
from engine.simulation.run import Model, run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STEP, STEPS = 1e-3, 200
CHAIN = 16
"""Bodies of the chain whose joints rub one after another."""
Tell = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Size:
    """One member of a family: its size n, seconds for a unit of work (minimum and median), seconds to build."""

    n: int
    minimum: float
    median: float
    build: float


@dataclass(frozen=True)
class Family:
    """A family of scenes: what grows, what is measured, and the sizes measured."""

    name: str
    what: str
    sizes: tuple[Size, ...]

    @property
    def exponent(self) -> float:
        """Growth of the cost over the upper half of the sizes: cost ∝ n^exponent."""
        return fitted([(s.n, s.minimum) for s in self.sizes])

    @property
    def build_exponent(self) -> float:
        """Growth of the build time, likewise; NaN when nothing was built for a size."""
        return fitted([(s.n, s.build) for s in self.sizes if s.build > 0])


def fitted(values: Sequence[tuple[float, float]]) -> float:
    """Slope of log cost over log n for the larger half of the sizes (at least three)."""
    upper = values[-max(3, (len(values) + 1) // 2) :]
    if len(upper) < 2:
        return math.nan
    x, y = np.log([v[0] for v in upper]), np.log([v[1] for v in upper])
    return float(np.polyfit(x, y, 1)[0])


def scaling(repeats: int = 7, largest: int = 64, tell: Tell = lambda *_: None) -> list[Family]:
    """Measure all families. largest: most bodies of a chain (the others stop at a quarter of it)."""
    bodies = _doubling(1, largest)
    rubbing = _doubling(1, CHAIN)
    loops = _doubling(1, max(2, largest // 4))
    cases = _doubling(1, 256)
    total = len(bodies) + len(rubbing) + len(loops) + 1
    done = 0

    def stepped(n: int, scene: sm.Scene) -> Size:
        nonlocal done
        tell(scene.title or scene.name, done, total)
        done += 1
        return _stepped(n, scene, repeats)

    each = "one step of rk5 (6 evaluations, all that goes with them)"
    return [
        Family("bodies", f"chain of revolutes: {each}", tuple(stepped(n, revolute_chain(n)) for n in bodies)),
        Family("friction joints", f"{CHAIN} bodies, n joints rub: {each}", tuple(stepped(n, rubbing_chain(n)) for n in rubbing)),
        Family("loops", f"N-four-bar: {each}", tuple(stepped(n, n_four_bar(n)) for n in loops)),
        Family("cases", "runs of example 8.1 (1 s), one after another, friction changed between them", _cases(cases, repeats)),
    ]


def _doubling(first: int, last: int) -> list[int]:
    return [first * 2**k for k in range(int(math.log2(last / first)) + 1)]


def rubbing_chain(n: int) -> sm.Scene:
    """A chain whose first n joints have friction (journals), in the default law."""
    scene = revolute_chain(CHAIN)
    friction = sm.Friction(mu=0.1, radius=0.01, half_length=0.05)
    joints = {k: replace(j, friction=friction) if i < n else j for i, (k, j) in enumerate(scene.joints.items())}
    title = f"chain of {CHAIN} revolutes, {n} of them with friction"
    return apply(replace(scene, joints=joints, title=title), {"friction.law": exact_law(scene)})


def _stepped(n: int, scene: sm.Scene, repeats: int) -> Size:
    """The member of size n of a family: seconds that a step of fixed length takes, and seconds to build the scene."""
    model = Model(scene, [next(iter(scene.joints)) + ".q[1]"], runs=math.inf)
    settings = Settings(method="rk5", step=STEP)

    def once() -> float:
        result = run(model, STEP * STEPS, STEP * STEPS, settings)
        return result.stats.wall_time / max(1, result.stats.steps)

    low, middle, _ = repeated(once, repeats)
    facts = model.kernel.facts
    return Size(n, low, middle, float(facts["symbolic_seconds"]) + float(facts["compile_seconds"]))


def _cases(counts: Sequence[int], repeats: int) -> tuple[Size, ...]:
    """For every count n: seconds that n runs of one structure with different friction take; nothing is built between them."""
    from engine.scene import load_scene

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

        low, middle, _ = repeated(once, repeats)
        out.append(Size(n, low, middle, 0.0))
    return tuple(out)


def write_scaling(families: Sequence[Family], folder: Path) -> list[Path]:
    """``scaling.svg``, ``scaling.png``, ``scaling.csv`` in the folder."""
    from engine.plots.files import save_figure, small

    drawn = figure(families)
    out = [save_figure(drawn, folder / "scaling.svg"), small(save_figure(drawn, folder / "scaling.png", dpi=90))]
    with writing(folder / "scaling.csv", (".csv",)) as work, work.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {', '.join(f'{k}: {v}' for k, v in describe().items())}, one core\n")
        for f in families:
            built = f", building n^{f.build_exponent:.3f}" if not math.isnan(f.build_exponent) else ""
            file.write(f"# {f.name}: {f.what}; cost n^{f.exponent:.3f}{built}\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["family", "n", "minimum [s]", "median [s]", "build [s]"])
        table.writerows([f.name, s.n, f"{s.minimum:.6g}", f"{s.median:.6g}", f"{s.build:.6g}"] for f in families for s in f.sizes)
    return [*out, folder / "scaling.csv"]


def figure(families: Sequence[Family]) -> Figure:
    """One panel for each family, with the cost and, apart, the time to build."""
    from matplotlib.figure import Figure

    fig = Figure(figsize=(11, 8), facecolor="white")
    fig.suptitle("cost against size", x=0.06, ha="left", size=13, weight="bold", color=INK)
    fig.text(0.06, 0.935, f"{describe()['processor']}, one core, minimum of the repeats", size=8, color="#555555")
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
