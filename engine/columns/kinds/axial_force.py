"""Axial force of a rod."""

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import JOINT_POSE, OUTBOARD_WRENCH, Pose
from trunnion.columns.subjects import ROD


def axial_force(wrench: SX, pose: Pose) -> dict[str, SX]:
    """The force on the outboard part, positive towards the inboard point."""
    return {"force": -ca.dot(wrench[:3], pose.s) / ca.norm_2(pose.s)}


KIND = ColumnKind(
    of=ROD,
    operands={"wrench": OUTBOARD_WRENCH, "pose": JOINT_POSE},
    expression=axial_force,
    quantities=(
        Quantity(name="axial_force", output="force", column="{joint}.axial_force", unit="N",
                 text="axial force of the rod {joint}, positive in tension", direct=True, reacts=True),
    ),
)  # fmt: skip
