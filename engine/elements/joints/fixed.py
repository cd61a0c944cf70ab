"""Fixed joint: no freedom."""

from trunnion.elements.joints.joint_kind import JointKind

FIXED = JointKind(
    name="fixed",
    freedoms="none",
    rows_s=(0, 1, 2),
    rows_r=((1, 0), (2, 0), (2, 1)),
)
