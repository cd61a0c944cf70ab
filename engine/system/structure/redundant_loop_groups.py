"""Groups of redundant loops. The undetermined reactions of a group are computed together, because no joint transmits the
multipliers of two loops of the group (theory, "Redundant loops")."""

from __future__ import annotations

from collections.abc import Collection

from trunnion.system.structure.bodies_and_joints import Joint, System
from trunnion.system.structure.loop_joints import bodies_of_loop, rows_of


def joints_of_loop(system: System, c: Joint, names: Collection[str]) -> list[str]:
    """The joints that transmit the multipliers of a cut joint or coupling. The multipliers of a coupling are transmitted by all
    joints on loops (``names``)."""
    return [*(system.tree[b].name for b in bodies_of_loop(system, c)), c.name] if c.name in names else list(names)


def reaction_groups(system: System) -> dict[str, list[int]]:
    """The kernel's tables of cut joints and couplings (loops):

    loop_rows   first constraint row of each loop, then the number of all rows.
    loop_group  group of each loop. The loops of a group share no joint.
    share_start for each loop, index of its first entry in ``share_at``.
    share_at    the scaled reactions that a loop's multipliers change, ascending."""
    rows: dict[str, range] = {}
    at = 0
    for name, n in rows_of(system):
        rows[name] = range(at, at + n)
        at += n
    used: dict[str, set[int]] = {name: set() for name in rows}
    tables: dict[str, list[int]] = {"loop_rows": [], "loop_group": [], "share_start": [0], "share_at": []}
    for c in system.cuts:
        on_loop = joints_of_loop(system, c, rows)
        taken = set().union(*(used[name] for name in on_loop))
        group = next(g for g in range(len(taken) + 1) if g not in taken)
        for name in on_loop:
            used[name].add(group)
        tables["loop_rows"].append(c.rows)
        tables["loop_group"].append(group)
        tables["share_at"] += sorted(i for name in on_loop for i in rows[name])
        tables["share_start"].append(len(tables["share_at"]))
    tables["loop_rows"].append(system.rows)
    return tables
