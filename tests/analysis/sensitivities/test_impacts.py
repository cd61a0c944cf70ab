"""Derivatives across impacts and across the beginning and end of contacts, compared with closed forms and differences of runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from tests.engine.unilateral.unilateral_scenes import G, body, corner, in_plane, scene
from trunnion.scene.data_classes.scene import Scene

RODS = ("joints.fly.start.q[1]", "joints.fly.start.qd[2]", "joints.fly.start.qd[3]", "bodies.rod.mass", "gravity[3]",
        "joints.tip.friction.mu", "joints.tip.unilateral.restitution")  # fmt: skip
ARMS = ("joints.upper.start.q", "joints.lower.start.qd", "bodies.b.mass", "gravity[3]", "joints.lower.friction.torque",
        "joints.tip.friction.mu", "joints.tip.unilateral.restitution")  # fmt: skip
FOLLOWERS = ("joints.shaft.drive.constant.rate", "joints.guide.spring.stiffness", "bodies.tappet.mass",
             "joints.touch.unilateral.restitution", "joints.touch.friction.mu")  # fmt: skip


@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_a_bouncing_block_has_the_derivatives_of_its_closed_form(law: str) -> None:
    """After n impacts the height is e^n v s − g s²/2 with v = √(2 g h) and s the time since the n-th impact."""
    h, e, until = 1.0, 0.6, 1.0
    floor = {"type": "point_on_plane", "inboard": "ground", "outboard": "block", "axis": [0, 0, 1]}
    floor["unilateral"] = {"restitution": e, "impact_law": law, "starts": "open"}
    fall = {"type": "prismatic", "inboard": "ground", "outboard": "block", "axis": [0, 0, 1], "start": {"q": h}}
    made = scene({"block": body(2.0, 0.1)}, {"fall": fall, "floor": floor})
    names = ["joints.fall.start.q", "joints.floor.unilateral.restitution", "gravity[3]"]
    r = trunnion.sensitivity(made, names, ["fall.q[1]"], until=until, every=until, rtol=1e-11)
    p = np.array([h, e, -G])

    def height(x: np.ndarray) -> complex:
        """The height after two impacts, as a function of a complex argument."""
        first = np.sqrt(2 * x[0] / -x[2])
        s = until - first * (1 + 2 * x[1])
        return -x[2] * first * x[1] ** 2 * s + x[2] * s**2 / 2

    exact = [height(p + 1e-30j * np.eye(3)[k]).imag / 1e-30 for k in range(3)]
    assert r.derivatives[-1, 0] == pytest.approx(exact, rel=1e-9)
    assert [x.time for x in r.events] == pytest.approx(np.sqrt(2 * h / G) * np.array([1.0, 1 + 2 * e]), abs=1e-11)
    assert r.events[1].shift[1] == pytest.approx(2 * np.sqrt(2 * h / G), rel=1e-9)


def rod(rng: np.random.Generator, law: str) -> tuple[Scene, tuple[str, ...]]:
    """A rod whose end strikes a table and bounces or slides."""
    length, angle, mu = rng.uniform(0.2, 0.6), rng.uniform(-0.9, 0.9), rng.uniform(0.05, 0.6)
    v = (0.0, rng.uniform(-2, 2), rng.uniform(-1, 1))
    fly = in_plane("rod", (length * np.cos(angle) + rng.uniform(0.1, 0.4), 0.0, angle), v)
    tip = corner("rod", (0.0, -length), mu, restitution=float(rng.uniform(0, 0.6)), impact_law=law, starts="open")
    return scene({"rod": body(rng.uniform(0.5, 3), rng.uniform(0.02, 0.2))}, {"fly": fly, "tip": tip}), RODS


def arms(rng: np.random.Generator, law: str) -> tuple[Scene, tuple[str, ...]]:
    """A double pendulum with friction in its second joint, whose end strikes a table."""
    own: dict[str, Any] = {"axis": [0, 1, 0], "type": "revolute"}
    upper = own | {"inboard": "ground", "outboard": "a", "start": {"q": float(rng.uniform(0.9, 1.4))}}
    lower = own | {"inboard": {"body": "a", "point": [0, 0, -0.4]}, "outboard": "b"}
    lower |= {"start": {"q": float(rng.uniform(-0.6, 0.6)), "qd": float(rng.uniform(1, 3))}}
    lower["friction"] = {"torque": float(rng.uniform(0.05, 0.6))}
    only = {"restitution": float(rng.uniform(0, 0.6)), "impact_law": law, "starts": "open"}
    tip = corner("b", (0.0, -0.3), float(rng.uniform(0.05, 0.5)), **only)
    tip["inboard"] = {"body": "ground", "point": [0.0, 0.0, -0.62 + float(rng.uniform(0.0, 0.1))]}
    bodies = {"a": body(1.0, 0.02) | {"center": [0, 0, -0.2]}}
    bodies["b"] = body(float(rng.uniform(0.5, 2)), 0.02) | {"center": [0, 0, -0.15]}
    return scene(bodies, {"upper": upper, "lower": lower, "tip": tip}), ARMS


def follower(rng: np.random.Generator, law: str) -> tuple[Scene, tuple[str, ...]]:
    """A cam follower that lifts off and lands."""
    angle = np.linspace(0.0, 2 * np.pi, 25)
    radius = 0.03 + 0.006 * np.exp(-8.0 * (1 - np.cos(angle - np.pi)))
    speed = float(rng.uniform(80, 120))
    shaft = {"type": "revolute", "inboard": "ground", "outboard": "cam", "axis": [0, 1, 0], "drive": {"constant": {"rate": speed}}}
    guide = {"type": "prismatic", "inboard": "ground", "outboard": "tappet", "axis": [0, 0, 1]}
    guide["spring"] = {"stiffness": float(rng.uniform(500, 1200))}
    touch = {"type": "cam", "inboard": {"body": "cam", "axis": [0, 1, 0]}, "outboard": {"body": "tappet", "axis": [0, 1, 0]}}
    touch["profile"] = {"angle": angle.tolist(), "radius": [*radius[:-1], radius[0]]}
    touch |= {"unilateral": {"restitution": float(rng.uniform(0, 0.5)), "impact_law": law}, "friction": {"mu": 0.1}}
    return scene({"cam": body(1.0, 1.0), "tappet": body(0.3, 0.1)}, {"shaft": shaft, "guide": guide, "touch": touch}), FOLLOWERS


FAMILIES = ((rod, "fly.q[*]", 0.5), (arms, "*er.q[1]", 0.6), (follower, "guide.q[1]", 0.09))


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(102))
def test_derivatives_across_impacts_are_those_of_neighbouring_runs(seed: int) -> None:
    """Impacts by Newton's and Poisson's laws, with friction in the contact and in joints, compared with differences of order
    four."""
    make, outputs, until = FAMILIES[seed % len(FAMILIES)]
    rng = np.random.default_rng(seed)
    made, names = make(rng, ("newton", "poisson")[seed % 2])
    names = tuple(names[k] for k in rng.permutation(len(names))[:3])
    r = trunnion.sensitivity(made, list(names), [outputs], until=until, every=until, rtol=1e-11)

    def at(name: str, value: float) -> tuple[np.ndarray, list[str]]:
        asked: dict[str, Any] = {"until": until, "every": until, "rtol": 1e-12, "method": "rk8", "outputs": [outputs]}
        run = trunnion.simulate(made, overrides={name: value}, **asked)
        return np.array([run[c][-1] for c in r.names]), [x.kind for x in run.events]

    for k, name in enumerate(names):
        value = next(x.value for x in trunnion.scene.overrides.list_parameters(made) if x.path == name)
        step = 1e-4 * max(abs(value), 0.01)
        (a, ka), (b, kb), (c, kc), (d, kd) = (at(name, value + i * step) for i in (-2, -1, 1, 2))
        if ka == kb == kc == kd:
            near = (8 * (c - b) - (d - a)) / (12 * step)
            assert r.derivatives[-1, :, k] == pytest.approx(near, rel=2e-5, abs=2e-6 * max(1.0, np.abs(near).max()))
