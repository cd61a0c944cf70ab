"""Scenes in which the load of a contact passes near zero. A joint at rest then loses its friction for a short time, and slips or
almost slips. Closed formulas give the times of the slips."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.reference.scenes.brief_crossing_signals import log_uniform

UNTIL = 2.0
"""Duration of a run, s."""
ROOM = 4.0
"""Distance of a dip from the start and the end of the run, relative to half its width."""
WIDEST = 0.05
"""Half width of a dip, relative to the load's period. A pair that slips longer may slide into the next dip."""


@dataclass(frozen=True)
class Dips:
    """A scene with one joint ``guide``, and the times at which this joint slips, s."""

    scene: dict[str, Any]
    slips: list[float]


def dips(seed: int) -> Dips | None:
    """A steady push along a guide, or a steady torque about a bearing, under a load across: one component is steady and small, the
    other is a large harmonic. The least capacity is slightly below or above the push. None if dips are too wide or too close to the
    run's ends."""
    r = np.random.default_rng([77, seed])
    period, mu, swing = r.uniform(0.5, 3.0), r.uniform(0.1, 0.5), r.uniform(5.0, 50.0)
    steady, phase = swing * log_uniform(r, -3.5, -0.7), r.uniform(0.0, 2.0 * math.pi)
    slips, far, slides = r.random() < 0.6, log_uniform(r, -4.0, -1.0), r.random() < 0.4
    lever = 1.0 if slides else 0.01 / math.sqrt(1.0 + mu * mu)
    push = lever * mu * steady * (1.0 + far if slips else 1.0 - far)
    wave = {"harmonic": {"amplitude": swing, "frequency": 1.0 / period, "phase": phase}}
    size = {"half_length": 0.05, "half_width": 0.02, "half_height": 0.03} if slides else {"radius": 0.01, "half_length": 0.02}
    joint = {"type": "prismatic", "axis": "x"} if slides else {"type": "revolute", "axis": "z"}
    scene = {
        "schema": 1, "gravity": [0, 0, 0], "bodies": {"slider": {"mass": 1.0, "inertia": [1e-2] * 3}},
        "joints": {"guide": joint | {"inboard": "ground", "outboard": "slider", "friction": {"mu": mu} | size}},
        "forces": {
            "load": {"type": "force", "on": "slider", "force": [push if slides else steady, wave, steady if slides else 0.0]},
            "twist": {"type": "torque", "on": "slider", "torque": [0, 0, 0 if slides else push]},
        },
        "simulation": {"until": UNTIL},
    }  # fmt: skip
    if not slips:
        return Dips(scene, [])
    full = steady * (1.0 + far)  # load at which the capacity equals the push: |y| + steady in a guide, a norm in a bearing
    half = period * math.asin((full - steady if slides else math.sqrt(full**2 - steady**2)) / swing) / (2.0 * math.pi)
    zeros = [t for k in range(20) if (t := period * (k / 2.0 - phase / (2.0 * math.pi))) > -ROOM * half and t < UNTIL + ROOM * half]
    if half > WIDEST * period or any(t < ROOM * half or t > UNTIL - ROOM * half for t in zeros):
        return None
    return Dips(scene, [t - half for t in zeros])
