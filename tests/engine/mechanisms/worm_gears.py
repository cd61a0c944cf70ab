"""Worms and their wheels on the ground, and the textbooks' formulas for their forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from trunnion.scene.data_classes import scene as sm
from trunnion.scene.scene_loader import scene_from_dict


@dataclass(frozen=True)
class Worm:
    """threads, teeth, axial module (m), lead angle (rad; negative: left-handed), normal pressure angle (rad), μ; side: the side of
    the wheel, along a × b of the axes a and b or against it."""

    threads: int
    teeth: int
    module: float
    lead: float
    pressure: float
    mu: float
    side: int = 1

    @property
    def r1(self) -> float:
        """Pitch radius of the worm, m."""
        return self.module * self.threads / (2 * math.tan(abs(self.lead)))

    @property
    def r2(self) -> float:
        """Pitch radius of the wheel, m."""
        return self.module * self.teeth / 2

    @property
    def turns(self) -> float:
        """Turns of the wheel per turn of the worm."""
        return self.side * math.copysign(self.threads / self.teeth, self.lead)

    def forces(self, torque: float, drives: bool) -> tuple[float, float, float, float]:
        """(circumferential force of the wheel, circumferential force of the worm, separating force, torque of the worm) for a
        torque of the wheel. drives: whether the worm drives (Niemann/Winter; Decker)."""
        tangent, rub = math.tan(abs(self.lead)), (1 if drives else -1) * self.mu / math.cos(self.pressure)
        wheel = torque / self.r2
        worm = wheel * (tangent + rub) / (1 - rub * tangent)
        apart = wheel * math.tan(self.pressure) / (math.cos(self.lead) * (1 - rub * tangent))
        return wheel, worm, apart, worm * self.r1

    def scene(self, on_worm: dict[str, Any], on_wheel: dict[str, Any]) -> sm.Scene:
        """The pair; on_worm, on_wheel: devices of the two shafts."""
        point = [0.01, 0.02, self.side * (self.r1 + self.r2)]
        joints = {
            "worm_shaft": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": "worm", **on_worm},
            "wheel_shaft": {"type": "revolute", "axis": "y", "inboard": {"body": "ground", "point": point}, "outboard": "wheel",
                            **on_wheel},
            "mesh": {"type": "worm", "inboard": {"body": "worm", "axis": "x"}, "outboard": {"body": "wheel", "axis": "y"},
                     "teeth": [self.threads, self.teeth], "module": self.module, "lead_angle": self.lead,
                     "friction": {"mu": self.mu, "pressure_angle": self.pressure}},
        }  # fmt: skip
        bodies = {"worm": {"mass": 1, "inertia": [0.001] * 3}, "wheel": {"mass": 2, "inertia": [0.01] * 3}}
        return scene_from_dict({"gravity": [0, 0, 0], "bodies": bodies, "joints": joints})


def random_worm(seed: int) -> Worm:
    """A worm of usual proportions, right- or left-handed."""
    rng = np.random.default_rng(seed)
    lead = float(rng.choice([-1, 1]) * np.radians(rng.uniform(3, 35)))
    return Worm(int(rng.integers(1, 6)), int(rng.integers(20, 60)), float(rng.uniform(0.001, 0.01)), lead,
                float(np.radians(rng.uniform(14, 25))), float(rng.uniform(0.0, 0.15)), int(rng.choice([-1, 1])))  # fmt: skip
