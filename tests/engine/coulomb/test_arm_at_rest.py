"""A spatial arm of six joints that friction holds. The arm stays at rest, and slips at the limit given by independent statics."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.engine.mechanisms.ball_pendulum_and_arm import arm, run
from tests.reference.contact_and_friction.contact_roots import journal
from tests.reference.contact_and_friction.friction_laws import Law
from tests.reference.mechanics.rotation import rotation_about
from trunnion.analysis.static_bounds.start_pose_statics import hold
from trunnion.scene.data_classes import scene as sm

LENGTH, RADIUS, HALF, MU, WEIGHT = 0.3, 0.05, 0.1, 0.3, 9.81 * 2700.0 * 0.05**2 * 0.3
AXES = {"x": 0, "y": 1, "z": 2}


def shares(tilt: float, mu: float = MU, load: float = 0.0) -> np.ndarray:
    """Required over available friction of every joint, from sums of weights and moments, and from numerical roots of the journal's
    contact equations. load: force along x at the tip, N."""
    R, at, joints, centres = np.eye(3), np.zeros(3), [], []
    for k, axis in enumerate(arm_axes()):
        R = R @ rotation_about(AXES[axis], tilt * (-1) ** k)
        up = R @ np.array([0.0, 0.0, LENGTH])
        joints.append((at, R[:, [AXES[axis], (AXES[axis] + 1) % 3, (AXES[axis] + 2) % 3]]))
        centres.append(at + up / 2)
        at = at + up
    out = []
    for k, (p, frame) in enumerate(joints):
        force = np.array([load, 0.0, -WEIGHT * (6 - k)])
        torque = np.cross(at - p, [load, 0.0, 0.0]) + sum(np.cross(c - p, [0.0, 0.0, -WEIGHT]) for c in centres[k:])
        fc, mc = frame.T @ force, frame.T @ torque
        most = abs(journal(fc, mc, np.sign(mc[0]) or 1.0, 0.0, RADIUS, HALF, Law("coulomb", mu)).torque)
        out.append(abs(mc[0]) / most)
    return np.array(out)


def arm_axes() -> tuple[str, ...]:
    from tests.engine.mechanisms.ball_pendulum_and_arm import ARM_AXES

    return ARM_AXES


@cache
def limit(mu: float = MU) -> float:
    return float(brentq(lambda a: shares(a, mu).max() - 1.0, 1e-4, 0.1, xtol=1e-15))


def test_statics_of_the_arm_agree_with_the_engine() -> None:
    got = [p.share for p in hold(arm(0.011)).pairs]
    assert got == pytest.approx(list(shares(0.011)), rel=1e-11, abs=1e-12)


def test_the_arm_holds_its_weight_for_ever() -> None:
    tilt = 0.8 * limit()
    r = run(arm(tilt), 1000.0, 100.0)
    assert not r.events
    for k in range(1, 7):
        q = r[f"j{k}.q[1]"]
        assert np.degrees(np.abs(q - tilt * (-1) ** (k - 1)).max()) <= 1e-12
        assert np.all(r[f"j{k}.qd[1]"] == 0.0)


@pytest.mark.parametrize(("mu", "mu_static"), [(MU, None), (0.2, MU)])
def test_the_arm_holds_up_to_the_tilt_that_statics_allows(mu: float, mu_static: float | None) -> None:
    for share, holds in ((1 - 1e-9, True), (1 + 1e-9, False)):
        scene = arm(share * limit(), mu, mu_static)
        assert hold(scene).holds is holds
        assert bool(run(scene, 0.01, 0.01, 1e-6)["j2.qd[1]"][-1] == 0.0) is holds


def test_a_growing_load_lets_the_arm_go_when_its_first_joint_reaches_its_limit() -> None:
    tilt = 0.5 * limit()
    force = brentq(lambda f: shares(tilt, load=f).max() - 1.0, 0.0, 100.0, xtol=1e-14)
    first = int(np.argmax(shares(tilt, load=force)))
    ramp = sm.Signal(table=sm.Table((0.0, 10.0), (0.0, 10.0 * force)))
    scene = arm(tilt, load=sm.Force("force", "b6.b", (ramp, 0.0, 0.0)))
    r = run(scene, 1.01, 0.25)
    assert (r.events[0].kind, r.events[0].joint) == ("slip", f"j{first + 1}")
    assert r.events[0].time == pytest.approx(1.0, rel=1e-9)
    assert math.isclose(float(np.ptp(r["j2.q[1]"][r.time < 1.0])), 0.0, abs_tol=0.0)
