"""Drawn bodies are at their computed positions. Solids are closed, joints hold together, and contacts lie on their pins."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.mechanisms.band_brakes_and_belt_drives import Band, Brake, Drive
from trunnion.basics.errors import SceneError
from trunnion.plots.geometry import meshes
from trunnion.plots.geometry.belts_and_brake_bands import THICK, WIDE, straps
from trunnion.plots.geometry.mechanism_geometry import scenery
from trunnion.plots.geometry.meshes import Mesh
from trunnion.plots.geometry.motion_and_view import arrow_scale, motion, round_force
from trunnion.plots.mechanism_pictures.instant_picture import contact_places
from trunnion.scene import load_scene, model_names
from trunnion.scene.library.model_folders import design_names
from trunnion.simulation.results.result import Result


def volume(mesh: Mesh) -> float:
    """Enclosed volume by the divergence theorem. It is correct only for closed meshes whose faces all point outward."""
    total = 0.0
    for face in mesh.faces:
        p = mesh.vertices[list(face)]
        total += sum(float(p[0] @ np.cross(p[k], p[k + 1])) for k in range(1, len(p) - 1)) / 6
    return total


def test_boxes_are_closed_and_look_outward() -> None:
    assert volume(meshes.box(1.0, 0.1, 0.2)) == pytest.approx(0.02)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cylinders_are_closed_and_look_outward(axis: int) -> None:
    n, r, length = meshes.ROUND, 0.3, 0.7
    prism = 0.5 * n * r * r * np.sin(2 * np.pi / n) * length
    mesh = meshes.cylinder(r, length, axis)
    assert volume(mesh) == pytest.approx(prism)
    assert np.ptp(mesh.vertices[:, axis]) == pytest.approx(length)


def test_spheres_look_outward_and_nearly_fill_the_ball() -> None:
    assert volume(meshes.sphere(0.5, 60)) == pytest.approx(4 / 3 * np.pi * 0.125, rel=0.01)


def test_rods_end_at_the_given_points() -> None:
    mesh = meshes.rod(np.array([0.0, 1.0, 0.0]), np.array([1.0, 1.0, 1.0]), 0.05)
    assert volume(mesh) == pytest.approx(np.sqrt(2) * 0.01)
    along = (mesh.vertices - [0, 1, 0]) @ np.array([1, 0, 1]) / np.sqrt(2)
    assert (along.min(), along.max()) == (pytest.approx(0), pytest.approx(np.sqrt(2)))


@pytest.mark.default_cases(11)
@pytest.mark.parametrize("name", model_names())
def test_every_bundled_model_can_be_drawn(name: str) -> None:
    scene = scenery(load_scene(name))
    assert all(len(p.mesh.faces) for p in scene.parts)
    assert scene.size > 0


def joint_gap(result: Result, row: int) -> float:
    """Largest distance between the two sides of the joints whose parts share a point."""
    scene = scenery(result.scene)
    moved = motion(result, [p.name for p in scene.parts])
    gaps = [0.0]
    for j in scene.joints:
        if j.type in ("revolute", "spherical", "universal"):
            places = [moved.pose(p, row) for p in j.parts]
            ends = [x + r @ p for (x, r), p in zip(places, j.points, strict=True)]
            gaps.append(float(np.linalg.norm(ends[1] - ends[0])))
    return max(gaps)


@pytest.mark.default_cases(5)
@pytest.mark.parametrize("name", design_names())
def test_pins_that_are_symbols_are_no_thicker_than_what_they_join(name: str) -> None:
    """A trolley of 40 mm on a panel of two metres must not be drawn with pins of 100 mm."""
    scene = load_scene(name)
    drawn = scenery(scene)
    for j in drawn.joints:
        joined = [np.ptp(drawn.parts[p].mesh.vertices, axis=0).min() for p in j.parts if p >= 0]
        for _, mesh in j.pins if scene.joints[j.name].friction is None else ():
            assert np.ptp(mesh.vertices, axis=0).min() <= min(joined) * 1.001


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("run", ["swing", "slider", "double"])
def test_drawn_bodies_meet_in_their_joints(run: str, request: pytest.FixtureRequest) -> None:
    result = request.getfixturevalue(run)
    assert max(joint_gap(result, row) for row in (0, 40, 60)) < 1e-6  # the run closes loops to its tolerance


@pytest.mark.parametrize(("run", "count"), [("swing", 1), ("slider", 2), ("double", 6)])
def test_contacts_lie_on_the_surface_of_their_pin(run: str, count: int, request: pytest.FixtureRequest) -> None:
    result = request.getfixturevalue(run)
    scene = scenery(result.scene)
    moved = motion(result, [p.name for p in scene.parts])
    marks = {c.columns: (j, c) for j in scene.joints for c in j.contacts}
    found = contact_places(scene, moved, result, 50)
    assert len(found) == count
    for columns, point, normal, force, _ in found:
        j, c = marks[columns]
        x, r = moved.pose(c.part, 50)
        side = j.parts.index(c.part)
        offset = point - (x + r @ c.base)
        axis = r @ j.frames[side][:, 1 if columns.endswith(("[3]", "[4]")) and j.type == "universal" else 0]
        assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-9)
        assert np.linalg.norm(offset) == pytest.approx(c.arm)
        assert force > 0
        if j.type != "spherical":
            assert abs(normal @ axis) < 1e-6


def test_normal_forces_of_the_ball_carry_what_the_joint_transmits(swing: Result) -> None:
    """f_c is the reaction on the ball (outboard). Its normal part is −f n, because friction is perpendicular to n."""
    for row in (10, 100, 250):
        n = np.array([swing[f"ball.contact[1].normal[{k}]"][row] for k in (1, 2, 3)])
        on_ball = -np.array([swing[f"ball.reaction.force[{k}]"][row] for k in (1, 2, 3)])
        assert on_ball @ n == pytest.approx(-swing["ball.contact[1].normal_force"][row], rel=1e-6)


def test_the_arrow_of_the_legend_is_round_and_of_a_sensible_length(slider: Result) -> None:
    scene = scenery(slider.scene)
    scale = arrow_scale(slider, scene)
    force = round_force(scale, scene.size)
    assert f"{force:g}".strip("0.") in ("1", "2", "5")
    assert 0.1 * scene.size < force * scale < 0.5 * scene.size


def test_columns_that_a_picture_needs_are_named_when_missing(pendulum: Result) -> None:
    from dataclasses import replace

    few = replace(pendulum, data=pendulum.data[:, :2], columns=pendulum.columns[:1])
    with pytest.raises(SceneError, match=r"orientation"):
        motion(few, ["pendulum"])


@pytest.mark.parametrize("crossed", [False, True])
@pytest.mark.parametrize("radii", [(0.05, 0.12), (0.1, 0.1), (0.15, 0.04)])
def test_the_strap_of_a_belt_has_the_length_of_the_belt_and_touches_both_pulleys(crossed: bool, radii: tuple[float, float]) -> None:
    """The volume of the strap's plates gives the length. Arcs of 12° are 0.2 % longer than their chords."""
    r, apart = np.array(radii), 0.4
    turn = np.arccos((r[0] + r[1] if crossed else r[0] - r[1]) / apart)
    length = 2 * apart * np.sin(turn) + 2 * (np.pi - turn) * r[0] + 2 * ((np.pi - turn) if crossed else turn) * r[1]
    ((_, body, mesh),) = straps(Drive(Band(0.3, 0.0, None, 200.0), radii, apart, (0.01, 0.05), (0.0, 0.0), crossed=crossed).scene())
    wide, thick = WIDE * min(radii), THICK * min(radii)
    assert body == "ground"
    assert volume(mesh) / (wide * thick) == pytest.approx(length, rel=4e-3)
    for radius, y in zip(radii, (0.0, apart), strict=True):
        near = np.hypot(mesh.vertices[:, 1] - y, mesh.vertices[:, 2]).min()
        assert radius * np.cos(np.deg2rad(6)) - thick < near < radius


def test_a_band_brake_is_drawn_about_its_drum_over_its_angle_of_wrap() -> None:
    ((_, body, mesh),) = straps(Brake(Band(0.3, 4.0, 100.0), 0.1, 0.2, 30.0, 5.0).scene())
    near = np.hypot(mesh.vertices[:, 1], mesh.vertices[:, 2])
    assert body == "ground"
    assert (near.min(), near.max()) == pytest.approx((0.1, np.hypot(0.1, 0.1)), rel=0.1)


def test_the_places_of_drag_fields_and_attraction_are_drawn_at_their_points() -> None:
    marks = {m.name: m for m in scenery(load_scene("hatch")).joints}
    for name, point in (("air", (0.0, 0.0, 0.0)), ("magnet", (0.5, 0.0, 0.0))):
        ((part, mesh),) = marks[name].pins
        assert part == 0
        assert mesh.vertices.mean(axis=0) == pytest.approx(point, abs=1e-9)
