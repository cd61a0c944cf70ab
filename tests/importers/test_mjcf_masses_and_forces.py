"""Numbers of MJCF: masses of geoms and meshes, and forces along joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.importers.test_mjcf import BALL, column, read
from trunnion.importers.mjcf.body_masses import unit_solid
from trunnion.importers.mjcf.mesh_solids import solid

SOLIDS = {
    "sphere": ([0.4], lambda x: (x**2).sum(0) <= 0.16),
    "capsule": ([0.2, 0.3], lambda x: x[0] ** 2 + x[1] ** 2 + np.maximum(np.abs(x[2]) - 0.3, 0.0) ** 2 <= 0.04),
    "cylinder": ([0.3, 0.4], lambda x: (x[0] ** 2 + x[1] ** 2 <= 0.09) & (np.abs(x[2]) <= 0.4)),
    "box": ([0.2, 0.3, 0.4], lambda x: (np.abs(x[0]) <= 0.2) & (np.abs(x[1]) <= 0.3) & (np.abs(x[2]) <= 0.4)),
    "ellipsoid": ([0.2, 0.3, 0.4], lambda x: ((x / np.array([[0.2], [0.3], [0.4]])) ** 2).sum(0) <= 1),
}


@pytest.mark.parametrize("kind", SOLIDS)
def test_geoms_weigh_what_their_points_do(kind: str) -> None:
    """The test compares volume and inertia with the sum over the cells of a grid. The sum uses only whether points are inside."""
    size, inside = SOLIDS[kind]
    n, half = 120, 0.5
    line = (np.arange(n) + 0.5) / n * 2 * half - half
    points = np.array(np.meshgrid(line, line, line)).reshape(3, -1)
    points = points[:, inside(points)]
    cell = (2 * half / n) ** 3
    made = unit_solid(kind, size)
    assert made.mass == pytest.approx(cell * points.shape[1], rel=0.02)  # a cell at the surface counts fully or not at all
    second = cell * points @ points.T
    expected = np.trace(second) * np.eye(3) - second
    assert made.inertia == pytest.approx(expected, rel=0.04, abs=1e-4 * np.trace(expected))


@pytest.mark.parametrize("way", ["exact", "legacy", "convex"])
def test_a_mesh_weighs_what_its_box_does(way: str) -> None:
    """A box away from the origin, as twelve triangles. For a solid that is not hollow, all methods for the mass agree."""
    corners = np.array([[x, y, z] for x in (1, 2) for y in (0, 3) for z in (-1, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]
    made, box = solid(corners[np.array(faces)], way), unit_solid("box", [0.5, 1.5, 1.0])
    assert made.mass == pytest.approx(box.mass, rel=1e-14)
    assert made.center == pytest.approx([1.5, 1.5, 0.0], abs=1e-14)
    assert made.inertia == pytest.approx(box.inertia, rel=1e-13, abs=1e-13)


def test_springs_dampers_friction_and_rotors_of_joints_are_imported(tmp_path: Path) -> None:
    """Angles in degrees become radians. A coordinate is zero where the file draws the mechanism. Motors add rotors and dampers by
    the square of their gears."""
    acting = 'springref="40" stiffness="2" damping="0.3" armature="0.02" frictionloss="0.4"'
    joint = f'<joint name="j" ref="10" {acting} range="-90 90"/>'
    motor = '<actuator><motor name="m" joint="j" gear="3" armature="0.01" damping="0.1"/></actuator>'
    key = '<keyframe><key name="home" qpos="0.5"/></keyframe>'
    scene, notes = read(tmp_path, f'<worldbody><body name="b">{joint}{BALL}</body></worldbody>{motor}{key}')
    j = scene.joints["j"]
    assert j.spring.stiffness == 2
    assert j.spring.rest == pytest.approx(np.deg2rad(30))
    assert (j.damping, j.rotor_inertia) == (pytest.approx(0.3 + 0.9), pytest.approx(0.02 + 0.09))
    assert j.friction.torque == 0.4
    assert j.start.q == pytest.approx(0.5 - np.deg2rad(10))
    assert any("limits" in n and "j" in n for n in notes)
    assert any("actuators" in n and "m" in n for n in notes)
    assert any("contacts" in n for n in notes)


def test_a_spring_given_by_its_swing_swings_so(tmp_path: Path) -> None:
    """springdamper gives a time constant of 0.5 s and a damping ratio of 0.4. The body has a rotor: ω = 1/(0.5·0.4), damping 2
    I/0.5."""
    joint = '<joint name="j" axis="0 0 1" springdamper="0.5 0.4" armature="0.3"/>'
    scene, _ = read(tmp_path, f'<worldbody><body name="b">{joint}{BALL}</body></worldbody>')
    inertia = 0.4 * 0.01 + 0.09 + 0.3
    assert scene.joints["j"].spring.stiffness == pytest.approx(inertia / (0.5 * 0.4) ** 2, rel=1e-14)
    assert scene.joints["j"].damping == pytest.approx(2 * inertia / 0.5, rel=1e-14)


def test_gravity_compensation_carries_its_share_of_the_weight(tmp_path: Path) -> None:
    """gravcomp 1 carries the whole weight of a body, and gravcomp 0.5 half of it."""
    for share, expected in ((1.0, 0.0), (0.5, -4.905)):
        scene, _ = read(tmp_path, f'<worldbody><body name="b" gravcomp="{share}"><freejoint name="f"/>{BALL}</body></worldbody>')
        assert column(scene, "b.acceleration[3]")[0] == pytest.approx(expected, abs=1e-14)
