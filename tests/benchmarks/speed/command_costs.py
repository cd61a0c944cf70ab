"""Processor time of warm commands, compared with Python alone and with ``import numpy``. The script also measures reading and
building a scene of 500 bodies, and ``run()`` of a ready model. Commands alternate. Byte code is stored, as after an installation.

``--than PYTHON``: the interpreter of another environment with an earlier version. Its commands alternate with the commands of this
version."""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import tests.scalable_mechanisms
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.scene.library.model_folders import model_folder

FIT = ["--column", "pivot.q[1]=angle", "--vary", "joints.pivot.friction.mu"]
LARGE = """
import gc, sys, time
gc.set_threshold(200_000)  # as in commands
import trunnion.simulation.run as runs
from trunnion.scene import load_scene
load_scene("spherical_pendulum")
at = [time.process_time()]
scene = load_scene(sys.argv[1])
at.append(time.process_time())
runs.Model(scene)
at.append(time.process_time())
print(at[1] - at[0], at[2] - at[1])
"""
READY = """
import time
import trunnion.simulation.run as runs
from trunnion.scene import load_scene
from trunnion.simulation.runtime_interface import simulation_block as bl
model = runs.Model(load_scene("simple_pendulum"))
def once():
    began = time.process_time()
    result = runs.run(model, 10.0, 10.0, bl.Settings(1e-6))
    return time.process_time() - began, result.stats.wall_time
print(*map(min, zip(*[once() for _ in range(400)])))
"""


def commands(data: str) -> dict[str, list[str]]:
    """{row: words after the interpreter}. data: the file of the measured swing."""
    command = ["-m", "trunnion"]
    return {
        "python": ["-c", "pass"],
        "numpy": ["-c", "import numpy"],
        "help": ["-c", "import sys; from trunnion.cli import main; sys.exit(main(['--help']))"],  # as the command, without runpy
        "simulate": [*command, "simulate", "spherical_pendulum"],
        "fit": [*command, "fit", "friction_identification", "--data", data, *FIT],
        "check": [*command, "check", "spherical_pendulum"],
        "check --hold --bounds, scissor lift": [*command, "check", "scissor_lift", "--hold", "--bounds"],
        "check --hold --bounds, drawer": [*command, "check", "drawer", "--hold", "--bounds"],
    }


def spent(python: str, words: list[str]) -> tuple[float, str]:
    """(processor seconds, standard output) of a process."""
    env = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    text = subprocess.run([python, *words], env=env, check=False, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, text


def main() -> None:
    """Print minimum (median) of each row, for each interpreter."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--rounds", type=int, default=9)
    asked.add_argument("--only", nargs="+", default=[])
    asked.add_argument("--than")
    given = asked.parse_args()
    pythons = [p for p in (given.than, sys.executable) if p]
    found: dict[tuple[str, str], list[float]] = {}
    try:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "chain.yaml"
            file.write_text(scene_to_yaml(tests.scalable_mechanisms.revolute_chain(500)))
            rows = commands(str(model_folder("friction_identification") / "measured.csv"))
            several = {"500 bodies: reading, model": ["-c", LARGE, str(file)], "run() of a ready pendulum; C": ["-c", READY]}
            chosen = {r: w for r, w in (rows | several).items() if not given.only or r in given.only}
            for n in range(given.rounds + 1):  # the first round fills caches
                for row, words in chosen.items():
                    for python in pythons:
                        seconds, text = spent(python, words)
                        for i, s in enumerate(map(float, text.split()) if row in several else [seconds]):
                            found.setdefault((python, f"{row} {i}"), []).extend([s] * (n > 0))
    finally:  # results so far are also printed after Ctrl-C
        for (python, row), times in ((k, t) for k, t in found.items() if t):
            print(f"{row:45s} {min(times) * 1e3:9.3f} ({statistics.median(times) * 1e3:.3f}) ms  {python}")


if __name__ == "__main__":
    main()
