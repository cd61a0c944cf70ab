"""Time to export an FMU of a new mechanism, for this platform and for all platforms. The machine has exported FMUs of other
mechanisms before.

Run it with ``python -m tests.benchmarks.speed.fmu_export`` (``--kernel parts``, ``--fmi 3``, ``--count N``, ``--platform host``).
Each mechanism is a random tree of one to three bodies with friction (``tests.reference``). The structure of each tree is new:
without a given seed, the seed is the present time. Another mechanism is exported first, so that all code that FMUs share is
compiled. The script prints wall time and processor time, including those of the compiler. On a machine that others use, only the
processor time is meaningful. """

from __future__ import annotations

import argparse
import itertools
import os
import tempfile
import time
from pathlib import Path

from tests.reference.scenes.random_friction_scenes import DRY
from tests.reference.scenes.random_scenes import random_tree
from trunnion.fmu.scene_export import export


def spent() -> float:
    """Processor seconds of this process and of its ended child processes."""
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


def once(seed: int, platform: str, kernel: str, fmi: int, folder: Path) -> tuple[float, float]:
    """Wall time and processor time of the export of a mechanism, s."""
    scene = random_tree(f"export {seed}", **DRY, bodies=1 + seed % 3).scene
    began, used = time.perf_counter(), spent()
    export(scene, folder / "new.fmu", platform=platform, kernel=kernel, fmi=fmi)
    return time.perf_counter() - began, spent() - used


def main() -> None:
    """Measure the export for each platform, with the given number of mechanisms each."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--kernel", default="compiled")
    asked.add_argument("--fmi", type=int, default=2)
    asked.add_argument("--count", type=int, default=6)
    asked.add_argument("--seed", type=int, default=int(time.time()))
    asked.add_argument("--platform", nargs="+", default=["host", "all"])
    given = asked.parse_args()
    seeds = itertools.count(given.seed)
    with tempfile.TemporaryDirectory() as name:
        for platform in given.platform:
            found = [once(next(seeds), platform, given.kernel, given.fmi, Path(name)) for _ in range(1 + given.count)][1:]
            for what, times in zip(("clock", "processor"), zip(*found, strict=True), strict=True):
                every = " ".join(f"{x:.2f}" for x in times)
                print(f"{platform:5} {what:9} median {sorted(times)[len(times) // 2]:.2f} s  ({every})", flush=True)


if __name__ == "__main__":
    main()
