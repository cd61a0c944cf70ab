"""The compliant model's contacts that begin and end, against closed forms; the engine has no part in these tests."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from tests.reference.compliant import NotJudged, judged
from trunnion import Scene, scene_from_dict

NEAR = 1e-5
"""Largest error, m, rad, m/s. Three levels of stiffness, extrapolated, leave errors below it."""
G = 9.81
LINE = {"points": [[5.0, 0.0], [-5.0, 0.0]]}
SLOT = {"points": [[-5.0, 0.02], [5.0, 0.02]]}


def scene(touch: dict, q: list[float], qd: list[float], body: dict | None = None) -> Scene:
    """A body that moves in the plane normal to z, with weight along -y, and touches the ground in one contact."""
    fly = {"type": "planar", "axis": "z", "reference": "x", "inboard": "ground", "outboard": "b", "start": {"q": q, "qd": qd}}
    touch = {"axis": "z", "reference": "x", "inboard": "ground", "outboard": "b", **touch}
    bodies = {"b": body or {"mass": 2.0, "inertia": [0.05, 0.05, 0.05]}}
    return scene_from_dict({"schema": 1, "gravity": [0, -G, 0], "bodies": bodies, "joints": {"fly": fly, "touch": touch}})


def last(case: Scene, until: float) -> dict[str, float]:
    """Coordinates and rates at the end; the compliant model's own error must be below NEAR."""
    out = judged(case, until, ["fly.*"], instants=1)
    assert out.worst < NEAR
    return {name: float(values[-1]) for name, values in out.values.items()}


@pytest.mark.parametrize("walls", ["line", "slot"])
def test_a_block_that_lands_loses_speed_by_friction_in_the_impact_and_then_slides(walls: str) -> None:
    """The block falls 0.1 m, or 0.03 m in the slot. The impact removes the falling speed. Along the wall, it removes the friction
    coefficient times the falling speed."""
    mu, fall, speed, until = 0.3, 0.1, 2.0, 0.3
    touch = {"type": "point_on_curve", "curve": LINE} if walls == "line" else {
        "type": "pin_in_slot", "curve": SLOT, "slot": {"play": 0.02, "mouth": "both"}}  # fmt: skip
    high = fall if walls == "line" else 0.03
    touch |= {"friction": {"mu": mu}, "unilateral": {"starts": "open"}}
    out = last(scene(touch, [0.0, high, 0.0], [speed, 0.0, 0.0]), until)
    falls = np.sqrt(2 * high / G)
    after, slid = speed - mu * G * falls, until - falls
    assert out["fly.qd[1]"] == pytest.approx(after - mu * G * slid, abs=NEAR)
    assert out["fly.q[1]"] == pytest.approx(speed * falls + after * slid - mu * G * slid**2 / 2, abs=NEAR)
    assert out["fly.q[2]"] == pytest.approx(0.0, abs=NEAR)


def test_a_wheel_slides_until_it_rolls() -> None:
    """Friction slows the wheel and turns it, until its rim rests on the line."""
    mu, speed, r, m, J = 0.2, 1.0, 0.1, 2.0, 0.012
    path = {"points": [[5.0, r], [-5.0, r]]}
    touch = {"type": "point_on_curve", "curve": path, "roller": r, "friction": {"mu": mu}, "unilateral": {}}
    out = last(scene(touch, [0.0, r, 0.0], [speed, 0.0, 0.0], {"mass": m, "inertia": [0.01, 0.01, J]}), 0.4)
    rolls = speed / (mu * G * (1 + m * r * r / J))
    assert rolls < 0.4
    assert out["fly.qd[1]"] == pytest.approx(speed - mu * G * rolls, abs=NEAR)
    assert out["fly.qd[3]"] == pytest.approx(-(speed - mu * G * rolls) / r, abs=NEAR)


def test_a_bead_leaves_a_round_cam_where_its_weight_no_longer_holds_it() -> None:
    """At the angle a from the top, v² = v₀² + 2 g R (1 − cos a); the bead leaves at v² = g R cos a, and falls freely."""
    R, speed, flight = 0.5, 0.8, 0.1
    touch = {"type": "cam", "profile": {"angle": [0.0, 2.0, 4.0, 2 * np.pi], "radius": [R] * 4}, "unilateral": {}}
    leaves = np.arccos((2 + speed**2 / (G * R)) / 3)
    fast = lambda a: np.sqrt(speed**2 + 2 * G * R * (1 - np.cos(a)))  # noqa: E731
    time = quad(lambda a: R / fast(a), 0.0, leaves, epsabs=1e-13)[0]
    out = last(scene(touch, [0.0, R, 0.0], [speed, 0.0, 0.0]), time + flight)
    v = fast(leaves)
    assert out["fly.q[1]"] == pytest.approx(R * np.sin(leaves) + v * np.cos(leaves) * flight, abs=NEAR)
    assert out["fly.q[2]"] == pytest.approx(R * np.cos(leaves) - v * np.sin(leaves) * flight - G * flight**2 / 2, abs=NEAR)


@pytest.mark.parametrize("e", [0.2, 0.6])
def test_a_block_that_bounces_keeps_its_restitution_and_loses_speed_by_friction_in_each_impact(e: float) -> None:
    """Each impact reverses the falling speed v to e v. Along the wall, the impact removes mu (1 + e) v."""
    mu, fall, speed = 0.2, 0.1, 2.0
    touch = {"type": "point_on_curve", "curve": LINE, "friction": {"mu": mu}, "unilateral": {"starts": "open", "restitution": e}}
    v, first = np.sqrt(2 * G * fall), np.sqrt(2 * fall / G)
    second = first + 2 * e * v / G
    until = second + e * e * v / G
    out = last(scene(touch, [0.0, fall, 0.0], [speed, 0.0, 0.0]), until)
    rates = [speed, speed - mu * (1 + e) * v, speed - mu * (1 + e) ** 2 * v]
    assert out["fly.qd[1]"] == pytest.approx(rates[2], abs=NEAR)
    assert out["fly.q[1]"] == pytest.approx(np.dot(rates, np.diff([0.0, first, second, until])), abs=NEAR)
    assert out["fly.q[2]"] == pytest.approx(e**4 * fall, abs=NEAR)


def test_a_block_whose_bounces_end_slides_on() -> None:
    """All impacts together remove the friction coefficient times all impulses, and weight times time is the sum of impulses."""
    mu, fall, speed, e, until = 0.1, 0.02, 2.0, 0.3, 0.25
    touch = {"type": "point_on_curve", "curve": LINE, "friction": {"mu": mu}, "unilateral": {"starts": "open", "restitution": e}}
    out = last(scene(touch, [0.0, fall, 0.0], [speed, 0.0, 0.0]), until)
    assert out["fly.qd[1]"] == pytest.approx(speed - mu * G * until, abs=NEAR)
    assert out["fly.q[2]"] == pytest.approx(0.0, abs=NEAR)


def test_a_contact_with_restitution_by_impulses_is_refused_by_name() -> None:
    touch = {"type": "point_on_curve", "curve": LINE, "unilateral": {"restitution": 0.5, "starts": "open", "impact_law": "poisson"}}
    with pytest.raises(NotJudged, match="touch: restitution"):
        judged(scene(touch, [0.0, 0.1, 0.0], [0.0, 0.0, 0.0]), 0.1)
