"""Joint types. A new type needs a new file in this folder and a line in TYPES; the rest of the engine does not depend on type
names."""

from trunnion.basics.objects_by_import_path import objects
from trunnion.elements.joints.declaration_checks import registered
from trunnion.elements.joints.free import FREE
from trunnion.elements.joints.joint_kind import Axis, JointKind
from trunnion.elements.joints.mimic_and_light_rows import TIES
from trunnion.elements.joints.revolute import REVOLUTE
from trunnion.elements.joints.spherical import SPHERICAL

TYPES = (
    "fixed.FIXED",
    "free.FREE",
    "revolute.REVOLUTE",
    "cylindrical.CYLINDRICAL",
    "prismatic.PRISMATIC",
    "spherical.SPHERICAL",
    "universal.UNIVERSAL",
    "planar.PLANAR",
    "screw.SCREW",
    "point_on_line_or_plane.POINT_ON_LINE",
    "point_on_line_or_plane.POINT_ON_PLANE",
    "wheel_pairs.GEAR",
    "wheel_pairs.BEVEL",
    "wheel_pairs.RACK",
    "wheel_pairs.BELT",
    "wheel_pairs.FRICTION_BELT",
    "worm.WORM",
    "cam_and_curve_followers.CAM",
    "cam_and_curve_followers.FLAT_CAM",
    "cam_and_curve_followers.POINT_ON_CURVE",
    "pin_in_slot.PIN_IN_SLOT",
    "rod.ROD",
    "gearbox.GEARBOX",
)
REGISTRY: dict[str, JointKind] = registered(*objects(__name__, TYPES))

__all__ = ["FREE", "REGISTRY", "REVOLUTE", "SPHERICAL", "TIES", "Axis", "JointKind"]
