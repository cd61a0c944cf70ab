"""Gearbox: the angle of the inboard shaft is the ratio times the angle of the outboard shaft (theory, "Gear units"). Other joints
carry the shafts. The friction acts along the angle of the outboard (output) shaft."""

from trunnion.elements.joints.joint_kind import E1, JointKind, turn

GEARBOX = JointKind(
    name="gearbox",
    freedoms="angle of the output shaft",
    axes=((turn(E1),),),
    follows="freedom",
    friction="gear unit",
)
