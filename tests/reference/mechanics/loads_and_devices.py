"""Applied loads on bodies and devices in joints at one state: forces, powers and stored energy, in the world frame."""

from __future__ import annotations

import numpy as np

from tests.reference.mechanics.bodies_and_joint_frames import GROUND, frame, place
from tests.reference.mechanics.characteristic_curves import nonlinear
from tests.reference.mechanics.joint_constraints import directions, free_picker, freedoms, of
from tests.reference.mechanics.kinematics import State
from tests.reference.mechanics.rotation import cross, quaternion_from_matrix
from tests.reference.mechanics.time_signals import formula_value, load_value, per_freedom


class Applied:
    """Loads on the bodies at a state: force (world) and torque about the mass centre of every body. For each source: the
    non-conservative power, W, and the stored energy, J."""

    def __init__(self, state: State):
        self.state = state
        self.force = {b: np.zeros(3) for b in state.R}
        self.torque = {b: np.zeros(3) for b in state.R}
        self.power = {"loads": 0.0, "dampers": 0.0}
        self.stored = {"gravity": 0.0, "springs": 0.0}
        self._gravity()
        for load in state.scene.forces.values():
            getattr(self, f"_{load.type}")(load)

    def push(self, body: str, point: np.ndarray, force: np.ndarray) -> None:
        """Apply a force to a body at a point of the world."""
        self.force[body] += force
        self.torque[body] += cross(point - self.state.c[body], force)

    def _gravity(self) -> None:
        g = np.array(self.state.scene.gravity, float)
        for body, part in self.state.parts.items():
            self.force[body] += part.mass * g
            self.stored["gravity"] -= part.mass * g @ self.state.c[body]

    def _vector(self, load, values) -> tuple[str, np.ndarray | None, np.ndarray]:
        body, local = place(self.state.scene, load.on)
        v = np.array([load_value(self.state.scene, x, self.state.t) for x in values])
        return body, local, self.state.R[body] @ v if load.frame == "body" else v

    def _force(self, load) -> None:
        body, local, f = self._vector(load, load.force)
        p, v = self.state.point(body, self.state.part(body).center if local is None else local)
        self.push(body, p, f)
        self.power["loads"] += f @ v

    def _torque(self, load) -> None:
        body, _, m = self._vector(load, load.torque)
        self.torque[body] += m
        self.power["loads"] += m @ self.state.omega[body]

    def _spring_damper(self, load) -> None:
        ends = []
        for text in load.between:
            body, local = place(self.state.scene, text)
            ends.append((body, *self.state.point(body, np.zeros(3) if local is None else local)))
        (b1, p1, v1), (b2, p2, v2) = ends
        length = np.linalg.norm(p2 - p1)
        if length == 0.0:
            raise ValueError(f"the ends of the spring between {load.between} coincide")
        along = (p2 - p1) / length
        rate = along @ (v2 - v1)
        stretch = length - load.length
        more, lost, kept = nonlinear(load.nonlinear, length, rate)
        pull = load.stiffness * stretch + load.damping * rate + more
        self.push(b1, p1, pull * along)
        self.push(b2, p2, -pull * along)
        self.power["dampers"] += lost - load.damping * rate**2
        self.stored["springs"] += load.stiffness * stretch**2 / 2 + kept

    def _drag(self, load) -> None:
        body, local = place(self.state.scene, load.on)
        p, v = self.state.point(body, self.state.part(body).center if local is None else local)
        f = -load.density * load.coefficient * load.area / 2 * np.linalg.norm(v) * v
        self.push(body, p, f)
        self.power["dampers"] += f @ v

    def _field(self, load) -> None:
        body, local = place(self.state.scene, load.on)
        p, v = self.state.point(body, self.state.part(body).center if local is None else local)
        at = dict(zip("xyz", p, strict=True))
        f = np.array([0.0 if x is None else formula_value(x.formula, at) for x in (load.fx, load.fy, load.fz)], float)
        self.push(body, p, f)
        self.power["loads"] += f @ v

    def _point_gravity(self, load) -> None:
        attractor, q, _ = self._end(load.towards)
        to = q - self.state.c[load.on]
        r = np.linalg.norm(to)
        f = load.gm * self.state.parts[load.on].mass / r**3 * to
        self.push(load.on, self.state.c[load.on], f)
        self.push(attractor, q, -f)
        self.stored["gravity"] -= f @ to

    def _bushing(self, load) -> None:
        (a, p, _), (b, q, v) = (self._end(text) for text in load.between)
        axes = frame(load.axis, load.reference)
        E, F = (self._turn(body) @ axes for body in (a, b))
        k, c, turning, slowing = (
            np.array(x) if isinstance(x, tuple) else np.full(3, x)
            for x in (load.stiffness, load.damping, load.turning_stiffness, load.turning_damping)
        )
        wa, wb = (np.zeros(3) if body == GROUND else self.state.omega[body] for body in (a, b))
        seen = v - (np.zeros(3) if a == GROUND else self.state.v[a] + cross(wa, q - self.state.c[a]))
        offset, rate, spin = E.T @ (q - p), E.T @ seen, E.T @ (wb - wa)
        w, *rest = quaternion_from_matrix(E.T @ F)
        x = np.array(rest)
        f = E @ -(k * offset + c * rate)
        m = E @ -(2 * (w * turning * x + cross(x, turning * x)) + slowing * spin)
        for body, sign in ((a, -1.0), (b, 1.0)):
            if body != GROUND:
                self.push(body, q, sign * f)
                self.torque[body] += sign * m
        self.power["dampers"] -= c @ rate**2 + slowing @ spin**2
        self.stored["springs"] += k @ offset**2 / 2 + 2 * turning @ x**2

    def _end(self, text: str) -> tuple[str, np.ndarray, np.ndarray]:
        body, local = place(self.state.scene, text)
        return body, *self.state.point(body, np.zeros(3) if local is None else local)

    def _turn(self, body: str) -> np.ndarray:
        return np.eye(3) if body == GROUND else self.state.R[body]

    def devices(self, name: str) -> np.ndarray:
        """Effort of a joint's springs, damping, stops and efforts along its freedoms, on the outboard part. The function adds
        powers and energies to the applied loads."""
        effort, power, stored = joint_devices(self.state, name)
        free = directions(self.state, name).pick(free_picker(self.state.scene.joints[name]))
        pose = self.state.joint_pose(name)
        f, m = effort @ free.F, effort @ free.T
        for body, sign in ((pose.outboard, 1.0), (pose.inboard, -1.0)):
            self.push(body, pose.p_out, sign * f)
            self.torque[body] += sign * m
        for key, value in power.items():
            self.power[key] = self.power.get(key, 0.0) + value
        for key, value in stored.items():
            self.stored[key] = self.stored.get(key, 0.0) + value
        return effort

    def stacked(self) -> np.ndarray:
        """Forces and torques of all bodies as one column, including gyroscopic torques, without the ground."""
        out = []
        for body, part in self.state.parts.items():
            R, w = self.state.R[body], self.state.omega[body]
            inertia = R @ part.inertia @ R.T
            out += [self.force[body], self.torque[body] - cross(w, inertia @ w)]
        return np.concatenate(out) if out else np.zeros(0)


def scalar_freedoms(joint) -> int:
    """Number of leading freedoms whose coordinate is a number. (The other freedoms belong to a quaternion.)"""
    return of(joint.type).scalars


def joint_devices(state: State, name: str) -> tuple[np.ndarray, dict, dict]:
    """Effort along the freedoms (on the outboard part), non-conservative powers, and stored energy."""
    joint, n = state.scene.joints[name], freedoms(state.scene.joints[name].type)
    q, qd, numbers = state.q[name], state.qd[name], scalar_freedoms(joint)
    effort, stored = np.zeros(n), {"joint_springs": 0.0, "end_stops": 0.0}
    power = {"joint_damping": 0.0, "effort": 0.0, "end_stops": 0.0}
    lists = [per_freedom(x, n) for x in (joint.spring, joint.damping, joint.end_stops, joint.effort, joint.nonlinear)]
    for k, (spring, damping, stops, load, more) in enumerate(zip(*lists, strict=True)):
        if (spring or stops) and k >= numbers:
            raise ValueError(f"{name}: no scalar coordinate for freedom {k + 1}")
        if spring:
            effort[k] -= spring.stiffness * (q[k] - spring.rest)
            stored["joint_springs"] += spring.stiffness * (q[k] - spring.rest) ** 2 / 2
        if damping:
            effort[k] -= damping * qd[k]
            power["joint_damping"] -= damping * qd[k] ** 2
        force, lost, kept = nonlinear(more, q[k] if k < numbers else 0.0, qd[k])
        effort[k] -= force
        stored["joint_springs"] += kept
        power["joint_damping"] += lost
        if stops:
            push, elastic = stop_force(stops, q[k], qd[k])
            effort[k] += push
            stored["end_stops"] += elastic["energy"]
            power["end_stops"] += (push - elastic["force"]) * qd[k]
        value = load_value(state.scene, load, state.t)
        effort[k] += value
        power["effort"] += value * qd[k]
    return effort, power, stored


def stop_force(stops, q: float, qd: float) -> tuple[float, dict]:
    """Force of stops after Hunt and Crossley, stiffness*depth*(1 + damping*depth rate), never a pull; also the elastic part of the
    force."""
    total, elastic, energy = 0.0, 0.0, 0.0
    for limit, sign in ((stops.lower, 1.0), (stops.upper, -1.0)):
        depth = 0.0 if limit is None else sign * (limit - q)
        if depth > 0.0:
            total += sign * max(stops.stiffness * depth * (1 - stops.damping * sign * qd), 0.0)
            elastic += sign * stops.stiffness * depth
            energy += stops.stiffness * depth**2 / 2
    return total, {"force": elastic, "energy": energy}


def kinetic_energy(state: State) -> float:
    """Sum of m v.v/2 + w.I w/2 over the bodies, and of a rate^2/2 over the freedoms that turn rotors."""
    total = 0.0
    for name, joint in state.scene.joints.items():
        rates = np.ravel(state.qd[name])
        total += sum((a or 0.0) * rate**2 / 2 for a, rate in zip(per_freedom(joint.rotor_inertia, len(rates)), rates, strict=True))
    for body, part in state.parts.items():
        w = state.R[body].T @ state.omega[body]
        total += part.mass * state.v[body] @ state.v[body] / 2 + w @ part.inertia @ w / 2
    return total
