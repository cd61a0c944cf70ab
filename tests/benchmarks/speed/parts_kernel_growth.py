"""Growth of costs with the size N = 8 … 256, parts kernel, processor time of one core: chains and trees, ideal, sliding and
sticking; loops in a plane and in space, ideal and with friction. Steps are timed inside the runtime's loop of steps. ``-o DIR``
writes the figures and their chart."""

from __future__ import annotations

import argparse
import csv
import ctypes
import math
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from mmap import PAGESIZE
from pathlib import Path

from tests.benchmarks.speed.cost_growth import Family, Size
from tests.benchmarks.speed.processor_time import inside_advance, pin
from tests.scalable_mechanisms import n_four_bar, revolute_chain
from trunnion import load_scene
from trunnion.analysis.work_precision.machine_description import describe_machine
from trunnion.plots.style.figure_files import reduce_colours, save_figure
from trunnion.plots.style.palette import GRID, color
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Block, Settings

SIZES = (8, 16, 32, 64, 128, 256)
STEP, STEPS, TIMES = 1e-4, 40, 5
"""Fixed step of rk5, s; number of steps; repetitions, in turns over all quantities of a scene."""
OWN, OWN_FRICTION = 0.2, 0.1
"""Length of the run with error control, s, without and with friction."""


def with_friction(scene: sm.Scene, mu: float) -> sm.Scene:
    """The scene with the same Coulomb friction in every revolute and prismatic joint, and in every ball."""
    kinds = {"revolute": sm.Friction(mu=mu, radius=0.01, half_length=0.05), "spherical": sm.Friction(mu=mu, radius=0.01),
             "universal": sm.Friction(mu=mu, radius=0.01, half_length=0.02),
             "prismatic": sm.Friction(mu=mu, half_length=0.3, half_width=0.02, half_height=0.02)}  # fmt: skip
    return replace(scene, joints={n: replace(j, friction=kinds[j.type]) for n, j in scene.joints.items()})


def tree(scene: sm.Scene) -> sm.Scene:
    """The bodies of a chain as a binary tree. The joint of body k is at the end of body (k - 1) / 2."""
    names, bodies = list(scene.joints), list(scene.bodies)
    joints = {names[0]: scene.joints[names[0]]}
    for k, name in enumerate(names[1:], 1):
        side = scene.joints[name].inboard
        joints[name] = replace(scene.joints[name], inboard=side.replace(bodies[k - 1], bodies[(k - 1) // 2]))
    return replace(scene, joints=joints, name=f"tree_{len(names)}")


def hanging(scene: sm.Scene) -> sm.Scene:
    """The scene at rest, without drives, on friction that holds every joint."""
    joints = {n: replace(j, start=sm.Start(0.0, 0.0), effort=0.0) for n, j in with_friction(scene, 0.5).joints.items()}
    bodies = {n: replace(b, mass=0.001) if k else b for k, (n, b) in enumerate(scene.bodies.items())}
    return replace(scene, joints=joints, bodies=bodies, gravity=(-1e-3, 0.0, 0.0))


def side_by_side(count: int) -> sm.Scene:
    """A given number of spatial slider-cranks, each with its own slider guide on the ground."""
    one = load_scene("spatial_slider_crank")
    bodies, joints = {}, {}
    for k in range(count):
        bodies |= {f"{n}{k}": b for n, b in one.bodies.items()}
        for n, j in one.joints.items():
            ends = [e if str(e).startswith("ground") else str(e).replace(str(e).split(".")[0], f"{str(e).split('.')[0]}{k}", 1)
                    for e in (j.inboard, j.outboard)]  # fmt: skip
            joints[f"{n}{k}"] = replace(j, inboard=ends[0], outboard=ends[1])
    return replace(one, bodies=bodies, joints=joints, name=f"slider_cranks_{count}")


def scenes() -> Iterator[tuple[str, Callable[[int], sm.Scene]]]:
    """Name and scene by size."""
    yield "chain, ideal", revolute_chain
    yield "chain, sliding", lambda n: with_friction(revolute_chain(n), 0.01)
    yield "chain, sticking", lambda n: hanging(revolute_chain(n))
    yield "tree, ideal", lambda n: tree(revolute_chain(n))
    yield "tree, sliding", lambda n: with_friction(tree(revolute_chain(n)), 0.01)
    yield "four-bars, ideal", n_four_bar
    yield "four-bars, friction", lambda n: with_friction(n_four_bar(n), 0.1)
    yield "spatial slider-cranks, ideal", side_by_side
    yield "spatial slider-cranks, friction", lambda n: with_friction(side_by_side(n), 0.02)


def seconds(model: Model, until: float, every: float, settings: Settings, taken: Callable[[], float]) -> tuple[float, float, int]:
    """Processor time of a run inside and outside its loop of steps, and its number of evaluations."""
    taken()
    began = time.process_time()
    result = run(model, until, every, settings)
    whole, inside = time.process_time() - began, taken()
    assert result.outcome.ok, result.outcome
    return inside, whole - inside, result.stats.rhs_evaluations


def resident(block: Block) -> float:
    """Size of the memory pages of a block that the runs have used, bytes (Linux)."""
    first = block.at // PAGESIZE
    count = (block.at + block.bytes - 1) // PAGESIZE - first + 1
    used = (ctypes.c_ubyte * count)()
    if ctypes.CDLL(None).mincore(ctypes.c_void_p(first * PAGESIZE), ctypes.c_size_t(count * PAGESIZE), used):
        return math.nan
    return float(sum(u & 1 for u in used) * PAGESIZE)


def costs(scene: sm.Scene, clock: Callable[[], float]) -> dict[str, tuple[float, float]]:
    """Minimum and median of each cost: evaluation and step at fixed steps, evaluation at the program's own steps, projection of a
    step, start, row, s; memory, bytes. With friction, the effect of projection is smaller than the noise of the measurement."""
    few, rows = Model(scene, (f"{next(iter(scene.bodies))}.position*",), "parts"), Model(scene, ("*.q[*]",), "parts")
    rubs = any(j.friction for j in scene.joints.values())
    fixed, own = Settings(method="rk5", step=STEP), OWN_FRICTION if rubs else OWN
    end = (STEPS + 1) * STEP
    runs = {"start": (few, STEP, STEP, fixed), "fixed": (few, end, end, fixed), "own": (few, own, own, Settings(rtol=1e-8)),
            "open": (few, end, end, replace(fixed, project=False)),
            "bare": (rows, STEPS * STEP, STEPS * STEP, fixed), "rows": (rows, STEPS * STEP, STEP / 20, fixed)}  # fmt: skip
    inside: dict[str, list[float]] = {n: [] for n in runs}
    starts: list[float] = []
    counts: dict[str, int] = {}
    for _ in range(TIMES):
        for name, (model, until, every, settings) in runs.items():
            took, outside, counts[name] = seconds(model, until, every, settings, clock)
            inside[name].append(took)
            starts += [outside] if name == "start" else []

    def both(more: str, less: str, count: int) -> tuple[float, float]:
        """Minimum and median of the time of one unit. Two runs differ by `count` units."""
        least, middle = ((of(inside[more]) - of(inside[less])) / count for of in (min, statistics.median))
        return least, middle

    return {
        "evaluation, fixed steps": both("fixed", "start", counts["fixed"] - counts["start"]),
        "evaluation, own steps": both("own", "start", max(1, counts["own"] - counts["start"])),
        "step, fixed": both("fixed", "start", STEPS),
        **({"projection of a step": both("fixed", "open", STEPS + 1)} if few.block.kernel.sizes["active"] and not rubs else {}),
        "start": (min(starts), statistics.median(starts)),
        "row of all coordinates": both("rows", "bare", 20 * STEPS - 1),
        "memory, bytes": (resident(few.block),) * 2,
    }


def write(families: list[Family], folder: Path) -> None:
    """Write ``growth.csv``, and a chart with one panel for each cost and one line for each family."""
    from matplotlib.figure import Figure

    with (folder / "growth.csv").open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {', '.join(f'{k}: {v}' for k, v in describe_machine().items())}, one core, parts kernel\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["family", "cost", "exponent", "n", "minimum", "median"])
        for f in families:
            table.writerows([f.name, f.what, f"{f.exponent:.3f}", z.n, f"{z.minimum:.4g}", f"{z.median:.4g}"] for z in f.sizes)
    costs, names = (list(dict.fromkeys(x)) for x in ([f.what for f in families], [f.name for f in families]))
    figure = Figure(figsize=(11, 3.6 * math.ceil(len(costs) / 2)), layout="constrained")
    panels = figure.subplots(math.ceil(len(costs) / 2), 2).ravel()
    for what, axes in zip(costs, panels, strict=False):
        for f in (f for f in families if f.what == what):
            sizes = [z for z in f.sizes if z.minimum > 0]
            unit = 1.0 if what.startswith("memory") else 1e6
            style = "--" if "ideal" not in f.name else "-"
            axes.loglog([z.n for z in sizes], [z.minimum * unit for z in sizes], style, marker="o", markersize=3,
                        color=color(names.index(f.name)), label=f.name)  # fmt: skip
        axes.set(title=what if what.startswith("memory") else f"{what}, µs", xlabel="n", xticks=SIZES, xticklabels=map(str, SIZES))
        axes.grid(color=GRID)
    for axes in panels[len(costs) :]:
        axes.set_axis_off()
    panels[-1].legend(*panels[0].get_legend_handles_labels(), loc="center")
    save_figure(figure, folder / "growth.svg")
    reduce_colours(save_figure(figure, folder / "growth.png", dpi=90))


def main() -> None:
    """Print a line for each family and size, and write the chart."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", type=Path, default=None)
    parser.add_argument("--largest", type=int, default=SIZES[-1])
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    pin()
    clock = inside_advance()
    families: list[Family] = []
    for name, make in scenes():
        if given.only not in name:
            continue
        found: dict[str, list[Size]] = {}
        for n in (n for n in SIZES if n <= given.largest):
            for what, (low, middle) in costs(make(n), clock).items():
                found.setdefault(what, []).append(Size(n, low, middle, math.nan))
        for what, sizes in found.items():
            families.append(Family(name, what, tuple(sizes)))
            numbers = ", ".join(f"{s.minimum:.3g} ({s.median:.3g})" if what.startswith("memory") else
                                f"{s.minimum * 1e6:.3g} ({s.median * 1e6:.3g}) µs" for s in sizes)  # fmt: skip
            print(f"{name:32s} {what:24s} n^{families[-1].exponent:.2f}: {numbers}", flush=True)
    if given.o:
        given.o.mkdir(parents=True, exist_ok=True)
        write(families, given.o)


if __name__ == "__main__":
    main()
