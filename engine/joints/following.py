"""Followers of cams (METHOD, "Cams"): a point, such as the middle of a roller, or a flat face of one part follows a curve around an
axis of the other; or a point a curve anywhere in a plane (METHOD, "Points on curves"). Such a pair carries no body: both parts move
on joints of their own, and one row ties them. So does one that ties the freedoms of two joints (METHOD, "Joints that follow
another"), of which a scene speaks in one of these."""

from typing import Literal

from engine.joints.base import E3, JointKind, identity, no_travel, slide

SLIDES = "its rate is how fast the follower slides along the curve"


def _kind(name: str, follows: Literal["point", "face", "curve"], freedoms: str = SLIDES, along: bool = False) -> JointKind:
    return JointKind(
        name=name, freedoms=freedoms, axes=((slide(E3),),), coordinates=("length",) if along else (),
        rotation=identity, travel=no_travel, rows_s=(), rows_r=(), measure=lambda r, s, ops: [], follows=follows,
        friction="follower", contacts=1,
    )  # fmt: skip


CAM = _kind("cam", "point")
FLAT_CAM = _kind("flat_cam", "face")
POINT_ON_CURVE = _kind("point_on_curve", "curve", "way along the curve from its first point", along=True)
MIMIC = JointKind(
    name="mimic", freedoms="", axes=(), coordinates=(), rotation=identity, travel=no_travel, rows_s=(), rows_r=(),
    measure=lambda r, s, ops: [], follows="freedom",
)  # fmt: skip
