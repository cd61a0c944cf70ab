"""Bodies with given poses have these poses when a run starts, in any body frame. The coordinates of joints follow from the
poses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trunnion
from tests.scene.valid_scene import problems_of
from trunnion.cli import main
from trunnion.scene import load_scene, scene_from_dict, scene_to_yaml
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.body_poses_and_joint_sides import pose_of

ROUNDING = 1e-14  # round-off of positions of about 1 m after a few rotations
POINTS = {"a": [0, 0, 0], "b": [0.3, 0.2, 0], "c": [0.9, 0, 0.1]}


def linkage() -> dict[str, Any]:
    """A spatial slider-crank. Its bodies use the three notations of a rotation."""
    return {
        "gravity": [0, -9.81, 0],
        "bodies": {
            "crank": {"box": [0.2, 0.02, 0.02], "density": 7800, "position": [0.1, 0, 0], "points": {"end": [0.1, 0.15, 0.2]},
                      "orientation": {"axis": "z", "angle": "40 deg"}},
            "rod": {"box": [0.5, 0.02, 0.02], "density": 7800, "position": [0.6, 0.1, 0.05],
                    "orientation": {"axis": "x", "towards": [0.6, -0.2, 0.1]}},
            "slider": {"mass": 1, "inertia": [0.01, 0.01, 0.01], "position": POINTS["c"],
                       "orientation": [{"axis": "y", "angle": "90 deg"}, {"axis": [1, 2, 0.5], "angle": 0.3}]},
        },
        "joints": {
            "a": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "crank", "at": POINTS["a"]},
            "b": {"type": "universal", "axis": "z", "reference": "y", "inboard": "crank", "outboard": "rod", "at": POINTS["b"]},
            "c": {"type": "spherical", "inboard": "rod", "outboard": "slider"},
            "d": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "slider"},
        },
        "simulation": {"until": 0.5, "rtol": 1e-10},
    }  # fmt: skip


def test_every_body_starts_where_and_how_it_is_placed() -> None:
    scene = scene_from_dict(linkage())
    run = trunnion.simulate(scene, until=0.01)
    towards, axis = np.array([0.6, -0.2, 0.1]), np.array([1, 2, 0.5])
    across = np.cross([1, 0, 0], towards)
    least = Rotation.from_rotvec(across / np.linalg.norm(across) * np.arccos(towards[0] / np.linalg.norm(towards)))
    turned = {
        "crank": Rotation.from_euler("z", 40, degrees=True),
        "rod": least,
        "slider": Rotation.from_rotvec(0.3 * axis / np.linalg.norm(axis)) * Rotation.from_euler("y", 90, degrees=True),
    }
    for name, body in scene.bodies.items():
        assert [run[f"{name}.position[{k}]"][0] for k in (1, 2, 3)] == pytest.approx(body.position, abs=ROUNDING)
        w, x, y, z = (run[f"{name}.orientation[{k}]"][0] for k in (1, 2, 3, 4))
        assert Rotation.from_quat([x, y, z, w]).as_matrix() == pytest.approx(turned[name].as_matrix(), abs=ROUNDING)
    assert [run[f"{j}.q[{k}]"][0] for j, k in (("a", 1), ("b", 1), ("b", 2), ("d", 1))] == [0, 0, 0, 0]
    assert run.outcome.ok
    assert run.notes == ()


def redescribed(data: dict[str, Any], seed: int) -> dict[str, Any]:
    """The linkage, with every body described in another frame."""
    scene, rng = scene_from_dict(data), np.random.default_rng(seed)
    for name, body in data["bodies"].items():
        pose, shift, turn = pose_of(scene, name), rng.normal(size=3), Rotation.from_rotvec(rng.normal(size=3))
        old = Rotation.from_matrix(np.array(pose.rotation))
        vector = (old * turn.inv()).as_rotvec()
        mass = trunnion.scene.queries.mass_properties.mass_properties(scene.bodies[name])
        I = turn.as_matrix() @ np.array(mass[2]) @ turn.as_matrix().T  # noqa: E741  (I is the usual symbol of the inertia)
        data["bodies"][name] = {
            "mass": mass[0], "center": turn.apply(mass[1]) + shift,
            "inertia": [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]],
            "points": {n: turn.apply(p) + shift for n, p in body.get("points", {}).items()},
            "position": np.array(pose.origin) - (old * turn.inv()).apply(shift),
            "orientation": {"axis": vector, "angle": float(np.linalg.norm(vector))},
        }  # fmt: skip
        data["bodies"][name] = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in data["bodies"][name].items()}
        data["bodies"][name]["points"] = {n: p.tolist() for n, p in data["bodies"][name]["points"].items()}
        data["bodies"][name]["orientation"]["axis"] = vector.tolist()
    data["joints"]["c"]["at"], data["joints"]["d"]["at"] = POINTS["c"], POINTS["c"]
    return data


@pytest.mark.parametrize("seed", [1, 2])
def test_the_frame_in_which_a_body_is_described_does_not_matter(seed: int) -> None:
    one, two = (trunnion.simulate(scene_from_dict(d)) for d in (linkage(), redescribed(linkage(), seed)))
    for column in ("a.q[1]", "d.q[1]", "b.q[1]", "b.q[2]", "crank.end.position[3]", "rod.position[1]", "a.reaction.force[2]"):
        size = np.abs(one[column]).max()
        assert np.abs(one[column] - two[column]).max() <= 1e-7 * max(size, 1.0), column  # limit: 1000 times the runs' tolerance


def test_a_placed_scene_is_the_one_whose_sides_are_written_by_hand() -> None:
    hand = load_scene("crank_slider_free")
    run = trunnion.simulate(hand, until=1e-9)
    places: dict[str, Any] = {}
    for name, b in hand.bodies.items():
        w, *v = (run[f"{name}.orientation[{k}]"][0] for k in (1, 2, 3, 4))
        turn = Rotation.from_quat([*v, w])
        center = np.array([run[f"{name}.position[{k}]"][0] for k in (1, 2, 3)])
        angle = turn.as_rotvec()
        size = float(np.linalg.norm(angle))
        places[name] = (center - turn.apply(b.center), {"axis": (angle / size).tolist(), "angle": size} if size > 1e-12 else None)
    data = trunnion.scene.file_format.yaml_writer.scene_to_dict(hand)
    for name, (origin, turn) in places.items():
        data["bodies"][name] |= {"position": origin.tolist()} | ({"orientation": turn} if turn else {})
    for joint in data["joints"].values():
        start = joint.pop("start", None)
        if start and "qd" in start:
            joint["start"] = {"qd": start["qd"]}
    placed = trunnion.simulate(scene_from_dict(data), until=0.5, rtol=1e-10)
    known = trunnion.simulate(hand, until=0.5, rtol=1e-10)
    for name in hand.bodies:
        for k in (1, 2, 3):
            assert np.abs(placed[f"{name}.position[{k}]"] - known[f"{name}.position[{k}]"]).max() < 1e-7


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x", [1, 2, 3]])
def test_half_a_turn_and_none_point_where_they_should(axis: Any) -> None:
    d = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "-x": [-1, 0, 0]}.get(str(axis), axis)
    for sign in (1.0, -1.0):
        turn = {"axis": axis, "towards": [sign * c for c in d]}
        body = {"mass": 1, "inertia": [1, 1, 1], "position": [0, 0, 0], "orientation": turn}
        joint = {"type": "free", "inboard": "ground", "outboard": "b"}
        R = np.array(pose_of(scene_from_dict({"bodies": {"b": body}, "joints": {"j": joint}}), "b").rotation)
        assert R @ d == pytest.approx(sign * np.array(d), abs=ROUNDING)
        assert pytest.approx(np.eye(3), abs=ROUNDING) == R @ R.T
        assert np.linalg.det(R) == pytest.approx(1.0)
        if sign > 0:
            assert (np.eye(3) == R).all()


def test_joints_are_found_from_named_points_too() -> None:
    data = linkage()
    data["bodies"]["crank"]["points"]["pin"] = [0.0, 0.0, 0.0]
    data["joints"]["e"] = {"type": "spherical", "inboard": "crank", "outboard": "extra", "at": "crank.pin"}
    data["joints"]["f"] = {"type": "revolute", "axis": "x", "inboard": "crank.pin", "outboard": "more"}
    data["bodies"] |= {n: {"mass": 1, "inertia": [1, 1, 1], "position": [0.5, 0.5, 0.5]} for n in ("extra", "more")}
    scene = scene_from_dict(data)
    run = trunnion.simulate(scene, until=1e-6)
    assert [run[f"extra.position[{k}]"][0] for k in (1, 2, 3)] == pytest.approx([0.5] * 3, abs=ROUNDING)
    assert [run[f"more.position[{k}]"][0] for k in (1, 2, 3)] == pytest.approx([0.5] * 3, abs=ROUNDING)
    assert scene_from_dict(trunnion.scene.file_format.yaml_writer.scene_to_dict(scene)) == scene


WRONG: dict[str, tuple[dict[str, Any], str, str]] = {
    "turned but not placed": ({"bodies.crank.position": None}, "bodies.crank.orientation", "an orientation needs a position"),
    "angle and towards": ({"bodies.rod.orientation.angle": 1}, "bodies.rod.orientation", "both angle and towards"),
    "no angle": ({"bodies.slider.orientation[2].angle": None}, "bodies.slider.orientation[2]", "neither angle nor towards"),
    "towards nothing": ({"bodies.rod.orientation.towards": [0, 0, 0]}, "bodies.rod.orientation", "zero length"),
    "no such body": ({"joints.c.at": "slyder"}, "joints.c.at", 'did you mean "slider"'),
    "no such point": ({"joints.c.at": "crank.x"}, "joints.c.at", 'no point "x"'),
    "points apart": ({"joints.b.inboard": "crank.end"}, "joints.b.inboard", "the point is"),
    "a list of two": ({"bodies.rod.position": [1, 2]}, "bodies.rod.position", "3 entries are expected"),
    "a turn in metres": ({"bodies.crank.orientation.angle": "3 mm"}, "bodies.crank.orientation.angle", "an angle is expected"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_body_that_cannot_be_placed_is_reported_at_its_key(case: str) -> None:
    changes, where, says = WRONG[case]
    data = linkage()
    for path, value in changes.items():
        node: Any = data
        *way, last = path.replace("[2]", ".1").split(".")
        for key in way:
            node = node[int(key) if isinstance(node, list) else key]
        node[last] = value
        if value is None:
            del node[last]
    found = problems_of(data)
    assert where in [p.where for p in found], found
    assert any(says in str(p) for p in found if p.where == where)


def test_a_joint_to_a_body_that_is_not_placed_says_what_to_place() -> None:
    data = linkage()
    del data["bodies"]["rod"]["position"], data["bodies"]["rod"]["orientation"]
    assert "add position to rod" in str(problems_of(data)[0])


def test_the_assembled_start_is_drawn_and_written(tmp_path, capsys) -> None:
    file, picture, whole = tmp_path / "linkage.yaml", tmp_path / "start.png", tmp_path / "whole.yaml"
    scene: Scene = scene_from_dict(linkage())
    file.write_text(scene_to_yaml(scene))
    assert main(["check", str(file), "--plot", str(picture), "-o", str(whole)]) == 0
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert load_scene(whole).bodies == scene.bodies
    assert str(picture) in capsys.readouterr().out
    assert main(["check", str(file), "--plot", str(tmp_path / "start.txt")]) == 2
