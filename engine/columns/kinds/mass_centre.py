"""Position and velocity of a body's mass centre."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import BODY_MOTION, MASS_CENTRE, Motion
from trunnion.columns.subjects import BODY


def mass_centre(motion: Motion, centre: SX) -> dict[str, SX]:
    """Position r + R c and velocity ṙ + ω × R c of the mass centre, by (1) and (5)."""
    from trunnion.recursion.vector_algebra import cross

    lever = motion.R @ centre
    return {"position": motion.r + lever, "velocity": motion.rdot + cross(motion.omega, lever)}


KIND = ColumnKind(
    of=BODY,
    operands={"motion": BODY_MOTION, "centre": MASS_CENTRE},
    expression=mass_centre,
    quantities=(
        Quantity(name="position", output="position", column="{body}.position[{component}]", size=3, unit="m",
                 text="mass centre of {body}, world frame"),
        Quantity(name="velocity", output="velocity", column="{body}.velocity[{component}]", size=3, unit="m/s",
                 text="velocity of the mass centre of {body}"),
    ),
)  # fmt: skip
