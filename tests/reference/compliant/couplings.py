"""Couplings of motions as springs along their rows: gears, belts, racks, bevel gears, screws, rods, and joints that follow other
joints.

The displacement of a row is a separate state, integrated from its rate; teeth and turns are not counted. A row presses with the
stiffness times this displacement plus a share of its rate. Teeth with friction push their wheels apart and transmit a friction
torque. """

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.reference.compliant.friction_laws import Laws, NotJudged, Signals
from tests.reference.compliant.joint_springs_and_friction import Level, arm, is_given, thread_arm
from tests.reference.compliant.positions_and_rates import Forces, Frames, Motion, cross, dot
from tests.reference.mechanics.joint_constraints import lead
from trunnion.scene.data_classes import scene as sm

WHEELS = ("gear", "belt", "rack", "bevel_gear")


def radii_of(joint) -> list[float]:
    """Radii of the wheels of a pair. They are negative for a ring, and for the larger of two pulleys whose belt is not crossed."""
    if joint.radii is not None:
        r = [float(x) for x in joint.radii]
    else:
        size = joint.module / 2 if joint.module is not None else joint.pitch / (2 * np.pi)
        r = [float(z) * size for z in joint.teeth]
    opposite = joint.internal or (joint.type == "belt" and not joint.crossed)
    if len(r) == 2 and opposite:
        r[int(np.argmax(r))] *= -1.0
    return r


class Teeth:
    """Teeth with friction. They add forces to the force along their row."""

    def __init__(self, scene, names: list[str], level: Level):
        joints = [scene.joints[n] for n in names]
        self.rubs = np.array([j.friction is not None for j in joints])
        angles = [j.friction.pressure_angle if j.friction else 0.0 for j in joints]
        self.angle = np.array([a or 0.0 for a in angles])
        self.arm = np.array([np.pi * (j.module or 0.0) * np.cos(a) / 4 for j, a in zip(joints, self.angle, strict=True)])
        some = [n for n, r in zip(names, self.rubs, strict=True) if r]
        self.at = np.flatnonzero(self.rubs)
        arms = np.maximum(self.arm[self.at], 1e-12)
        self.law = Laws(scene, [scene.joints[n].friction for n in some], arms * level.rate)

    def act(self, m: Motion, push: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(separating force, friction torque on the inboard wheel along the relative rate, power taken)."""
        apart, torque = np.abs(push) * np.tan(self.angle), np.zeros_like(push)
        if len(self.at):
            f, v = np.abs(push[:, self.at]) / np.cos(self.angle[self.at]), self.arm[self.at] * rate[:, self.at]
            torque[:, self.at] = self.law.slope(m.t, np.abs(v)) * v * self.arm[self.at] * f
        return apart, torque, (torque * rate).sum(-1)


class Wheels:
    """Wheels that roll on each other or are joined by a belt."""

    def __init__(self, scene, frames: Frames, level: Level, names: list[str]):
        self.level, self.names = level, names
        joints = [scene.joints[n] for n in names]
        self.kind = np.array([j.type for j in joints])
        self.sides = frames.sides(names)
        r = [radii_of(j) for j in joints]
        self.r1 = np.array([x[0] for x in r])
        self.r2 = np.array([x[1] if len(x) > 1 else 0.0 for x in r])
        self.teeth = Teeth(scene, names, level)
        arms = np.array([arm(frames, n) for n in names])
        # A belt has no contacts. A pair of contacts at the arm carries force and torque about the inboard pulley.
        soft = np.where(self.kind != "belt", 1.0, 1.0 + (self.r1 / arms) ** 2)
        self.k = 2 * level.stiffness * np.array([(j.stiffness or 1e8) / 1e8 for j in joints]) / soft

    def rows(self, m: Motion) -> tuple:
        """(rate, direction, inner point, torque per force on the inner wheel, outer point, torque per force on the outer wheel,
        axis of sliding, direction in which the wheels are pushed apart, relative rate about the axis of sliding)."""
        s = self.sides.pairs(m)
        a, b = s.A[..., 0], s.B[..., 0]
        across = s.q - s.p
        # Wheels about parallel axes, and belts.
        p = across - dot(across, a)[..., None] * a
        p2 = np.maximum(dot(p, p), 1e-30)
        k = ((self.r1 + self.r2) / p2)[..., None] * cross(a, p)
        inner, outer = s.p, s.p + p
        t1, t2 = -self.r1[:, None] * a, -self.r2[:, None] * a
        apart = np.sign(self.r1 + self.r2)[:, None] * p / np.sqrt(p2)[..., None]
        slip = a
        rack, bevel = self.kind == "rack", self.kind == "bevel_gear"
        if rack.any():
            n = across - dot(across, a)[..., None] * a
            n = n - dot(n, b)[..., None] * b
            n = n / np.sqrt(np.maximum(dot(n, n), 1e-30))[..., None]
            at = s.p + self.r1[:, None] * n
            k, inner, outer, apart = _where(rack, (b, at, at, n), (k, inner, outer, apart))
        if bevel.any():
            both = cross(a, b)
            sine = np.sqrt(np.maximum(dot(both, both), 1e-30))[..., None]
            g = (self.r2[:, None] * a + self.r1[:, None] * b) / sine
            turn = g / np.sqrt(np.maximum(dot(g, g), 1e-30))[..., None]
            away = cross(turn, both / sine)
            away = away * np.sign(dot(away, b))[..., None]
            new = (both / sine, s.p + g, s.q + g, away, turn)
            k, inner, outer, apart, slip = _where(bevel, new, (k, inner, outer, apart, slip))
        plain = ~(rack | bevel)
        t1, t2 = t1 * plain[:, None], t2 * plain[:, None]
        one, two = self.sides.one, self.sides.two
        v1 = m.v[:, one] + cross(m.w[:, one], inner - m.c[:, one])
        v2 = m.v[:, two] + cross(m.w[:, two], outer - m.c[:, two])
        rate = dot(k, v2 - v1) + dot(t2, m.w[:, two]) + dot(t1, m.w[:, one])
        # The apexes of cones are a distance apart along k, which turns with the axes. The rate includes this turning, because
        # meshing teeth depend on angles and positions, not on paths.
        if bevel.any():
            turns = cross(cross(m.w[:, one], a), b) + cross(a, cross(m.w[:, two], b))
            rate = rate + np.where(bevel, dot(turns - dot(k, turns)[..., None] * k, across) / sine[..., 0], 0.0)
        return rate, k, inner, t1, outer, t2, slip, apart, dot(s.turn, slip)

    def rate(self, m: Motion) -> np.ndarray:
        """The rates of the rows."""
        return self.rows(m)[0]

    def act(self, m: Motion, rolled: np.ndarray, out: Forces) -> np.ndarray:
        """Add the forces. Returns the rates of the rows."""
        rate, k, inner, t1, outer, t2, slip, apart, sliding = self.rows(m)
        push = -self.k * (rolled + self.level.delay * rate)
        away, torque, taken = self.teeth.act(m, push, sliding)
        f = push[..., None] * k
        out.push(self.sides.two, outer, f + away[..., None] * apart, push[..., None] * t2 - torque[..., None] * slip)
        out.push(self.sides.one, inner, -f - away[..., None] * apart, push[..., None] * t1 + torque[..., None] * slip)
        out.taken += taken
        return rate


def _where(which: np.ndarray, new: tuple, old: tuple) -> list[np.ndarray]:
    return [np.where(which[:, None], a, b) for a, b in zip(new, old, strict=True)]


class Rods:
    """Rods as springs between their points. Rods have no states: the poses give their stretch."""

    def __init__(self, scene, frames: Frames, level: Level, names: list[str]):
        joints = [scene.joints[n] for n in names]
        self.sides = frames.sides(names)
        self.length = np.array([j.length for j in joints], float)
        k = [2 * level.stiffness * (j.stiffness or 1e8) / 1e8 for j in joints]
        self.points, self.springs = {}, {}
        for n, j, stiffness in zip(names, joints, k, strict=True):
            f = frames.frames[n]
            for body, point in ((f.inboard, f.p_in), (f.outboard, f.p_out)):
                self.points.setdefault(body, {})[n] = tuple(map(float, point))
            ends = f"{f.inboard}.{n}", f"{f.outboard}.{n}"
            self.springs[n] = sm.SpringDamper("spring_damper", ends, stiffness, stiffness * level.delay, j.length)

    def in_scene(self, scene):
        """The scene with the springs in place of the rods, for the forces."""
        bodies = {n: replace(b, points=b.points | self.points.get(n, {})) for n, b in scene.bodies.items()}
        ground = replace(scene.ground, points=scene.ground.points | self.points.get("ground", {}))
        return replace(scene, bodies=bodies, ground=ground, forces=scene.forces | self.springs)

    def stretch(self, m: Motion) -> tuple[np.ndarray, np.ndarray]:
        """The stretches of the rods, m, and their rates."""
        s = self.sides.pairs(m)
        across = s.q - s.p
        far = np.sqrt(dot(across, across))
        one, two = self.sides.one, self.sides.two
        v1 = m.v[:, one] + cross(m.w[:, one], s.p - m.c[:, one])
        v2 = m.v[:, two] + cross(m.w[:, two], s.q - m.c[:, two])
        return far - self.length, dot(across, v2 - v1) / far


class Screws:
    """Threads, in which travel follows angle. Flanks have the friction of the theory's "Thread"."""

    def __init__(self, scene, frames: Frames, level: Level, names: list[str]):
        self.level, self.names = level, names
        joints = [scene.joints[n] for n in names]
        self.sides = frames.sides(names)
        self.lead = np.array([lead(j) for j in joints])
        arms = np.array([thread_arm(frames, n, j) for n, j in zip(names, joints, strict=True)])
        self.k = 2 * level.stiffness * np.array([(j.stiffness or 1e8) / 1e8 for j in joints]) / (1 + (self.lead / arms) ** 2)
        rubs = [j.friction is not None and not is_given(j.friction) for j in joints]
        self.at = np.flatnonzero(rubs)
        f = [j.friction for j, r in zip(joints, rubs, strict=True) if r]
        self.radius = np.array([x.radius for x in f], float)
        self.helix = np.arctan2(self.lead[self.at], self.radius)
        self.flank = np.array([x.flank_angle or 0.0 for x in f], float)
        self.preload = Signals(scene, [x.preload for x in f])
        self.law = Laws(scene, f, self.radius / np.cos(self.helix) * level.rate)

    def rate(self, m: Motion) -> np.ndarray:
        """The rates of the rows."""
        s = self.sides.pairs(m)
        return dot(s.slide, s.A[..., 0]) - self.lead * dot(s.turn, s.A[..., 0])

    def act(self, m: Motion, rolled: np.ndarray, out: Forces) -> np.ndarray:
        """Add the forces. Returns the rates of the rows."""
        s = self.sides.pairs(m)
        a = s.A[..., 0]
        spin = dot(s.turn, a)
        rate = dot(s.slide, a) - self.lead * spin
        push = -self.k * (rolled + self.level.delay * rate)
        force, torque = push.copy(), -self.lead * push
        if len(self.at):
            c, sn = np.cos(self.helix), np.sin(self.helix)
            f = np.abs(push[:, self.at]) / (np.cos(self.flank) * c) + self.preload(m.t)
            v = self.radius * spin[:, self.at] / c
            rub = self.law.slope(m.t, np.abs(v)) * v * f
            force[:, self.at] -= rub * sn
            torque[:, self.at] -= rub * self.radius * c
            out.taken += (rub * v).sum(-1)
        out.between(self.sides.one, self.sides.two, s.q, force[..., None] * a, torque[..., None] * a)
        return rate


def wheels_in(scene) -> list[str]:
    """The joints that are pairs of wheels."""
    return [n for n, j in scene.joints.items() if j.type in WHEELS]


def follower_stiffness(frames: Frames, level: Level, name: str, turns: bool) -> float:
    """Stiffness of the row of a joint that follows another joint, or of its drive."""
    return level.stiffness * (arm(frames, name) ** 2 if turns else 1.0)


__all__ = ["NotJudged", "Screws", "Wheels", "follower_stiffness", "radii_of", "wheels_in"]
