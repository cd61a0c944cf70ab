"""Loops whose start values cannot be made to agree: by how much they stay open, and what is involved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from engine.scene.model import Side
from engine.scene.poses import vector
from engine.simulation.diagnosis import around
from engine.simulation.outcome import Outcome
from engine.system.structure import Joint

if TYPE_CHECKING:
    from engine.simulation.run import Model

TOLD = 3
"""Open loops that are described; one cause mostly opens several."""
OPEN = 1e-6
"""A loop counts as open when its gap, in length scales or radians, is at least this part of the largest gap."""


@dataclass(frozen=True)
class Gap:
    """A loop that stays open at its cut joint: distance m (or m/s) and angle rad (or rad/s) between the two sides."""

    cut: Joint
    distance: float
    angle: float


def open_loop(model: Model, code: int) -> Outcome:
    """The outcome of start values that cannot close the loops. code: what ``Block.assemble`` gave, 0 for positions, −1 for
    velocities."""
    gaps = _gaps(model, positions=code == 0)
    what, check = ("positions", "lengths, axes and start values") if code == 0 else ("velocities", "the drives and start rates")
    told = "; ".join(_told(model, g, code == 0) for g in gaps[:TOLD])
    more = f"; and {len(gaps) - TOLD} loops more" if len(gaps) > TOLD else ""
    advice = f"the start {what} cannot be made to agree: {told}{more}; check {check}"
    numbers = {"distance": gaps[0].distance, "angle": gaps[0].angle} if gaps else {}
    return Outcome("open_loop", 0.0, gaps[0].cut.name if gaps else "", advice, numbers)


def _gaps(model: Model, positions: bool) -> list[Gap]:
    """The loops that stay open, the widest first."""
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


def _told(model: Model, gap: Gap, positions: bool) -> str:
    """One open loop in words: "0.2 m and 3 deg stay open at rod_pin, in the loop crank (revolute, axis z), …; driven: crank"."""
    per = "" if positions else "/s"
    parts = [f"{gap.distance:.3g} m{per}"] if gap.distance > 0.0 else []
    if gap.angle > 1e-9 or not parts:
        parts.append(f"{math.degrees(gap.angle):.3g} deg{per}")
    loop = around(model.system, gap.cut)
    driven = [j.name for j in loop if j.driven]
    text = f"{' and '.join(parts)} stay open at {gap.cut.name}, in the loop {', '.join(_named(model, j) for j in loop)}"
    return text + (f", driven: {', '.join(driven)}" if driven else "")


def _named(model: Model, j: Joint) -> str:
    """A joint with its type and, where it has one, its axis as written."""
    scene = model.built.scene.joints[j.name]
    own = scene.inboard.axis if isinstance(scene.inboard, Side) else None
    axis = own if own is not None else scene.axis
    if axis is None:
        return f"{j.name} ({j.kind_name})"
    text = axis if isinstance(axis, str) else "[" + ", ".join(f"{x:g}" for x in vector(axis)) + "]"
    return f"{j.name} ({j.kind_name}, axis {text})"
