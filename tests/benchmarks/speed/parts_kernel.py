"""Cost of a new structure on parts, and cost of its steps compared with the compiled kernel. The script measures the wall time of
``trunnion.simulate`` to the first rows with compiled parts, and the processor time of stepping."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable

from tests.benchmarks.speed.processor_time import pin
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.library.model_folders import model_names
from trunnion.simulation.run import Model, run, simulate
from trunnion.simulation.runtime_interface.simulation_block import Settings

BRIEF = {"until": 1e-9, "every": 1e-9, "kernel": "parts"}
"""A run of a step or two."""


def chain(count: int) -> sm.Scene:
    """A chain of bars of 0.3 m on journals with μ = 0.3, slightly displaced."""
    bodies, joints = {}, {}
    for k in range(count):
        ends = {"a": (-0.15, 0.0, 0.0), "b": (0.15, 0.0, 0.0)}
        bodies[f"b{k}"] = sm.Body(box=(0.3, 0.06, 0.04), density=2700.0, points=ends)
        rub = sm.Friction(mu=0.3, radius=0.02, half_length=0.05)
        start = sm.Start(0.3 * (-1.0) ** k, 1.0)
        inboard = "ground" if k == 0 else f"b{k - 1}.b"
        joints[f"j{k}"] = sm.Joint("revolute", inboard, f"b{k}.a", axis="y", friction=rub, start=start)
    return sm.Scene(bodies, joints, f"chain{count}", gravity=(0.0, 0.0, -9.81))


def quickest(what: Callable[[], object], times: int, clock: Callable[[], float]) -> float:
    """Least wall time of some calls, s."""
    taken = []
    for _ in range(times):
        began = clock()
        what()
        taken.append(clock() - began)
    return min(taken)


def stepping(scene: sm.Scene, kernel: str) -> float:
    """Processor time, s, of a run without intermediate rows. The model is built before the measurement."""
    model = Model(scene, ("*.q[*]",), kernel)
    until = float(scene.simulation.until)
    return quickest(lambda: run(model, until, until, Settings()), 5, time.process_time)


def main() -> None:
    """Print a line for each of the bundled models, and for chains."""
    pin()
    print("to the first rows, all columns; stepping on parts over the compiled kernel's")
    for name in model_names():
        scene = load_scene(name)
        simulate(scene, **BRIEF)
        first = quickest(lambda scene=scene: simulate(scene, **BRIEF), 5, time.perf_counter)
        print(f"{name:24s} {first:6.3f} s   {stepping(scene, 'parts') / stepping(scene, 'compiled'):.2f}")
    for count in (8, 16, 32, 64, 128, 256):
        scene = chain(count)
        first = quickest(lambda scene=scene: simulate(scene, outputs="*.q[*]", **BRIEF), 3 if count < 200 else 1, time.perf_counter)
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        print(f"chain of {count:3d}             {first:6.3f} s   {most} MB at most so far", flush=True)


if __name__ == "__main__":
    main()
