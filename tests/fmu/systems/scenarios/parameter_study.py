"""Largest angle of the pendulum of example 8.1 for six coefficients of friction: one FMU, six runs, no recompilation."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

from trunnion.fmu.scene_export import export

COEFFICIENTS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
WANTED = ["pendulum.tip.position[1]", "ball.contact[1].normal_force"]


def study(folder: Path) -> dict[float, tuple[float, float]]:
    """{mu: (furthest reach on the far side, m; greatest normal force, N)} of the first 3 s."""
    file = folder / "pendulum.fmu"
    export("spherical_pendulum", file)
    found = {}
    for mu in COEFFICIENTS:
        start = {"joints.ball.friction.mu": mu}
        run = simulate_fmu(str(file), stop_time=3.0, output_interval=0.005, output=WANTED, start_values=start)
        found[mu] = float(np.min(run[WANTED[0]])), float(np.max(run[WANTED[1]]))
    return found


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        print("   mu   reach    normal force")
        for mu, (reach, force) in study(Path(folder)).items():
            print(f"  {mu:.1f}  {reach:6.3f} m  {force:9.1f} N")


if __name__ == "__main__":
    main()
