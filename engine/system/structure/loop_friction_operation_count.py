"""Number of multiplications of an evaluation with friction in a mechanism with loops. The evaluation has two forms: dense maps, or
passes along the recursion (theory, "Friction along the recursion"). The kernel uses the form with fewer multiplications."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from trunnion.system.structure.bodies_and_joints import System
from trunnion.system.structure.friction_joint_indices import elements
from trunnion.system.structure.loop_matrix_fill import coupled, path, pattern, rows_by_loop

BODY = 1200
"""Multiplications of the passes for one body: inertias with the laws' derivative, forces, accelerations; two Newton steps."""
COLUMN = 150
"""Multiplications of the maps for one force column and one body, inward and outward, with the overhead of the bytecode."""
ROW = 120
"""Multiplications of the recursion for one constraint row (with its force column) and one body on the row's path."""
MEETING = 24
"""Multiplications for one entry of the unsymmetric S."""
MAPS_SERVE_MORE = 1.2
"""The recursion is used if maps take more than this multiple of its multiplications. The factor is above 1, because decisions about
pairs at rest require maps in both forms."""


def maps_work(system: System, active: Sequence[int]) -> float:
    """Multiplications of the maps: columns, elimination of λ from reactions and accelerations, a Newton step."""
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
