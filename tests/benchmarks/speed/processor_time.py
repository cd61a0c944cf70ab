"""Timing for the benchmark scripts. The process stays on one core. Times are the minimum and the median of many repetitions."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable

import numpy as np

from trunnion.simulation.runtime_interface.simulation_block import Block


def pin() -> None:
    """Stay on one core if the system allows it."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def repeat(f: Callable[[], float], repetitions: int = 15) -> tuple[float, float]:
    """(minimum, median) of the seconds that repeated calls of f return."""
    times = [f() for _ in range(repetitions)]
    return min(times), statistics.median(times)


def clocked(f: Callable[[], object], batch: float = 2e-3, repetitions: int = 31) -> tuple[float, float]:
    """(minimum, median) seconds per call of a short function."""
    n = 1
    while True:
        started = time.perf_counter()
        for _ in range(n):
            f()
        if time.perf_counter() - started > batch:
            break
        n *= 2
    times = []
    for _ in range(repetitions):
        started = time.perf_counter()
        for _ in range(n):
            f()
        times.append((time.perf_counter() - started) / n)
    return min(times), statistics.median(times)


def inside_advance() -> Callable[[], float]:
    """From now on, measure the processor time inside the runtime's loop of steps. Returns a function that gives the seconds since
    its last call. (Times of whole runs vary by more than the time of a step.)"""
    spent, advance = [0.0], Block.advance

    def timed(block: Block, target: float, max_steps: int, rows: np.ndarray) -> tuple[int, int]:
        began = time.process_time()
        try:
            return advance(block, target, max_steps, rows)
        finally:
            spent[0] += time.process_time() - began

    def taken() -> float:
        found, spent[0] = spent[0], 0.0
        return found

    Block.advance = timed  # type: ignore[method-assign]
    return taken
