"""Coulomb and viscous friction of a pendulum from one measured swing: ``python identify.py`` in this folder.

``make`` writes measured.csv: a run with known friction, read by an encoder with noise.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

import trunnion

HERE = Path(__file__).resolve().parent
TRUTH = {"joints.pivot.friction.mu": 0.23, "joints.pivot.damping": 0.008}
NOISE, SEED = 0.5e-3, 2024
"""Standard deviation of the encoder, rad, and the seed of its noise."""
ANGLE = "pivot.q[1]"


def make(file: Path) -> None:
    """Write synthetic measurements of a run with the numbers TRUTH."""
    run = trunnion.simulate(str(HERE / "scene.yaml"), rtol=1e-10, overrides=TRUTH, outputs=[ANGLE])
    noise = NOISE * np.random.default_rng(SEED).normal(size=len(run.time))
    with file.open("w", newline="", encoding="utf-8") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(["time [s]", "angle [rad]"])
        table.writerows((f"{t:.4f}", f"{a:.6f}") for t, a in zip(run.time, run[ANGLE] + noise, strict=True))


def identify(file: Path) -> trunnion.Fit:
    """Fit the numbers by least squares, with exact gradients across the stops of the run."""
    time, angle = np.loadtxt(file, delimiter=",", skiprows=1).T
    return trunnion.fit(str(HERE / "scene.yaml"), list(TRUTH), time, {ANGLE: angle})


if __name__ == "__main__":
    data = HERE / "measured.csv"
    if "make" in sys.argv[1:]:
        make(data)
    found = identify(data)
    for name, value in found.values.items():
        print(f"{name}: {value:.5f} ± {found.deviation[name]:.5f} (true: {TRUTH[name]:g})")
    print(f"misfit {1e3 * found.misfit:.3f} mrad (noise: {1e3 * NOISE:g}), {found.rounds} rounds")
    print(f"correlation of the two numbers: {found.correlation[0, 1]:.3f}")
