"""Rows about sleeves on guides."""

from __future__ import annotations

from engine.scene import model as sm
from tests.stability.row import Row
from tests.stability.verdicts import holding


def carriage(offset: float) -> sm.Scene:
    """A sleeve pushed along its guide beside its axis."""
    body = sm.Body(box=(0.1, 0.1, 0.1), mass=2.0, points={"push": (0.0, offset, 0.0)})
    rub = sm.Friction(mu=0.4, half_length=0.08, half_width=0.03, half_height=0.02)
    joint = sm.Joint("prismatic", "ground", "carriage", axis="x", friction=rub, start=sm.Start(0.0, 0.0))
    push = sm.Force("force", "carriage.push", (50.0, 0.0, 0.0))
    return sm.Scene({"carriage": body}, {"guide": joint}, "wedge", gravity=(0.0, 0.0, 0.0), forces={"push": push},
                    simulation=sm.Simulation(until=0.01))  # fmt: skip


ROWS = (
    Row(8, "wedge", "wedging of a guide", lambda b: carriage(0.2 * (1 + b)), holding, "slips", "holds",
        "depends on the size of the force"),
)  # fmt: skip
