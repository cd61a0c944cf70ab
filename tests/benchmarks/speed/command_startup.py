"""First and warm run of `trunnion simulate spherical_pendulum`, wall time including imports."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def once(folder: Path, cache: Path) -> float:
    """Seconds that one run takes in a folder, with the kernel cache given."""
    command = [sys.executable, "-m", "trunnion", "simulate", "spherical_pendulum", "-o", "p.csv", "--plot", "p.png"]
    started = time.perf_counter()
    subprocess.run(command, cwd=folder, env=dict(os.environ, TRUNNION_CACHE=str(cache)), check=True, capture_output=True)
    return time.perf_counter() - started


def main() -> None:
    """Print first (empty cache) and warm runs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        first = [once(folder, folder / f"cache{i}") for i in range(3)]
        warm = sorted(once(folder, folder / "cache0") for _ in range(5))
    print(f"first run  min {min(first):.2f} s, max {max(first):.2f} s (empty kernel cache)")
    print(f"warm run   min {warm[0]:.2f} s, median {warm[2]:.2f} s")


if __name__ == "__main__":
    main()
