"""A contact whose force is round-off counts as open: its state is 0 and its angle keeps its last value, in every world."""

from __future__ import annotations

import numpy as np
import pytest

from trunnion import Scene, linearize, scene_from_dict, simulate

SEEDS = range(20)
ROUND_OFF = 1e-11
"""Largest force that round-off of springs of some hundred newtons leaves, N."""


def turn(rng: np.random.Generator) -> np.ndarray:
    """A random rotation (3×3)."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.diag(r)) * np.linalg.det(q * np.sign(np.diag(r)))


def pulled_rotor(seed: int, more: float) -> Scene:
    """A rotor on a journal. Three springs pull at the centre of its pin, and their forces cancel. more: additional force in the
    plane of the springs, N."""
    rng = np.random.default_rng(seed)
    world, stiffness, reach = turn(rng), rng.uniform(100, 1000), rng.uniform(0.3, 2.0)
    angles = rng.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * np.arange(3)
    ends = [world @ (reach * np.array([np.cos(a), np.sin(a), 0.0])) for a in angles]
    forces: dict[str, dict] = {
        f"spring{k}": {"type": "spring_damper", "between": [f"ground.end{k}", "rotor.centre"], "stiffness": stiffness,
                       "length": 0.5 * reach}
        for k in range(3)
    }  # fmt: skip
    forces["more"] = {"type": "force", "on": "rotor.centre", "force": (world @ [more, 0.0, 0.0]).tolist()}
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


@pytest.mark.parametrize("seed", SEEDS)
def test_contacts_with_forces_of_round_off_are_open(seed: int) -> None:
    found = simulate(pulled_rotor(seed, 0.0), outputs=["pin.contact*"])
    assert np.abs(found["pin.contact[1].normal_force"]).max() < ROUND_OFF
    for contact in (1, 2):
        assert not np.any(found[f"pin.contact[{contact}].state"])
        assert not np.any(found[f"pin.contact[{contact}].angle"])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_small_force_is_a_contact(seed: int) -> None:
    found = simulate(pulled_rotor(seed, 1e-6), outputs=["pin.contact*"])
    assert np.all(found["pin.contact[1].state"] == 1.0)


def test_the_state_of_a_contact_has_the_derivative_zero() -> None:
    found = linearize("crank_slider", outputs=["slider_pin.contact*"])
    rows = {name: np.abs(np.asarray(found.C)[i]).max() for i, name in enumerate(found.outputs)}
    assert rows["slider_pin.contact[1].normal_force"] > 0.0
    assert rows["slider_pin.contact[1].state"] == rows["slider_pin.contact[2].state"] == 0.0
