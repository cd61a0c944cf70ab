"""A rope over a fixed drum between two moving bodies. The scene consists of two halves of a drum and a gearbox whose efficiencies
are exp(−μ φ)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import trunnion
from tests.default_case_selection import sampled
from trunnion import hold, scene_from_dict, simulate

G, RADIUS, END = 9.81, 0.1, 0.5


@dataclass(frozen=True)
class Rope:
    """Masses on both ends, friction coefficient, angle of wrap, and start rate of the left body upward."""

    left: float
    right: float
    mu: float
    wrap: float
    rate: float

    @property
    def growth(self) -> float:
        """Ratio of the tensions while the rope slides."""
        return math.exp(self.mu * self.wrap)

    def scene(self) -> trunnion.Scene:
        def half(of: str, sign: int) -> dict:
            mimic = {"joint": of, "ratio": sign / RADIUS}
            return {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": f"{of}_drum", "mimic": mimic}

        def guide(name: str, rate: float) -> dict:
            return {"type": "prismatic", "axis": "z", "inboard": "ground", "outboard": f"{name}_body", "start": {"qd": rate}}

        friction = {"efficiency": 1 / self.growth, "efficiency_backward": 1 / self.growth}
        body, drum = {"inertia": [1, 1, 1]}, {"mass": 0, "inertia": [0, 0, 0]}
        return scene_from_dict({
            "name": "rope", "gravity": [0, 0, -G],
            "bodies": {"left_body": {"mass": self.left, **body}, "right_body": {"mass": self.right, **body},
                       "left_drum": drum, "right_drum": drum},
            "joints": {"left": guide("left", self.rate), "right": guide("right", -self.rate),
                       "a": half("left", 1), "b": half("right", -1),
                       "rope": {"type": "gearbox", "inboard": "left_drum", "outboard": "right_drum", "ratio": 1,
                                "friction": friction}},
        })  # fmt: skip

    def sliding(self, sense: int) -> float:
        """Acceleration of the left body upward while it moves up (1) or down (−1)."""
        pull = self.growth**sense
        return G * (self.right - pull * self.left) / (self.right + pull * self.left)

    @property
    def holds(self) -> bool:
        return abs(math.log(self.right / self.left)) < self.mu * self.wrap

    def height(self, t: np.ndarray) -> np.ndarray:
        """Height of the left body."""
        sense = int(math.copysign(1, self.rate))
        a = self.sliding(sense)
        stops = -self.rate / a if a * self.rate < 0 else math.inf
        moving = self.rate * np.minimum(t, stops) + 0.5 * a * np.minimum(t, stops) ** 2
        later = np.maximum(t - stops, 0.0)
        return moving + (0.0 if self.holds else 0.5 * self.sliding(-sense) * later**2)


def random_rope(seed: int) -> Rope:
    rng = np.random.default_rng(seed)
    left, right = rng.uniform(1.0, 5.0, 2)
    return Rope(left, right, rng.uniform(0.05, 0.5), rng.uniform(0.5, 7.0), float(rng.choice([-1, 1]) * rng.uniform(0.3, 2.0)))


@pytest.mark.parametrize("seed", sampled(range(120), 3))
def test_the_bodies_move_stop_hold_and_reverse_by_the_capstan_relation(seed: int) -> None:
    rope = random_rope(seed)
    r = simulate(rope.scene(), until=END, every=END / 20, rtol=1e-10)
    assert r.outcome.name == "done"
    assert r["left.q[1]"] == pytest.approx(rope.height(r.time), abs=1e-9)
    assert r["right.q[1]"] == pytest.approx(-rope.height(r.time), abs=1e-9)


@pytest.mark.parametrize("seed", sampled(range(20), 1))
def test_the_rope_holds_just_within_exp_mu_phi_and_slides_just_beyond(seed: int) -> None:
    rope = random_rope(seed)
    for sense in (1, -1):
        for beyond in (-1e-6, 1e-6):
            heavy = rope.left * rope.growth**sense * (1 + sense * beyond)
            assert bool(hold(Rope(rope.left, heavy, rope.mu, rope.wrap, 0.0).scene()).holds) == (beyond < 0)
