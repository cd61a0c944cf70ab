"""A scene draws the visuals of other programs' files: simple solids as shapes, all other solids as their surfaces."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.scene.bodies.test_surfaces import volume
from trunnion.importers import scene_of_mjcf, scene_of_sdf, scene_of_urdf
from trunnion.importers.pose_matrices import pose
from trunnion.importers.visual_shapes import FACES, Solid, coarse, drawn
from trunnion.scene.queries.packed_surfaces import unpacked

EXACT = {
    "box": ((0.2, 0.3, 0.4), 0.024), "cylinder": ((0.1, 0.5), np.pi * 0.01 * 0.5), "sphere": ((0.2,), 4 / 3 * np.pi * 0.008),
    "capsule": ((0.1, 0.5), np.pi * 0.01 * 0.5 + 4 / 3 * np.pi * 0.001), "ellipsoid": ((0.1, 0.2, 0.3), 4 / 3 * np.pi * 0.006),
}  # fmt: skip
TURNED = pose((0.3, 0.1, -0.2), Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).as_matrix())


@pytest.mark.parametrize("kind", EXACT)
def test_surfaces_of_solids_are_closed_around_their_volume(kind: str) -> None:
    """With twenty sides, a round solid loses 1.6 % of its volume (sin(2π/20)/(2π/20)), and a sphere 4 %."""
    sizes, expected = EXACT[kind]
    corners = Solid(kind, sizes, TURNED).triangles()
    found = volume(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    assert 0.955 * expected <= found <= expected * (1 + 1e-9)
    middle = (corners.reshape(-1, 3).max(axis=0) + corners.reshape(-1, 3).min(axis=0)) / 2
    assert middle == pytest.approx([0.3, 0.1, -0.2], abs=0.02)


def test_one_solid_about_the_mass_centre_is_a_shape() -> None:
    for turn, edges in ((np.eye(3), [0.2, 0.3, 0.4]), (Rotation.from_euler("x", 90, degrees=True).as_matrix(), [0.2, 0.4, 0.3])):
        assert drawn([Solid("box", (0.2, 0.3, 0.4), pose((1, 2, 3), turn))], np.array([1, 2, 3])) == {"box": edges}
    assert set(drawn([Solid("box", (0.2, 0.3, 0.4), pose((1, 2, 3)))], np.zeros(3))) == {"surface"}
    assert drawn([], np.zeros(3)) == {}


def test_fine_meshes_are_coarsened_and_keep_their_extent() -> None:
    fine = np.concatenate([Solid("sphere", (1.0,), pose((0.001 * k, 0, 0))).triangles() for k in range(20)])
    points, faces = coarse(fine)
    assert 100 < len(faces) <= FACES < len(fine)
    assert np.ptp(points, axis=0) == pytest.approx(np.ptp(fine.reshape(-1, 3), axis=0), rel=0.1)


def stl(file: Path, corners: np.ndarray) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in corners)
    file.write_bytes(bytes(80) + struct.pack("<I", len(corners)) + rows)


WEIGHED = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'


def robot(mesh: str) -> str:
    """A URDF of one link, whose visual is a mesh 0.3 m from its origin."""
    visual = f'<visual><origin xyz="0.3 0 0"/><geometry>{mesh}</geometry></visual>'
    joint = '<joint name="j" type="continuous"><parent link="w"/><child link="a"/></joint>'
    return f'<robot name="r"><link name="w"/><link name="a">{WEIGHED}{visual}</link>{joint}</robot>'


def extent(scene: object, name: str) -> np.ndarray:
    points = np.array(unpacked(scene.bodies[name].surface)[0])  # type: ignore[attr-defined]
    return np.array([points.min(axis=0), points.max(axis=0)])


def test_meshes_of_all_formats_are_drawn_where_they_stand(tmp_path: Path) -> None:
    """A box of 1 × 2 × 3 from an STL, scaled to a tenth and moved. URDF refers to the file by its package, MJCF by its asset, SDF
    by its uri."""
    stl(tmp_path / "bot" / "meshes" / "box.stl", Solid("box", (1, 2, 3), np.eye(4)).triangles())
    expected = np.array([[0.25, -0.1, -0.15], [0.35, 0.1, 0.15]])
    urdf = tmp_path / "bot" / "urdf" / "bot.urdf"
    urdf.parent.mkdir()
    urdf.write_text(robot('<mesh filename="package://bot/meshes/box.stl" scale="0.1 0.1 0.1"/>'))
    mjcf = tmp_path / "bot" / "bot.xml"
    asset = '<compiler meshdir="meshes"/><asset><mesh name="m" file="box.stl" scale="0.1 0.1 0.1"/></asset>'
    body = '<body name="a"><joint/><geom type="mesh" mesh="m" pos="0.3 0 0"/></body>'
    mjcf.write_text(f"<mujoco>{asset}<worldbody>{body}</worldbody></mujoco>")
    sdf = tmp_path / "bot" / "bot.sdf"
    mesh = "<geometry><mesh><uri>meshes/box.stl</uri><scale>0.1 0.1 0.1</scale></mesh></geometry>"
    link = f'<link name="a"><visual name="v"><pose>0.3 0 0 0 0 0</pose>{mesh}</visual></link>'
    sdf.write_text(f'<sdf version="1.9"><model name="m">{link}</model></sdf>')
    for read, file in ((scene_of_urdf, urdf), (scene_of_mjcf, mjcf), (scene_of_sdf, sdf)):
        assert extent(read(file)[0], "a") == pytest.approx(expected, abs=1e-5), file.name


def test_a_body_that_mujoco_hides_altogether_is_drawn_by_its_first_group(tmp_path: Path) -> None:
    """In MuJoCo a skin covers this body, but scenes have no skins, so the body would be invisible. If another geom is visible,
    hidden geoms stay hidden."""
    file = tmp_path / "dog.xml"
    bone, flesh = '<geom type="sphere" size="0.2" group="5"/>', '<geom type="sphere" size="0.5" group="3"/>'
    bodies = (bone + flesh, bone, bone + '<geom type="sphere" size="0.1" group="1"/>')
    made = "".join(f'<body name="b{k}" pos="{k} 0 0"><joint/>{geoms}</body>' for k, geoms in enumerate(bodies))
    file.write_text(f"<mujoco><worldbody>{made}</worldbody></mujoco>")
    scene, _ = scene_of_mjcf(file)
    assert [scene.bodies[f"b{k}"].sphere for k in range(3)] == [pytest.approx(r) for r in (0.5, 0.2, 0.1)]


def test_a_mesh_that_is_not_there_is_reported_and_not_missed(tmp_path: Path) -> None:
    file = tmp_path / "bot.urdf"
    file.write_text(robot('<mesh filename="none.dae"/>'))
    scene, notes = scene_of_urdf(file)
    assert scene.bodies["a"].surface is None
    assert any("none.dae" in n for n in notes)
