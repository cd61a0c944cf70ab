"""Random epicyclic trains with planets in parallel, whose sun slips in its bearing."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.reference.scenes.random_streams import stream


def train(seed: int, planets: int) -> dict[str, Any]:
    """An epicyclic train. The torque on its ring grows until the sun slips. Seeds give sizes, masses and the joints with
    friction."""
    rng = stream(seed, str(planets), "planets")
    sun, planet, module = int(rng.integers(16, 30)), int(rng.integers(16, 30)), 4e-3
    arm, angles = (sun + planet) * module / 2, 2 * np.pi * np.arange(planets) / planets
    at = [[float(arm * np.cos(a)), float(arm * np.sin(a)), 0.0] for a in angles]
    origin = [0.0, 0.0, 0.0]

    def body(mass: float, radius: float, **more: Any) -> dict[str, Any]:
        j = 0.5 * mass * radius**2
        return {"mass": mass, "inertia": [j / 2, j / 2, j], "position": origin} | more

    ratio = (sun + 2 * planet) / sun
    size = float(rng.uniform(0.5, 2.0))
    center = [float(x) for x in rng.uniform(-0.02, 0.02, 2)] + [0.0]
    bodies = {"sun": body(0.5, 0.04), "ring": body(2.0, 0.13), "car": body(1.0, arm, center=center)}
    joints: dict[str, Any] = {
        "rsun": {"inboard": "ground", "outboard": "sun", "at": origin,
                 "friction": {"mu": float(rng.uniform(0.2, 0.6)), "radius": 0.015, "half_length": 0.05}},
        "rring": {"inboard": "ground", "outboard": "ring", "at": origin,
                  "effort": {"ramp": {"start": 0, "end": size, "duration": 1}}},
        "rcar": {"inboard": "ground", "outboard": "car", "at": origin, "damping": float(rng.uniform(0.0, 0.3)) * ratio},
    }  # fmt: skip
    for i, place in enumerate(at):
        bodies[f"p{i}"] = body(float(rng.uniform(0.2, 0.5)), planet * module / 2) | {"position": place}
        rubs = {"friction": {"torque": float(rng.uniform(0.002, 0.02))}} if rng.random() < 0.6 else {}
        joints[f"rp{i}"] = {"inboard": "car", "outboard": f"p{i}", "at": place} | rubs
        joints[f"gs{i}"] = {"type": "gear", "inboard": "sun", "outboard": f"p{i}", "teeth": [sun, planet], "module": module}
        joints[f"gr{i}"] = {"type": "gear", "inboard": f"p{i}", "outboard": "ring", "teeth": [planet, sun + 2 * planet],
                            "module": module, "internal": True}  # fmt: skip
    joints = {n: {"type": "revolute", "axis": "z"} | j for n, j in joints.items()}
    return {"gravity": [0, -9.81, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 1.0}}
