"""Operands of column expressions: values of bodies, joints, loads and the run.

Both kernels provide every operand. The module ``kernel.units.column_operand_expressions`` gives each operand as an expression. The
module ``parts.programs.column_operand_slots`` gives each operand as a slot of the bytecode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi.run_records import EXTRA

if TYPE_CHECKING:
    from trunnion.recursion.body_kinematics import Motion, Pose
else:
    Motion = Pose = Any
    """Types of operands, for annotations only, because this module must not import the symbolic library."""


@dataclass(frozen=True)
class Operand:
    """A value that an expression takes.

    name      name of the method that provides the operand.
    size      number of components; 0 if the number depends on the joint's structure.
    subject   number of parts of the subject's key, from the first, that the method takes as arguments.
    solved    whether the operand contains multipliers or accelerations, which depend on every force."""

    name: str
    size: int
    subject: int
    solved: bool = False


Provider = TypeVar("Provider", bound=type)


def provides_all(provider: Provider) -> Provider:
    """Class decorator that checks that a class provides all operands. Raises TypeError with the names of the operands that have no
    method."""
    declared = {o.name for o in globals().values() if isinstance(o, Operand)}
    missing = sorted(name for name in declared if not hasattr(provider, name))
    if missing:
        raise TypeError(f"{provider.__module__} provides no {', '.join(missing)}")
    return provider


BODY_MOTION = Operand("body_motion", 18, 1)
"""``Motion`` of a body, in the world frame: R (3×3), r, omega and rdot (3 each)."""
BODY_ANGULAR_VELOCITY = Operand("body_angular_velocity", 3, 1)
"""ω of a body, world frame, rad/s."""
BODY_ACCELERATION = Operand("body_acceleration", 6, 1, solved=True)
"""Ż of a body, world frame: acceleration of the reference origin, m/s², then angular acceleration, rad/s². Gravity enters as an
acceleration of the ground."""
MASS_CENTRE = Operand("mass_centre", 3, 1)
"""Vector from a body's reference origin to the mass centre, body axes, m."""
BODY_POINT = Operand("body_point", 3, 2)
"""Vector from a body's reference origin to a named point, body axes, m."""
GRAVITY = Operand("gravity", 3, 0)
"""Gravity, world frame, m/s²."""

COORDINATE = Operand("coordinate", 1, 2)
"""One coordinate of a joint, rad or m, or a component of a quaternion."""
RATE = Operand("rate", 1, 2)
"""Rate of a freedom, rad/s or m/s."""
JOINT_ACCELERATION = Operand("joint_acceleration", 1, 2, solved=True)
"""Acceleration of a freedom, rad/s² or m/s²."""
JOINT_POSE = Operand("joint_pose", 21, 1)
"""``Pose``: the joint's frames Ein and Eout in the world frame (3×3), and s = p_out − p_in (3), m."""
REACTION_ARM = Operand("reaction_arm", 3, 1)
"""Vector from the point where the reaction is reported to p_out, world frame, m. The vector is s, or 0 if the pin belongs to the
outboard part."""
OUTBOARD_WRENCH = Operand("outboard_wrench", 6, 1, solved=True)
"""Force (N) and torque (N·m) that a joint transmits to its outboard part, at p_out, world frame."""
DRIVE_EFFORT = Operand("drive_effort", 1, 2, solved=True)
"""Effort of a freedom's drive on the outboard part, N or N·m."""
DEVICE_EFFORT = Operand("device_effort", 1, 3)
"""Effort of one device of a freedom on the outboard part, N or N·m."""
LATCH_HOOK = Operand("latch_hook", 1, 2)
"""Number, from 1, of the tooth that holds the hook of a freedom's latch; 0 if the hook is up."""
GAP = Operand("gap", 1, 1)
"""Gap, m, of a joint whose contact pushes but does not pull."""
COUPLING_MULTIPLIER = Operand("coupling_multiplier", 1, 1, solved=True)
"""Lagrange multiplier of a coupling's constraint row, N or N·m."""

FRICTION_MULTIPLIER = Operand("friction_multiplier", 1, 2, solved=True)
"""Friction multiplier η along a freedom: the effort of friction on the inboard part, N or N·m."""
BRISTLE_STATE = Operand("bristle_state", 1, 2)
"""State of a bristle law along a freedom."""
BRISTLE_SCALE = Operand("bristle_scale", 1, 1)
"""Ratio of a bristle's state to its deflection, 1/m."""
PAIR_STATE = Operand("pair_state", 1, 1)
"""Sliding state of a friction pair."""
FRICTION = Operand("friction", 0, 1)
"""``FrictionTerms`` of a joint: the friction element, its laws, and its parameters as expressions."""
CONTACT_REACTION = Operand("contact_reaction", 0, 1, solved=True)
"""All components of f_c and m_c of a joint with friction, in the order of ``everything``."""
JOINT_RATES = Operand("joint_rates", 0, 1)
"""Rates of all freedoms of a joint."""
JOINT_MULTIPLIERS = Operand("joint_multipliers", 0, 1, solved=True)
"""η of all freedoms of a joint."""

LOAD_ENDS = Operand("load_ends", 36, 1)
"""The ``Motion`` of each of the two bodies that a load joins."""
SPRING_NUMBERS = Operand("load_numbers", 9, 1)
"""Parameters of a spring-damper: stiffness, damping, free length, then the points on the first and second body (3 each)."""
NONLINEAR_FORCE = Operand("nonlinear_force", 1, 1)
"""Force of the nonlinear springs and dampers of a spring-damper, N; positive if it pulls the ends together."""
BUSHING_NUMBERS = Operand("load_numbers", 36, 1)
"""Parameters of a bushing: stiffness and damping (12), then points (3 each) and frames (9 each) on the first and second body."""

ENERGIES = Operand("energies", 2, 0)
"""Kinetic and potential energy, J."""
WORK = Operand("work", 1, 1)
"""Time integral of one power, J. The subject's key is the power's name (``names_of_powers``)."""
DRIVE_WORK = Operand("drive_work", 1, 0)
"""Work of all drives, J."""
LOAD_WORK = Operand("load_work", 1, 0)
"""Work of all loads, efforts and motors, J."""
TAKEN_WORK = Operand("taken_work", 1, 0)
"""Work of friction and dampers, J (≤ 0)."""
RUNTIME_VALUES = Operand("runtime_values", EXTRA.numbers, 0)
"""Values that the runtime computes (record ``tr_extra``)."""
