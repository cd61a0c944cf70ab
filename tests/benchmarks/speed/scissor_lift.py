"""A scissor lift with friction in every pin: its loads compared with hand statics, and the cost of one second from rest. The cost
is the wall time of a whole call of ``trunnion.simulate``."""

from __future__ import annotations

import argparse
import time

import numpy as np

from tests.benchmarks.speed.processor_time import pin
from tests.engine.mechanisms.scissor_lift import driven, scissor, statics
from trunnion.simulation.run import simulate

RATE, MU = 1e-6, 0.15
"""Rate of the shoe, m/s, and friction coefficient; inertia forces are 1e-10 of the weight at a hundred stages."""


def loads(stages: int, rate: float) -> float:
    """Largest relative difference of a pin's force from hand statics."""
    r = simulate(driven(stages, rate, MU), until=0.01, every=0.01, outputs=("*.reaction.force[*]", "guide.q[1]"), kernel="parts")
    by_hand = statics(stages, MU, r["guide.q[1]"][-1], np.sign(rate))
    found = {j: np.linalg.norm([r[f"{j}.reaction.force[{k}]"][-1] for k in (1, 2, 3)]) for j in by_hand}
    return max(abs(found[j] / by_hand[j] - 1.0) for j in by_hand)


def main() -> None:
    """Print a line for each size."""
    parser = argparse.ArgumentParser()
    parser.add_argument("stages", type=int, nargs="*", default=[10, 40, 70, 100])
    pin()
    for n in parser.parse_args().stages:
        began = time.perf_counter()
        r = simulate(scissor(n, MU), until=1.0, every=0.1, outputs=("guide.q[1]",), kernel="parts")
        took, end = time.perf_counter() - began, r["guide.q[1]"][-1] if r.outcome.ok else np.nan
        print(f"{n:4d} stages: {took:6.1f} s for 1 s from rest ({r.outcome.name}, shoe at {end:.6f} m), "
              f"pins off by {loads(n, -RATE):.1e} rising, {loads(n, RATE):.1e} going down", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
