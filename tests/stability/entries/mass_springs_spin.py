"""Rows of the gallery about masses, springs and spin: their scenes and verdicts."""

from __future__ import annotations

import math

import numpy as np

from tests.reference.mechanics.rotation import matrix_from_quaternion as rotation
from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import accepted, bundled, honest, ran
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply


def tumbling(beyond: float, spin: float = 1e4) -> sm.Scene:
    """A free box that spins fast about an axis 1e-3 off its axis y. The inertia about y is the middle one if the side of the box is
    below 0.3 m."""
    body = sm.Body(box=(0.3, 0.3 * (1 + beyond), 0.1), mass=1.0)
    start = sm.Start((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1e-3 * spin, spin, 0.0))
    return sm.Scene({"top": body}, {"free": sm.Joint("free", "ground", "top", start=start)}, "tumbling", gravity=(0.0, 0.0, 0.0),
                    simulation=sm.Simulation(until=4000.0 / spin))  # fmt: skip


def normed(scene: sm.Scene) -> str:
    """Verdict on whether the spin leaves its axis in the body. It deviates by cosh 3.6 = 18 times the first deviation, or not at
    all. Quaternion length and energy must be constant."""
    r = ran(scene, 1e-10)
    q = np.array([r[f"free.q[{k}]"] for k in (4, 5, 6, 7)])
    w = np.array([r[f"free.qd[{k}]"] for k in (4, 5, 6)])
    lost = np.abs(r["energy.residual"]).max() / r["energy.kinetic"][0]
    if not r.outcome.ok or np.abs((q * q).sum(axis=0) - 1.0).max() > 1e-12 or lost > 1e-7:
        return f"{r.outcome.name}, energy {lost:.1e}"
    off = [abs((rotation(a).T @ b)[0]) / np.linalg.norm(b) for a, b in zip(q.T, w.T, strict=True)]
    return "turns over" if 17.0 < off[-1] / off[0] < 19.0 else "stays" if max(off) <= 1.001 * off[0] else f"off by {max(off):.1e}"


def massive(mass: float) -> sm.Scene:
    """A body whose mass may be NaN."""
    return sm.Scene({"b": sm.Body(box=(1.0, 1.0, 1.0), mass=mass)}, {"j": sm.Joint("prismatic", "ground", "b", axis="z",
                    start=sm.Start(0.0, 1.0))}, "massive", simulation=sm.Simulation(until=0.1))  # fmt: skip


def governor(beyond: float) -> sm.Scene:
    """The flyball governor with relaxed springs. Its rate is so large that centrifugal force just carries the balls."""
    slope, m, c = math.pi / 6, 5.3, 5.15 / 5.3
    inertia = m * c * c + 0.09575721698113207 - 5e-6
    rate = math.sqrt(m * 9.81 * c * math.cos(slope) / (math.sin(slope) * (0.05 * m * c + inertia * math.cos(slope))))
    return apply(bundled("governor", 0.2)(0.0), {"joints.spin.start.qd": rate * (1 + beyond)})


def lifting(scene: sm.Scene) -> str:
    """The verdict of ``honest``, and the direction in which the balls begin to move."""
    word, sets_off = honest(scene), float(ran(scene)["pin_right.qdd[1]"][0])
    return f"{word}, {'lifts' if sets_off < 0 else 'sinks'}"


def lopsided(beyond: float) -> sm.Scene:
    """A free body whose largest moment of inertia is 1 − beyond times the sum of the two other moments."""
    body = sm.Body(mass=1.0, inertia=(1.0, 2.0, 3.0 * (1 - beyond)))
    start = sm.Start((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 2.0, 3.0))
    return sm.Scene(
        {"b": body}, {"j": sm.Joint("free", "ground", "b", start=start)}, "lopsided", simulation=sm.Simulation(until=1.0)
    )


ROWS = (
    Row(13, "stiff_springs", "stiff springs", (
        Edge("rate at which the governor's balls lift", governor, lifting, "right, sinks", "right, lifts"),),
        "explicit methods need a step of microseconds"),
    Row(15, "fast_spin", "high speed, quaternion norm", (
        Edge("spin axis between middle and least inertia, 1e4 rad/s", tumbling, normed, "turns over", "stays"),),
        "the quaternion's norm drifts"),
    Row(19, "not_finite", "non-finite input, absurd units", (
        Edge("largest inertia = sum of the others", lopsided, accepted, "refused", "right"),
        Edge("mass 1e-300 kg", lambda b: massive(1e-300), accepted, "right"),
        Edge("mass 1e300 kg", lambda b: massive(1e300), accepted, "right"),), "NaN in the results"),
)  # fmt: skip
