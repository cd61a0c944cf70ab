"""Torque of a gearbox's input shaft."""

from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import COUPLING_MULTIPLIER
from trunnion.columns.subjects import GEARBOX_ROW

KIND = ColumnKind(
    of=GEARBOX_ROW,
    operands={"multiplier": COUPLING_MULTIPLIER},
    quantities=(
        Quantity(name="input_torque", column="{joint}.input_torque", unit="N*m", vector=False, direct=True,
                 text="torque of the input shaft on the gearbox {joint}"),
    ),
)  # fmt: skip
