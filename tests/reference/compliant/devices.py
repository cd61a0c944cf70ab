"""Devices along freedoms of joints: springs, damping, stops, latches, motors, efforts, drives, and joints that follow other joints.

A freedom is a direction of a joint, measured on its inboard part; angles are continued from ``near``. The discrete state of a latch
says whether the hook is down, and on which tooth. This state changes only between two steps. """

from __future__ import annotations

import numpy as np

from tests.reference.compliant.couplings import follower_stiffness
from tests.reference.compliant.friction_laws import NotJudged, Signals, bends
from tests.reference.compliant.joint_springs_and_friction import Level
from tests.reference.compliant.positions_and_rates import Forces, Frames, Motion, cross, dot
from tests.reference.mechanics.joint_constraints import of
from tests.reference.mechanics.time_signals import drive_motion, per_freedom

LIFTED = 0.5
"""Value of a release above which a hook is lifted."""


class Freedoms:
    """All freedoms of joints, in order. ``near``: coordinates of the last accepted state."""

    def __init__(self, scene, frames: Frames, names: list[str]):
        self.labels = [(n, k) for n in names for k in range(len(of(scene.joints[n].type).free))]
        kinds = [of(scene.joints[n].type) for n, _ in self.labels]
        directions = [k.free[i] for k, (_, i) in zip(kinds, self.labels, strict=True)]
        self.sides = frames.sides([n for n, _ in self.labels])
        self.turns = np.array([d >= 3 for d in directions], bool)
        self.axis = np.array([d % 3 for d in directions], int)
        self.second = np.array([k.crossed and d == 4 for k, d in zip(kinds, directions, strict=True)], bool)
        self.number = np.array([i < k.scalars for k, (_, i) in zip(kinds, self.labels, strict=True)], bool)
        self.lead = np.array([k.lead for k in kinds], bool)
        self.near = np.zeros(len(self.labels))
        self.each = np.arange(len(self.labels))

    def at(self, name: str, k: int = 0) -> int:
        """The index of a freedom."""
        return self.labels.index((name, k))

    def coordinates(self, m: Motion) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates (n x freedoms), rates, axes in the world, and the outboard points."""
        s = self.sides.pairs(m)
        axes = np.where(self.second[:, None], s.B[..., 1], s.A[:, self.each, :, self.axis].swapaxes(0, 1))
        R = s.A.swapaxes(-1, -2) @ s.B
        angle = np.where(self.second, np.arctan2(R[..., 0, 2], R[..., 0, 0]), np.arctan2(R[..., 2, 1], R[..., 1, 1]))
        angle = angle + 2 * np.pi * np.round((self.near - angle) / (2 * np.pi))
        q = np.where(self.turns, angle, dot(axes, s.q - s.p))
        return np.where(self.number, q, 0.0), np.where(self.turns, dot(axes, s.turn), dot(axes, s.slide)), axes, s.q

    def act(self, effort: np.ndarray, axes: np.ndarray, at: np.ndarray, out: Forces) -> None:
        """Efforts along the freedoms, on the outboard parts."""
        along = effort[..., None] * axes
        turns = self.turns[:, None]
        out.between(self.sides.one, self.sides.two, at, np.where(turns, 0.0, along), np.where(turns, along, 0.0))


def listed(scene, freedoms: Freedoms, key: str) -> list[tuple[int, object]]:
    """(freedom, entry) of a device."""
    out = []
    for name in dict.fromkeys(n for n, _ in freedoms.labels):
        n = sum(label == name for label, _ in freedoms.labels)
        entries = per_freedom(getattr(scene.joints[name], key), n)
        out += [(freedoms.at(name, k), e) for k, e in enumerate(entries) if e is not None]
    return out


def _column(entries: list, key: str, none: float = 0.0) -> np.ndarray:
    return np.array([none if getattr(e, key) is None else getattr(e, key) for _, e in entries], float)


class Devices:
    """The devices of a scene."""

    def __init__(self, scene, frames: Frames, freedoms: Freedoms, level: Level):
        self.scene, self.free, self.level = scene, freedoms, level
        n = len(freedoms.labels)
        self.spring, self.rest, self.damping = np.zeros(n), np.zeros(n), np.zeros(n)
        for i, s in listed(scene, freedoms, "spring"):
            self.spring[i], self.rest[i] = s.stiffness, s.rest
        for i, c in listed(scene, freedoms, "damping"):
            self.damping[i] = c
        if any(a for _, a in listed(scene, freedoms, "rotor_inertia")):
            raise NotJudged("rotor_inertia")
        self.stops = listed(scene, freedoms, "end_stops")
        self.latches = listed(scene, freedoms, "latch")
        self.drives = listed(scene, freedoms, "drive")
        if any(d.input is not None for _, d in self.drives):
            raise NotJudged("a drive by an input")
        if any(d.move is not None and d.move.profile == "s_curve" for _, d in self.drives):
            raise NotJudged("a drive along an s_curve")
        self.efforts = listed(scene, freedoms, "effort")
        self.motors = listed(scene, freedoms, "motor")
        self.effort = Signals(scene, [e for _, e in self.efforts])
        self.signal = Signals(scene, [e.signal for _, e in self.motors])
        self.release = Signals(scene, [e.release for _, e in self.latches])
        self.kd = np.array([follower_stiffness(frames, level, *self._name(i)) for i, _ in self.drives])
        names = [n for n, _ in freedoms.labels]
        self.mimics = [(freedoms.at(n), freedoms.at(scene.joints[n].mimic.joint), scene.joints[n].mimic)
                       for n in dict.fromkeys(names) if scene.joints[n].mimic is not None]  # fmt: skip
        self.km = np.array([follower_stiffness(frames, level, *self._name(i)) for i, _, _ in self.mimics])
        self.down = np.zeros(len(self.latches), bool)
        self.tooth = np.ones(len(self.latches))

    def _name(self, i: int) -> tuple[str, bool]:
        return self.free.labels[i][0], bool(self.free.turns[i])

    def kinks(self) -> list[float]:
        """Instants at which a signal bends."""
        loads = [e for _, e in self.efforts] + [e.signal for _, e in self.motors] + [e.release for _, e in self.latches]
        out = [t for load in loads for t in bends(load)]
        for _, d in self.drives:
            out += bends(d)
            if getattr(d, "move", None) is not None:
                out += [d.move.begin + d.move.duration * k / 6 for k in range(7)]
        return out

    def act(self, m: Motion, out: Forces) -> np.ndarray:
        """Add the forces. Returns the coordinates."""
        effort, q, qd, axes, at = self.total_efforts(m)
        self.free.act(effort, axes, at, out)
        out.taken += (self.damping * qd * qd).sum(-1)
        return q

    def total_efforts(self, m: Motion) -> tuple[np.ndarray, ...]:
        """(efforts along the freedoms, coordinates, rates, axes, outboard points)."""
        q, qd, axes, at = self.free.coordinates(m)
        effort = -self.spring * (q - self.rest) - self.damping * qd
        for values, entries in ((self.effort, self.efforts), (self.signal, self.motors)):
            now = values(m.t)
            for j, (i, e) in enumerate(entries):
                effort[:, i] += now[:, j] if values is self.effort else e.stall * (now[:, j] - qd[:, i] / e.no_load)
        for i, s in self.stops:
            for limit, side in ((s.lower, 1.0), (s.upper, -1.0)):
                if limit is not None:
                    effort[:, i] += pressed(side, limit, s.stiffness, s.damping, q[:, i], qd[:, i])
        for j, (i, e) in enumerate(self.latches):
            if self.down[j]:
                effort[:, i] += pressed(*self._hook(j), e.stiffness, e.damping, q[:, i], qd[:, i])
        for j, (i, d) in enumerate(self.drives):
            wanted = np.array([drive_motion(d, float(t))[:2] for t in np.unique(m.t)])[np.unique(m.t, return_inverse=True)[1]]
            effort[:, i] -= self.kd[j] * (q[:, i] - wanted[:, 0] + self.level.delay * (qd[:, i] - wanted[:, 1]))
        for j, (i, k, mimic) in enumerate(self.mimics):
            gap = q[:, i] - mimic.ratio * q[:, k] - mimic.offset + self.level.delay * (qd[:, i] - mimic.ratio * qd[:, k])
            effort[:, i] -= self.km[j] * gap
            effort[:, k] += mimic.ratio * self.km[j] * gap
        return effort, q, qd, axes, at

    # -- latches ---------------------------------------------------------------------------------------------------------

    def _hook(self, j: int) -> tuple[float, float]:
        """(side, place) of a hook that is down."""
        e = self.latches[j][1]
        side = 1.0 if e.keeps == "above" else -1.0
        return side, e.at + side * (self.tooth[j] - 1) * (e.pitch or 0.0)

    def start_hooks(self, q: np.ndarray) -> None:
        """Set the hooks that are down at the start."""
        for j, (i, e) in enumerate(self.latches):
            side = 1.0 if e.keeps == "above" else -1.0
            passed = side * (q[i] - e.at)
            free = float(self.release(np.zeros(1))[0, j]) <= LIFTED
            self.tooth[j] = 1.0
            self.down[j] = bool(free and (passed >= 0 or e.down))
            if self.down[j] and e.pitch and passed >= 0:
                self.tooth[j] = np.floor(passed / e.pitch) + 1

    def hook_functions(self, m: Motion) -> np.ndarray:
        """A function for every latch (n x latches). It is positive in the present state of the latch; its sign changes when the
        state changes."""
        q = self.free.coordinates(m)[0]
        lift = LIFTED - self.release(m.t)
        out = np.ones((len(m.t), len(self.latches)))
        for j, (i, e) in enumerate(self.latches):
            side, place = self._hook(j)
            free = np.broadcast_to(lift[:, j], (len(m.t),))
            if not self.down[j]:
                side, place = (1.0 if e.keeps == "above" else -1.0), e.at
                out[:, j] = -np.minimum(free, side * (q[:, i] - place))
                continue
            depth = side * (place - q[:, i])
            now = free
            if e.holds is not None:
                now = np.minimum(now, e.holds / e.stiffness - depth)
            if e.pitch is not None:
                now = np.minimum(now, depth + e.pitch)
            out[:, j] = now
        return out

    def change_hook(self, j: int, m: Motion) -> None:
        """Change the state of a latch after the sign of its function has changed."""
        i, e = self.latches[j]
        side = 1.0 if e.keeps == "above" else -1.0
        passed = float(side * (self.free.coordinates(m)[0][0, i] - e.at))
        free = float(self.release(m.t)[0, j]) <= LIFTED
        if not self.down[j]:
            self.down[j] = True
            self.tooth[j] = np.floor(passed / e.pitch + 1e-9) + 1 if e.pitch else 1.0
            return
        if not free or e.pitch is None:
            self.down[j] = False
            return
        depth = -passed + (self.tooth[j] - 1) * e.pitch
        self.tooth[j] += 1 if depth < 0 else -1
        self.down[j] = bool(self.tooth[j] >= 1)
        self.tooth[j] = max(self.tooth[j], 1.0)


def pressed(side: float, place: float, stiffness: float, damping: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Effort of a stop or a hook that keeps a coordinate above (side 1) or below (-1) a place."""
    depth = np.maximum(side * (place - q), 0.0)
    return side * stiffness * depth * np.maximum(1 - damping * side * qd, 0.0)


class Loads:
    """Weight, and loads on bodies."""

    def __init__(self, scene, frames: Frames):
        from tests.reference.mechanics.bodies_and_joint_frames import place

        self.scene, self.frames = scene, frames
        self.weight = frames.mass[:, None] * np.array(scene.gravity, float)
        self.single, self.springs = [], []
        for load in scene.forces.values():
            if load.type in ("force", "torque"):
                body, local = place(scene, load.on)
                i = frames.index[body]
                x = np.zeros(3) if local is None else local - frames.center[i]
                self.single.append((load, i, x, Signals(scene, list(load.force if load.type == "force" else load.torque))))
            elif load.type == "spring_damper":
                ends = []
                for text in load.between:
                    body, local = place(scene, text)
                    i = frames.index[body]
                    ends.append((i, (np.zeros(3) if local is None else local) - frames.center[i]))
                self.springs.append((load, ends))
            elif load.type == "bushing":
                raise NotJudged("a bushing")

    def kinks(self) -> list[float]:
        """Instants at which a signal bends."""
        return [t for *_, s in self.single for load in s.loads for t in bends(load)]

    def act(self, m: Motion, out: Forces) -> None:
        """Add the forces."""
        out.force[:, :-1] += self.weight
        for load, i, x, signal in self.single:
            v = np.broadcast_to(signal(m.t), (len(m.t), 3))
            v = (m.R[:, i] @ v[..., None])[..., 0] if load.frame == "body" else v
            if load.type == "torque":
                out.torque[:, i] += v
            else:
                out.force[:, i] += v
                out.torque[:, i] += cross(m.R[:, i] @ x, v)
        for load, ((i, x), (k, z)) in self.springs:
            arm, other = m.R[:, i] @ x, m.R[:, k] @ z
            way = m.c[:, k] + other - m.c[:, i] - arm
            length = np.sqrt(dot(way, way))
            along = way / length[:, None]
            rate = dot(along, m.v[:, k] + cross(m.w[:, k], other) - m.v[:, i] - cross(m.w[:, i], arm))
            pull = (load.stiffness * (length - load.length) + load.damping * rate)[:, None] * along
            for body, at, sign in ((i, arm, 1.0), (k, other, -1.0)):
                out.force[:, body] += sign * pull
                out.torque[:, body] += cross(at, sign * pull)
            out.taken += load.damping * rate**2
