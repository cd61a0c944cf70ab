"""Loops that assembly cannot close: their gaps and joints."""

from __future__ import annotations

import math

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes.scene import Side
from trunnion.scene.queries.body_poses_and_joint_sides import vector
from trunnion.simulation.execution.failure_diagnosis import loop_joints
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.results.outcome import Outcome
from trunnion.system.structure.bodies_and_joints import Joint

DESCRIBED = 3
"""Largest number of open loops that a message describes. A single cause usually opens several loops."""
OPEN = 1e-6
"""A loop counts as open if its gap is at least this fraction of the largest gap (in length scales or rad)."""


@dataclass(frozen=True)
class Gap:
    """An open loop: distance, m or m/s, and angle, rad or rad/s, between the two sides of its cut joint."""

    cut: Joint
    distance: float
    angle: float


def open_loop(model: Model, code: int) -> Outcome:
    """The outcome if the loops cannot be closed from the start values. code: result of ``Block.assemble``: 0 if positions stay
    open, −1 if velocities stay open."""
    gaps = _gaps(model, positions=code == 0)
    what, check = ("positions", "lengths, axes and start values") if code == 0 else ("velocities", "the drives and start rates")
    if code != 0 and gaps and not any(j.driven for j in model.system.joints):
        part = max(gaps[0].distance / model.built.numbers.length, gaps[0].angle) / model.built.numbers.rate
        check = (
            f"the dimensions of the loop: the loop can move only if they agree exactly, but they agree only to {part:.0e} of its "
            "size. Give lengths and axes with more digits, or give a joint of the loop another freedom"
        )
    described = "; ".join(_describe(model, g, code == 0) for g in gaps[:DESCRIBED])
    more = f"; and {len(gaps) - DESCRIBED} more loops" if len(gaps) > DESCRIBED else ""
    starts = {n: j.start for n, j in model.built.scene.joints.items() if j.start is not None}
    exact = [n for n, start in starts.items() if start.use == "exact"]
    check += f" (exact: {', '.join(exact)})" if exact else ""
    advice = f"no start {what} close all loops: {described}{more}; check {check}"
    numbers = {"distance": gaps[0].distance, "angle": gaps[0].angle} if gaps else {}
    return Outcome("open_loop", 0.0, gaps[0].cut.name if gaps else "", advice, numbers)


def _gaps(model: Model, positions: bool) -> list[Gap]:
    """The open loops, in the order of decreasing gaps."""
    residuals, rates = model.block.gap()
    h = np.nan_to_num(residuals if positions else rates)
    found = []
    for j in model.system.cuts:
        travel, turn = np.split(h[j.rows : j.rows + j.kind.rows], [j.travels])
        angle = float(np.linalg.norm(turn))
        found.append(Gap(j, float(np.linalg.norm(travel)), math.asin(min(1.0, angle)) if positions else angle))
    length = model.built.numbers.length
    size = {g.cut.name: max(g.distance / length, g.angle) for g in found}
    widest = max(size.values(), default=0.0)
    return sorted((g for g in found if size[g.cut.name] >= OPEN * widest), key=lambda g: -size[g.cut.name])


def _describe(model: Model, gap: Gap, positions: bool) -> str:
    """Text about a gap, such as "a gap of 0.2 m and 3 deg remains at rod_pin, in the loop crank (revolute, axis z), …, driven:
    crank"."""
    per = "" if positions else "/s"
    parts = [f"{gap.distance:.3g} m{per}"] if gap.distance > 0.0 else []
    if gap.angle > 1e-9 or not parts:
        parts.append(f"{math.degrees(gap.angle):.3g} deg{per}")
    loop = loop_joints(model.system, gap.cut)
    driven = [j.name for j in loop if j.driven]
    text = f"a gap of {' and '.join(parts)} remains at {gap.cut.name}, in the loop {', '.join(_joint_text(model, j) for j in loop)}"
    return text + (f", driven: {', '.join(driven)}" if driven else "")


def _joint_text(model: Model, j: Joint) -> str:
    """A joint's name, type and, if the scene gives it, axis."""
    scene = model.built.scene.joints[j.name]
    own = scene.inboard.axis if isinstance(scene.inboard, Side) else None
    axis = own if own is not None else scene.axis
    if axis is None:
        return f"{j.name} ({j.kind_name})"
    text = axis if isinstance(axis, str) else "[" + ", ".join(f"{x:g}" for x in vector(axis)) + "]"
    return f"{j.name} ({j.kind_name}, axis {text})"
