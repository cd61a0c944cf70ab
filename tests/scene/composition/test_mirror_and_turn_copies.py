"""Copies of an assembly, mirrored, turned or shifted, move like the first assembly and find their neighbours."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trunnion
from tests.reference.scenes.random_device_scenes import crossed_dict
from trunnion.scene import scene_from_dict, scene_from_text, scene_to_yaml
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply

SPATIAL: dict[str, Any] = {
    "bodies": {
        "link": {"mass": 2, "center": [0.02, 0.2, 0.03], "inertia": [0.05, 0.04, 0.06, 0.004, -0.003, 0.002],
                 "position": [0.3, 0.4, 0.1], "points": {"end": [0.1, 0.3, 0.2]},
                 "orientation": [{"axis": "z", "angle": 0.3}, {"axis": "y", "towards": [0.1, 1, 0.4]}]},
        "fork": {"mass": 1, "inertia": [0.02, 0.03, 0.04], "position": [0.5, 0.9, 0.2]},
        "nut": {"mass": 0.5, "inertia": [0.01, 0.01, 0.02, 0.001, 0, 0], "position": [0.6, 1.0, 0.0],
                "orientation": {"axis": "x", "angle": 1}},
        "ram": {"mass": 0.7, "inertia": [0.01, 0.02, 0.02], "position": [0.7, 0.8, 0.3]},
    },
    "joints": {
        "hinge": {"type": "revolute", "axis": [1, 0.5, 0.2], "inboard": "ground", "outboard": "link", "at": [0.2, 0.3, 0.1],
                  "friction": {"mu": 0.1, "radius": 0.01, "half_length": 0.02}, "spring": {"stiffness": 5, "rest": 0.4},
                  "start": {"q": 0, "qd": 1.5}},
        "cross": {"type": "universal", "axis": "x", "reference": "y", "inboard": "link.end", "outboard": "fork",
                  "spring": [{"stiffness": 3, "rest": 0.2}, {"stiffness": 2}], "start": {"qd": [0.5, -1]}},
        "thread": {"type": "screw", "axis": [0, 0.3, 1], "pitch": 0.1, "inboard": "fork", "outboard": "nut", "start": {"qd": 3}},
        "guide": {"type": "prismatic", "axis": [1, 1, 0], "inboard": "nut", "outboard": "ram", "at": [0.7, 0.8, 0.3],
                  "spring": {"stiffness": 40, "rest": 0.05},
                  "friction": {"mu": 0.2, "half_length": 0.05, "half_width": 0.02, "half_height": 0.01}},
    },
    "forces": {
        "pull": {"type": "force", "on": "fork", "force": [1, -2, 0.5]},
        "carried": {"type": "force", "on": "link.end", "force": [0.3, 0.2, -1], "frame": "body"},
        "twist": {"type": "torque", "on": "nut", "torque": [0.02, 0.01, -0.03]},
        "own": {"type": "torque", "on": "link", "torque": [0.1, -0.2, 0.3], "frame": "body"},
        "rubber": {"type": "bushing", "between": ["link", "ram"], "axis": [1, 0.2, 0], "stiffness": [20, 30, 40], "damping": 0.2,
                   "turning_stiffness": [1, 2, 3], "turning_damping": [0.01, 0.02, 0.03]},
        "rope": {"type": "spring_damper", "between": ["ram", "ground.post"], "stiffness": 20, "damping": 1, "length": 0.3},
    },
    "ground": {"points": {"post": [1, 0.2, 0.5]}},
}  # fmt: skip


def copied(copies: dict[str, Any], gravity: list[float], **more: Any) -> Scene:
    """The mechanism and copies of it."""
    part = json.loads(json.dumps(SPATIAL))
    data = {"gravity": gravity, "assemblies": {"m": {"use": part, "copies": copies, **more}}}
    return scene_from_dict(data | {"simulation": {"until": 0.4, "rtol": 1e-10}})


MAPS: dict[str, tuple[dict[str, Any], list[float], np.ndarray, np.ndarray]] = {
    "mirror x": ({"mirror": "x"}, [0, 0, -9.81], np.diag([-1.0, 1, 1]), np.zeros(3)),
    "mirror y": ({"mirror": {"axis": "y", "through": [0, "-0.5 m", 0]}}, [0, 0, -9.81],
                 np.diag([1.0, -1, 1]), np.array([0, -1.0, 0])),
    "mirror z": ({"mirror": "z"}, [0, -9.81, 0], np.diag([1.0, 1, -1]), np.zeros(3)),
    "third of a turn": ({"rotate": {"times": 3}}, [0, 0, -9.81],
                        Rotation.from_euler("z", 120, degrees=True).as_matrix(), np.zeros(3)),
    "by an angle": ({"rotate": {"times": 2, "axis": "x", "by": "25 deg"}}, [-9.81, 0, 0],
                    Rotation.from_euler("x", 25, degrees=True).as_matrix(), np.zeros(3)),
    "line": ({"line": {"times": 2, "step": ["20 cm", 0, 0.1]}}, [0, 0, -9.81], np.eye(3), np.array([0.2, 0, 0.1])),
}  # fmt: skip


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("case", MAPS)
def test_a_copy_moves_as_the_first_one_seen_in_the_mirror_or_turned(case: str) -> None:
    copies, gravity, matrix, shift = MAPS[case]
    scene = copied(copies, gravity)
    run = trunnion.simulate(scene, outputs=["*.position*", "*.q*", "*.qd*", "*.normal_force", "*.velocity*"])
    assert run.outcome.ok

    def place(body: str) -> np.ndarray:
        return np.column_stack([run[f"{body}.position[{k}]"] for k in (1, 2, 3)])

    for body in ("link", "fork", "nut", "ram", "link.end"):
        one, two = place(f"m1_{body}"), place(f"m2_{body}")
        assert np.abs(one - one[0]).max() > 1e-3, "it moves"
        assert np.abs(one @ matrix.T + shift - two).max() < 1e-8  # the limit is a hundred times the tolerance of the run
    for column in ("hinge.q[1]", "cross.q[1]", "cross.q[2]", "thread.q[1]", "guide.q[1]", "guide.qd[1]"):
        first, second = run[f"m1_{column}"], run[f"m2_{column}"]
        assert np.abs(first - second).max() < 1e-6 * max(1.0, np.abs(first).max()), column
    one, two = (sorted(run[f"m{k}_hinge.contact[{i}].normal_force"][-1] for i in (1, 2)) for k in (1, 2))
    assert one == pytest.approx(two, rel=1e-6), "in a mirror, the ends of a pin are the other way round"


def guided(rng: np.random.Generator, kind: str) -> dict[str, Any]:
    """A bead on a curve, or a follower on a turning cam. Neither has a symmetry."""
    inertia, wheel = [0.001] * 3, {"mass": 1.0, "inertia": [0.001] * 3, "position": [0.0, 0.0, 0.0]}
    plane = {"type": "planar", "axis": "z", "reference": "x", "inboard": "ground", "outboard": "bead", "at": [0, 0, 0]}
    if kind == "curve":
        heights = rng.uniform(-0.05, 0.1, 5)
        points = [[x, float(h)] for x, h in zip((-0.2, -0.1, 0.0, 0.1, 0.2), heights, strict=True)]
        rail = {"type": "point_on_curve", "curve": {"points": points}, "inboard": {"body": "ground", "axis": "z", "reference": "x"},
                "outboard": {"body": "bead", "axis": "z", "reference": "x"}}  # fmt: skip
        return {"bodies": {"bead": wheel}, "joints": {"plane": plane, "rail": rail}}
    radii = rng.uniform(0.03, 0.05, 5).tolist()
    profile = {"angle": ["0 deg", "80 deg", "150 deg", "210 deg", "290 deg", "360 deg"], "radius": [*radii, radii[0]]}
    side = {"axis": "z", "reference": "x"}
    joints = {
        "shaft": {"type": "revolute", "axis": "z", "reference": "x", "inboard": "ground", "outboard": "cam", "at": [0, 0, 0],
                  "start": {"q": float(rng.uniform(0, 6)), "qd": 9.0}},
        "slide": {"type": "prismatic", "axis": "y", "reference": "x", "inboard": "ground", "outboard": "bead", "at": [0, 0, 0],
                  "start": {"q": 0.04}},
        "follow": {"type": kind, "profile": profile, "inboard": {"body": "cam", **side}, "outboard": {"body": "bead", **side}},
    }  # fmt: skip
    return {"bodies": {"cam": wheel, "bead": {"mass": 0.5, "inertia": inertia, "position": [0, 0, 0]}}, "joints": joints}


@pytest.mark.default_cases(5)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["curve", "cam"])
@pytest.mark.parametrize("mirror", ["x", "y", "z"])
def test_a_mirrored_curve_guides_along_the_mirror_image(mirror: str, kind: str, seed: int) -> None:
    part = guided(np.random.default_rng(seed), kind)
    gravity = [0.0 if mirror == "x" else 2.0, 0.0 if mirror == "y" else -9.81, 0.0]
    data = {"gravity": gravity, "assemblies": {"m": {"use": part, "copies": {"mirror": mirror}}}}
    run = trunnion.simulate(scene_from_dict(data), until=0.2, rtol=1e-10, outputs=["*_bead.position*"])
    assert run.outcome.ok
    one, two = (np.column_stack([run[f"m{k}_bead.position[{i}]"] for i in (1, 2, 3)]) for k in (1, 2))
    matrix = np.diag([-1.0 if a == mirror else 1.0 for a in "xyz"])
    assert np.abs(one - one[0]).max() > 1e-3, "it moves"
    assert np.abs(one @ matrix - two).max() < 1e-8  # the limit is a hundred times the tolerance of the run


WHEELS = ("bevel_differentials", "worm_drives", "belts", "racks", "gear_trains", "cams")
"""Random mechanisms whose wheels have axes of their own on both sides, threads, or profiles."""


@pytest.mark.default_cases(6)
@pytest.mark.parametrize("turned", [False, True], ids=["mirrored", "turned"])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("family", WHEELS)
def test_a_copy_of_wheels_and_threads_moves_as_the_first_one(family: str, seed: int, turned: bool) -> None:
    """In a mirror, a right-handed thread becomes a left-handed thread."""
    data, axis = crossed_dict(family, seed), "xyz"[seed]
    copies = {"rotate": {"times": 3, "axis": axis}} if turned else {"mirror": axis}
    use = {k: data[k] for k in ("bodies", "joints", "forces")}
    scene = scene_from_dict({"gravity": [0, 0, 0], "assemblies": {"m": {"use": use, "copies": copies}}})
    columns = [f"m{k}_{b}.position*" for b in data["bodies"] for k in (1, 2)] + [f"m{k}_*.q[1]" for k in (1, 2)]
    run = trunnion.simulate(scene, until=0.1, every=0.02, rtol=1e-9, kernel="parts", outputs=columns)
    mirror = np.diag([-1.0 if a == axis else 1.0 for a in "xyz"])
    matrix = Rotation.from_euler(axis, 120, degrees=True).as_matrix() if turned else mirror
    for body in data["bodies"]:
        one, two = (np.column_stack([run[f"m{k}_{body}.position[{i}]"] for i in (1, 2, 3)]) for k in (1, 2))
        assert np.abs(one @ matrix.T - two).max() < 1e-7, body  # the limit is a hundred times the tolerance of the run
    for name in [c.name for c in run.columns if c.name.startswith("m1_") and c.unit == "rad"]:
        one, two = (np.abs(run[n]) for n in (name, name.replace("m1_", "m2_", 1)))  # a mirror changes the sense of some rotations
        assert np.abs(one - two).max() < 1e-6 * max(1.0, one.max()), name


def test_an_assembly_is_turned_and_placed_as_a_whole() -> None:
    turns = [{"axis": "x", "angle": "20 deg"}, {"axis": "z", "angle": "{-0.3}"}]
    matrix = Rotation.from_euler("xz", [np.radians(20), -0.3]).as_matrix()
    gravity = np.array([0.0, 0, -9.81])
    whole: dict[str, Any] = {"orientation": turns, "position": [1, "20 cm", 0]}
    once = {"line": {"times": 1, "step": [0, 0, 0]}}
    plain = trunnion.simulate(copied(once, gravity.tolist()), outputs=["*.position*"])
    turned = trunnion.simulate(copied(once, (matrix @ gravity).tolist(), **whole), outputs=["*.position*"])
    one, two = (np.column_stack([r[f"m1_ram.position[{k}]"] for k in (1, 2, 3)]) for r in (plain, turned))
    assert np.abs(one @ matrix.T + [1, 0.2, 0] - two).max() < 1e-8


def test_quarters_thirds_and_sixths_of_a_turn_are_exact() -> None:
    part = {"bodies": {"b": {"mass": 1, "inertia": [1, 1, 1], "position": [1, 0, 0.5]}},
            "joints": {"j": {"type": "revolute", "axis": "x", "inboard": "ground", "outboard": "b"}}}  # fmt: skip
    for times in (2, 4, 6, 12):
        scene = scene_from_dict({"assemblies": {"a": {"use": part, "copies": {"rotate": {"times": times}}}}})
        for k in range(times):
            angle = 2 * np.pi * k / times
            x, y, z = scene.bodies[f"a{k + 1}_b"].position
            assert (x, y, z) == pytest.approx((np.cos(angle), np.sin(angle), 0.5), abs=5e-16)
            if 4 * k % times == 0:
                assert {x, y} <= {0.0, 1.0, -1.0}
                assert isinstance(scene.joints[f"a{k + 1}_j"].axis, str)
        assert scene_from_text(scene_to_yaml(scene)) == scene


CHAIN = """
parameters: {length: 0.2 m}
assemblies:
  link:
    copies: {line: {times: 4, step: ["{length}", 0, 0]}}
    use:
      bodies:
        rod: {box: ["{length}", 1 cm, 1 cm], density: 7800, position: ["{length/2}", 0, 0]}
      points: {end: rod}
  pin:
    copies: {line: {times: 3, step: ["{length}", 0, 0]}}
    use: {joints: {hinge: {type: revolute, axis: y, at: ["{length}", 0, 0], inboard: "link{i}.end", outboard: "link{i+1}_rod",
                           damping: "{i*0.01 N*m*s/rad}"}}}
joints: {foot: {type: revolute, axis: y, inboard: ground, outboard: link1_rod, at: [0, 0, 0]}}
"""


def test_copies_name_their_neighbours_by_number() -> None:
    scene = scene_from_text(CHAIN)
    pairs = [(j.inboard, j.outboard) for n, j in scene.joints.items() if n != "foot"]
    assert pairs == [(f"link{i}_rod", f"link{i + 1}_rod") for i in (1, 2, 3)]
    assert [float(scene.joints[f"pin{i}_hinge"].damping) for i in (1, 2, 3)] == pytest.approx([0.01, 0.02, 0.03])
    longer = apply(scene, {"parameters.length": 0.3})
    assert [b.position[0] for b in longer.bodies.values()] == pytest.approx([0.15, 0.45, 0.75, 1.05])
    assert longer.joints["pin3_hinge"].at[0] == pytest.approx(0.9)
    assert trunnion.simulate(longer, until=0.1).outcome.ok
