"""Reaction of a joint."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import JOINT_POSE, OUTBOARD_WRENCH, REACTION_ARM, Pose
from trunnion.columns.subjects import JOINT, Subject


def reaction(wrench: SX, pose: Pose, arm: SX) -> dict[str, SX]:
    """Reaction on the inboard part, about the joint centre (the pin's point), in the inboard joint frame, by (57)–(66)."""
    from trunnion.recursion.vector_algebra import cross

    force, torque = wrench[:3], wrench[3:] + cross(arm, wrench[:3])
    return {"force": -(pose.Ein.T @ force), "torque": -(pose.Ein.T @ torque)}


def transmits(s: Subject) -> bool:
    """Whether the joint has a reaction. A joint with six freedoms transmits no force."""
    return s.data.kind.nv < 6


KIND = ColumnKind(
    of=JOINT,
    operands={"wrench": OUTBOARD_WRENCH, "pose": JOINT_POSE, "arm": REACTION_ARM},
    expression=reaction,
    quantities=(
        Quantity(name="reaction", output="force", label=("f",), column="{joint}.reaction.force[{component}]", size=3, unit="N",
                 text="force transmitted by {joint} to the inboard part, inboard joint frame", given=transmits, direct=True,
                 reacts=True),
        Quantity(name="reaction", output="torque", label=("m",), column="{joint}.reaction.torque[{component}]", size=3, unit="N*m",
                 text="torque transmitted by {joint} to the inboard part, inboard joint frame", given=transmits, direct=True,
                 reacts=True),
    ),
)  # fmt: skip
