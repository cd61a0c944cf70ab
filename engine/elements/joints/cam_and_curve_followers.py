"""Joints that follow a cam (theory, "Cams") or a curve (theory, "Points on curves").

A cam is a curve around an axis of one part. A point (such as the centre of a roller) or a flat face of the other part follows the
cam. A point can also follow any curve in a plane. These joints carry no body: other joints carry both parts, and one constraint row
couples the parts."""

from typing import Literal

from trunnion.elements.joints.joint_kind import E3, JointKind, slide

SLIDES = "its rate is the sliding speed of the follower along the curve"


def _kind(name: str, follows: Literal["point", "face", "curve"], freedoms: str = SLIDES, along: bool = False) -> JointKind:
    return JointKind(
        name=name, freedoms=freedoms, axes=((slide(E3),),), coordinates=("length",) if along else (), follows=follows,
        friction="follower", contacts=1,
    )  # fmt: skip


CAM = _kind("cam", "point")
FLAT_CAM = _kind("flat_cam", "face")
POINT_ON_CURVE = _kind("point_on_curve", "curve", "arc length along the curve from its first point", along=True)
