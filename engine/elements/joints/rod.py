"""A rod: rigid and massless, with an ideal ball at each end (theory, "Rods"). The rod keeps the distance of two points."""

from trunnion.elements.joints.joint_kind import JointKind

ROD = JointKind(name="rod", freedoms="", keeps_distance=True)
