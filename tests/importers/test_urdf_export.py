"""A scene that is written as URDF and read again has the same accelerations. Content that URDF cannot hold is refused or listed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.importers.mujoco_comparison import accelerations, evaluable
from trunnion.basics.errors import SceneError
from trunnion.elements.joints import REGISTRY
from trunnion.importers import scene_of_urdf, urdf_of_scene
from trunnion.importers.pose_matrices import roll_pitch_yaw, rpy
from trunnion.importers.urdf_export import SAID, WRITTEN
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.library.model_folders import model_names
from trunnion.scene.scene_loader import scene_from_dict

LOST = ("friction", "spring", "nonlinear", "rotor_inertia", "effort", "drive", "motor", "latch", "end_stops")
"""Devices of joints that URDF holds in part or not at all."""
STATES = 5


def compared(scene: Scene, folder: Path) -> float:
    """The largest difference of accelerations before and after, relative to the largest acceleration, at random states. Devices
    that URDF lacks are off."""
    bare = {
        n: replace(j, start=None, **{k: None for k in LOST if k != "friction" or len(_given(scene, n)) != 1})
        for n, j in scene.joints.items()
    }
    before = replace(scene, joints=bare, forces={}, outputs=("*",))
    file = folder / "out.urdf"
    file.write_text(urdf_of_scene(scene)[0], encoding="utf-8")
    after, _ = scene_of_urdf(file)
    models = [evaluable(s) for s in (before, after)]
    rng, gap, size = np.random.default_rng(0), 0.0, 0.0
    for _ in range(STATES):
        q, qd = {}, {}
        for n, j in scene.joints.items():
            kind = REGISTRY[j.type]
            q[n], qd[n] = rng.normal(size=kind.nq), rng.normal(size=kind.nv)
            if kind.quaternion >= 0:
                q[n][kind.quaternion :] /= np.linalg.norm(q[n][kind.quaternion :])
        had, have = (np.concatenate(list(accelerations(m, q, qd).values())) for m in models)
        gap, size = max(gap, float(np.abs(had - have).max())), max(size, float(np.abs(had).max()))
    return gap / size


def _given(scene: Scene, joint: str) -> dict[str, Any]:
    return dict(scene_to_dict(scene)["joints"][joint].get("friction", {}))


def tree(seed: int) -> Scene:
    """A random tree of the joint types of URDF, in both directions, with oblique frames, damping and constant friction."""
    rng = np.random.default_rng(seed)

    def vector(size: float = 1.0) -> list[float]:
        return [float(x) for x in size * rng.normal(size=3)]

    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    for i, kind in enumerate(rng.permutation([*SAID, "revolute", "prismatic"])):
        Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        inertia = Q @ np.diag(0.1 + rng.random(3) * 0.1) @ Q.T
        six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        bodies[f"b{i}"] = {"mass": float(1 + rng.random()), "center": vector(0.3), "inertia": [float(x) for x in six]}
        holder = "ground" if i == 0 else f"b{rng.integers(i)}"
        sides = [{"body": b, "point": vector(0.3), "axis": vector(), "reference": vector()} for b in (holder, f"b{i}")]
        single = REGISTRY[kind].nv == 1
        inboard, outboard = sides[:: -1 if single and rng.random() < 0.4 else 1]
        joints[f"j{i}"] = {"type": str(kind), "inboard": inboard, "outboard": outboard}
        if single:
            friction = {"torque" if kind == "revolute" else "force": float(rng.random())}
            joints[f"j{i}"] |= {"damping": float(rng.random()), "friction": friction}
    down = np.array(vector())
    gravity = [float(x) for x in 9.81 * down / np.linalg.norm(down)]
    return scene_from_dict({"schema": 1, "name": "tree", "gravity": gravity, "bodies": bodies, "joints": joints})


def sayable() -> list[str]:
    """The bundled models that URDF can hold."""
    out = []
    for name in model_names():
        try:
            urdf_of_scene(load_scene(name))
        except SceneError:
            continue
        out.append(name)
    return out


def test_the_bundled_models_that_urdf_can_hold_accelerate_alike_after_writing_and_reading(tmp_path: Path) -> None:
    names = sayable()
    assert len(names) >= 6
    assert {n: gap for n in names if (gap := compared(load_scene(n), tmp_path)) > 1e-12} == {}


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(100))
def test_random_trees_accelerate_alike_after_writing_and_reading(seed: int, tmp_path: Path) -> None:
    assert compared(tree(seed), tmp_path) < 1e-12


def test_angles_of_a_rotation_give_the_rotation_also_where_the_outer_axes_are_parallel() -> None:
    for tilt in (0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0):
        R = rpy(0.7, np.pi / 2 - tilt, 0.3)
        assert np.abs(rpy(*roll_pitch_yaw(R)) - R).max() < 1e-15


def test_every_key_that_urdf_does_not_hold_is_listed() -> None:
    scene = load_scene("caught_carriage")
    data, notes = scene_to_dict(scene), " ".join(urdf_of_scene(scene)[1])
    for key in set(data) - WRITTEN["scene"]:
        assert key in notes
    for group in ("bodies", "joints"):
        for name, given in data[group].items():
            assert not [
                k for k in given if k not in WRITTEN[group] and not (k in notes.replace("end stops", "end_stops") and name in notes)
            ]


def test_expressions_are_written_as_numbers_and_friction_over_time_is_left_out() -> None:
    hinge = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b", "friction": {"torque": "{T}"}, "damping": "{c}"}
    hinge["end_stops"] = {"stiffness": 1e4, "upper": "{2*a}"}
    fading = {**hinge, "inboard": "b", "outboard": "d", "friction": {"torque": {"ramp": {"start": 1, "end": 0, "duration": 1}}}}
    body = {"mass": 1, "inertia": [1, 1, 1]}
    text, notes = urdf_of_scene(scene_from_dict({
        "parameters": {"T": "0.5 N*m", "c": "0.1 N*m*s/rad", "a": "0.7 rad"}, "bodies": {"b": body, "d": body},
        "joints": {"hinge": hinge, "fading": fading},
    }))  # fmt: skip
    first, second = (ElementTree.fromstring(text).findall("joint")[k] for k in (0, 1))
    assert {k: float(x) for k, x in first.find("dynamics").items()} == {"damping": 0.1, "friction": 0.5}  # type: ignore[union-attr]
    assert first.find("limit").get("upper") == "1.4"  # type: ignore[union-attr]
    assert second.find("dynamics").items() == [("damping", "0.1")]  # type: ignore[union-attr]
    assert "left out: friction of fading" in notes


def test_a_mechanism_that_urdf_cannot_hold_is_refused_with_every_reason() -> None:
    with pytest.raises(SceneError) as told:
        urdf_of_scene(load_scene("trifilar"))
    assert [p.where for p in told.value.problems] == ["joints.rod_a", "joints.rod_b", "joints.rod_c"]
    with pytest.raises(SceneError, match="closes a loop"):
        urdf_of_scene(load_scene("andrews"))
