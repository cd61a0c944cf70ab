"""Start values given at cut joints. The same mechanism, cut at other joints, converts them to start values of the tree joints."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from trunnion.kernel.interface.output_columns import columns, select
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.queries.bare_mechanism import without_forces
from trunnion.scene.queries.cuttable_joints import may_be_cut, tied
from trunnion.simulation.execution.assembly_notes import assembly_notes
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.system.construction.system_builder import Built, build
from trunnion.system.structure.bodies_and_joints import state_coordinates

TURN = 2.0 * math.pi


def build_with_cut_starts(scene: Scene) -> Built:
    """The result of ``build``, with the start values of the cut joints converted to start values of the tree joints.

    The start values of the cut joints are dropped if cutting the loops elsewhere would drop as many given values, or if no position
    satisfies all given values. A note of the run then names the joints.
    """
    built = build(scene)
    unused = [j.name for j in built.system.joints if j.cut and _given(scene, j.name)]
    if not unused:
        return built
    n, found = built.numbers, _tree_starts(built, _cut_elsewhere(scene))
    if found is None:
        notes = [f"start of {name}: not used, the loop is cut there and its other joints have start values" for name in unused]
        return replace(built, numbers=replace(n, ignored=(*notes, *n.ignored)))
    q, v, notes = found
    given = {a: np.ones_like(getattr(n, a)) for a in ("q_given", "v_given", "q_given_by_rate")}
    return replace(built, numbers=replace(n, q=q, v=v, ignored=(*notes, *n.ignored), **given))


def _given(scene: Scene, joint: str) -> set[str]:
    """The start values that the scene gives for a joint: a subset of {"q", "qd"}."""
    start = scene.joints[joint].start
    return {k for k in ("q", "qd") if start is not None and getattr(start, k) is not None}


def _given_at_cuts(scene: Scene, built: Built) -> set[str]:
    return {k for j in built.system.joints if j.cut for k in _given(scene, j.name)}


def _cut_elsewhere(scene: Scene) -> Scene:
    """The scene without forces, its loops cut at the joints with the fewest given start values where the joints may be cut."""
    bare, wish, never = without_forces(scene), {0: True, 1: None, 2: False}, tied(scene)
    cuts = {n: wish[len(_given(scene, n))] if may_be_cut(j) and n not in never else None for n, j in bare.joints.items()}
    return replace(bare, joints={n: replace(j, cut=cuts[n]) for n, j in bare.joints.items()})


def _tree_starts(built: Built, elsewhere: Scene) -> tuple[np.ndarray, np.ndarray, list[str]] | None:
    """(q, v, notes): start values of the tree joints, from the start of the scene that is cut elsewhere. None if that scene uses no
    more of the given values than ``built``, or cannot start."""
    there = build(elsewhere)
    if not all(may_be_cut(elsewhere.joints[j.name]) for j in there.system.joints if j.cut):
        return None
    if not _given_at_cuts(elsewhere, there) < _given_at_cuts(elsewhere, built):
        return None
    chosen, parameters = select(columns(there.system), ("*.q[*]", "*.qd[*]")), np.array(there.parameters.values)
    block = bl.Block(parts_kernel(there.system, len(parameters), chosen, False, False), there.numbers, parameters)
    block.configure(bl.Settings())
    if block.assemble() != 1:
        return None
    notes, row = assembly_notes(there, block), np.zeros(block.width)
    if block.start(0.0, 1.0, 1.0, row) != bl.OK:
        return None
    at = dict(zip((c.name for c in chosen), row[1:], strict=True))
    q, v = built.numbers.q.copy(), built.numbers.v.copy()
    for j in built.system.tree:
        for k, i in enumerate(state_coordinates(j)):
            found, asked = at[f"{j.name}.q[{i + 1}]"], q[j.q0 + k]
            turns = j.kind.quaternion < 0 and j.kind.turns(i)
            q[j.q0 + k] = found + TURN * round((asked - found) / TURN) if turns and _given(elsewhere, j.name) else found
        for k, i in enumerate(j.free):
            v[j.v0 + k] = at[f"{j.name}.qd[{i + 1}]"]
    return q, v, notes
