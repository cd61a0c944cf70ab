"""Rows of the gallery about loads that depend on speed and position, and about guessed starts."""

from __future__ import annotations

import math

from tests.stability.entries.gear_units_and_loads import made, revolute
from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import honest, ran
from trunnion.scene.data_classes import scene as sm

WIDTH, WAY, SPEED = 0.001, 0.5, 1.0
"""Data of the potential hill: width, m; distance of the start, m; start speed with which a body just reaches the top, m/s."""
FAST, THICK = 1e4, 1000.0
"""Data of the body that enters a dense medium: speed, m/s; drag divided by squared speed and mass, 1/m."""
PLATEAU, OPENS = 10.0, 0.1
"""Data of the valve: force at which it opens, N; speed at this force, m/s."""


def block(name: str, until: float, start: dict, forces: dict | None = None, **more: object) -> sm.Scene:
    """A block of 1 kg on a guide."""
    guide = {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block", "start": start, **more}
    loads = {"forces": forces} if forces else {}
    return made(name, {"block": {"mass": 1, "inertia": [0.01] * 3}}, {"guide": guide}, until, **loads)


def hill(beyond: float) -> sm.Scene:
    """A block that a field slows down on a short part of its way. The energy of the field at x is F w/2 exp(−(x/w)²)."""
    w = f"({WIDTH} m)"
    field = {"type": "field", "on": "block", "fx": f"{SPEED**2 / WIDTH} N*(x/{w})*exp(-(x/{w})^2)", "width": WIDTH}
    return block("hill", 2.0, {"q": -WAY, "qd": SPEED * math.sqrt(1 + beyond)}, {"hill": field})


def goes_over(scene: sm.Scene) -> str:
    """Verdict on whether the block is beyond the hill at the end; for an incorrect run, the verdict of ``honest``."""
    over = ran(scene)["guide.q[1]"][-1] > 0.0
    return ("goes over" if over else "turns back") if honest(scene) == "right" else honest(scene)


def chute(_: float) -> sm.Scene:
    """A block that drag slows down by a factor of ten million within a second."""
    air = {"type": "drag", "on": "block", "area": 1.0, "coefficient": 2.0, "density": THICK}
    return block("chute", 1.0, {"q": 0.0, "qd": FAST}, {"air": air})


def slows(scene: sm.Scene) -> str:
    """The verdict of ``honest``. For "right", the remaining speed must also agree with the closed form."""
    rate = ran(scene)["guide.qd[1]"]
    share = rate[-1] / rate[0] * (1 + THICK * FAST)
    return honest(scene) if abs(share - 1) < 1e-5 else f"{share:.6g} of the speed"


def valve(beyond: float) -> sm.Scene:
    """A block pushed against a damper whose force does not exceed a plateau."""
    curve = {"speed": [-1.0, -OPENS, 0.0, OPENS, 1.0], "effort": [-PLATEAU, -PLATEAU, 0.0, PLATEAU, PLATEAU]}
    more = {"effort": PLATEAU * (1 + beyond), "nonlinear": {"damping_curve": curve}}
    return block("valve", 2e4, {"q": 0.0, "qd": 0.0}, **more)


def opens(scene: sm.Scene) -> str:
    """Verdict on whether the speed exceeds the speed at which the damper opens."""
    run = ran(scene)
    word = "runs away" if run["guide.qd[1]"][-1] > run["guide.qd[1]"][1] * 1.5 else "settles"
    return word if honest(scene) == "right" else honest(scene)


def guessed(beyond: float) -> sm.Scene:
    """Two links whose ends are on the ground, with a guess of the angle between the links. The guess is slightly to one side of the
    straight position, or to the other side."""
    bodies = {n: {"mass": 1, "inertia": [0.1] * 3, "center": [0.5, 0, 0]} for n in ("crank", "rod")}
    end = {"body": "rod", "point": [1, 0, 0]}
    elbow = {**revolute("rod"), "inboard": {"body": "crank", "point": [1, 0, 0]}, "start": {"q": beyond, "use": "guess"}}
    joints = {"pivot": revolute("crank", start={"q": 0.0, "use": "guess"}), "elbow": elbow,
              "end": {**revolute("rod"), "inboard": {"body": "ground", "point": [1.2, 0, 0]}, "outboard": end}}  # fmt: skip
    return made("guessed_elbow", bodies, joints, 0.01)


def side(scene: sm.Scene) -> str:
    """The side on which the elbow closes, if the angle of the elbow agrees with the triangle."""
    run = ran(scene)
    angle = float(run["elbow.q[1]"][0])
    right = run.outcome.ok and abs(abs(angle) - 2 * math.acos(0.6)) < 1e-9
    return ("left" if angle > 0 else "right") if right else f"{run.outcome.name} at {angle:.6g} rad"


ROWS = (
    Row(37, "hill", "a narrow field on the way", (
        Edge("energy to pass a hill, F w/2", hill, goes_over, "turns back", "goes over"),), "a long step passes the field unseen"),
    Row(38, "chute", "drag that stops a fast body", (
        Edge("slowed down ten million times in 1 s", chute, slows, "right"),), "fixed steps throw the body back, ever faster"),
    Row(39, "valve", "a damper with a plateau", (
        Edge("push = plateau, 20,000 s", valve, opens, "settles", "runs away"),),
        "explicit methods need millions of steps; a polynomial fit of the curve has no plateau"),
    Row(40, "guessed_elbow", "a guess between two closings", (
        Edge("guess 0 ∓ 1e-6 rad of the straight links", guessed, side, "right", "left"),),
        "Newton's method from the singular pose ends at either closing, or diverges"),
)  # fmt: skip
