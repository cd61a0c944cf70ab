"""Reported reactions keep every body in balance. Drives follow their signals. Random scenes contain every feature."""

from itertools import product

import numpy as np
import pytest

from tests.reference import solve
from tests.reference.mechanics.loads_and_devices import Applied
from tests.reference.mechanics.time_signals import drive_motion, load_value
from tests.reference.scenes import random_scenes as rs
from tests.reference.scenes.random_components import RUBBING_TYPES, drive, load


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(12))
def test_reactions_and_loads_move_every_body(seed):
    case = rs.random_tree(seed, t=0.4) if seed % 2 else rs.random_loop(seed, t=0.4)
    state = case.state()
    result, applied = solve(state), Applied(state)
    force, torque = dict(applied.force), dict(applied.torque)
    for name, joint in case.scene.joints.items():
        pose = state.joint_pose(name)
        f, m = (pose.A_in @ x for x in result.reaction[name])
        centre = pose.p_in if joint.pin == "inboard" else pose.p_out
        for body, sign in ((pose.inboard, 1.0), (pose.outboard, -1.0)):
            force[body] = force[body] + sign * f
            torque[body] = torque[body] + sign * (m + np.cross(centre - state.c[body], f))
    for body, part in case.scene.bodies.items():
        mass, J = state.parts[body].mass, state.R[body] @ state.parts[body].inertia @ state.R[body].T
        w = state.omega[body]
        assert np.allclose(force[body], mass * result.acceleration[body], atol=1e-8), part
        assert np.allclose(torque[body], J @ result.angular[body] + np.cross(w, J @ w), atol=1e-8)


@pytest.mark.parametrize("seed", range(8))
def test_drives_are_followed_and_their_rates_are_derivatives(seed):
    rng, h = np.random.default_rng(seed), 1e-4
    signal, _, _ = drive(rng, 0.0)
    for t in (0.05, 0.37, 0.9, 5.0):
        (a, va, _), (_, v, acc), (b, vb, _) = (drive_motion(signal, t + x) for x in (-h, 0, h))
        assert (b - a) / (2 * h) == pytest.approx(v, abs=1e-5)
        assert (vb - va) / (2 * h) == pytest.approx(acc, abs=1e-2 if abs(vb - va) > 1e-9 else 1e-6)
    case = rs.random_tree(seed, 3, types=("revolute", "cylindrical", "planar", "free"), drives=1.0, t=0.37)
    result = solve(case.state())
    for name, efforts in result.drive_effort.items():
        entry = case.scene.joints[name].drive
        for k in efforts:
            one = entry[k] if isinstance(entry, tuple) else entry
            q, v, acc = drive_motion(one, 0.37)
            assert (case.q[name][k], case.qd[name][k]) == (q, v)
            assert result.qdd[name][k] == pytest.approx(acc, abs=1e-9)


def test_loads_hold_their_ends():
    rng = np.random.default_rng(0)
    scene = rs.random_tree(0).scene
    for _ in range(20):
        signal = load(rng, 2.0)
        assert np.isfinite(load_value(scene, signal, 0.3))
        if getattr(signal, "ramp", None):
            r = signal.ramp
            assert load_value(scene, signal, -1.0) == r.start
            assert load_value(scene, signal, 9.0) == r.end


def test_random_scenes_contain_every_type_from_both_sides_with_either_pin():
    """Joints have friction if the type can have friction. ``covering`` raises an error if it does not find a feature."""

    def told(joint, kind, pin, outward):
        ends = [x if isinstance(x, str) else x.body for x in (joint.inboard, joint.outboard)]
        inner, outer = (0 if x.startswith("ground") else int(x.partition(".")[0][1:]) for x in ends)
        return (joint.type, joint.pin, inner < outer) == (kind, pin, outward) and bool(joint.friction) >= (kind in RUBBING_TYPES)

    claims = {
        f"{kind}, pin {pin}, {outward}": lambda c, how=(kind, pin, outward): any(told(j, *how) for j in c.scene.joints.values())
        for kind, pin, outward in product(rs.USUAL_TYPES, ("inboard", "outboard"), (True, False))
    }
    rubbing = {j.type for case in rs.covering(claims, rs.random_tree).values() for j in case.scene.joints.values() if j.friction}
    assert rubbing == set(RUBBING_TYPES)
