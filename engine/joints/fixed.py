"""Fixed joint: no freedom."""

from engine.joints.base import JointKind, identity, no_travel

FIXED = JointKind(
    name="fixed",
    freedoms="none",
    axes=(),
    coordinates=(),
    rotation=identity,
    travel=no_travel,
    rows_s=(0, 1, 2),
    rows_r=((1, 0), (2, 0), (2, 1)),
    measure=lambda r, s, ops: [],
)
