"""Scenes of any size: the singular N-four-bar (benchmark A02), and the chain of revolutes for performance comparisons."""

from __future__ import annotations

import math
from typing import Any

from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.scene_loader import scene_from_dict

GRAVITY = 9.81
ROD = 1 / 12
"""Inertia of a thin rod (1 m, 1 kg) about a transverse axis through its centre, kg m²."""
CHAIN_AXIAL = 1.0e-3
"""Axial inertia of a chain link, kg m²; not zero, because some other programs refuse a zero inertia."""


def n_four_bar(n: int = 40) -> Scene:
    """Benchmark A02: n + 1 cranks on the ground at x = 0 … n and n couplers on top, in the x-y plane. All parts are thin rods of
    1 m and 1 kg.

    The cranks start vertical (along y), with tip velocities of +1 m/s in x; the couplers lie along x. All coordinates start
    at 0.
    """
    if n < 1:
        raise ValueError("an N-four-bar has at least one loop")
    crank = {"mass": 1, "center": [0, 0.5, 0], "inertia": [ROD, 0, ROD], "points": {"tip": [0, 1, 0]}}
    coupler = {"mass": 1, "center": [0.5, 0, 0], "inertia": [0, ROD, ROD], "points": {"end": [1, 0, 0]}}
    bodies: dict[str, Any] = {f"crank{i}": crank for i in range(n + 1)}
    bodies |= {f"coupler{i}": coupler for i in range(1, n + 1)}
    joints: dict[str, Any] = {}
    for i in range(n + 1):
        joints[f"pivot{i}"] = _hinge(f"ground.p{i}", f"crank{i}", -1.0)
    for i in range(1, n + 1):
        joints[f"left{i}"] = _hinge(f"crank{i - 1}.tip", f"coupler{i}", 1.0)
        joints[f"right{i}"] = _hinge(f"coupler{i}.end", f"crank{i}.tip", None)
    return scene_from_dict(
        {
            "name": f"n_four_bar_{n}",
            "title": f"{n}-four-bar mechanism, singular when the cranks lie flat",
            "gravity": [0, -GRAVITY, 0],
            "ground": {"points": {f"p{i}": [i, 0, 0] for i in range(n + 1)}},
            "bodies": bodies,
            "joints": joints,
            "simulation": {"until": 10, "every": 0.01},
        }
    )


def _hinge(inboard: str, outboard: str, rate: float | None) -> dict[str, Any]:
    hinge: dict[str, Any] = {"type": "revolute", "axis": "z", "inboard": inboard, "outboard": outboard}
    return hinge if rate is None else {**hinge, "start": {"q": 0, "qd": rate}}


def revolute_chain(n: int) -> Scene:
    """A chain of n rods (1 m, 1 kg) on revolutes about y and z alternately, with the start values and torques that the
    performance comparisons use."""
    if n < 1:
        raise ValueError("a chain has at least one link")
    link = {
        "mass": 1, "center": [0.5, 0, 0], "inertia": [CHAIN_AXIAL, ROD, ROD], "points": {"end": [1, 0, 0]},
    }  # fmt: skip
    joints = {
        f"joint{i + 1}": {
            "type": "revolute",
            "axis": "z" if i % 2 else "y",
            "inboard": f"link{i}.end" if i else "ground",
            "outboard": f"link{i + 1}",
            "start": {"q": 0.3 * math.sin(1.7 * i + 0.2), "qd": 0.5 * math.cos(2.3 * i)},
            "effort": 0.1 * math.sin(0.9 * i),
        }
        for i in range(n)
    }
    return scene_from_dict(
        {
            "name": f"revolute_chain_{n}",
            "title": f"chain of {n} revolutes, axes y and z in turn",
            "gravity": [0, 0, -GRAVITY],
            "bodies": {f"link{i + 1}": link for i in range(n)},
            "joints": joints,
        }
    )
