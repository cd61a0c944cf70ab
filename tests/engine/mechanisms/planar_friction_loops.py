"""Closed chains of links in the x-z plane with friction in every joint, and the largest torque that they hold. The torque follows
from plane statics with friction cones, without the engine.

Joint i sits at point i, link i runs from point i to i + 1, the ground closes the chain. In the plane a journal with force F
holds any torque |M| ≤ R |F|, R = r μ/√(1+μ²)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import fsolve, minimize

from trunnion.scene.data_classes import scene as sm

THICK, DENSITY, GRAVITY = 0.05, 2700.0, 9.81


@dataclass(frozen=True)
class PlaneLoop:
    """A loop. points: (x, z) of the joints, m. radii: of the journals of the joints, m. mu: coefficient of friction of all
    joints."""

    points: tuple[tuple[float, float], ...]
    radii: tuple[float, ...]
    mu: float

    @property
    def count(self) -> int:
        return len(self.points)

    def link(self, i: int) -> np.ndarray:
        return np.subtract(self.points[i + 1], self.points[i])

    def weight(self, i: int) -> np.ndarray:
        return np.array([0.0, -GRAVITY * DENSITY * THICK**2 * float(np.hypot(*self.link(i)))])

    def reach(self) -> np.ndarray:
        return np.array(self.radii) * self.mu / math.hypot(1.0, self.mu)

    def loads(self, force: np.ndarray, moment: float, torques: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces and torques (about y) of all joints on their links, from force and torque of joint 0 and the torques on the
        links."""
        F, M = [np.asarray(force, float)], [float(moment)]
        for i in range(self.count - 1):
            d, w = self.link(i), self.weight(i)
            F.append(F[-1] + w)
            M.append(M[-1] - turn(d, F[-1]) + turn(d / 2, w) + torques[i])
        return np.array(F), np.array(M)

    def balance(self) -> np.ndarray:
        """Torques that hold the weight without friction, on the first link and (for five-bars and longer chains) on the last link.
        The torques on other links are zero."""
        ends = [0, self.count - 2][: self.count - 3]

        def lack(x: np.ndarray) -> np.ndarray:
            return self.loads(x[:2], 0.0, self._torques(ends, x[2:]))[1][1:]

        return self._torques(ends, fsolve(lack, np.ones(2 + len(ends)), xtol=1e-14)[2:])

    def _torques(self, ends: list[int], values: np.ndarray) -> np.ndarray:
        out = np.zeros(self.count - 1)
        out[ends] = values
        return out

    def most(self, sense: float) -> float:
        """Largest additional torque on link 0 (sense ±1) for which some distribution of friction is in equilibrium."""
        first, base, reach = np.eye(self.count - 1)[0], self.balance(), self.reach()
        start = fsolve(lambda x: self.loads(x, 0.0, base)[1][1:3], np.ones(2), xtol=1e-14)
        unit = float(np.abs(start).max())

        def slack(x: np.ndarray) -> np.ndarray:
            F, M = self.loads(x[:2] * unit, x[2] * unit, base + sense * x[3] * unit * first)
            room = reach * np.hypot(*F.T)
            return np.concatenate([room - M, room + M]) / unit

        found = minimize(
            lambda x: -x[3], [*(start / unit), 0.0, 0.0], method="SLSQP", constraints={"type": "ineq", "fun": slack},
            options={"ftol": 1e-15, "maxiter": 500},
        )  # fmt: skip
        active = np.sort(np.argsort(slack(found.x))[:4])  # with four unknowns, four joints are at their limit
        exact = fsolve(lambda x: slack(x)[active], found.x, xtol=1e-14)
        assert np.abs(slack(exact)[active]).max() <= 1e-14
        assert slack(exact).min() >= -1e-14
        assert abs(exact[3] - found.x[3]) <= 1e-5 * abs(exact[3])
        return float(exact[3] * unit)

    def scene(self, extra: float | sm.Signal) -> sm.Scene:
        """The scene of the chain. Torques hold its weight, and ``extra`` torque about y acts on link 0."""
        bodies, joints = {}, {}
        forces: dict[str, sm.Applied] = {}
        before, base = 0.0, self.balance()
        for i in range(self.count - 1):
            d = self.link(i)
            length, angle = float(np.hypot(*d)), -math.atan2(d[1], d[0])
            ends = {"a": (-length / 2, 0.0, 0.0), "b": (length / 2, 0.0, 0.0)}
            bodies[f"l{i}"] = sm.Body(box=(length, THICK, THICK), density=DENSITY, points=ends)
            inboard = sm.Side("ground", (self.points[0][0], 0.0, self.points[0][1])) if i == 0 else f"l{i - 1}.b"
            joints[f"p{i}"] = self._joint(i, inboard, f"l{i}.a", sm.Start(angle - before, 0.0))
            before = angle
            if base[i]:
                forces[f"hold{i}"] = sm.Torque("torque", f"l{i}", (0.0, float(base[i]), 0.0))
        last = self.count - 1
        wall = sm.Side("ground", (self.points[last][0], 0.0, self.points[last][1]))
        joints[f"p{last}"] = self._joint(last, f"l{last - 1}.b", wall, None)
        forces["extra"] = sm.Torque("torque", "l0", (0.0, extra, 0.0))
        return sm.Scene(bodies, joints, "plane_loop", gravity=(0.0, 0.0, -GRAVITY), forces=forces)

    def _joint(self, i: int, inboard, outboard, start) -> sm.Joint:
        rub = sm.Friction(mu=self.mu, radius=self.radii[i], half_length=0.05)
        return sm.Joint("revolute", inboard, outboard, axis="y", friction=rub, start=start)


def turn(a: np.ndarray, b: np.ndarray) -> float:
    """y component of a × b, both in the x-z plane."""
    return float(a[1] * b[0] - a[0] * b[1])


FOUR_BAR = PlaneLoop(((0.0, 0.0), (0.4, 0.9), (1.2, 0.8), (1.0, 0.0)), (0.03, 0.04, 0.03, 0.02), 0.3)
FIVE_BAR = PlaneLoop(((0.0, 0.0), (-0.3, 0.7), (0.4, 1.3), (1.2, 0.8), (1.0, 0.0)), (0.03, 0.04, 0.05, 0.03, 0.02), 0.3)
