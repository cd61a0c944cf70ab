"""Surfaces of bodies, packed as text. Unpacking gives the same surface, also mirrored. Other text is reported."""

from __future__ import annotations

import base64
import zlib

import numpy as np
import pytest

from trunnion.basics.errors import SceneError
from trunnion.plots.geometry.mechanism_geometry import scenery
from trunnion.scene.queries.packed_surfaces import GRID, HEAD, mirrored, packed, unpacked
from trunnion.scene.scene_loader import scene_from_dict

POINTS = np.array([[0.1, 0.2, -0.3], [0.5, 0.2, -0.3], [0.1, 0.9, -0.3], [0.1, 0.2, 0.4]])
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def volume(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.einsum("ni,ni->", a, np.cross(b, c)) / 6)


def test_a_packed_surface_is_unpacked_to_half_a_step_of_the_grid() -> None:
    points, faces = unpacked(packed(POINTS.tolist(), FACES))
    step = np.ptp(POINTS, axis=0) / GRID
    assert np.all(np.abs(np.array(points) - POINTS) <= 0.5 * step + 1e-7)  # the stored bounds have single precision
    assert faces == FACES


@pytest.mark.parametrize("axis", range(3))
def test_a_mirror_turns_no_surface_inside_out(axis: int) -> None:
    text = packed(POINTS.tolist(), FACES)
    points, faces = unpacked(mirrored(text, axis))
    flip = np.ones(3)
    flip[axis] = -1
    assert np.array(points) == pytest.approx(POINTS * flip, abs=1e-4)
    assert volume(np.array(points), np.array(faces)) == pytest.approx(volume(POINTS, np.array(FACES)), rel=1e-4)


def body(surface: str) -> dict:
    return {
        "bodies": {"a": {"mass": 1, "inertia": [1, 1, 1], "center": [0.2, 0.3, 0], "surface": surface}},
        "joints": {"j": {"type": "free", "inboard": "ground", "outboard": "a"}},
    }


def test_a_surface_is_drawn_about_the_mass_centre() -> None:
    mesh = scenery(scene_from_dict(body(packed(POINTS.tolist(), FACES)))).parts[0].mesh
    assert mesh.vertices == pytest.approx(POINTS - [0.2, 0.3, 0], abs=1e-4)
    assert mesh.edges == (7,) * 4  # all sides of a tetrahedron are sharp


def test_a_mirrored_copy_of_a_body_has_the_mirrored_surface() -> None:
    placed = body(packed(POINTS.tolist(), FACES))["bodies"]["a"] | {"position": [0, 1, 0]}
    joint = {"type": "free", "inboard": "ground", "outboard": "a"}
    part = {"use": {"bodies": {"a": placed}, "joints": {"j": joint}}, "copies": {"mirror": "y"}}
    scene = scene_from_dict({"assemblies": {"wing": part}, "bodies": {}, "joints": {}})
    points = np.array(unpacked(scene.bodies["wing2_a"].surface)[0])
    assert points == pytest.approx(POINTS * [1, -1, 1], abs=1e-4)


def text(raw: bytes) -> str:
    return base64.b64encode(zlib.compress(raw)).decode()


WRONG = {
    "no such text": "surface!", "not compressed": base64.b64encode(b"nothing").decode(),
    "cut short": text(HEAD.pack(3, 1, *[0.0] * 6)),
    "refer to missing points": text(HEAD.pack(1, 1, *[0.0] * 6) + bytes(6) + b"\1\0" * 3),
    "nothing in it": text(HEAD.pack(0, 0, *[0.0] * 6)), "a bomb": text(bytes(50_000_000)), "too long": "A" * 2_000_000,
    "no numbers": text(HEAD.pack(1, 1, *[float("nan")] * 6) + bytes(12)),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_an_invalid_surface_is_reported(what: str) -> None:
    with pytest.raises(SceneError, match="invalid packed surface") as e:
        scene_from_dict(body(WRONG[what]))
    assert [p.where for p in e.value.problems] == ["bodies.a.surface"]
