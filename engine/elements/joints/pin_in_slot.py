"""A pin of one part in a slot of the other part, with play, end walls or mouths (theory, "Pins in slots")."""

from trunnion.elements.joints.cam_and_curve_followers import POINT_ON_CURVE
from trunnion.elements.joints.joint_kind import E3, JointKind, slide

PIN_IN_SLOT = JointKind(
    name="pin_in_slot", freedoms="its rate is the sliding speed of the pin along the touched wall, which is on the left",
    axes=((slide(E3),),), follows=POINT_ON_CURVE.follows, plays=True, friction=POINT_ON_CURVE.friction, contacts=1,
)  # fmt: skip
