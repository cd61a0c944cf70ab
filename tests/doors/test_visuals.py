"""What a URDF shows is drawn where its link is: places, scales, meshes; and what cannot be found is told at once."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import engine
from engine.basics.problems import SceneError
from engine.cli import main
from engine.doors import shapes_of_urdf
from engine.doors.visuals import coarser
from engine.plots.meshes import FINE, box, sphere
from engine.plots.playback import content
from engine.plots.scenery import scenery

ARM = """<robot name="arm"><link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <link name="arm-1"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.05" length="1"/></geometry></visual>
    {more}</link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="arm-1"/><axis xyz="0 0 1"/></joint></robot>"""
MESH = '<visual><origin xyz="1 0 0"/><geometry><mesh filename="{name}" scale="0.001 0.001 0.002"/></geometry></visual>'
SCENE = """schema: 1
gravity: [0, 0, -9.81]
bodies: {arm_1: {mass: 2, center: [0.5, 0, 0], inertia: [0.1, 0.1, 0.1]}}
joints: {turn: {type: revolute, axis: z, inboard: ground, outboard: arm_1}}
"""


def stl(file: Path, vertices: np.ndarray, faces: list[tuple[int, ...]]) -> Path:
    """A binary STL."""
    triangles = [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
    data = b"".join(struct.pack("<12fH", 0, 0, 0, *vertices[list(t)].ravel(), 0) for t in triangles)
    file.write_bytes(b" " * 80 + struct.pack("<I", len(triangles)) + data)
    return file


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A URDF of one arm on a base, without meshes."""
    (tmp_path / "arm.urdf").write_text(ARM.format(more=""))
    (tmp_path / "arm.yaml").write_text(SCENE)
    return tmp_path / "arm.urdf"


def test_visuals_are_in_the_frames_of_their_links(arm: Path) -> None:
    """A cylinder along z, turned by rpy (0, 90°, 0), lies along x, from the link's origin to 1 m; a base without mass is ground."""
    shapes = shapes_of_urdf(arm)
    assert set(shapes) == {"ground", "arm_1"}
    low, high = shapes["arm_1"].vertices.min(axis=0), shapes["arm_1"].vertices.max(axis=0)
    np.testing.assert_allclose([low, high], [[0, -0.05, -0.05], [1, 0.05, 0.05]], atol=1e-12)
    np.testing.assert_allclose(np.ptp(shapes["ground"].vertices, axis=0), [0.2, 0.2, 0.1])


def test_they_are_drawn_from_the_mass_centre_and_stand_on_the_ground(arm: Path) -> None:
    run = engine.simulate(str(arm.with_suffix(".yaml")), until=0.1)
    drawn = scenery(run.scene, FINE, shapes_of_urdf(arm))
    np.testing.assert_allclose(drawn.parts[0].mesh.vertices[:, 0].min(), -0.5, atol=1e-12)
    parts = content(run, shapes_of_urdf(arm))["parts"]
    assert [(p["name"], p["channel"] < 0) for p in parts] == [("arm_1", False), ("ground", True)]


def test_the_command_draws_them(arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, page = str(arm.with_suffix(".yaml")), tmp_path / "arm.html"
    assert main(["simulate", scene, "--until", "0.1", "--animate", str(page), "--shapes", str(arm)]) == 0
    assert '"name":"ground"' in page.read_text(encoding="utf-8")
    assert main(["simulate", scene, "--until", "0.1", "--shapes", str(arm)]) == 2
    assert "add --animate FILE" in capsys.readouterr().err


def test_meshes_are_found_scaled_and_placed(tmp_path: Path, needs: Callable[[str], None]) -> None:
    """A block in millimetres, beside the file and by package://, ends where its origin and its scales put it."""
    needs("trimesh")
    (tmp_path / "robot" / "meshes").mkdir(parents=True)
    (tmp_path / "robot" / "urdf").mkdir()
    block = box(100.0, 60.0, 20.0, FINE)
    stl(tmp_path / "robot" / "meshes" / "tool.stl", block.vertices, list(block.faces))
    for name in ("package://robot/meshes/tool.stl", "../meshes/tool.stl"):
        file = tmp_path / "robot" / "urdf" / "arm.urdf"
        file.write_text(ARM.format(more=MESH.format(name=name)))
        spots = shapes_of_urdf(file)["arm_1"].vertices
        np.testing.assert_allclose(spots.max(axis=0), [1.05, 0.05, 0.05], atol=1e-7)  # STL has single precision
        tool = spots[spots[:, 0] > 1.0 + 1e-9]
        np.testing.assert_allclose(np.ptp(tool[:, 1:], axis=0), [0.06, 0.04], atol=1e-7)


def test_every_mesh_that_is_not_there_is_told(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM.format(more=MESH.format(name="a.stl") + MESH.format(name="package://x/b.stl")))
    with pytest.raises(SceneError) as e:
        shapes_of_urdf(tmp_path / "arm.urdf")
    assert [w in str(e.value) for w in ("'a.stl'", "'package://x/b.stl'")] == [True, True]
    (tmp_path / "no.urdf").write_text("<robot")
    with pytest.raises(SceneError, match="cannot be read"):
        shapes_of_urdf(tmp_path / "no.urdf")


def test_large_meshes_are_made_coarser_and_keep_their_shape() -> None:
    """A ball of 40,000 triangles: as few as asked for, its vertices no farther from the sphere than cells of the grid allow."""
    fine = sphere(1.0, 200)
    faces = np.array([(f[0], f[k], f[k + 1]) for f in fine.faces for k in range(1, len(f) - 1)])
    vertices, few = coarser(fine.vertices, faces, 6000)
    assert 2000 < len(few) <= 6000
    used = vertices[np.unique(few)]
    np.testing.assert_allclose(np.linalg.norm(used, axis=1), 1.0, atol=0.02)
    same = coarser(fine.vertices, faces, len(faces))
    assert same[1] is faces
