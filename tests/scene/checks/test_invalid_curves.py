"""Impossible curves are refused with the reason."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from trunnion.basics.errors import SceneError
from trunnion.scene.checks import problems
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.data_classes.joint_couplings import Curve
from trunnion.scene.scene_loader import scene_from_text
from trunnion.system.construction.system_builder import build

PIN = (
    "{type: pin_in_slot, axis: z, inboard: a, outboard: b, slot: {play: 1 mm}, unilateral: {}, "
    "curve: {points: [[0, 0], [40 mm, 10 mm], [80 mm, 0]]}}"
)
GOOD = "{type: point_on_curve, axis: z, inboard: a, outboard: b, curve: {points: [[0, 0], [40 mm, 10 mm], [80 mm, 0]]}}"
WRONG = {
    "a point_on_curve needs the curve on which its point stays": re.sub(", curve.*", "}", GOOD),
    "an open curve of 1 points": re.sub(r"\[\[.*\]\]", "[[0, 0]]", GOOD),
    "a closed curve of 2 points": re.sub(r"\[\[.*\]\]", "[[0, 0], [1, 0]], closed: true", GOOD),
    "two consecutive points are the same place": GOOD.replace("[80 mm, 0]", "[40 mm, 10 mm]"),
    "a closed curve returns to its first point by itself": GOOD.replace("80 mm, 0]]", "80 mm, 0], [0, 0]], closed: true"),
    "the curve crosses itself between points 3 and 4": GOOD.replace("[80 mm, 0]", "[20 mm, 20 mm], [20 mm, -20 mm]"),
    "curves in space are not supported": GOOD.replace("[40 mm, 10 mm]", "[40 mm, 10 mm, 5 mm]"),
    "a revolute joint has no curve": GOOD.replace("point_on_curve", "revolute"),
    "a point_on_curve has no drive of its own: curve and point move on other": GOOD.replace(
        ", curve", ", drive: {constant: {rate: 1}}, curve"
    ),
    "a point_on_curve has no start of its own": GOOD.replace(", curve", ", start: {q: 0}, curve"),
    "a closed curve has no ends: end stops along it": GOOD.replace("0]]}", "0]], closed: true}, end_stops: {stiffness: 1}"),
    "a roller touches one side of its curve": GOOD.replace(", curve", ", roller: 3 mm, curve"),
    "the rate of this joint is the sliding speed": GOOD.replace(", curve", ", roller: 3 mm, unilateral: {}, damping: 2, curve"),
    "a point_on_curve joint has no slot with play": GOOD.replace(", curve", ", slot: {play: 1 mm}, curve"),
    "a pin_in_slot needs the play of its slot": PIN.replace(", slot: {play: 1 mm}", ""),
    "the walls of a pin_in_slot push, but do not pull": PIN.replace(", unilateral: {}", ""),
    "0 slots": PIN.replace("1 mm", "1 mm, repeated: 0"),
    "the curve leaves its sector of 360°/60": PIN.replace("1 mm", "1 mm, repeated: 60"),
    "a closed curve has no end for a mouth": PIN.replace("1 mm", "1 mm, mouth: end").replace("0]]", "0]], closed: true"),
    "the ends of a slot are its mouths": PIN.replace("unilateral: {}", "unilateral: {thickness: 1 mm}"),
    "the wall is closed, so it has no ends": GOOD.replace("0]]}", "0]], closed: true}, unilateral: {thickness: 1 mm}"),
    "this contact has no ends": "{type: point_on_plane, axis: z, inboard: a, outboard: b, unilateral: {thickness: 1 mm}}",
    "m is a point_on_curve joint; a joint that follows": GOOD.replace(", curve", ", mimic: {joint: on_b}, curve"),
}


@pytest.mark.parametrize("says", WRONG)
def test_impossible_curves_are_refused_with_the_reason(says: str) -> None:
    joints = "  on_a: {type: revolute, axis: z, inboard: ground, outboard: a}\n"
    joints += "  on_b: {type: prismatic, axis: x, inboard: ground, outboard: b}"
    each = "".join(f"  {b}: {{mass: 1, inertia: [0.01, 0.01, 0.02]}}\n" for b in "ab")
    with pytest.raises(SceneError, match=re.escape(says)):
        build(scene_from_text(f"schema: 1\nbodies:\n{each}joints:\n{joints}\n  m: {WRONG[says]}\nsimulation: {{until: 1 s}}\n"))


@pytest.mark.parametrize("way", [(0.0, 1.0), (1.0, 0.0), (1.0, 0.3), (-0.7, 1.1)])
def test_a_straight_curve_of_many_points_does_not_cross_itself(way: tuple[float, float]) -> None:
    """Round-off places points on either side of the line."""
    points = [tuple(float(x) * k * 0.1 for x in way) for k in range(7)]
    curve = Curve(points=tuple(points))
    scene = sm.Scene({"b": sm.Body(mass=1.0, inertia=(1.0, 1.0, 1.0))}, {
        "plane": sm.Joint("planar", "ground", "b", axis="z"),
        "slot": sm.Joint("point_on_curve", "ground", "b", axis="z", curve=curve)})  # fmt: skip
    assert not problems(scene)
    back = replace(curve, points=(*points, (points[3][0] + 0.05, points[3][1] - 0.05), (points[3][0] - 0.05, points[3][1] + 0.05)))
    wrong = problems(replace(scene, joints=scene.joints | {"slot": replace(scene.joints["slot"], curve=back)}))
    assert any("crosses itself" in str(w) for w in wrong)
