"""Multiplications of an evaluation with friction in a mechanism with loops, in two forms: dense maps, or passes along the recursion
(theory, "Friction along the recursion"). The kernel uses the form with fewer."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.friction_joint_indices import elements
from trunnion.system.structure.loop_matrix_fill import coupled, path, pattern, rows_by_loop

BODY = 1200
"""Of the passes over a body: inertias with the laws' derivative, forces, accelerations; two Newton steps."""
COLUMN = 150
"""Of a force column of the maps on a body, inward and outward, with what the bytecode adds."""
ROW = 120
"""Of a force column and of a constraint row along the recursion, on a body of their path."""
MEETING = 24
"""Of an entry of the unsymmetric S."""
MAPS_SERVE_MORE = 1.2
"""Ratio of multiplications from which the recursion is used. Decisions about pairs at rest need maps in both forms."""


def maps_work(system: System, active: Sequence[int]) -> float:
    """Multiplications of maps: columns, elimination of λ from reactions and accelerations, a Newton step."""
    a, e, n = len(active), system.neta, sum(len(x.needs) for x in elements(system))
    return COLUMN * len(system.bodies) * (a + e) + n * a * e + a * a * (a / 3 + e) + 2 * a * e * e + e**3 / 3


def recursion_work(system: System, active: Sequence[int]) -> float:
    """Multiplications of the recursion: passes over the bodies, columns and rows of loops along their paths, S and its factor."""
    loops = rows_by_loop(system, active)
    near, count = coupled(system, [c for c, _ in loops]), [len(rows) for _, rows in loops]
    along = sum(len(rows) * len(path(system, c)) for c, rows in loops)
    entries = sum(n * (n + sum(count[k] for k in others)) for n, others in zip(count, near, strict=True))
    start = pattern(system, active).start
    factor = sum((end - begin) ** 2 for begin, end in pairwise(start))
    return BODY * len(system.bodies) + ROW * along + MEETING * entries + 2 * factor


def is_recursion_shorter(system: System, active: Sequence[int]) -> bool:
    """Whether the recursion needs fewer multiplications than maps."""
    return maps_work(system, active) > MAPS_SERVE_MORE * recursion_work(system, active)
