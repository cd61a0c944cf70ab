"""Friction of one joint as a function of its reaction, for each joint type with friction and the pin on either side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.reference.contact_and_friction import contact_roots as ct
from tests.reference.contact_and_friction.friction_laws import is_adams, law_of
from tests.reference.mechanics.joint_constraints import directions, of
from tests.reference.mechanics.kinematics import State
from tests.reference.mechanics.rotation import cross


@dataclass(frozen=True)
class Pin:
    """A joint seen from the part that carries the pin: sign (+1 inboard, -1 outboard), frame and point of this part."""

    sign: float
    A: np.ndarray
    point: np.ndarray


def pin_of(state: State, name: str) -> Pin:
    """The part that carries the pin."""
    pose = state.joint_pose(name)
    if state.scene.joints[name].pin == "inboard":
        return Pin(1.0, pose.A_in, pose.p_in)
    return Pin(-1.0, pose.A_out, pose.p_out)


def ends_of(pose, joint) -> np.ndarray:
    """The point from which the ends of the contacts are measured. It is on the part that has the ends, or in the middle of the
    overlap."""
    if joint.ends == "overlap":
        low, high = _touching(pose, joint)
        return pose.p_in + 0.5 * (low + high) * pose.A_in[:, 0]
    return pose.p_in if (joint.ends or joint.pin) == "inboard" else pose.p_out


def _touching(pose, joint) -> tuple[float, float]:
    """The interval in which both parts overlap, along the axis from the inboard point."""
    away, g = float(pose.A_in[:, 0] @ (pose.p_out - pose.p_in)), joint.friction
    inner, outer = np.array([-1, 1]) * g.inboard_length / 2, away + np.array([-1, 1]) * g.outboard_length / 2
    return max(inner[0], outer[0]), min(inner[1], outer[1])


def sized(pose, joint):
    """The joint with the half length of its contacts at this pose."""
    if joint.ends != "overlap":
        return joint
    low, high = _touching(pose, joint)
    return replace(joint, friction=replace(joint.friction, half_length=(high - low) / 2))


def rates_of(state: State, name: str) -> np.ndarray:
    """Rates of the bearing relative to the pin, in the pin's frame: travel (3), then turn (3)."""
    six, pin = directions(state, name), pin_of(state, name)
    world = six.F[:3].T @ six.rate[:3], six.T[3:].T @ six.rate[3:]
    return pin.sign * np.concatenate([pin.A.T @ x for x in world])


def pair(value) -> tuple[float, float]:
    """Two numbers, one for each journal of a universal joint. A single value stands for both."""
    return tuple(value) if isinstance(value, (tuple, list)) else (value, value)


def _ball(joint, fc, mc, rates, law, adams) -> ct.Outcome:
    radius = joint.friction.radius
    out = ct.ball(fc, rates[3:], radius, law)
    return replace(out, torque=ct.adams_ball(fc, rates[3:], radius, law)) if adams else out


def _sleeve(joint, fc, mc, rates, law, adams) -> ct.Outcome:
    g, sdot = joint.friction, rates[0]
    out = ct.sleeve(fc, mc, sdot, g.half_width, g.half_height, g.half_length, law)
    return replace(out, force=law.slope(abs(sdot)) * sdot * np.linalg.norm(fc[1:])) if adams else out


def _shaft(joint, fc, mc, rates, law, adams) -> ct.Outcome:
    g = joint.friction
    out = ct.journal(fc, mc, rates[3], rates[0], g.radius, g.half_length, law)
    return ct.adams_journal(out, fc, rates[3], rates[0], g.radius, law, axial=False) if adams else out


def _journal(joint, fc, mc, rates, law, adams) -> ct.Outcome:
    g = joint.friction
    out = ct.journal(fc, mc, rates[3], 0.0, g.radius, g.half_length, law, g.thrust_radius or 0.0)
    return ct.adams_journal(out, fc, rates[3], 0.0, g.radius, law, axial=True) if adams else out


PAIRS = {
    "ball": (_ball, lambda out: out.torque),
    "sleeve": (_sleeve, lambda out: np.array([out.force])),
    "shaft": (_shaft, lambda out: np.array([out.force, out.torque])),
    "journal": (_journal, lambda out: np.array([out.torque])),
}
"""By ``Reference.rubs``: the function that solves the sliding pair, and the function that maps the outcome's friction on the pin to
the freedoms."""


class Rubbing:
    """A joint with friction at one state. ``friction`` gives the friction on the inboard part along each freedom, and the contacts
    with normals in the inboard joint frame. Its arguments are

    ``wrench``   constraint and friction on the inboard part: force, torque at the outboard point (world)
    ``devices``  springs, drives and so on along the freedoms, on the outboard part
    ``scale``    share of the friction (for the continuation from zero)
    """

    def __init__(self, state: State, name: str):
        self.joint, self.pose, self.pin = state.scene.joints[name], state.joint_pose(name), pin_of(state, name)
        self.rubs = of(self.joint.type).rubs
        if self.rubs not in (*PAIRS, "cross"):
            raise NotImplementedError(f"{name}: no friction in a {self.joint.type} joint")
        self.six = directions(state, name)
        self.law = law_of(state.scene, self.joint.friction)
        self.adams = is_adams(state.scene, self.joint.friction)
        self.qd = state.qd[name]
        self.rates = rates_of(state, name)

    def friction(self, wrench, devices, scale: float = 1.0) -> tuple[np.ndarray, list]:
        """Friction on the inboard part along each freedom, and the contacts."""
        law = replace(self.law, scale=scale)
        if self.rubs == "cross":
            return self._universal(wrench, devices, law)
        sign, A = self.pin.sign, self.pin.A
        arm = self.pose.p_out - ends_of(self.pose, self.joint)
        fc, mc = sign * A.T @ wrench[:3], sign * A.T @ (wrench[3:] + cross(arm, wrench[:3]))
        solver, along = PAIRS[self.rubs]
        out = solver(sized(self.pose, self.joint), fc, mc, self.rates, law, self.adams)
        back = self.pose.A_in.T @ A
        seen = [replace(c, normal=back @ c.normal) for c in out.contacts]
        if self.rubs != "ball":
            return sign * along(out), seen
        n = seen[0].normal
        angle, elevation = float(np.arctan2(n[2], n[0])), float(np.arcsin(np.clip(n[1], -1, 1)))
        return sign * back @ along(out), [replace(seen[0], angle=angle, elevation=elevation)]

    def _universal(self, wrench, devices, law) -> tuple[np.ndarray, list]:
        """Friction of a universal joint by (141)-(150) with errata: journals about u1 and u2 on either side of a massless cross.

        Pin inboard: pins on the inboard and the outboard part. Pin outboard: both pins on the cross.
        """
        g, C = self.joint.friction, self.six.T[3:]
        radius, half = pair(g.radius), pair(g.half_length)
        friction, seen = np.zeros(2), []
        for k in range(2):
            f, m = C @ wrench[:3], C @ wrench[3:]
            m[1 - k] -= devices[1 - k]  # the cross transmits the devices of the other axis
            sign = self.pin.sign * (1.0 if k == 0 else -1.0)
            turn = [0, 1, 2] if k == 0 else [1, 2, 0]
            fc, mc, omega = sign * f[turn], sign * m[turn], sign * self.qd[k]
            out = ct.journal(fc, mc, omega, 0.0, radius[k], half[k], law)
            if self.adams:
                out = ct.adams_journal(out, fc, omega, 0.0, radius[k], law, axial=True)
            friction[k] = sign * out.torque
            back = self.pose.A_in.T @ C[turn].T
            seen += [replace(c, normal=back @ c.normal) for c in out.contacts]
        return friction, seen


def reaction(state: State, name: str, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Convert a joint's wrench from the outboard point and world axes to the point of the pin's part and the inboard joint
    frame."""
    pose, point = state.joint_pose(name), pin_of(state, name).point
    return pose.A_in.T @ wrench[:3], pose.A_in.T @ (wrench[3:] + cross(pose.p_out - point, wrench[:3]))
