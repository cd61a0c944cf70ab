"""Effort, reaction and power of the drive of a freedom."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import DRIVE_EFFORT, RATE
from trunnion.columns.subjects import DRIVEN


def drive(effort: SX, rate: SX) -> dict[str, SX]:
    """Effort = transmitted force along the freedom − forces of friction and devices + inertia force of the rotor. The power is
    effort × rate. The reaction acts on the drive's source, for example a motor in another model."""
    return {"effort": effort, "reaction": -effort, "power": effort * rate}


KIND = ColumnKind(
    of=DRIVEN,
    operands={"effort": DRIVE_EFFORT, "rate": RATE},
    expression=drive,
    quantities=(
        Quantity(name="drive", output="effort", column="{joint}.drive.effort[{number}]", unit="{effort}",
                 text="effort of the drive of {joint}", direct=True, reacts=True),
        Quantity(name="drive", output="reaction", label=("reaction",), column="{joint}.drive.reaction[{number}]", unit="{effort}",
                 text="effort that the drive of {joint} exerts on its source: minus the effort on {joint}", direct=True,
                 reacts=True),
        Quantity(name="power", output="power", label=("drive",), column="{joint}.drive.power[{number}]", unit="W",
                 text="power of the drive of {joint}", vector=False, direct=True, reacts=True),
    ),
)  # fmt: skip
