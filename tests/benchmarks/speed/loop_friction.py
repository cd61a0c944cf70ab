"""Cost of friction in loops, as processor time. The script compares one evaluation with friction with one evaluation without
friction, for Stewart platforms, scissor lifts and N four-bars. Steps are fixed, and timed inside the loop of steps. ``--run`` adds
a run of 0.3 s, with its events, of a Stewart platform on six legs."""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Iterator
from dataclasses import replace

from tests.benchmarks.speed.four_bar_loops import rubbing
from tests.benchmarks.speed.processor_time import inside_advance, pin
from tests.engine.mechanisms.scissor_lift import scissor
from tests.engine.mechanisms.stewart_platform import stewart
from tests.scalable_mechanisms import n_four_bar
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

STEP, STEPS, TIMES = 1e-4, 40, 9
"""Step of the fifth-order method, s; number of steps; repetitions, alternating with and without friction."""


def scenes() -> Iterator[tuple[str, sm.Scene]]:
    """Name and mechanism with friction, for each scene."""
    yield from ((f"Stewart, {n} legs", stewart(n)) for n in (3, 4, 5, 6))
    yield from ((f"scissor, {n} stages", scissor(n)) for n in range(3, 11))
    yield from ((f"four-bars, {n}", rubbing(n_four_bar(n))) for n in (2, 4, 8, 16, 32, 64, 128))


def timed(model: Model, until: float, settings: Settings, clock: Callable[[], float]) -> tuple[float, int]:
    """Seconds of a run in its loop of steps, and number of evaluations."""
    clock()
    r = run(model, until, until, settings)
    return clock(), r.stats.rhs_evaluations


def evaluation(models: list[Model], clock: Callable[[], float]) -> list[tuple[float, float]]:
    """Minimum and median of an evaluation of each model, s."""
    taken: list[list[list[float]]] = [[[], []] for _ in models]
    counts = [[0, 0] for _ in models]
    for _ in range(TIMES):
        for i, model in enumerate(models):
            for k, steps in enumerate((1, STEPS + 1)):
                took, counts[i][k] = timed(model, steps * STEP, Settings(method="rk5", step=STEP), clock)
                taken[i][k].append(took)
    found = []
    for (short, long), (few, many) in zip(taken, counts, strict=True):
        least, middle = min(long) - min(short), statistics.median(long) - statistics.median(short)
        found.append((least / (many - few), middle / (many - few)))
    return found


def main() -> None:
    """Print a line for each mechanism, or the time of the run."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--run", action="store_true")
    pin()
    clock = inside_advance()
    if parser.parse_args().run:
        model = Model(stewart(6), ("platform.position[*]",), "parts")
        took = [timed(model, 0.3, Settings(), clock) for _ in range(TIMES)]
        times = [t for t, _ in took]
        print(f"{min(times) * 1e3:.0f} ms (median {statistics.median(times) * 1e3:.0f}), {took[0][1]} evaluations")
        return
    for name, scene in scenes():
        ideal = replace(scene, joints={n: replace(j, friction=None) for n, j in scene.joints.items()})
        models = [Model(s, (f"{next(iter(s.bodies))}.position*",), "parts") for s in (scene, ideal)]
        (rubs, rubs_median), (free, free_median) = evaluation(models, clock)
        print(f"{name:20s} {rubs * 1e6:7.1f} ({rubs_median * 1e6:.1f}) µs, without {free * 1e6:6.1f} ({free_median * 1e6:.1f}), "
              f"ratio {rubs / free:.2f} ({rubs_median / free_median:.2f})", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
