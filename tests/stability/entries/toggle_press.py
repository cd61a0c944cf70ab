"""The gallery's row about a toggle press: its change point, where the links are folded on each other, and its pressing force."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial

import numpy as np
from scipy.optimize import brentq

from tests.engine.coulomb.test_toggle_press import PUSH, PUSH_TIMES, TOGGLE
from tests.reference.contact_and_friction.sprung_toggle_press import CIRCLE, SprungToggle
from tests.stability.entries.ball_pendulums import counted
from tests.stability.entries.wishbone_and_platform import SLOW, going, most, rests
from tests.stability.gallery_entry import Edge, Row
from trunnion.scene import scene_from_text
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

CHANGE = -math.pi / 2
"""Angle between the upper link and the path of the ram at the change point, rad."""
STRAIGHT = math.radians(5.0)
"""Angle between the upper link and the path of the ram where the press works, nearly straight, rad."""
RESIST = 2000.0
"""The resistance against the press, N."""


def folding(until: float) -> sm.Scene:
    """The press, pushed through its change point until a time in s. All its pins have friction."""
    text = TOGGLE.replace("RUB", "friction: {mu: 0.1, radius: 20 mm, half_length: 30 mm}")
    scene = scene_from_text(text.replace("TIMES", str(PUSH_TIMES)).replace("PUSH", str(PUSH)))
    return replace(scene, simulation=sm.Simulation(until=until))


def placed(angle: float, rate: float, push: float, resist: float, until: float) -> sm.Scene:
    """The press without its stop, at an angle (rad) of the upper link. The link turns at a rate. Other forces, N, may act."""
    scene = folding(until)
    loads = {"push": sm.Force("force", "upper.knee", (push, 0.0, 0.0)), "resist": sm.Force("force", "ram", (0.0, 0.0, resist))}
    start = {"crown": sm.Start(angle, rate), "knee": sm.Start(-2 * angle, -2 * rate)}
    joints = {n: replace(j, start=start.get(n), end_stops=None) for n, j in scene.joints.items()}
    return replace(scene, joints=joints, forces=loads, outputs=("*.q[*]", "*.qd[*]", "*.qdd[*]"))


def pressing(push: float, rate: float = 0.0) -> sm.Scene:
    """The press nearly straight. A force (N) pushes its knee, and it straightens at a rate."""
    return placed(STRAIGHT, -rate, push, RESIST, 0.01)


def pushed(beyond: float, rate: float = 0.0) -> sm.Scene:
    """The press nearly straight. Its push is (1 + ``beyond``) times the push at which its sliding keeps its speed."""
    return pressing((1 + beyond) * most(pressing, "crown", 100.0, 2000.0), rate)


@cache
def pole() -> float:
    """Distance from the change point (rad) at which friction of the press in plane has a pole. At this distance, a lateral force
    and the friction that this force alone causes do not accelerate the foot sideways."""
    model = SprungToggle(0.0, 0.0, lambda _: 0.0)

    def lean(beside: float) -> float:
        angle, pins = CHANGE - beside, np.ones(3)
        inverse, loads = model.balance(0.0, 1.0, angle, -angle, 0.0, 0.0)
        weights = model.balance(0.0, 0.0, angle, -angle, 0.0, 0.0)[1]
        for _ in range(50):
            friction = CIRCLE * np.array([1.0, -1.0, 1.0]) * pins
            x = inverse @ (loads - weights + np.r_[np.zeros(4), friction[0] - friction[1], friction[1] - friction[2], 0.0])
            pins = np.array([math.hypot(x[2], x[3]), math.hypot(x[4], x[5]), math.hypot(1.0, x[6])])
        return float(x[0] + x[1])

    return float(brentq(lean, 1e-4, 1e-2, xtol=1e-18, rtol=1e-14))


def beside(beyond: float, rate: float) -> sm.Scene:
    """The press folded through its change point, at 1 + beyond times the distance ``pole`` behind this point. The press is on its
    way back or, at a negative rate, on its way on."""
    return placed(CHANGE - (1 + beyond) * pole(), rate, 0.0, 0.0, 1e-10)


def folds(scene: sm.Scene) -> str:
    """Words for the motion at the change point, by every method at two tolerances."""
    until, words = float(scene.simulation.until), set()
    for method in ("auto", "rk5", "rk8", "rosenbrock"):
        for rtol in (1e-6, 1e-8):
            r = simulate(scene, until=until, every=until / 100, rtol=rtol, method=method, outputs=["crown.q[1]", "crown.qd[1]"])
            through = "folds through" if r["crown.q[1]"].min() < CHANGE else "stays before it"
            back = " on its way back" if r["crown.qd[1]"][-1] > 0 else ""
            words.add(f"{through}, {r.outcome.name}{back}")
    return words.pop() if len(words) == 1 else f"by method and tolerance: {sorted(words)}"


ROWS = (
    Row(28, "toggle", "a change point of links with friction", (
        Edge("pushed through the change point", lambda _: folding(1.0), folds, "folds through, jammed on its way back"),
        Edge("a pole of friction near the change point, on the way back", lambda b: beside(b, 1.0), counted, "jammed", "one root"),
        Edge("the same on the way through", lambda b: beside(b, -1.0), counted, "several roots", "one root"),
        Edge("nearly straight: push at which the press continues to slide", pushed, rests, "holds", "slips"),
        Edge("the same while it moves", lambda b: pushed(b, SLOW), partial(going, joint="crown"), "slows down", "speeds up"),),
        "steps over the change point, or ends there by chance"),
)  # fmt: skip
