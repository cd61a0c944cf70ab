"""A contact whose force is round-off counts as open: its state is 0, and its direction keeps its last value, in every world."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.reference.mechanics.rotation import random_rotation
from trunnion import Scene, linearize, scene_from_dict, simulate

SEEDS = range(20)
ROUND_OFF = 1e-11
"""Largest force that round-off of springs of some hundred newtons leaves, N."""


DIRECTION = ("angle", "normal[1]", "normal[2]", "normal[3]")
"""Columns of a contact that show its direction."""


def pulled_rotor(seed: int, more: Any) -> Scene:
    """A rotor on a journal. Three springs pull at the centre of its pin, and their forces cancel. more: additional force in the
    plane of the springs, N."""
    rng = np.random.default_rng(seed)
    world, stiffness, reach = random_rotation(rng), rng.uniform(100, 1000), rng.uniform(0.3, 2.0)
    angles = rng.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * np.arange(3)
    ends = [world @ (reach * np.array([np.cos(a), np.sin(a), 0.0])) for a in angles]
    forces: dict[str, dict] = {
        f"spring{k}": {"type": "spring_damper", "between": [f"ground.end{k}", "rotor.centre"], "stiffness": stiffness,
                       "length": 0.5 * reach}
        for k in range(3)
    }  # fmt: skip
    forces["more"] = {"type": "force", "on": "rotor.centre", "force": [_along(more, x) for x in world[:, 0]]}
    return scene_from_dict({
        "gravity": [0, 0, 0],
        "ground": {"points": {f"end{k}": p.tolist() for k, p in enumerate(ends)}},
        "bodies": {"rotor": {"mass": 1.0, "center": [0, 0, 0], "inertia": [0.1, 0.1, 0.1], "points": {"centre": [0, 0, 0]}}},
        "joints": {"pin": {"type": "revolute", "axis": world[:, 2].tolist(), "inboard": "ground", "outboard": "rotor",
                           "start": {"q": 0, "qd": 1.0},
                           "friction": {"law": "coulomb", "mu": 0.2, "radius": 0.02, "half_length": 0.05}}},
        "forces": forces,
        "simulation": {"until": 0.2, "every": 0.1},
    })  # fmt: skip


def _along(more: Any, x: float) -> Any:
    """A component of the force along a direction with this component."""
    return {"ramp": more["ramp"] | {"start": more["ramp"]["start"] * float(x)}} if isinstance(more, dict) else more * float(x)


@pytest.mark.parametrize("seed", SEEDS)
def test_contacts_with_forces_of_round_off_are_open(seed: int) -> None:
    found = simulate(pulled_rotor(seed, 0.0), outputs=["pin.contact*"])
    assert np.abs(found["pin.contact[1].normal_force"]).max() < ROUND_OFF
    for contact in (1, 2):
        assert not np.any(found[f"pin.contact[{contact}].state"])
        for name in DIRECTION:
            assert not np.any(found[f"pin.contact[{contact}].{name}"])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_contact_that_loses_its_load_keeps_its_last_direction(seed: int) -> None:
    scene = pulled_rotor(seed, {"ramp": {"start": 1.0, "end": 0.0, "duration": 0.11}})
    found = simulate(scene, outputs=["pin.contact*"], every=0.02)
    last = int(np.searchsorted(found.time, 0.11)) - 1
    for contact in (1, 2):
        state = found[f"pin.contact[{contact}].state"]
        assert np.all(state[: last + 1] == 1.0)
        assert not np.any(state[last + 1 :])
        for name in DIRECTION:
            values = found[f"pin.contact[{contact}].{name}"]
            assert np.all(values[last:] == values[last])
            assert name != "normal[1]" or np.linalg.norm([found[f"pin.contact[{contact}].{n}"][-1] for n in DIRECTION[1:]]) > 0.99


@pytest.mark.parametrize("seed", SEEDS)
def test_the_held_direction_of_an_unloaded_contact_has_the_derivative_zero(seed: int) -> None:
    found = linearize(pulled_rotor(seed, 0.0), outputs=["pin.contact*"])
    rows = {name: np.abs(np.asarray(found.C)[i]).max() for i, name in enumerate(found.outputs)}
    assert not any(rows[f"pin.contact[{contact}].{name}"] for contact in (1, 2) for name in DIRECTION)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_small_force_is_a_contact(seed: int) -> None:
    found = simulate(pulled_rotor(seed, 1e-6), outputs=["pin.contact*"])
    assert np.all(found["pin.contact[1].state"] == 1.0)


def test_the_state_of_a_contact_has_the_derivative_zero() -> None:
    found = linearize("crank_slider", outputs=["slider_pin.contact*"])
    rows = {name: np.abs(np.asarray(found.C)[i]).max() for i, name in enumerate(found.outputs)}
    assert rows["slider_pin.contact[1].normal_force"] > 0.0
    assert rows["slider_pin.contact[1].state"] == rows["slider_pin.contact[2].state"] == 0.0
