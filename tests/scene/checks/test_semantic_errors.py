"""Every mistake of meaning is reported at its place, with an explanation. A valid scene has no problem."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.scene.valid_scene import GONE, VALID, edited, problems_of
from trunnion.scene import checked, problems, scene_from_dict
from trunnion.scene.data_classes.scene import Body, Joint, Scene
from trunnion.scene.file_format.yaml_reader import read

CASES: dict[str, Any] = read(Path(__file__).with_name("mistakes.yaml").read_bytes()).data


def test_a_scene_with_one_of_everything_has_no_problem():
    assert problems_of(VALID) == []


@pytest.mark.default_cases(33)
@pytest.mark.parametrize("case", CASES)
def test_a_mistake_is_found_at_its_place_and_alone(case):
    changes = {path: GONE if value == "GONE" else value for path, value in CASES[case]["change"].items()}
    found = problems_of(edited(changes))
    assert [p.where for p in found] == [CASES[case]["where"]], found
    assert CASES[case]["says"] in str(found[0])


LIMITS = {
    "point mass": {"bodies.sled.inertia": [0, 0, 0]},
    "thin rod": {"bodies.sled.inertia": [0, 1, 1]},
    "flat plate": {"bodies.sled.inertia": [1, 1, 2]},
    "rounded flat plate": {"bodies.sled.inertia": [1, 1, 2.000000001]},
    "mass, inertia and a shape to draw": {"bodies.sled.box": [1, 1, 1]},
    "shape with mass": {"bodies.arm.density": GONE, "bodies.arm.mass": 3},
    "friction of size zero": {"joints.hinge.friction.mu": 0},
    "frequency zero": {"joints.cross.effort[1].harmonic.frequency": 0},
    "axis given by lengths": {"joints.rail.axis": ["1 mm", "2 mm", 0]},
    "coordinates of one freedom as a list": {"joints.hinge.start.q": ["3 deg"], "joints.hinge.spring": [None]},
    "ground on the outboard side": {"joints.hinge.inboard": "arm", "joints.hinge.outboard": "ground.hook"},
    "closed loop": {"joints.back": {"type": "spherical", "inboard": "ground", "outboard": "link.end", "cut": True}},
    "damping of a ball": {"joints.socket.damping": [1, 1, 1], "joints.socket.effort": [0, None, 1]},
    "stiffness without the unspoken radian": {"joints.hinge.spring.stiffness": "5 N*m"},
    "input of no unit": {"inputs.motor.unit": "1", "inputs.motor.start": 0},
    "lower stop alone": {"joints.hinge.end_stops.upper": GONE},
    "screw": {"joints.flight": {"type": "screw", "axis": "z", "pitch": "-5 mm", "inboard": "ground", "outboard": "flyer"}},
}


@pytest.mark.parametrize("case", LIMITS)
def test_an_unusual_scene_is_accepted(case):
    assert problems_of(edited(LIMITS[case])) == []


def test_problems_of_form_and_of_meaning_are_reported_together():
    changes = {
        "bodies.arm.masss": 3,  # mistake of form
        "joints.hinge.friction.mu": "3 deg",  # mistake of form
        "joints.socket.inboard": "amr.tip",  # mistake of meaning
        "simulation.until": -1,  # mistake of meaning
        "joints.rail.type": "prism",  # mistake of form
    }
    assert {p.where for p in problems_of(edited(changes))} == {
        "bodies.arm.masss",
        "joints.hinge.friction.mu",
        "joints.socket.inboard",
        "simulation.until",
        "joints.rail.type",
    }


@pytest.mark.parametrize(
    "changes",
    [
        {"bodies.arm.points.tip": [1, 2]},
        {"bodies.arm.points": 3},
        {"bodies.arm": "heavy"},
        {"bodies.arm.mass": "3 m", "bodies.arm.density": GONE},
        {"bodies.link.cylinder.radius": GONE},
        {"joints.hinge.axis": "w"},
        {"joints.hinge.outboard": 3},
        {"joints.hinge.friction.radius": "x"},
        {"inputs.wind": 3},
        {"ground.points.hook": "there"},
        {"joints.rail.drive": {"ramp": {"start": "x", "end": 0, "duration": 1}}},
        {"joints.hinge.end_stops": {"stiffness": 1, "upper": "x"}},
        {"joints.hinge.friction": {"mu": 1, "radus": 1, "half_length": 1}},
        {"bodies.arm.density": GONE, "bodies.arm.densty": 7800},
        {"joints.hinge.friction.mu": GONE, "joints.hinge.friction.law": "viscos", "joints.hinge.friction.viscosity": 1},
        {"joints.hinge.axis": GONE, "joints.hinge.axes": "y"},
        {"joints.hinge": "revolute"},
    ],
)
def test_a_mistake_of_form_is_not_followed_by_its_consequences(changes):
    found = problems_of(edited(changes))
    assert len(found) == 1, found


@pytest.mark.parametrize("given", ["revolut", "hinge", 3, GONE])
def test_a_wrong_joint_type_hides_no_other_mistake_of_the_joint(given):
    changes = {"joints.hinge.type": given, "joints.hinge.friction.mu": -1, "joints.hinge.outboard": "arm.tap"}
    found = {p.where for p in problems_of(edited(changes))}
    assert found == {"joints.hinge.type", "joints.hinge.friction.mu", "joints.hinge.outboard"}


@pytest.mark.parametrize("joint", VALID["joints"])
def test_a_wrong_joint_type_is_not_followed_by_its_consequences(joint):
    for given in (VALID["joints"][joint]["type"][:-1], "hinge"):
        found = problems_of(edited({f"joints.{joint}.type": given}))
        assert [p.where for p in found] == [f"joints.{joint}.type"], found


def test_an_unrelated_mistake_of_form_hides_nothing():
    changes = {"bodies.sled.inertia": GONE, "bodies.sled.colr": 1, "bodies.sled.points": {"a": 3}}
    assert {p.where for p in problems_of(edited(changes))} == {
        "bodies.sled",
        "bodies.sled.colr",
        "bodies.sled.points.a",
    }


def test_scenes_made_in_python_are_checked_by_the_same_rules():
    scene = Scene(bodies={"a": Body(box=(1, 1, 1), density=1)}, joints={"j": Joint("revolute", "ground", "b", axis="z")})
    assert [p.where for p in problems(scene)] == ["joints.j.outboard"]
    assert checked(scene_from_dict(VALID)).name == "one_of_everything"

