"""A valid scene with one of everything, changes that make it invalid, and its problems after a change."""

from __future__ import annotations

import copy
from typing import Any

from trunnion.basics.errors import Problem, SceneError
from trunnion.scene import scene_from_dict, scene_from_text
from trunnion.scene.findings.findings_and_paths import parse_path

GONE = object()
"""Value that removes a key."""

VALID: dict[str, Any] = {
    "name": "one_of_everything",
    "title": "One of everything",
    "gravity": [0, 0, "-9.81 m/s^2"],
    "ground": {"points": {"origin": [0, 0, 0], "hook": [1, 0, 2]}},
    "friction": {"law": "regularized", "v_eps": "0.1 mm/s"},
    "inputs": {"motor": {"start": "2 N*m", "unit": "N*m"}, "wind": {"unit": "N"}},
    "bodies": {
        "arm": {
            "box": [1, "10 cm", 0.1],
            "density": "7.8 g/cm^3",
            "center": [0.5, 0, 0],
            "points": {"tip": [1, 0, 0]},
            "color": "steelblue",
        },
        "link": {"cylinder": {"radius": 0.02, "length": 0.4, "axis": "x"}, "mass": 2, "points": {"end": [0.2, 0, 0]}},
        "ball": {"sphere": "30 mm", "mass": 1},
        "block": {"mass": 3, "inertia": [0.1, 0.2, 0.25, 0.01, 0, 0], "points": {"side": [0, 0.1, 0]}},
        "sled": {"mass": 1, "inertia": [0, 0, 0]},
        "flyer": {"box": [0.1, 0.2, 0.3], "density": 500},
    },
    "joints": {
        "hinge": {
            "type": "revolute",
            "axis": "y",
            "inboard": "ground.hook",
            "outboard": "arm",
            "friction": {"mu": 0.3, "radius": "20 mm", "half_length": 0.05, "thrust_radius": 0.01},
            "start": {"q": "30 deg", "qd": "10 rpm"},
            "spring": {"stiffness": "5 N*m/rad", "rest": "45 deg"},
            "damping": "0.1 N*m*s/rad",
            "end_stops": {"stiffness": 1e4, "lower": "-90 deg", "upper": "90 deg", "damping": 0.2},
            "effort": {"input": "motor"},
        },
        "socket": {
            "type": "spherical",
            "inboard": "arm.tip",
            "outboard": "link",
            "pin": "outboard",
            "friction": {"mu": 0.2, "radius": 0.01, "law": "viscous", "viscosity": "0.2 s/m"},
            "start": {"q": {"axis": [0, 1, 1], "angle": "20 deg"}, "qd": [0, 0, 1]},
        },
        "cross": {
            "type": "universal",
            "axis": "x",
            "reference": "y",
            "inboard": "link.end",
            "outboard": {"body": "ball", "point": [0.01, 0, 0], "axis": [1, 0, 0]},
            "friction": {"mu": 0.2, "radius": [0.01, 0.012], "half_length": 0.03},
            "effort": [{"harmonic": {"amplitude": "2 N*m", "frequency": "3 Hz"}}, None],
        },
        "shaft": {
            "type": "cylindrical",
            "axis": "z",
            "inboard": "ground",
            "outboard": "block",
            "start": {"q": ["10 mm", "5 deg"], "qd": ["1 m/s", "1 rad/s"]},
            "drive": [None, {"constant": {"rate": "60 rpm", "start": "10 deg"}}],
            "spring": [{"stiffness": "2 kN/m"}, None],
        },
        "rail": {
            "type": "prismatic",
            "axis": [0, 0.6, 0.8],
            "reference": "x",
            "inboard": "block.side",
            "outboard": "sled",
            "friction": {"mu": 0.1, "half_length": 0.1, "half_width": 0.02, "half_height": 0.02},
            "drive": {"table": {"time": [0, 1, 2], "value": [0, "10 mm", 0]}},
        },
        "flight": {"type": "free", "inboard": "ground", "outboard": "flyer", "start": {"q": [0, 0, 1, 1, 0, 0, 0]}},
    },
    "forces": {
        "push": {"type": "force", "on": "arm.tip", "force": [0, {"input": "wind"}, "3 N"], "frame": "body"},
        "twist": {
            "type": "torque",
            "on": "flyer",
            "torque": [0, 0, {"ramp": {"start": 0, "end": "1 N*m", "duration": 2}}],
        },
        "rubber": {"type": "spring_damper", "between": ["sled", "ground.origin"], "stiffness": 200, "length": 0.5},
    },
    "outputs": ["arm.*", "hinge.q[1]", "energy.*", "*.friction.*"],
    "simulation": {"until": "5 s", "every": "10 ms", "rtol": 1e-7},
    "tunable": ["bodies.arm.center[2]"],
}

ARM = """
schema: 1
gravity: [0, -9.81, 0]
parameters: {a: 600 mm, thick: "{a/15}", mu: 0.12, pin: 8 mm, lift: 30 deg}
bodies:
  arm:
    box: ["{a}", "{thick}", "{thick}"]
    density: 7800
    points: {pivot: ["{-a/2}", 0, 0]}
joints:
  pivot:
    type: revolute
    axis: z
    inboard: ground
    outboard: arm.pivot
    friction: {mu: "{mu}", radius: "{pin}", half_length: "{2*pin - 1 mm}"}
    start: {q: "{lift}"}
simulation: {until: 0.2}
"""
"""A swinging arm whose numbers are expressions."""


def edited(changes: dict[str, Any]) -> dict[str, Any]:
    """The valid scene with other values at dotted paths. The value GONE removes a key."""
    data = copy.deepcopy(VALID)
    for text, value in changes.items():
        path = parse_path(text)
        assert path is not None, text
        node: Any = data
        for key in path[:-1]:
            node = node[key]
        if value is GONE:
            del node[path[-1]]
        else:
            node[path[-1]] = value
    return data


def problems_of(data: dict[str, Any]) -> list[Problem]:
    """Problems of a scene given as a dict; an empty list for a valid scene."""
    try:
        scene_from_dict(data)
    except SceneError as e:
        return list(e.problems)
    return []


def problems_in(text: str | bytes, file: str = "s.yaml", is_json: bool = False) -> list[Problem]:
    """Problems of a scene given as text."""
    try:
        scene_from_text(text, file, is_json)
    except SceneError as e:
        return list(e.problems)
    return []
