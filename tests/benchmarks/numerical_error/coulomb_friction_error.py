"""Error against stepping time with exact Coulomb friction. The first scene is example 8.1 (0–5 s), also with the regularised law.
The second scene is a skew chain of three links with friction that falls and comes to rest (10 s). The reference of each scene is
its run at rtol 1e-13. The reference of 8.1 has Coulomb's law, so that the error of a regularised run includes the error of its
law."""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np

from tests.benchmarks.speed.processor_time import pin, repeat
from trunnion import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

AXES = ((0.2, 1.0, 0.1), (0.3, 0.9, -0.2), (-0.2, 0.95, 0.25))
LENGTH = 0.5


def skew_chain() -> sm.Scene:
    """Three bars of half a metre on journals with μ = 0.8 and skew axes, released from the horizontal."""
    bodies, joints = {}, {}
    for k, axis in enumerate(AXES):
        points = {"a": (-LENGTH / 2, 0.0, 0.0), "b": (LENGTH / 2, 0.0, 0.0)}
        bodies[f"b{k + 1}"] = sm.Body(box=(LENGTH, 0.08, 0.06), density=2700.0, points=points)
        inboard = "ground" if k == 0 else f"b{k}.b"
        rub = sm.Friction(mu=0.8, radius=0.02, half_length=0.06, law="coulomb")
        joints[f"j{k + 1}"] = sm.Joint("revolute", inboard, f"b{k + 1}.a", axis=axis, friction=rub, start=sm.Start(0.0, 0.0))
    return sm.Scene(bodies, joints, "skew_chain", gravity=(0.0, 0.0, -9.81))


def swing(law: str, kernel: str, v_eps: float = 1e-4) -> Model:
    """The model of example 8.1 with a friction law."""
    changes: dict[str, object] = {"friction.law": law}
    if law == "regularized":
        changes["friction.v_eps"] = v_eps
    return Model(apply(load_scene("spherical_pendulum"), changes), ("pendulum.position[1]", "pendulum.position[3]"), kernel)


def angle(r: Result) -> np.ndarray:
    """8.1's angle from the downward vertical at the end, rad."""
    return np.arctan2(r["pendulum.position[1]"][-1:], -r["pendulum.position[3]"][-1:])


def turns(r: Result) -> np.ndarray:
    """The chain's angles at the end, rad."""
    return np.array([r[f"j{k + 1}.q[1]"][-1] for k in range(3)])


def stepping(model: Model, until: float, settings: Settings) -> float:
    """Seconds of one run's stepping."""
    return run(model, until, until, settings).stats.wall_time


def table(name: str, model: Model, until: float, read, exact: np.ndarray, rtols: tuple[float, ...]) -> None:
    """Print one line for each tolerance: error, stepping time, steps."""
    for rtol in rtols:
        settings = Settings(rtol=rtol)
        r = run(model, until, until, settings)
        low, middle = repeat(partial(stepping, model, until, settings), 60)
        error, s = float(np.abs(read(r) - exact).max()), r.stats
        counts = f"{s.steps:6d} {s.counters['rejected']:6d} {s.events:6d}"
        print(f"{name:28s} {rtol:7.0e} {error:10.1e} {low * 1e3:8.3f} {middle * 1e3:8.3f} {counts}")


def main() -> None:
    """Print the table."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--kernel", default="compiled", choices=("compiled", "parts"))
    kernel = asked.parse_args().kernel
    pin()
    tight = Settings(rtol=1e-13)
    counts = f"{'steps':>6s} {'reject':>6s} {'events':>6s}"
    print(f"{'scene, law':28s} {'rtol':>7s} {'error rad':>10s} {'min ms':>8s} {'median':>8s} {counts}")
    dry = swing("coulomb", kernel)
    exact = angle(run(dry, 5.0, 5.0, tight))
    table("8.1 coulomb", dry, 5.0, angle, exact, (1e-6, 1e-7, 3e-8, 1e-8, 1e-9, 1e-10))
    for v_eps in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        table(f"8.1 regularized {v_eps:.0e} m/s", swing("regularized", kernel, v_eps), 5.0, angle, exact, (1e-6, 1e-9))
    chain = Model(skew_chain(), ("j?.q[1]",), kernel)
    table("skew chain coulomb", chain, 10.0, turns, turns(run(chain, 10.0, 10.0, tight)), (1e-5, 1e-6, 1e-7, 1e-8))


if __name__ == "__main__":
    main()
