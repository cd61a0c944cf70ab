"""Further poses of rest of a mechanism without friction, most of them unstable (theory, "Rest, swings and efforts")."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from trunnion.analysis.mechanics.mechanism_at_rest import MechanismAtRest
from trunnion.basics.errors import SimulationError
from trunnion.system.structure.bodies_and_joints import state_coordinates

ONE_FREEDOM, SEVERAL = tuple(np.linspace(-1.0, 1.0, 17)), (-0.5, 0.5, 1.0)
"""Starts of Newton's method: changes of one coordinate, in half turns or lengths of the scene. ONE_FREEDOM is for mechanisms with
one coordinate, SEVERAL for all others."""
MOST = 8
"""Largest number of further poses of rest; a chain of n pendulums has 2ⁿ."""
SAME = 1e-7
"""Two poses count as the same if their coordinates differ by less than this value, in rad or relative to the scene's length.
Newton's method is accurate to 1e-13."""
NEUTRAL = 1e-9
"""A direction counts as without stiffness if its stiffness, relative to the largest stiffness, is below this value (round-off is
1e-13)."""


def kind_of(still: MechanismAtRest) -> tuple[str, bool]:
    """(kind, isolated). kind: "stable", "neutral" or "unstable". isolated: whether no neighbouring pose is a pose of rest."""
    stiffness, _, _ = still.reduced()
    if not stiffness.size:
        return "stable", True
    sizes = np.linalg.eigvals(stiffness).real
    most, scale = float(sizes.max()), max(still.model.built.numbers.rate**2, float(np.abs(stiffness).max()))
    kind = "unstable" if most > NEUTRAL * scale else "neutral" if most > -NEUTRAL * scale else "stable"
    return kind, bool(np.abs(sizes).min() > NEUTRAL * scale)


def other_rests(still: MechanismAtRest) -> Iterator[tuple[np.ndarray, str]]:
    """(coordinates (nq), kind) of further isolated poses of rest, at most MOST. Newton's method starts from the pose of ``still``,
    and from each pose found, with one coordinate moved. The function finds no poses for mechanisms with contacts that begin and
    end, or with ball joints. (With ball joints, poses of rest are rarely isolated.) ``still`` keeps its pose."""
    system = still.system
    if system.unilateral or any(j.kind.quaternion >= 0 for j in system.tree) or not kind_of(still)[1]:
        return
    kinds = [j.kind.coordinates[c] for j in system.tree for c in state_coordinates(j)]
    turns, length, found = np.array(kinds) == "angle", still.model.built.numbers.length, [still.pose()]
    for base in found:  # ``found`` grows: the loop also visits the poses appended below
        for i, way in product(range(len(kinds)), ONE_FREEDOM if len(kinds) == 1 else SEVERAL):
            still.block.y[: system.nq] = base
            still.block.y[i] += way * (math.pi if turns[i] else length)
            if len(found) > MOST or not _settles(still) or any(_is_same(still.pose(), x, turns, length) for x in found):
                continue
            kind, alone = kind_of(still)
            if alone:
                found.append(still.pose())
                yield found[-1], kind
    still.place(found[0])


def _settles(still: MechanismAtRest) -> bool:
    try:
        return still.settle()
    except (SimulationError, RuntimeError, np.linalg.LinAlgError):
        return False


def _is_same(a: np.ndarray, b: np.ndarray, turns: np.ndarray, length: float) -> bool:
    """Whether two poses are equal. Angles are compared within a turn."""
    off = a - b
    off = np.where(turns, off - 2 * math.pi * np.round(off / (2 * math.pi)), off / length)
    return bool(np.abs(off).max(initial=0.0) < SAME)
