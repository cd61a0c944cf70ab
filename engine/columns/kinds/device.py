"""Effort and power of devices along a freedom: springs, dampers, end stops, efforts, motors, latches."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import DEVICE_EFFORT, RATE
from trunnion.columns.subjects import DEVICE


def device(effort: SX, rate: SX) -> dict[str, SX]:
    """The effort and the power. power = effort × rate."""
    return {"effort": effort, "power": effort * rate}


KIND = ColumnKind(
    of=DEVICE,
    operands={"effort": DEVICE_EFFORT, "rate": RATE},
    expression=device,
    quantities=(
        Quantity(name="device", output="effort", column="{joint}.{stem}[{number}]", unit="{effort}", vector=False, direct=True,
                 text="force or torque of the {what} of {joint}, on the outboard part along freedom {number}"),
        Quantity(name="power", output="power", column="{joint}.{device}.power[{number}]", unit="W", vector=False, direct=True,
                 text="power of the {what} of {joint}, on the outboard part along freedom {number}"),
    ),
)  # fmt: skip
