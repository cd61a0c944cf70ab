"""Torque of a gearbox on its output shaft."""

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import JOINT_POSE, OUTBOARD_WRENCH, Pose
from trunnion.columns.subjects import GEARBOX


def output_torque(wrench: SX, pose: Pose) -> dict[str, SX]:
    """The torque on the outboard part about e1."""
    return {"torque": ca.dot(wrench[3:], pose.Ein[:, 0])}


KIND = ColumnKind(
    of=GEARBOX,
    operands={"wrench": OUTBOARD_WRENCH, "pose": JOINT_POSE},
    expression=output_torque,
    quantities=(
        Quantity(name="output_torque", output="torque", column="{joint}.output_torque", unit="N*m",
                 text="torque of the gearbox {joint} on the output shaft, friction included", direct=True, reacts=True),
    ),
)  # fmt: skip
