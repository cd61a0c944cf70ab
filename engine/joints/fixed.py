"""Fixed joint: no freedom."""

from engine.joints.base import JointKind, identity, no_travel

FIXED = JointKind("fixed", (), (), identity, no_travel, (0, 1, 2), ((1, 0), (2, 0), (2, 1)), lambda r, s, ops: [])
