"""Rows about masses, springs and spin."""

from __future__ import annotations

from engine.scene import model as sm
from tests.stability.row import Row
from tests.stability.verdicts import accepted, bundled, honest, ran


def tumbling(spin: float) -> sm.Scene:
    """A free body that spins fast about its middle axis."""
    body = sm.Body(box=(0.3, 0.2, 0.1), mass=1.0)
    start = sm.Start((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1e-3 * spin, spin, 0.0))
    return sm.Scene({"top": body}, {"free": sm.Joint("free", "ground", "top", start=start)}, "tumbling", gravity=(0.0, 0.0, 0.0),
                    simulation=sm.Simulation(until=50.0 / spin))  # fmt: skip


def normed(scene: sm.Scene) -> str:
    """The quaternion's length and the energy after many turns."""
    r = ran(scene)
    drift = max(abs(sum(r[f"free.q[{k}]"][i] ** 2 for k in (4, 5, 6, 7)) - 1.0) for i in range(len(r)))
    return honest(scene) if drift <= 1e-12 else f"norm off by {drift:.1e}"


def massive(mass: float) -> sm.Scene:
    """A body with a mass that may be no number."""
    return sm.Scene({"b": sm.Body(box=(1.0, 1.0, 1.0), mass=mass)}, {"j": sm.Joint("prismatic", "ground", "b", axis="z",
                    start=sm.Start(0.0, 1.0))}, "massive", simulation=sm.Simulation(until=0.1))  # fmt: skip


ROWS = (
    Row(9, "light_cart", "tiny inertias", lambda b: bundled("cart_pole", 2.0)(b), honest, "right", "right",
        "default solvers are silently wrong"),
    Row(13, "stiff_springs", "stiff springs", lambda b: bundled("governor", 0.2)(b), honest, "right", "right",
        "explicit methods need a step of microseconds"),
    Row(15, "fast_spin", "high speed, quaternion norm", lambda b: tumbling(1e4 * (1 + b)), normed, "right", "right",
        "the quaternion's norm drifts"),
    Row(19, "not_finite", "non-finite input, absurd units", lambda b: massive(1e-30 if b < 0 else 1e30), accepted, "right", "right",
        "NaN in the results"),
)  # fmt: skip
