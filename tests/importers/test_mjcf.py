"""MJCF: the scene has the content of the file. ``test_mjcf_accelerations_mujoco`` compares scenes with MuJoCo, if it is
installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trunnion
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.importers import scene_of_mjcf
from trunnion.importers.mjcf.scene_builder import linkage_of_mjcf
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model

BALL = '<geom type="sphere" size="0.1" mass="1" pos="0.3 0 0"/>'


def read(tmp_path: Path, inside: str, name: str = "model.xml") -> tuple[Scene, list[str]]:
    file = tmp_path / name
    file.write_text(f"<mujoco>{inside}</mujoco>")
    return scene_of_mjcf(file)


def column(scene: Scene, *names: str) -> list[float]:
    r = trunnion.simulate(scene, 0.01, 0.01, outputs=list(names))
    return [r[n][0] for n in names]


def place(scene: Scene, body: str) -> list[float]:
    return column(scene, *(f"{body}.position[{k}]" for k in (1, 2, 3)))


TURNS = {
    'quat="0.5 0.1 -0.7 0.2"': Rotation.from_quat([0.1, -0.7, 0.2, 0.5]),
    'axisangle="1 2 -0.5 40"': Rotation.from_rotvec(np.deg2rad(40) * np.array([1, 2, -0.5]) / np.linalg.norm([1, 2, -0.5])),
    'euler="10 -20 30"': Rotation.from_euler("XYZ", [10, -20, 30], degrees=True),
    'xyaxes="1 1 0 0 1 1"': Rotation.from_matrix(np.linalg.qr(np.array([[1.0, 1, 0], [0, 1, 1], [1, -1, 1]]).T)[0] * [-1, -1, 1]),
    'zaxis="0 3 4"': Rotation.from_euler("x", -np.arctan2(3, 4)),
}


@pytest.mark.parametrize("how", TURNS)
def test_every_way_to_turn_a_body_is_understood(how: str, tmp_path: Path) -> None:
    scene, _ = read(tmp_path, f'<worldbody><body name="b" pos="1 2 3" {how}><joint/>{BALL}</body></worldbody>')
    expected = np.array([1, 2, 3]) + TURNS[how].apply([0.3, 0, 0])
    assert place(scene, "b") == pytest.approx(expected, abs=1e-14)


def test_the_order_of_euler_angles_is_the_compilers(tmp_path: Path) -> None:
    """Capital letters mean turns about fixed axes. Small letters mean turns about axes that turn with the body."""
    for sequence, meant in (("zyx", "ZYX"), ("XYZ", "xyz"), ("yxz", "YXZ")):
        turned = f'<body name="b" euler="0.3 0.5 -0.7"><joint/>{BALL}</body>'
        scene, _ = read(tmp_path, f'<compiler angle="radian" eulerseq="{sequence}"/><worldbody>{turned}</worldbody>')
        expected = Rotation.from_euler(meant, [0.3, 0.5, -0.7]).apply([0.3, 0, 0])
        assert place(scene, "b") == pytest.approx(expected, abs=1e-14)


def test_three_hinges_at_a_point_are_a_ball(tmp_path: Path) -> None:
    """A body on three hinges with massless links between them moves like a body on a ball. Both bodies have the same angular
    acceleration, without rotors."""
    weighed = '<inertial pos="0.2 0.1 -0.3" mass="2" fullinertia="0.3 0.4 0.5 0.02 -0.03 0.04"/>'
    hinges = "".join(f'<joint name="{n}" axis="{a}"/>' for n, a in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1")))
    one, _ = read(tmp_path, f'<worldbody><body name="b">{hinges}{weighed}</body></worldbody>')
    two, _ = read(tmp_path, f'<worldbody><body name="b"><joint name="ball" type="ball"/>{weighed}</body></worldbody>')
    angles, rates = np.array([0.3, -0.5, 0.7]), np.array([0.2, 0.4, -0.6])
    turn = [Rotation.from_rotvec(a * np.eye(3)[k]) for k, a in enumerate(angles)]
    axes = np.array([np.eye(3)[0], turn[0].apply(np.eye(3)[1]), (turn[0] * turn[1]).apply(np.eye(3)[2])]).T
    names = ("b.acceleration[1]", "b.acceleration[2]", "b.acceleration[3]")
    q1, v1 = ({n: np.array([x]) for n, x in zip("xyz", values, strict=True)} for values in (angles, rates))
    quaternion = (turn[0] * turn[1] * turn[2]).as_quat()
    q2, v2 = {"ball": np.r_[quaternion[3], quaternion[:3]]}, {"ball": axes @ rates}
    rows = [evaluate(Model(s, names), q, v, 0.0) for s, q, v in ((one, q1, v1), (two, q2, v2))]
    assert [rows[0][n] for n in names] == pytest.approx([rows[1][n] for n in names], rel=1e-12)


CLASSES = """
<default><joint damping="0.1"/><default class="arm"><joint damping="0.2" stiffness="3"/>
  <default class="hand"><joint damping="0.3"/></default></default></default>
<worldbody><body name="a" childclass="arm"><joint name="one"/>{0}<body name="b"><joint name="two" class="hand"/>{0}
  <body name="c"><joint name="three" damping="0.5"/>{0}</body></body></body>
  <frame childclass="hand" pos="0 0 1"><body name="d"><joint name="four"/>{0}</body></frame>
  <body name="e"><joint name="five"/>{0}</body></worldbody>"""


def test_a_class_is_taken_from_the_nearest_element_that_names_one(tmp_path: Path) -> None:
    scene, _ = read(tmp_path, CLASSES.format(BALL))
    damping = {n: j.damping for n, j in scene.joints.items()}
    assert damping == {"one": 0.2, "two": 0.3, "three": 0.5, "four": 0.3, "five": 0.1}
    assert {n for n, j in scene.joints.items() if j.spring is not None} == {"one", "two", "three", "four"}
    assert place(scene, "d") == pytest.approx([0.3, 0, 1])


FOUR_BAR = """<option gravity="2 0 -9.81"/><worldbody>
  <body name="crank"><joint name="a" axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.2"/>
    <body name="coupler" pos="0 0 0.2"><joint name="b" axis="0 1 0"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0.5 0 0.1"/></body></body>
  <body name="rocker" pos="0.5 0 0"><joint name="c" axis="0 1 0"/>
    <geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.3"/></body>
  </worldbody><equality>{}</equality>"""


def test_connect_closes_a_four_bar(tmp_path: Path) -> None:
    """The loop stays closed, and energy is conserved. The angles follow the closed form of the loop."""
    scene, _ = read(tmp_path, FOUR_BAR.format('<connect name="loop" body1="coupler" body2="rocker" anchor="0.5 0 0.1"/>'))
    r = trunnion.simulate(scene, 1.0, 0.05, rtol=1e-9)
    assert r.outcome.ok
    assert np.abs(r["energy.residual"]).max() < 1e-7
    a, b, c = (r[f"{n}.q[1]"] for n in "abc")
    arm = lambda angle, x, z: np.array([x * np.cos(angle) + z * np.sin(angle), -x * np.sin(angle) + z * np.cos(angle)])  # noqa: E731
    gap = arm(a, 0.0, 0.2) + arm(a + b, 0.5, 0.1) - arm(c, 0.0, 0.3) - np.array([[0.5], [0.0]])
    assert np.abs(gap).max() < 1e-9
    assert np.ptp(a) > 0.5


def test_a_joint_that_an_equality_ties_follows_the_other(tmp_path: Path) -> None:
    """q − ref of one joint is 0.1 − 0.6 (q − ref) of the other joint. Equalities that a scene cannot express are reported."""
    tie = '<joint name="tie" joint1="b" joint2="a" polycoef="0.1 -0.6 {} 0 0"/>'
    scene, _ = read(tmp_path, FOUR_BAR.format(tie.format(0)))
    r = trunnion.simulate(scene, 1.0, 0.1, rtol=1e-9)
    assert r["b.q[1]"] == pytest.approx(0.1 - 0.6 * r["a.q[1]"], abs=1e-12)
    for wrong, told in ((tie.format(2), "polynomial"), (tie.format(0).replace('"a"', '"z"'), "unknown joint"),
                        (tie.format(0).replace('joint2="a"', ""), "fixes a joint")):  # fmt: skip
        with pytest.raises(SceneError, match=told):
            read(tmp_path, FOUR_BAR.format(wrong))


def test_weld_holds_bodies_together(tmp_path: Path) -> None:
    """One free body is welded to the world in its position. A second free body is welded to the first as ``relpose`` says."""
    places = (("one", 0, 30), ("two", 1, 0))
    bodies = "".join(f'<body name="{n}" pos="{x} 0 1" euler="0 {e} 0"><freejoint/>{BALL}</body>' for n, x, e in places)
    welds = '<weld body1="one"/><weld body1="one" body2="two" relpose="0 0 0.5 1 0 0 0"/>'
    scene, _ = read(tmp_path, f"<worldbody>{bodies}</worldbody><equality>{welds}</equality>")
    s, c = np.sin(np.pi / 6), np.cos(np.pi / 6)
    assert place(scene, "one") == pytest.approx([0.3 * c, 0, 1 - 0.3 * s], abs=1e-9)
    assert place(scene, "two") == pytest.approx([0.5 * s + 0.3 * c, 0, 1 + 0.5 * c - 0.3 * s], abs=1e-9)


def test_included_files_belong_to_the_model(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text(f'<mujocoinclude><body name="arm"><joint/>{BALL}</body></mujocoinclude>')
    bad = '<body name="x">\n<joint axis="0 0"/></body><include file="bad.xml"/>'
    (tmp_path / "bad.xml").write_text(f"<mujocoinclude>\n{bad}</mujocoinclude>")
    scene, _ = read(tmp_path, '<worldbody><include file="parts/arm.xml"/></worldbody>')
    assert set(scene.bodies) == {"arm"}
    inside = tmp_path / "inside"
    inside.mkdir()
    beside, _ = read(inside, '<worldbody><include file="../parts/arm.xml"/></worldbody>')
    assert set(beside.bodies) == {"arm"}
    with pytest.raises(SceneError) as e:
        read(tmp_path, '<worldbody>\n<include file="none.xml"/>\n<include file="bad.xml"/></worldbody>')
    told = {(p.file.rpartition("/")[2], p.line, p.what) for p in e.value.problems}
    assert told == {
        ("model.xml", 2, "there is no file 'none.xml'"),
        ("bad.xml", 3, "'bad.xml' includes itself"), ("bad.xml", 3, "'0 0': 3 numbers are expected"),
        ("bad.xml", 2, "moves and has no mass"),
    }  # fmt: skip


REFUSED = {
    "a tendon that pulls": ('<tendon><fixed name="t" stiffness="5"><joint joint="j" coef="1"/></fixed></tendon>', "exerts forces"),
    "coordinates that are tied": ('<equality><joint name="m" joint1="j"/></equality>', "fixes a joint"),
    "a body that is made": ('<worldbody><composite type="cable" count="3 1 1"/></worldbody>', "generates bodies"),
    "a spring of a ball": (
        '<worldbody><body><joint type="ball" stiffness="1"/><geom size="1"/></body></worldbody>', "a spring along a ball"),
    "a polynomial": ('<worldbody><body><joint stiffness="1 2"/><geom size="1"/></body></worldbody>', "polynomial"),
    "no mass": ('<worldbody><body name="w"><joint/></body></worldbody>', "has no mass"),
    "no mesh": ('<worldbody><body><joint/><geom type="mesh" mesh="m"/></body></worldbody>', "unknown mesh"),
    "no class": ('<worldbody><body><joint class="k"/><geom size="1"/></body></worldbody>', "no class 'k'"),
    "no body": ('<equality><weld body1="nobody"/></equality>', "there is no body 'nobody'"),
    "global coordinates": ('<compiler coordinate="global"/>', "global coordinates"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_unsupported_content_is_refused_with_its_line(what: str, tmp_path: Path) -> None:
    text, words = REFUSED[what]
    with pytest.raises(SceneError, match=words) as e:
        read(tmp_path, f'\n<worldbody><body name="b"><joint name="j"/>{BALL}</body></worldbody>\n{text}')
    assert {(p.file.rpartition("/")[2], p.line) for p in e.value.problems} == {("model.xml", 3)}


def test_the_command_writes_a_scene_that_runs(tmp_path: Path) -> None:
    file = tmp_path / "bar.xml"
    closing = '<connect body1="coupler" body2="rocker" anchor="0.5 0 0.1"/>'
    file.write_text(f"<mujoco>{FOUR_BAR.format(closing)}</mujoco>")
    assert main(["import", str(file), "-o", str(tmp_path / "bar.yaml")]) == 0
    assert trunnion.simulate(str(tmp_path / "bar.yaml"), 0.1).outcome.ok


def test_a_chain_of_sixty_joints_is_taken_over_as_it_is(tmp_path: Path) -> None:
    """Every joint of a large model keeps its name. Bodies without mass add no joints."""
    inside, axes = "", (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1"))
    for k in reversed(range(20)):
        joints = "".join(f'<joint name="j{k}_{a}" axis="{b}" armature="0.01"/>' for a, b in axes)
        inside = f'<body name="b{k}" pos="0.3 0 0">{joints}<geom size="0.05"/>{inside}</body>'
    file = tmp_path / "chain.xml"
    file.write_text(f"<mujoco><worldbody>{inside}</worldbody></mujoco>")
    linkage, _, bodies = linkage_of_mjcf(file)
    assert len(linkage.scene().joints) == len(bodies.freedoms) == 60
    total = sum(link.mass for link in linkage.links.values())
    assert total == pytest.approx(20 * 1000 * 4 / 3 * np.pi * 0.05**3, rel=1e-13)


MESH = (
    '<asset><mesh name="t" vertex="{vertex}" face="{face}"/></asset>'
    '<worldbody><body><freejoint/><geom type="mesh" mesh="t"/></body></worldbody>'
)
CORNERS = "0 0 0 1 0 0 0 1 0 0 0 1"
WRONG = {
    "a vertex that is no number": (MESH.format(vertex="0 0 zero", face=""), "vertices or faces"),
    "two numbers of a vertex": (MESH.format(vertex="0 0", face=""), "vertices or faces"),
    "a face beyond the vertices": (MESH.format(vertex=CORNERS, face="0 2 1 0 1 3 0 3 2 1 2 4"), "refers to a vertex"),
    "an order of no axes": ('<compiler eulerseq="xyw"/><worldbody/>', "not an order of axes"),
}


@pytest.mark.parametrize("what", WRONG)
def test_numbers_that_mean_nothing_are_problems(what: str, tmp_path: Path) -> None:
    text, problem = WRONG[what]
    with pytest.raises(SceneError, match=problem):
        read(tmp_path, text)
