"""Mechanisms at rest with hand-calculated bounds."""

from __future__ import annotations

from typing import Any

WEIGHT, ARM, SPACING, RADIUS, HALF, THRUST, MU = 300.0, 0.45, 1.5, 0.006, 0.03, 0.008, 0.15
"""Data of the door: weight, N; lengths, m: distance of the mass centre from the hinges, distance between the hinges, pin radius,
half length, thrust radius; friction coefficient."""


def inertia() -> dict[str, Any]:
    return {"mass": 1.0, "inertia": [0.01, 0.01, 0.01]}


def door() -> dict[str, Any]:
    sizes = {"mu": MU, "radius": RADIUS, "half_length": HALF, "thrust_radius": THRUST}
    hinge = {"type": "revolute", "axis": "z", "friction": sizes}
    points = {"low": [0, 0, 0.25], "high": [0, 0, 0.25 + SPACING]}
    return {
        "schema": 1, "gravity": [0, 0, -10], "ground": {"points": points},
        "bodies": {"door": {"mass": WEIGHT / 10, "inertia": [10, 10, 2], "center": [ARM, 0, 1.0], "points": points}},
        "joints": {
            "low": hinge | {"inboard": "ground.low", "outboard": "door.low", "start": {"q": 0}, "effort": 0.1},
            "high": hinge | {"inboard": "ground.high", "outboard": "door.high"},
        },
    }  # fmt: skip


def walls() -> dict[str, Any]:
    """A block of 50 N between two walls. A force pushes the block along the walls."""
    sizes = {"mu": 0.2, "half_length": 0.06, "half_width": 0.01, "half_height": 0.01}
    sleeve = {"type": "prismatic", "axis": "x", "reference": "y", "friction": sizes}
    points = {"left": [0, 0.2, 0], "right": [0, -0.2, 0]}
    return {
        "schema": 1, "gravity": [0, 0, -10], "ground": {"points": points},
        "bodies": {"block": {"mass": 5.0, "inertia": [0.01, 0.01, 0.01], "points": points}},
        "joints": {
            "left": sleeve | {"inboard": "ground.left", "outboard": "block.left", "start": {"q": 0}},
            "right": sleeve | {"inboard": "ground.right", "outboard": "block.right"},
        },
        "forces": {"push": {"type": "force", "on": "block", "force": [2, 0, 0]}},
    }  # fmt: skip


def four_bar(
    cross: bool = False, held: float = 13.5, torque: float = -4.5, mu: float = 0.2, ball: bool = False
) -> dict[str, Any]:  # fmt: skip
    """An upright crank of 0.1 m, an upright rocker of 0.3 m, and a coupler from (0, 0.1) to (0.4, 0.3) m. The pins on the ground
    have friction. With ``cross``, the universal joint at the crank's end has friction, too; with ``ball``, the ball joint at the
    rocker's end. The bodies have no weight, and the loop is not redundant."""
    b, c = [0, 0.1, 0], [0.4, 0.3, 0]
    across: dict[str, Any] = {"type": "universal", "axis": "z", "reference": "x", "inboard": "crank.b", "outboard": "coupler.b"}
    if cross:
        across["friction"] = {"mu": 0.25, "radius": 0.008, "half_length": 0.025}
    rubs = {"friction": {"mu": 0.2, "radius": 0.01}} if ball else {}
    return {
        "schema": 1, "gravity": [0, 0, 0], "ground": {"points": {"d": [0.4, 0, 0]}},
        "bodies": {
            "crank": inertia() | {"points": {"a": [0, 0, 0], "b": b}}, "coupler": inertia() | {"points": {"b": b, "c": c}},
            "rocker": inertia() | {"points": {"d": [0.4, 0, 0], "c": c}},
        },
        "joints": {
            "a": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "crank.a", "start": {"q": 0}, "effort": torque,
                  "friction": {"mu": mu, "radius": 0.01, "half_length": 0.02}},
            "b": across | {"start": {"q": [0, 0]}},
            "c": {"type": "spherical", "inboard": "coupler.c", "outboard": "rocker.c"} | rubs,
            "d": {"type": "revolute", "axis": "z", "inboard": "ground.d", "outboard": "rocker.d", "effort": held,
                  "friction": {"mu": 0.3, "radius": 0.012, "half_length": 0.02}},
        },
    }  # fmt: skip


def guide(height: float) -> dict[str, Any]:
    """A sleeve of 20 N with half length 60 mm. A force at ``height`` above the guide pushes the sleeve along the guide."""
    sizes = {"mu": 0.2, "half_length": 0.06, "half_width": 0.01, "half_height": 1e-6}
    return {
        "schema": 1, "gravity": [0, 0, -10],
        "bodies": {"sleeve": {"mass": 2.0, "inertia": [0.01, 0.01, 0.01], "points": {"push": [0, 0, height]}}},
        "joints": {"guide": {"type": "prismatic", "axis": "x", "reference": "y", "inboard": "ground", "outboard": "sleeve",
                             "friction": sizes, "start": {"q": 0}}},
        "forces": {"push": {"type": "force", "on": "sleeve.push", "force": [1, 0, 0]}},
    }  # fmt: skip


def rod(offset: float = 1e-3, torque: float = 0.01) -> dict[str, Any]:
    """A rod of 20 N hangs from a ball joint. A torque about y turns the rod. offset: horizontal distance of the mass centre from
    the ball, m."""
    return {
        "schema": 1, "gravity": [0, 0, -10],
        "bodies": {"rod": {"mass": 2.0, "inertia": [0.01, 0.01, 0.01], "center": [offset, 0, -0.2], "points": {"top": [0, 0, 0]}}},
        "joints": {"ball": {"type": "spherical", "inboard": "ground", "outboard": "rod.top",
                            "friction": {"mu": 0.2, "radius": 0.01}}},
        "forces": {"turn": {"type": "torque", "on": "rod", "torque": [0, torque, 0]}},
    }  # fmt: skip


def beam() -> dict[str, Any]:
    """A beam of 100 N with its mass centre at 1.2 m. It can slide along guides at 0, 1 and 2 m, of half length 0.05 m, with μ 0.1,
    0.5 and 0.2."""
    joints: dict[str, Any] = {}
    points = {f"p{k}": [k, 0, 0] for k in range(3)}
    for k, mu in enumerate((0.1, 0.5, 0.2)):
        sizes = {"mu": mu, "half_length": 0.05, "half_width": 0.01, "half_height": 1e-6}
        joints[f"s{k}"] = {"type": "prismatic", "axis": "x", "reference": "y", "inboard": f"ground.p{k}", "outboard": f"beam.p{k}",
                           "friction": sizes}  # fmt: skip
    joints["s0"] |= {"start": {"q": 0}, "effort": 1.0}
    body = {"mass": 10.0, "inertia": [1, 1, 1], "center": [1.2, 0, 0], "points": points}
    return {"schema": 1, "gravity": [0, 0, -10], "ground": {"points": points}, "bodies": {"beam": body}, "joints": joints}
