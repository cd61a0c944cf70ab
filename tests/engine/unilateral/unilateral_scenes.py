"""Scenes with joints that only push: blocks, boxes, wheels and rods on a table, as dicts for ``scene_from_dict``."""

from __future__ import annotations

from typing import Any

import trunnion
from trunnion.scene.data_classes.scene import Scene

G = 9.81
UP = {"points": [[0.0, -50.0], [0.0, 50.0]]}
"""The table as a straight curve along x in the plane normal to y; its free side is above."""


def scene(bodies: dict[str, Any], joints: dict[str, Any], **more: Any) -> Scene:
    """A scene with gravity along −z."""
    return trunnion.scene_from_dict({"bodies": bodies, "joints": joints, "gravity": [0, 0, -G]} | more)


def body(mass: float, inertia: float) -> dict[str, Any]:
    return {"mass": mass, "inertia": [inertia, inertia, inertia]}


def in_plane(name: str, q: Any, qd: Any, **more: Any) -> dict[str, Any]:
    """A planar joint in the plane normal to y: z, x, and the angle about y."""
    start = {"q": list(map(float, q)), "qd": list(map(float, qd))}
    return {"type": "planar", "inboard": "ground", "outboard": name, "axis": [0, 1, 0], "start": start, **more}


def corner(name: str, point: tuple[float, float], mu: float | None, **unilateral: Any) -> dict[str, Any]:
    """A point (x, z) of a body that touches the table."""
    joint: dict[str, Any] = {"type": "point_on_curve", "inboard": "ground", "axis": [0, 1, 0], "curve": UP}
    joint["unilateral"] = unilateral
    joint["outboard"] = {"body": name, "point": [point[0], 0.0, point[1]]}
    return joint if mu is None else joint | {"friction": {"mu": mu}}


def rim(name: str, radius: float, mu: float, **unilateral: Any) -> dict[str, Any]:
    """A wheel on the table: a cam of constant profile on a face."""
    profile = {"angle": [0.0, 2.0, 4.0, 6.283185307179586], "radius": [radius] * 4}
    return {
        "type": "flat_cam", "inboard": {"body": name, "axis": [0, 1, 0]}, "profile": profile, "friction": {"mu": mu},
        "outboard": {"body": "ground", "axis": [0, 0, -1], "reference": [0, 1, 0]}, "unilateral": unilateral,
    }  # fmt: skip


def box(
    mu: float, half: float, height: float, mass: float, inertia: float, q: Any, qd: Any, effort: Any = None, **unilateral: Any
) -> Scene:
    """A box with two corners at ±half below the mass centre at ``height``."""
    fly = in_plane("box", q, qd, **({"effort": [None, effort, None]} if effort else {}))
    sides = {"left": corner("box", (-half, -height), mu, **unilateral), "right": corner("box", (half, -height), mu, **unilateral)}
    return scene({"box": body(mass, inertia)}, {"fly": fly, **sides})
