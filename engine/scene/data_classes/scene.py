"""The scene as frozen dataclasses, with the same keys as the YAML file. This module exports the classes of its parts, too.

Numbers are SI. A text with a unit ("45 deg", "30 mm", "60 rpm") is converted when the scene is read.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Annotated, Literal

from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.setting_declarations import RTOL
from trunnion.runtime.integrators import METHODS
from trunnion.scene.data_classes.assemblies import Assembly
from trunnion.scene.data_classes.bodies import Body, Cylinder, Ground, Turn
from trunnion.scene.data_classes.drag_and_attraction import Drag, PointGravity
from trunnion.scene.data_classes.field_types import LIST, SCALAR, STRICT, AxisName, Direction, Position, Vector, either
from trunnion.scene.data_classes.force_field import Field, PlaceFormula
from trunnion.scene.data_classes.friction_keys import Wear
from trunnion.scene.data_classes.joints import (
    AxisAngle,
    Coordinates,
    EndStops,
    Friction,
    FrictionDefaults,
    Joint,
    JointType,
    Nonlinear,
    Side,
    Spring,
    Start,
)
from trunnion.scene.data_classes.loads import Applied, Bushing, Force, Input, SpringDamper, Torque
from trunnion.scene.data_classes.realtime_steps import RealTime
from trunnion.scene.data_classes.signals import (
    ByLoad,
    BySpeed,
    Drive,
    FromInput,
    InputCurve,
    Latch,
    Load,
    LoadVector,
    Motor,
    Signal,
)
from trunnion.scene.force_laws.damping_curve import DampingCurve
from trunnion.scene.force_laws.spring_curve import SpringCurve
from trunnion.scene.signals.constant import Constant
from trunnion.scene.signals.harmonic import Harmonic
from trunnion.scene.signals.move import Move
from trunnion.scene.signals.ramp import Ramp
from trunnion.scene.signals.table import Table
from trunnion.scene.units.numbers_with_units import Acceleration, Duration, Number, Per

if TYPE_CHECKING:
    MethodName = str
else:
    MethodName = Literal[METHODS]
    """The registered integration methods."""


@validated(frozen=True, config=STRICT)
class Simulation:
    """Default settings of a run."""

    until: Duration = 10.0
    """End of the run."""
    every: Duration | None = None
    """Interval of the output; default: a thousandth of the run."""
    rtol: Annotated[float, Per("1", RTOL)] = 1e-6
    """Relative tolerance of the integration."""
    method: MethodName = "auto"
    """Integration method."""
    jams: Literal["end", "impact"] = "end"
    """Reaction to a jam: end the run as ``jammed``, or stop the jammed pair by a tangential impact and continue."""
    realtime: RealTime | None = None
    """Fixed steps with bounded work; default: step size control by the tolerance."""


@validated(frozen=True, config=STRICT)
class Scene:
    """A mechanism: bodies, joints, loads."""

    bodies: dict[str, Body]
    """Rigid bodies by name."""
    joints: dict[str, Joint]
    """Joints by name."""
    name: str = "scene"
    """Short name; default: the name of the file or its folder."""
    schema: Literal[1] = 1
    """Version of this format."""
    title: str = ""
    """One line about the scene."""
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, -9.81)
    """Acceleration of gravity in the world frame."""
    ground: Ground = field(default_factory=Ground)
    """The fixed world."""
    friction: FrictionDefaults = field(default_factory=FrictionDefaults)
    """Default values for frictional joints."""
    forces: dict[str, Applied] = field(default_factory=dict)
    """Applied forces, torques and springs by name."""
    inputs: dict[str, Input] = field(default_factory=dict)
    """External inputs by name."""
    outputs: tuple[str, ...] = ("*",)
    """Patterns of the requested result columns."""
    simulation: Simulation = field(default_factory=Simulation)
    """Settings of a run."""
    tunable: tuple[str, ...] = ()
    """Numbers (dotted paths or patterns) that can be changed at run time even if their value in the scene is zero."""
    parameters: dict[str, Number] = field(default_factory=dict)
    """Named numbers for expressions such as "{a/2 + 5 mm}", which are allowed in place of any number."""
    include: Annotated[
        Annotated[str, SCALAR] | Annotated[tuple[str, ...], LIST], either("the name of a file, or a list of them")
    ] = ()
    """Files in the folder of this file (one name or a list); their keys apply if this file does not give them. Commands and
    Python read these files, servers do not. Reading replaces the includes by the keys."""
    assemblies: dict[str, Assembly] = field(default_factory=dict)
    """Groups of parts by name, which may be repeated. Reading replaces the assemblies by bodies and joints."""
    author: str = ""
    """Author of the scene; exported FMUs contain the name."""
    version: str = ""
    """Version of the scene, such as "1.2"."""
    date: str = ""
    """Date of the scene, such as 2026-11-23."""

    def law_of(self, friction: Friction) -> str:
        """Friction law of a joint: the joint's own law, otherwise the scene's."""
        return friction.law or self.friction.law

    def normal_force_of(self, friction: Friction) -> str:
        """Computation of the normal force of a joint, "exact" or "adams": the joint's own setting, otherwise the scene's."""
        return friction.normal_force or self.friction.normal_force


__all__ = [
    "Applied", "AxisAngle", "AxisName", "Body", "Bushing", "ByLoad", "BySpeed", "Constant", "Coordinates", "Cylinder",
    "DampingCurve", "Direction", "Drag", "Drive", "EndStops", "Field", "Force", "Friction", "FrictionDefaults", "FromInput",
    "Ground", "Harmonic", "Input", "InputCurve", "Joint", "JointType", "Latch", "Load", "LoadVector", "Motor", "Move",
    "Nonlinear", "PlaceFormula", "PointGravity", "Position", "Ramp", "Scene", "Side", "Signal", "Simulation", "Spring",
    "SpringCurve", "SpringDamper", "Start", "Table", "Torque", "Turn", "Vector", "Wear",
]  # fmt: skip
