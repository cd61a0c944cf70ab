"""A joint type with contradictory declarations cannot be registered, so its module cannot be imported. All parts of the program
know a joint type with consistent declarations."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args, get_type_hints

import pytest

from tests.scalable_mechanisms import revolute_chain
from trunnion.elements.joints import REGISTRY, JointKind
from trunnion.elements.joints.declaration_checks import faults, registered
from trunnion.elements.joints.joint_kind import E2, E3, Axis, about_e1, of_quaternion, slide, turn
from trunnion.scene.data_classes.scene import Joint
from trunnion.scene.library.starter_scene import starter_text

WRONG = {
    "a row too many": ("cylindrical", {"rows_s": (0, 1, 2)}, "2 freedoms, 5 rows and 0 ties do not add up to 6"),
    "a screw without its tie": ("screw", {"ties": 0}, "1 freedoms, 4 rows and 0 ties do not add up to 6"),
    "two freedoms of a coordinate": ("cylindrical", {"coordinates": ("length",)}, "1 coordinates but 2 rates"),
    "a length that is an angle": ("prismatic", {"coordinates": ("angle",)}, "coordinate 1 is a angle"),
    "travels after the quaternion": (
        "free", {"coordinates": ("quaternion",) * 4 + ("length",) * 3}, "a quaternion must be the last four coordinates",
    ),
    "a sliding axis of the outboard part": (
        "prismatic", {"axes": ((Axis(index=0, rot=False, side="out"),),)}, "a sliding axis must belong to the inboard frame",
    ),
    "a screw that can be cut": ("screw", {"ties": 0, "rows_s": (0, 1, 2)}, "must have exactly one axis per rate"),
    "no rotation": ("revolute", {"rotation": lambda q, ops: [[1, 0, 0], [0, 1 + q[0], 0], [0, 0, 1]]}, "is not a rotation matrix"),
    "a reflection": ("prismatic", {"rotation": lambda q, ops: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "is not a rotation matrix"),
    "frames apart at rest": ("prismatic", {"travel": lambda q: [q[0], 0.1, 0.0]}, "do not coincide at q = 0"),
    "an angle measured backwards": ("revolute", {"measure": lambda r, s, ops: [ops.atan2(r[1][2], r[1][1])]}, "gives (-0.7)"),
    "an angle turned backwards": ("revolute", {"rotation": lambda q, ops: about_e1(-q[0], ops)}, "rate 1: by its axes it"),
    "another axis": ("revolute", {"axes": ((turn(E2),),)}, "rate 1: by its axes it slides by (0, 0, 0), turns by (0, 1, 0)"),
    "another travel": ("planar", {"axes": ((slide(E3),), (slide(E2),), (turn(0),))}, "rate 2: by its axes it slides by (0, 1, 0)"),
    "rates of the wrong side": ("spherical", {"axes": tuple((turn(k, "out"),) for k in range(3))}, "rate 1: by its axes it"),
    "the quaternion the other way": (
        "spherical", {"rotation": lambda q, ops: of_quaternion([q[0], -q[1], -q[2], -q[3]])}, "rate 1: by its axes it",
    ),
    "a row along its motion": ("planar", {"rows_s": (1,)}, "row r·h2 (49) is not zero along its motion"),
    "a row about its axis": ("universal", {"rows_r": ((1, 1),)}, "row h2·h2 (46) is not zero along its motion"),
    "a row said twice": ("revolute", {"rows_r": ((1, 0), (1, 0))}, "its rows must prevent exactly what its axes exclude"),
}  # fmt: skip


@pytest.mark.parametrize("kind", REGISTRY.values(), ids=lambda k: k.name)
def test_every_type_keeps_the_contract(kind: JointKind) -> None:
    assert faults(kind) == []


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_declaration_refuses_to_import(what: str) -> None:
    name, change, said = WRONG[what]
    with pytest.raises(ValueError, match="joint type") as e:
        registered(replace(REGISTRY[name], **change))
    assert str(e.value).startswith(f"joint type {name}: ")
    assert said in str(e.value)


def test_every_mistake_is_reported_at_once_and_a_name_is_taken_once() -> None:
    bad = replace(REGISTRY["revolute"], name="crooked", travel=lambda q: [0.1, 0.0, 0.0], axes=((turn(E2),),))
    with pytest.raises(ValueError, match="joint type crooked") as e:
        registered(REGISTRY["revolute"], bad, REGISTRY["revolute"])
    assert [said for said in ("coincide at q = 0", "crooked: rate 1", "revolute: declared twice") if said not in str(e.value)] == []


def test_a_declaration_names_its_fields() -> None:
    with pytest.raises(TypeError):
        JointKind("revolute", "angle about e1")  # type: ignore[call-arg, misc]
    with pytest.raises(TypeError):
        Axis(0, True)  # type: ignore[call-arg, misc]


def test_scene_schema_and_starter_know_the_types_that_are_registered() -> None:
    literal, *marks = get_args(get_type_hints(Joint, include_extras=True)["type"])
    assert get_args(literal) == tuple(REGISTRY)
    assert all(f"{k.name} ({k.freedoms})" in marks[0].text for k in REGISTRY.values() if k.nv)
    assert ", ".join(REGISTRY) in starter_text("crane")
    assert revolute_chain(1).joints["joint1"].type in REGISTRY
