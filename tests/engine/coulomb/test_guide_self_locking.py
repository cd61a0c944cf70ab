"""Wedging (theory, "Reference numbers", F5). A push parallel to a guide at offset e presses on each of its ends with F e/(2c). The
guide holds for any F when e ≥ c/μ.

The last tests concern simultaneous sliding along and about an axis."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.engine.mechanisms.ball_pendulum_and_arm import run
from tests.reference.contact_and_friction.contact_roots import journal
from tests.reference.contact_and_friction.friction_laws import Law
from tests.reference.scenes.random_scenes import random_loop
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

HALF_LENGTH, MU, MASS = 0.08, 0.4, 2.0
GUIDES = {
    "prismatic": {"half_length": HALF_LENGTH, "half_width": 0.03, "half_height": 0.02},
    "cylindrical": {"half_length": HALF_LENGTH, "radius": 0.02},
}
EXACT = 1e-9


def pushed(kind: str, force: float, offset: float, pin: str = "inboard", angle: float = 0.0, **rub) -> sm.Scene:
    """A carriage on a guide along x. The push along x acts at a point at the distance ``offset`` from the axis; ``angle``: position
    of this point about the axis."""
    point = (0.0, offset * math.cos(angle), offset * math.sin(angle))
    carriage = sm.Body(box=(0.1, 0.1, 0.1), mass=MASS, points={"push": point})
    friction = sm.Friction(**{"mu": MU, **GUIDES[kind], **rub})
    joint = sm.Joint(kind, "ground", "carriage", axis="x", pin=pin, friction=friction)
    push = sm.Force("force", "carriage.push", (force, 0.0, 0.0))
    return sm.Scene({"carriage": carriage}, {"guide": joint}, "wedge", gravity=(0.0, 0.0, 0.0), forces={"push": push})


def travel(r: Result) -> float:
    return float(abs(r["guide.q[1]"][-1]))


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("pin", ["inboard", "outboard"])
@pytest.mark.parametrize("force", [1e-3, -50.0, 1e6])
@pytest.mark.parametrize("kind", GUIDES)
def test_a_guide_wedges_beyond_half_length_over_mu_however_hard_it_is_pushed(kind: str, force: float, pin: str) -> None:
    angles = (0.0, 0.7) if kind == "cylindrical" else (0.0, math.pi / 2)
    for angle in angles:
        held = run(pushed(kind, force, HALF_LENGTH / MU * (1 + EXACT), pin, angle), 1.0, 0.5)
        assert travel(held) == 0.0
        assert not held.events
        gone = run(pushed(kind, force, HALF_LENGTH / MU * (1 - EXACT), pin, angle), 1.0, 0.5)
        # a = F (1 − μ e/c)/m; round-off of the difference is below 1e-4
        assert travel(gone) == pytest.approx(abs(force) * EXACT / MASS / 2, rel=1e-4)


@pytest.mark.parametrize("kind", GUIDES)
def test_a_guide_that_static_friction_holds_lets_go_at_static_friction(kind: str) -> None:
    edge = HALF_LENGTH / 0.6
    assert travel(run(pushed(kind, 10.0, edge * (1 + EXACT), mu_static=0.6), 0.1, 0.1)) == 0.0
    gone = run(pushed(kind, 10.0, edge * (1 - EXACT), mu_static=0.6), 0.1, 0.1)
    assert travel(gone) == pytest.approx(10.0 * (1 - MU / 0.6) / MASS * 0.1**2 / 2, rel=1e-7)


def test_a_guide_under_a_growing_push_slips_when_the_push_exceeds_friction() -> None:
    """The weight acts across the guide, and a growing push acts through the mass centre. The guide slips when F = μ m g."""
    scene = pushed("cylindrical", 1.0, 0.0)
    ramp = sm.Signal(table=sm.Table((0.0, 10.0), (0.0, 20.0)))
    push = sm.Force("force", "carriage", (ramp, 0.0, 0.0))
    r = run(sm.Scene(scene.bodies, scene.joints, "ramp", gravity=(0.0, 0.0, -9.81), forces={"push": push}), 6.0, 0.1)
    slip = r.events[0]
    assert slip.kind == "slip"
    assert slip.time == pytest.approx(MU * MASS * 9.81 / 2.0, rel=1e-9)
    assert np.all(r["guide.q[1]"][r.time <= slip.time] == 0.0)


def test_travel_and_turn_share_one_friction() -> None:
    """A loaded shaft is pushed along its axis and turned about this axis. The shaft slips in the direction in which sliding would
    begin. Numerical roots of the contact equations give the limit."""
    radius, direction = 0.02, 0.6
    load, spin, slide = np.array([0.0, 0.0, -MASS * 9.81]), math.sin(direction) / radius, math.cos(direction)
    out = journal(load, np.zeros(3), spin, slide, radius, HALF_LENGTH, Law("coulomb", MU))
    base = pushed("cylindrical", 1.0, 0.0)
    for share, moves in ((1 - EXACT, False), (1 + 1e-6, True)):
        loads: dict[str, sm.Applied] = {
            "push": sm.Force("force", "carriage", (share * abs(out.force), 0.0, 0.0)),
            "turn": sm.Torque("torque", "carriage", (share * abs(out.torque), 0.0, 0.0)),
        }
        r = run(sm.Scene(base.bodies, base.joints, "both", gravity=(0.0, 0.0, -9.81), forces=loads), 0.5, 0.5)
        assert (travel(r) > 0.0) is moves
        assert bool(r["guide.q[2]"][-1] > 0.0) is moves


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("rtol", [1e-7, 1e-9])
def test_friction_follows_the_sliding_that_turns_right_behind_a_reversal(rtol: float) -> None:
    """A cylindrical guide on a loop with one freedom comes to rest at 0.792 s. After its reversal, the guide slides along a line
    whose direction changes at once. Friction must follow this direction from the first step."""
    scene = random_loop("nov24b14", laws=("coulomb", "stribeck", "regularized", "lugre", "viscous")).scene
    how = {"until": 0.81, "every": 1e-3, "outputs": ("j2.friction.*", "j2.qd[1]")}
    r, exact = simulate(scene, rtol=rtol, method="rk8", **how), simulate(scene, rtol=1e-12, method="rk5", **how)
    behind = (r.time > 0.7925) & (r["j2.qd[1]"] < 0.0)
    for name in ("j2.friction.torque[1]", "j2.friction.force"):
        assert np.abs(r[name] - exact[name])[behind].max() <= 10 * rtol * np.abs(exact[name]).max()
