"""Cost of friction in every joint of a chain, along the recursion (parts) and from compiled maps. The script compares one
evaluation with the ideal chain, with all joints sliding and with every second joint at rest. It also measures a second of motion,
and error against time (``-o DIR`` draws the chart).

Times are processor times, minimum of some repetitions. Compiled kernels are measured up to 32 bodies; at 32, a build takes more
than a minute and 1.3 GB."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.benchmarks.speed.chain_evaluation import measured
from tests.benchmarks.speed.parts_kernel import chain
from tests.benchmarks.speed.processor_time import pin
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

SIZES = (8, 16, 32, 64, 128, 256)
COMPILED = 32
ANGLES = ("*.q[*]",)
NEAR, STATES = 2e-4, 8
"""Time between evaluated states, s, and their number. The states follow the motion, as stages of a step do."""


def ideal(scene: sm.Scene) -> sm.Scene:
    """The chain without friction."""
    return replace(scene, joints={n: replace(j, friction=None) for n, j in scene.joints.items()})


def evaluation(scene: sm.Scene, resting: bool = False) -> float:
    """Processor time of one evaluation on parts, s; resting: every second joint sticks."""
    model = Model(scene, ANGLES, "parts")
    block, nv = model.block, model.system.nv
    block.configure(Settings())
    block.assemble()
    row, rng = np.zeros(block.width), np.random.default_rng(1)
    v = np.where(np.arange(nv) % 2 == 0, 3.0, 0.0 if resting else -3.0) * (1.0 + 0.1 * rng.normal(size=nv))
    block.y[nv : 2 * nv] = v
    block.start(0.0, 1.0, 1.0, row)
    q, dy, z = block.y[:nv].copy(), np.zeros(len(block.y) + 8), np.zeros(nv + 8)
    states = [q + k * NEAR * v for k in range(STATES)]

    def once(lib: object = block.lib, at: int = block.at, to: tuple[int, int] = (dy.ctypes.data, z.ctypes.data)) -> float:
        began, count = time.process_time(), max(50, 20000 // nv)
        for k in range(count):
            block.y[:nv] = states[k % STATES]
            lib.tr_evaluate(at, *to)  # type: ignore[attr-defined]
        return (time.process_time() - began) / count

    return min(once() for _ in range(9))


def motion(model: Model, rtol: float, until: float = 1.0) -> tuple[float, Result]:
    """Processor time of a second (until) of motion, s, and the run."""
    best, found = np.inf, None
    for _ in range(3):
        began = time.process_time()
        found = run(model, until, until, Settings(rtol=rtol))
        best = min(best, time.process_time() - began)
    assert found is not None
    return best, found


def end(r: Result) -> np.ndarray:
    """Angles at the end, rad."""
    return np.array([r[c.name][-1] for c in r.columns])


def evaluations() -> None:
    """Print the cost of one evaluation over the size of the chain."""
    print("one evaluation, ns a body: ideal compiled (all reactions), ideal on parts, sliding, every second joint at rest")
    for n in SIZES:
        base = measured(n, True)[0]
        without, sliding, resting = evaluation(ideal(chain(n))), evaluation(chain(n)), evaluation(chain(n), True)
        each = "".join(f"{x / n * 1e9:8.0f}" for x in (without, sliding, resting))
        print(f"{n:5d}{base:8.0f}{each}   {sliding / without:.2f} of ideal on parts", flush=True)


def seconds(folder: Path | None) -> None:
    """Print the cost of a second of motion; draw error against time."""
    curves: dict[str, list[tuple[float, float]]] = {}
    print("a second of motion, coulomb: µs an evaluation, events")
    for n in (8, 16, 32, 64):
        exact: np.ndarray | None = None
        for kind in ("parts", "compiled") if n <= COMPILED else ("parts",):
            model = Model(chain(n), ANGLES, kind)
            if exact is None:
                exact = end(run(model, 0.1, 0.1, Settings(rtol=1e-12)))
            took, r = motion(model, 1e-6)
            print(f"{n:5d} {kind:9s}{took / r.stats.rhs_evaluations * 1e6:8.1f}{len(r.events):7d}", flush=True)
            for rtol in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9):
                spent, brief = motion(model, rtol, 0.1)
                curves.setdefault(f"{n} bodies, {kind}", []).append((spent, float(np.abs(end(brief) - exact).max())))
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
        _write(curves, folder)
        _draw(curves, folder)


def _write(curves: dict[str, list[tuple[float, float]]], folder: Path) -> None:
    lines = [f"{name.replace(',', ' on')},{t:.4g},{error:.3g}" for name, points in curves.items() for t, error in points]
    (folder / "chart.csv").write_text("\n".join(["chain,processor time of 0.1 s s,largest error of an angle rad", *lines]) + "\n")


def _draw(curves: dict[str, list[tuple[float, float]]], folder: Path) -> None:
    import matplotlib.pyplot as plt

    from trunnion.plots.style.palette import color

    figure, axes = plt.subplots(figsize=(7.6, 4.4), layout="constrained")
    sizes = sorted({int(name.split()[0]) for name in curves})
    for name, points in curves.items():
        line, which = "-" if name.endswith("parts") else "--", color(sizes.index(int(name.split()[0])))
        axes.loglog(*zip(*points, strict=True), line, marker="o", markersize=4, color=which, label=name)
    axes.set(xlabel="processor time of 0.1 s of motion, s", ylabel="largest error of an angle, rad",
             title="A chain that rubs in every joint, on parts and compiled")  # fmt: skip
    axes.grid(True, which="major", alpha=0.3)
    figure.legend(fontsize=8, loc="outside right center")
    for kind in ("svg", "png"):
        figure.savefig(folder / f"chart.{kind}", dpi=100)


def main() -> None:
    """Print both tables, and draw the chart."""
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", dest="folder", type=Path)
    pin()
    evaluations()
    seconds(parser.parse_args().folder)


if __name__ == "__main__":
    main()
