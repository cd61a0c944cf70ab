"""Joint types. A new one is a new file here and one line in REGISTRY; nothing else in the engine asks for a type by name."""

from engine.joints.base import Axis, JointKind
from engine.joints.contract import registered
from engine.joints.cylindrical import CYLINDRICAL
from engine.joints.fixed import FIXED
from engine.joints.following import CAM, FLAT_CAM, MIMIC, POINT_ON_CURVE
from engine.joints.free import FREE
from engine.joints.planar import PLANAR
from engine.joints.point import POINT_ON_LINE, POINT_ON_PLANE
from engine.joints.prismatic import PRISMATIC
from engine.joints.revolute import REVOLUTE
from engine.joints.rolling import BELT, BEVEL, GEAR, RACK
from engine.joints.screw import SCREW
from engine.joints.spherical import SPHERICAL
from engine.joints.universal import UNIVERSAL

REGISTRY: dict[str, JointKind] = registered(
    FIXED, FREE, REVOLUTE, CYLINDRICAL, PRISMATIC, SPHERICAL, UNIVERSAL, PLANAR, SCREW, POINT_ON_LINE, POINT_ON_PLANE,
    GEAR, BEVEL, RACK, BELT, CAM, FLAT_CAM, POINT_ON_CURVE,
)

TIES = {MIMIC.name: MIMIC}
"""What ties the freedoms of two joints: no joint of a scene by itself."""

__all__ = ["FREE", "REGISTRY", "REVOLUTE", "SPHERICAL", "TIES", "Axis", "JointKind"]
