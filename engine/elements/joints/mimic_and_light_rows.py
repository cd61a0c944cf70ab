"""Kinds of constraint rows for freedoms: a freedom that follows another freedom (theory, "Joints that follow another"), and a light
freedom (theory, "Light bodies"). These rows do not belong to cut joints, and these kinds are not allowed as the ``type`` of a joint
in a scene."""

from trunnion.elements.joints.joint_kind import JointKind

MIMIC = JointKind(name="mimic", freedoms="", follows="freedom")
LIGHT_ROW = JointKind(name="light", freedoms="", follows="freedom")
TIES = {kind.name: kind for kind in (MIMIC, LIGHT_ROW)}
