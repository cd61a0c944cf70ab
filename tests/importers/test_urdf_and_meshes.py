"""Files of other programs. Masses of solids equal closed forms, and URDF joints turn about the right axes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.importers.mujoco_comparison import accelerations, evaluable
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.importers import body_of_mesh, scene_of, scene_of_urdf
from trunnion.importers.xml_reader import LARGEST

URDF = """<robot name="two links">
  <link name="world"/>
  <link name="upper"><inertial><origin xyz="0.5 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>
    <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.2"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
    <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.02" iyz="0" izz="0.005"/></inertial>
    <visual><geometry><box size="0.1 0.1 0.5"/></geometry></visual></link>
  <link name="tool"/>
  <joint name="shoulder" type="continuous"><parent link="world"/><child link="upper"/><origin xyz="0 0 1" rpy="0 0 0.3"/>
    <axis xyz="0 1 0"/><dynamics damping="0.05"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="1 0 0" rpy="0.2 0.1 0"/>
    <axis xyz="1 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/><dynamics friction="0.1"/></joint>
  <joint name="mount" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0 0 -0.5"/></joint>
</robot>"""


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    return file


def box(file: Path, size: tuple[float, float, float], shift: tuple[float, float, float] = (0, 0, 0)) -> Path:
    import trimesh

    mesh = trimesh.creation.box(size)
    mesh.apply_translation(shift)
    mesh.export(file)
    return file


def test_a_boxs_mass_properties_are_its_closed_form(tmp_path: Path, needs: Callable[[str], None]) -> None:
    needs("trimesh")
    file = box(tmp_path / "block.stl", (1000, 100, 100), (500, 0, 0))  # lengths in millimetres
    body = body_of_mesh(file, 7800.0, "mm")
    assert body["mass"] == pytest.approx(78.0, rel=1e-6)  # STL has single precision
    assert body["center"] == pytest.approx([0.5, 0, 0], abs=1e-7)
    assert body["inertia"] == pytest.approx([0.13, 6.565, 6.565, 0, 0, 0], abs=1e-5)
    assert body["box"] == pytest.approx([1, 0.1, 0.1], rel=1e-6)


def test_an_open_surface_has_no_mass(tmp_path: Path, needs: Callable[[str], None]) -> None:
    needs("trimesh")
    import trimesh

    mesh = trimesh.creation.box((1, 1, 1))
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    mesh.export(tmp_path / "open.stl")
    with pytest.raises(SceneError, match="not closed"):
        body_of_mesh(tmp_path / "open.stl", 7800.0)


def test_surfaces_that_overlap_are_one_solid(tmp_path: Path, needs: Callable[[str], None]) -> None:
    """Two cubes of 100 mm, shifted by 50 mm, weigh 11.7 kg. A hollow cube weighs as much as both parts if a ball of the same
    material is in its cavity. If the hollow cube surrounds an overlapping cube, it weighs as the union."""
    needs("trimesh")
    needs("manifold3d")
    import trimesh

    def cube(edge: float, shift: float = 0.0) -> trimesh.Trimesh:
        made = trimesh.creation.box((edge, edge, edge))
        made.apply_translation((shift, 0, 0))
        return made

    def weight(*shells: trimesh.Trimesh) -> tuple[float, list[str]]:
        file, notes = tmp_path / "shells.stl", []
        trimesh.util.concatenate(shells).export(file)
        return body_of_mesh(file, 7800.0, "mm", notes)["mass"], notes

    mass, notes = weight(cube(100), cube(100, 50))
    assert mass == pytest.approx(11.7, rel=1e-6)
    assert [n for n in notes if "15.6" in n]
    hollow = cube(60)
    hollow.invert()
    assert weight(cube(100), hollow, cube(40)) == (pytest.approx(7.8 - 1.6848 + 0.4992, rel=1e-6), [])
    assert weight(cube(100), cube(40, 200)) == (pytest.approx(7.8 + 0.4992, rel=1e-6), [])
    assert weight(cube(100), hollow, cube(40, 40))[0] == pytest.approx(7.8 - 1.6848 + 7.8e-6 * 1600 * (10 + 10), rel=1e-6)


def test_a_urdf_becomes_a_scene_with_the_same_kinematics(urdf: Path) -> None:
    """The test compares forward kinematics of the file, written out, with the columns of the scene at given angles."""
    scene, notes = scene_of_urdf(urdf)
    assert set(scene.bodies) == {"upper", "lower"}
    assert scene.joints["elbow"].friction.torque == 0.1
    assert any("limits" in n for n in notes)
    q1, q2 = 0.7, -0.4
    start = {"joints.shoulder.start.q": q1, "joints.elbow.start.q": q2}
    r = trunnion.simulate(scene, 0.01, 0.01, overrides=start, outputs=["lower.tool.position[*", "upper.position[*"])
    shoulder = _place((0, 0, 1), (0, 0, 0.3)) @ _turn((0, 1, 0), q1)
    elbow = shoulder @ _place((1, 0, 0), (0.2, 0.1, 0)) @ _turn((1, 1, 0), q2)
    upper = [r[f"upper.position[{k}]"][0] for k in (1, 2, 3)]
    assert upper == pytest.approx((shoulder @ [0.5, 0, 0, 1])[:3], abs=1e-12)
    tool = [r[f"lower.tool.position[{k}]"][0] for k in (1, 2, 3)]
    assert tool == pytest.approx((elbow @ [0, 0, -0.5, 1])[:3], abs=1e-12)


def test_inertia_is_turned_into_the_links_axes(urdf: Path) -> None:
    body = scene_of_urdf(urdf)[0].bodies["upper"]
    assert body.inertia == pytest.approx((0.01, 0.2, 0.2, 0, 0, 0), abs=1e-12)
    assert body.center == pytest.approx((0.5, 0, 0))


def test_all_unsupported_content_is_reported_at_once(tmp_path: Path) -> None:
    file = tmp_path / "bad.urdf"
    file.write_text("""<robot name="bad"><link name="a"/><link name="b"/><link name="c"/>
      <joint name="one" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
      <joint name="two" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
      <mimic joint="none"/></joint></robot>""")
    with pytest.raises(SceneError) as e:
        scene_of_urdf(file)
    assert {(p.where, p.line) for p in e.value.problems} == {("b", 1), ("c", 1), ("two", 3)}


def test_a_joint_that_mimics_another_follows_it(tmp_path: Path) -> None:
    file = tmp_path / "gripper.urdf"
    weighed = '<inertial><origin xyz="0.1 0.2 0.3"/><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    hinge = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><axis xyz="0 1 0"/>{}</joint>'
    links = "".join(f'<link name="{n}">{weighed}</link>' for n in "ab")
    mimic = '<mimic joint="near" multiplier="-0.02" offset="0.1"/>'
    joints = hinge.format("near", "revolute", "world", "a", "") + hinge.format("far", "prismatic", "a", "b", mimic)
    file.write_text(f'<robot name="gripper"><link name="world"/>{links}{joints}</robot>')
    r = trunnion.simulate(scene_of_urdf(file)[0], 0.5, 0.1)
    assert np.ptp(r["near.q[1]"]) > 0.1
    assert r["far.q[1]"] == pytest.approx(0.1 - 0.02 * r["near.q[1]"], abs=1e-12)


def test_a_joint_that_mimics_another_starts_by_its_equation(tmp_path: Path) -> None:
    """Joints of a URDF start at 0, followers at their offset. Followers of followers start by the same rule."""
    file = tmp_path / "chain.urdf"
    weighed = '<inertial><origin xyz="0.1 0.2 0.3"/><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    links = "".join(f'<link name="{n}">{weighed}</link>' for n in "abc")
    hinge = '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/><axis xyz="0 1 0"/>{}</joint>'
    joints = (("third", "b", "c", ("second", 0.5, -1)), ("first", "world", "a", None), ("second", "a", "b", ("first", 2, 0.1)))
    text = ""
    for name, parent, child, m in joints:
        mimic = f'<mimic joint="{m[0]}" multiplier="{m[1]}" offset="{m[2]}"/>' if m else ""
        text += hinge.format(name, parent, child, mimic)
    file.write_text(f'<robot name="chain"><link name="world"/>{links}{text}</robot>')
    r = trunnion.simulate(scene_of_urdf(file)[0], 0.01, 0.01)
    assert [r[f"{n}.q[1]"][0] for n in ("first", "second", "third")] == pytest.approx([0, 0.1, 0.5 * 0.1 - 1], abs=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_massless_frames_in_chains_of_fixed_joints_are_points_of_bodies(seed: int, tmp_path: Path) -> None:
    """Each hinge has up to two frames before and after it, and each link has up to two frames behind it. Their order in the file is
    random. By forward kinematics, every mass centre and every point is at its place."""
    rng = np.random.default_rng(seed)
    parts: list[str] = []
    places: dict[str, np.ndarray] = {}

    def add(kind: str, parent: str, child: str, at: np.ndarray, mass: str = "") -> np.ndarray:
        """A joint with its child; ``at`` is the pose of the parent. Returns the pose of the child."""
        xyz, rpy = (rng.normal(size=3), rng.normal(size=3)) if kind == "fixed" else (np.zeros(3), np.zeros(3))
        origin = f'<origin xyz="{" ".join(map(str, xyz))}" rpy="{" ".join(map(str, rpy))}"/>'
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        parts.append(f'<link name="{child}">{mass}</link>')
        parts.append(f'<joint name="to_{child}" type="{kind}">{ends}{origin}<axis xyz="0 1 0"/></joint>')
        return at @ _place(tuple(xyz), tuple(rpy))

    parent, at = "world", np.eye(4)
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1.2" izz="0.9"/></inertial>'
    for k in range(3):
        frames = [f"f{k}{n}" for n in range(rng.integers(0, 3))]
        for frame in frames:
            at = add("fixed", parent, frame, at)
            parent = frame
        behind = rng.integers(0, 3)  # number of frames that the hinge moves, and that carry the link
        links = [*(f"a{k}{n}" for n in range(behind)), f"link{k}"]
        for n, link in enumerate(links):
            at = add("fixed" if n else "continuous", parent, link, at, mass if link == links[-1] else "")
            parent = link
        places[f"{parent}.position"] = at[:3, 3]
        tip, at_tip = parent, at
        for n in range(rng.integers(0, 3)):
            at_tip = add("fixed", tip, f"t{k}{n}", at_tip)
            tip = f"t{k}{n}"
            places[f"{parent}.{tip}.position"] = at_tip[:3, 3]
    rng.shuffle(parts)
    file = tmp_path / "frames.urdf"
    file.write_text(f'<robot name="frames"><link name="world"/>{"".join(parts)}</robot>')
    scene = scene_of_urdf(file)[0]
    assert set(scene.bodies) == {"link0", "link1", "link2"}
    r = trunnion.simulate(scene, 0.01, 0.01)
    for name, place in places.items():
        assert [r[f"{name}[{i}]"][0] for i in (1, 2, 3)] == pytest.approx(place, abs=1e-12)


def test_a_fixed_joint_may_be_turned(tmp_path: Path) -> None:
    """A plate turned by rpy at the end of an arm has the pose of forward kinematics."""
    file = tmp_path / "turned.urdf"
    weighed = '<inertial><origin xyz="0.1 0.2 0.3"/><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    file.write_text(f"""<robot name="turned"><link name="world"/><link name="plate">{weighed}</link>
      <joint name="mount" type="fixed"><parent link="world"/><child link="plate"/><origin xyz="1 2 3" rpy="0.3 -0.4 1.1"/></joint>
      </robot>""")
    r = trunnion.simulate(scene_of_urdf(file)[0], 0.01, 0.01, outputs=["plate.position[*"])
    found = [r[f"plate.position[{k}]"][0] for k in (1, 2, 3)]
    assert found == pytest.approx((_place((1, 2, 3), (0.3, -0.4, 1.1)) @ [0.1, 0.2, 0.3, 1])[:3], abs=1e-14)


HOSTILE = {
    "entities": ('<!DOCTYPE r [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><robot name="&b;"/>', "document type"),
    "too deep": ("<robot>" + "<a>" * 400 + "</a>" * 400 + "</robot>", "levels"),
    "no XML": ("<robot><link></robot>", "not well-formed"),
    "something else": ("<sphere/>", "begins with"),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_a_file_can_do_no_more_than_be_read(what: str, tmp_path: Path) -> None:
    text, words = HOSTILE[what]
    file = tmp_path / "hostile.xml"
    file.write_text(text)
    with pytest.raises(SceneError, match=words):
        scene_of(file)


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "large.xml"
    with file.open("wb") as f:
        f.truncate(LARGEST + 1)
    with pytest.raises(SceneError, match="larger than"):
        scene_of(file)


def test_the_command_imports_a_urdf_and_refuses_a_step_file(
    urdf: Path, tmp_path: Path, needs: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["import", str(urdf), "-o", str(tmp_path / "arm.yaml")]) == 0
    assert trunnion.simulate(str(tmp_path / "arm.yaml"), 0.1).outcome.ok
    assert main(["import", "thing.step"]) == 2
    capsys.readouterr()
    needs("trimesh")
    assert main(["import", str(box(tmp_path / "part.stl", (0.2, 0.1, 0.1))), "--unit", "m", "--density", "2700"]) == 0
    assert "part:" in capsys.readouterr().out


def _place(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> np.ndarray:
    out = np.eye(4)
    for axis, angle in zip(((0, 0, 1), (0, 1, 0), (1, 0, 0)), rpy[::-1], strict=True):
        out = out @ _turn(axis, angle)
    out[:3, 3] = xyz
    return out


def _turn(axis: tuple[float, ...], angle: float) -> np.ndarray:
    a = np.array(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    out = np.eye(4)
    out[:3, :3] = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return out


def test_the_moments_of_a_link_without_mass_are_those_of_the_body_that_holds_it(tmp_path: Path) -> None:
    """The axis xx of the link is the axis yy of the body."""
    foot = '<link name="f"><inertial><mass value="0"/><inertia ixx="0.01" iyy="0" izz="0"/></inertial></link>'
    body = '<inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.02" iyy="0.02" izz="0.02"/></inertial>'
    (tmp_path / "leg.urdf").write_text(f"""<robot name="leg"><link name="w"/><link name="a">{body}</link>{foot}
    <joint name="j" type="continuous"><parent link="w"/><child link="a"/><axis xyz="0 1 0"/></joint>
    <joint name="k" type="fixed"><parent link="a"/><child link="f"/><origin xyz="1 2 3" rpy="0 0 {np.pi / 2}"/></joint></robot>""")
    scene, _ = scene_of_urdf(tmp_path / "leg.urdf")
    assert list(scene.bodies) == ["a"]
    assert scene.bodies["a"].inertia == pytest.approx([0.02, 0.03, 0.02, 0, 0, 0], abs=1e-15)


def test_a_massless_link_between_moving_joints_adds_nothing(tmp_path: Path) -> None:
    """A slide along x, a massless link, a slide along z, and a body in series. The body falls freely."""
    ends = '<parent link="{1}"/><child link="{2}"/><axis xyz="{3}"/>'
    joint = f'<joint name="{{0}}" type="prismatic">{ends}<dynamics damping="2"/></joint>'
    body = '<inertial><mass value="4"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    (tmp_path / "xy.urdf").write_text(f"""<robot name="xy"><link name="w"/><link name="m"/><link name="a">{body}</link>
    {joint.format("x", "w", "m", "1 0 0")}{joint.format("z", "m", "a", "0 0 1")}</robot>""")
    model = evaluable(scene_of_urdf(tmp_path / "xy.urdf")[0])
    found = accelerations(model, {"x": [0.3], "z": [0.2]}, {"x": np.array([3.0]), "z": np.array([1.0])})
    assert [found["x"][0], found["z"][0]] == pytest.approx([-1.5, -9.81 - 0.5], rel=1e-12)


def test_a_fixed_joint_follows_nothing(tmp_path: Path) -> None:
    body = '<inertial><mass value="4"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    joint = '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>{4}</joint>'
    links = f'<link name="w"/><link name="a">{body}</link><link name="b">{body}</link>'
    (tmp_path / "hand.urdf").write_text(f"""<robot name="hand">{links}
    {joint.format("j", "continuous", "w", "a", "")}\n{joint.format("k", "fixed", "a", "b", '<mimic joint="j"/>')}</robot>""")
    assert "mimic of a fixed joint left out: <mimic> in line 3" in scene_of_urdf(tmp_path / "hand.urdf")[1]
