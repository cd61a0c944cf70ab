"""End stops of a slider that a driven crank moves. The instants of contact and the energy loss agree with hand calculation for
every cut of the loop."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import trunnion
from trunnion.scene import scene_from_dict

JOINTS = ("main", "crankpin", "gudgeon", "guide")
METHODS = ("auto", "rk5", "rk8", "rosenbrock")
STEPS = 400
"""More than twice the steps of any method. A run without progress takes 40,000 steps."""


class DrivenCrank:
    """Crank `a` turned at the rate `w` through two turns, rod `b`, and a damped stop at the slider's travel −`limit`."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.a = rng.uniform(0.05, 0.15)
        self.b = self.a * rng.uniform(2.5, 5.0)
        self.w = rng.uniform(2.0, 12.0)
        self.limit = self.a * rng.uniform(0.4, 1.8)
        self.stiffness, self.damping = 10 ** rng.uniform(3.0, 5.0), 10 ** rng.uniform(-0.5, 1.0) / (self.a * self.w)

    def travel(self, t: float) -> float:
        """Travel of the slider from the outer dead centre, m."""
        angle = self.w * t
        return self.a * math.cos(angle) + math.sqrt(self.b**2 - (self.a * math.sin(angle)) ** 2) - (self.a + self.b)

    def rate(self, t: float) -> float:
        angle = self.w * t
        root = math.sqrt(self.b**2 - (self.a * math.sin(angle)) ** 2)
        return -self.a * self.w * math.sin(angle) * (1.0 + self.a * math.cos(angle) / root)

    def engaged(self) -> list[float]:
        """Instants at which the slider reaches its stop, s."""
        turn = 2.0 * math.pi / self.w
        first = brentq(lambda t: self.travel(t) + self.limit, 0.0, 0.5 * turn, xtol=1e-15)
        return [first, first + turn]

    def loss(self) -> float:
        """Energy that the stop takes in two turns, J. The stop's force is stiffness · depth · max(1 + damping · rate of depth,
        0)."""
        begin = self.engaged()[0]
        end = 2.0 * math.pi / self.w - begin

        def power(t: float) -> float:
            depth, rate = -self.limit - self.travel(t), -self.rate(t)
            return self.stiffness * depth * max(1.0 + self.damping * rate, 0.0) * rate

        corners = np.linspace(begin, end, 50)
        return 2.0 * sum(quad(power, p, q, epsabs=0.0, epsrel=1e-10)[0] for p, q in itertools.pairwise(corners))

    def scene(self, cut: str) -> trunnion.Scene:
        a, b = self.a, self.b
        joints: dict[str, dict[str, Any]] = {
            "main": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "crank", "at": [0, 0, 0],
                     "drive": {"constant": {"rate": self.w}}},
            "crankpin": {"type": "revolute", "axis": "z", "inboard": "crank", "outboard": "rod", "at": [a, 0, 0]},
            "gudgeon": {"type": "revolute", "axis": "z", "inboard": "rod", "outboard": "slider", "at": [a + b, 0, 0]},
            "guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "slider", "at": [a + b, 0, 0],
                      "end_stops": {"stiffness": self.stiffness, "damping": self.damping, "lower": -self.limit}},
        }  # fmt: skip
        joints[cut]["cut"] = True
        bodies = {"crank": [0, 0, 0], "rod": [a + 0.5 * b, 0, 0], "slider": [a + b, 0, 0]}
        return scene_from_dict({
            "schema": 1, "gravity": [0, -9.81, 0], "joints": joints, "simulation": {"until": 4.0 * math.pi / self.w},
            "bodies": {n: {"mass": 0.5, "inertia": [1e-3] * 3, "position": at} for n, at in bodies.items()},
        })  # fmt: skip


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("cut", JOINTS[1:])  # a driven joint is never cut
@pytest.mark.parametrize("seed", range(6))
def test_a_stop_beside_a_drive_acts_as_by_hand_wherever_the_loop_is_cut(seed: int, cut: str) -> None:
    """The depth of a cut joint's stop depends on the drives, which must be taken at the same instant."""
    crank, rtol = DrivenCrank(seed), 1e-8
    for method in METHODS:
        result = trunnion.simulate(crank.scene(cut), method=method, rtol=rtol, outputs=["energy.dissipated"])
        found = [e.time for e in result.events if e.kind == "end_stop_engaged"]
        assert found == pytest.approx(crank.engaged(), abs=10.0 * rtol / crank.w), method
        assert result["energy.dissipated"][-1] == pytest.approx(crank.loss(), rel=1e-5), method
        assert result.stats.steps <= STEPS, method
