"""Joints compared with closed forms, and with the simpler joints of which they consist."""

from dataclasses import replace

import numpy as np
import pytest

from tests.reference import forward, solve, solve_scene
from tests.reference.mechanics.joint_constraints import TYPES
from tests.reference.scenes.random_scenes import random_tree
from trunnion.scene.data_classes import scene as sm

G = 9.81
LIGHT = {"mass": 1e-9, "inertia": (1e-12, 1e-12, 1e-12)}


def test_a_pendulum_has_the_acceleration_of_the_closed_form():
    m, arm, q, qd, J = 2.0, 0.7, 0.9, 1.3, 0.05
    body = sm.Body(mass=m, inertia=(J, J, J), center=(arm, 0, 0))
    joint = sm.Joint("revolute", "ground", "bob", axis="y", reference="x", start=sm.Start(q, qd))
    result = solve_scene(sm.Scene({"bob": body}, {"hinge": joint}), {"hinge": q}, {"hinge": qd})
    qdd = m * G * arm * np.cos(q) / (J + m * arm**2)
    force, torque = result.reaction["hinge"]
    x, z = arm * np.cos(q), -arm * np.sin(q)
    ax, az = -qdd * arm * np.sin(q) - qd**2 * x, -qdd * arm * np.cos(q) - qd**2 * z
    assert result.qdd["hinge"] == pytest.approx([qdd])
    assert force == pytest.approx([0, -m * ax, m * (az + G)])  # components in the joint frame (y, x, -z)
    assert torque == pytest.approx([0, 0, 0], abs=1e-12)


def test_a_nut_on_a_steep_screw_has_the_acceleration_of_the_closed_form():
    m, pitch = 3.0, 0.4
    body = sm.Body(sphere=0.2, mass=m)
    joint = sm.Joint("screw", "ground", "nut", axis="z", pitch=pitch)
    result = solve_scene(sm.Scene({"nut": body}, {"thread": joint}), {"thread": 0.3}, {"thread": 2.0})
    J, h = 0.4 * m * 0.04, pitch / (2 * np.pi)
    assert result.qdd["thread"] == pytest.approx([-m * G * h / (J + m * h * h)])


def test_a_conical_pendulum_on_a_ball_has_the_acceleration_of_the_closed_form():
    arm, angle = 0.8, 0.6
    spin = np.sqrt(G / (arm * np.cos(angle)))
    scene = sm.Scene(
        {"bob": sm.Body(mass=1.5, inertia=(0.0, 0.0, 0.0), center=(0, 0, -arm))},
        {"ball": sm.Joint("spherical", "ground", "bob")},
    )
    q = [np.cos(angle / 2), np.sin(angle / 2), 0, 0]
    result = solve_scene(scene, {"ball": q}, {"ball": [0, 0, spin]})
    radius = arm * np.sin(angle)
    assert result.acceleration["bob"] == pytest.approx([0, -(spin**2) * radius, 0], abs=1e-12)
    assert np.linalg.norm(result.reaction["ball"][0]) == pytest.approx(1.5 * G / np.cos(angle))


def frames(seed: int):
    rng = np.random.default_rng(seed)
    return [tuple(float(v) for v in x) for x in rng.normal(size=(2, 3))]


def one_body(seed: int):
    scene = random_tree(seed, 1, types=("free",), friction=0, devices=0, drives=0).scene
    return scene, frames(seed)


@pytest.mark.parametrize("pin", ["inboard", "outboard"])
@pytest.mark.parametrize("adams", ["exact", "adams"])
def test_universal_is_two_journals_on_a_massless_cross(pin, adams):
    """Friction, springs and drives are included. The cross transmits the forces of the devices of the other axis."""
    scene, (axis, ref) = one_body(5)
    rub = {"mu": 0.4, "law": "regularized", "v_eps": 1e-3, "normal_force": adams}
    spring, drive = sm.Spring(30.0, 0.2), sm.Drive(sm.Constant(1.5, 0.3))
    whole = sm.Joint(
        "universal",
        sm.Side("ground", (0.1, 0.2, 0.3), axis, ref),
        sm.Side("b1", "a", axis, ref),
        pin=pin,
        friction=sm.Friction(radius=(0.02, 0.03), half_length=(0.1, 0.15), **rub),
        spring=(spring, None),
        drive=(None, drive),
    )
    other = "outboard" if pin == "inboard" else "inboard"
    e1 = np.array(axis) / np.linalg.norm(axis)
    e2 = np.array(ref) - (np.array(ref) @ e1) * e1
    first = sm.Friction(radius=0.02, half_length=0.1, **rub)
    second = sm.Friction(radius=0.03, half_length=0.15, **rub)
    at = {"axis": tuple(float(x) for x in e2), "reference": tuple(float(x) for x in np.cross(e1, e2))}
    split = {
        "u1": sm.Joint("revolute", whole.inboard, "cross", axis, ref, pin=pin, friction=first, spring=spring),
        "u2": sm.Joint("revolute", "cross", "b1.a", **at, pin=other, friction=second, drive=drive),
    }
    q, qd = {"j": (0.5, 0.3), "u1": 0.5, "u2": 0.3}, {"j": (1.2, 1.5), "u1": 1.2, "u2": 1.5}
    one = solve(forward(replace(scene, joints={"j": whole}), {"j": q["j"]}, qd))
    cross = replace(scene, joints=split, bodies=scene.bodies | {"cross": sm.Body(**LIGHT)})
    two = solve(forward(cross, {"u1": 0.5, "u2": 0.3}, qd))
    assert one.qdd["j"] == pytest.approx([*two.qdd["u1"], *two.qdd["u2"]], rel=1e-6)
    assert one.friction["j"] == pytest.approx([*two.friction["u1"], *two.friction["u2"]], rel=1e-6)
    for a, b in zip(one.reaction["j"], two.reaction["u1"], strict=True):
        assert a == pytest.approx(b, rel=1e-6, abs=1e-6)
    pressed = [c.normal_force for n in ("u1", "u2") for c in two.contacts[n]]
    assert [c.normal_force for c in one.contacts["j"]] == pytest.approx(pressed, rel=1e-6)
    assert one.drive_effort["j"][1] == pytest.approx(two.drive_effort["u2"][0], rel=1e-6)
    normals = [c.normal for c in two.contacts["u1"]]
    assert np.allclose([c.normal for c in one.contacts["j"][:2]], normals, atol=1e-6)


CHAINS = {
    kind: [("prismatic" if d < 3 else "revolute", d % 3) for d in r.free]
    for kind, r in TYPES.items()
    if len(r.free) > 1 and not r.ball and not r.lead
}
"""Types whose freedoms are single travels and turns, one after the other: (simple type, axis)."""


@pytest.mark.parametrize("kind", CHAINS)
@pytest.mark.parametrize("backwards", [False, True])
def test_joint_is_the_chain_of_simpler_joints(kind, backwards):
    scene, (axis, ref) = one_body(7)
    e1 = np.array(axis) / np.linalg.norm(axis)
    e2 = np.array(ref) - (np.array(ref) @ e1) * e1
    frame = np.array([e1, e2 / np.linalg.norm(e2), 0 * e1])
    frame[2] = np.cross(frame[0], frame[1])
    n = len(CHAINS[kind])
    q, qd = np.random.default_rng(3).uniform(-1, 1, (2, n))
    ends = ("b1.a", "ground") if backwards else ("ground", "b1.a")
    one = solve_scene(replace(scene, joints={"j": sm.Joint(kind, *ends, axis, ref)}), {"j": q}, {"j": qd})
    stops = [ends[0], *(f"m{i}" for i in range(1, n)), ends[1]]
    joints = {}
    for i, (simple, k) in enumerate(CHAINS[kind]):
        a, r = (tuple(float(x) for x in frame[(k + d) % 3]) for d in (0, 1))
        joints[f"s{i}"] = sm.Joint(simple, stops[i], stops[i + 1], a, r)
    bodies = scene.bodies | {m: sm.Body(**LIGHT) for m in stops[1:-1]}
    start = ({f"s{i}": x[i] for i in range(n)} for x in (q, qd))
    many = solve_scene(replace(scene, joints=joints, bodies=bodies), *start)
    assert one.qdd["j"] == pytest.approx([many.qdd[f"s{i}"][0] for i in range(n)], rel=1e-6)
    assert one.acceleration["b1"] == pytest.approx(many.acceleration["b1"], rel=1e-6)
