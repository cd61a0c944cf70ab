"""Spherical joint: the coordinates are a quaternion; the rates are the relative angular velocity in the inboard joint frame."""

from trunnion.elements.joints.joint_kind import SPIN, JointKind, of_quaternion, to_quaternion

SPHERICAL = JointKind(
    name="spherical",
    freedoms="quaternion; rates: angular velocity in the inboard joint frame",
    axes=SPIN,
    coordinates=("quaternion", "quaternion", "quaternion", "quaternion"),
    rotation=lambda q, ops: of_quaternion(q),
    rows_s=(0, 1, 2),
    measure=lambda r, s, ops: to_quaternion(r, ops),
    friction="ball",
    contacts=1,
)
