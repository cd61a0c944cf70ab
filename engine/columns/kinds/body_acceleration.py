"""Acceleration of a body's mass centre."""

from trunnion.basics.lazy_casadi import SX
from trunnion.columns.declaration import ColumnKind, Quantity
from trunnion.columns.operands import BODY_ACCELERATION, BODY_MOTION, GRAVITY, MASS_CENTRE, Motion
from trunnion.columns.subjects import BODY


def acceleration(motion: Motion, centre: SX, gravity: SX, Z: SX) -> dict[str, SX]:
    """Acceleration r̈ + ω̇ × R c + ω × (ω × R c) of the mass centre. Ż contains gravity as an acceleration −g of the ground.
    Therefore r̈ = Ż[:3] + g."""
    from trunnion.recursion.vector_algebra import cross

    lever = motion.R @ centre
    return {"acceleration": Z[:3] + cross(Z[3:], lever) + cross(motion.omega, cross(motion.omega, lever)) + gravity}


KIND = ColumnKind(
    of=BODY,
    operands={"motion": BODY_MOTION, "centre": MASS_CENTRE, "gravity": GRAVITY, "Z": BODY_ACCELERATION},
    expression=acceleration,
    quantities=(
        Quantity(name="acceleration", output="acceleration", column="{body}.acceleration[{component}]", size=3, unit="m/s^2",
                 text="acceleration of the mass centre of {body}", direct=True),
    ),
)  # fmt: skip
