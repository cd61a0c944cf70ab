"""A ladder: a rod between a driven top and a foot with friction. The force in the rod is calculated by hand."""

from __future__ import annotations

import math

import numpy as np

from trunnion import Scene, scene_from_dict

LENGTH, DOWN, MASS = 0.5, 0.4, 2.0


def ladder(mu: float = 0.3, rods: int = 1, placed: bool = False) -> Scene:
    """A slider with friction on a horizontal guide. Rods push the slider. Their upper ends come down at the constant speed DOWN, as
    a ladder at a wall. The slider has no weight: only the rods press it on its guide. placed: the length of the rods follows from
    the poses."""
    x, y = LENGTH * math.cos(0.9), LENGTH * math.sin(0.9)
    top, foot = ({"mass": m, "inertia": [0.1] * 3} for m in (1.0, MASS))
    rub = {"friction": {"mu": mu, "half_length": 0.1, "half_width": 0.05, "half_height": 0.05}} if mu else {}
    joints = {
        "wall": {"type": "prismatic", "axis": "y", "inboard": "ground", "outboard": "top",
                 "drive": {"constant": {"rate": -DOWN, "start": 0 if placed else y}}},
        "guide": {"type": "prismatic", "axis": "x", "reference": "y", "inboard": "ground", "outboard": "foot", "pin": "outboard",
                  **rub},
    }  # fmt: skip
    if placed:
        top["position"], foot["position"] = [0, y, 0], [x, 0, 0]
    else:
        joints["guide"]["start"] = {"q": x}
    length = {} if placed else {"length": LENGTH}
    joints |= {f"r{k}": {"type": "rod", "inboard": "top", "outboard": "foot", **length} for k in range(rods)}
    return scene_from_dict({"name": "ladder", "gravity": [0, 0, 0], "bodies": {"top": top, "foot": foot}, "joints": joints,
                            "simulation": {"until": 0.4, "every": 0.1}})  # fmt: skip


def tension(t: np.ndarray, mu: float, length: float = LENGTH) -> np.ndarray:
    """The hand-calculated force in the rod: m ẍ = −T (cos α + μ sin α), where x² + y² = L² gives ẍ = −(ẋ² + ẏ²)/x. Rod and friction
    brake the slider."""
    y = LENGTH * math.sin(0.9) - DOWN * t
    x = np.sqrt(length**2 - y**2)
    return MASS * DOWN**2 * (1 + y**2 / x**2) / x * length / (x + mu * y)
