"""Start values given at cut joints, and start positions of points. A second mechanism has other cuts, and joints that hold the
points at their positions. The start of this mechanism gives the start values of the tree joints."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.elements.joints.point_on_line_or_plane import POINT_ON_PLANE
from trunnion.kernel.interface.output_columns import Column, columns, select
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.scene.data_classes.scene import Joint, Scene, Side
from trunnion.scene.findings.findings_and_paths import Path, dotted
from trunnion.scene.queries.body_poses_and_joint_sides import UPRIGHT
from trunnion.scene.queries.cuttable_joints import may_be_cut, with_cuts
from trunnion.scene.queries.mechanism_without_forces import without_forces
from trunnion.simulation.execution.assembly_notes import assembly_notes
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.system.construction.spanning_tree import light_bodies, span, span_without_masses
from trunnion.system.construction.system_builder import Built, build
from trunnion.system.structure.bodies_and_joints import state_coordinates

TURN = 2.0 * math.pi


def build_with_starts(scene: Scene) -> Built:
    """The result of ``build``, with the start values of cut joints and the start positions of points converted to start values of
    the tree joints.

    The start values of the cut joints are dropped in two cases: other cuts would drop as many given values, or no position
    satisfies all given values. A note of the run then names the joints. Raises SceneError if exact values would be dropped, or if a
    point cannot be brought to its position.
    """
    built = build(scene)
    unused = [j.name for j in built.system.joints if j.cut and _given(scene, j.name)]
    points, usual = _points(scene), span_without_masses(scene).cut if light_bodies(scene) else ()
    light = bool(usual) and usual != span(scene).cut
    if not unused and not points and not light:
        return built
    elsewhere = without_forces(scene)
    if light or unused:
        as_usual = light and not any(_given(scene, n) for n in usual)
        elsewhere = with_cuts(elsewhere, {n: n in usual for n in scene.joints}) if as_usual else _cut_elsewhere(scene)
    n, found = built.numbers, _tree_starts(built, elsewhere, points, light)
    if found is None:
        if exact := [name for name in unused if _is_exact(scene, name)]:
            raise SceneError([_exact_problem(name) for name in exact])
        notes = [f"start of {name}: not used (cut joint of a loop whose other joints have start values)" for name in unused]
        notes += [f"{dotted(path)}: not used, because the mechanism without forces cannot start" for path, _ in points.values()]
        return replace(built, numbers=replace(n, ignored=(*notes, *n.ignored)))
    q, v, notes = found
    given = {a: np.maximum(1.0, getattr(n, a)) for a in ("q_given", "v_given", "q_given_by_rate")}
    return replace(built, numbers=replace(n, q=q, v=v, ignored=(*notes, *n.ignored), **given))


def _points(scene: Scene) -> dict[str, tuple[Path, Joint]]:
    """{name of an added joint: (path of a start component of a point, the joint)}. The joint holds the point in the plane of this
    component."""
    found: dict[str, tuple[Path, Joint]] = {}
    for body, point, at in ((n, point, at) for n, b in scene.bodies.items() for point, at in b.start.items()):
        for i, (x, e) in enumerate(zip(at, UPRIGHT, strict=True)):
            if x is not None:
                plane = Side("ground", (x * e[0], x * e[1], x * e[2]))
                holder = Joint(POINT_ON_PLANE.name, plane, f"{body}.{point}", axis=e, cut=True)
                found[f"start {i} of {body}.{point}"] = (("bodies", body, "start", point, i), holder)
    return found


def _is_exact(scene: Scene, joint: str) -> bool:
    start = scene.joints[joint].start
    return start is not None and start.use == "exact"


def _exact_problem(joint: str) -> Problem:
    what = "the exact start of this joint cannot be kept: the loop is cut here, and start values of its other joints contradict it"
    return Problem(dotted(("joints", joint, "start")), what, "give fewer start values in this loop, or correct them")


def _given(scene: Scene, joint: str) -> set[str]:
    """The start values that the scene gives for a joint: a subset of {"q", "qd"}."""
    start = scene.joints[joint].start
    return {k for k in ("q", "qd") if start is not None and getattr(start, k) is not None}


def _given_at_cuts(scene: Scene, built: Built) -> set[str]:
    return {k for j in built.system.joints if j.cut and j.name in scene.joints for k in _given(scene, j.name)}


def _cut_elsewhere(scene: Scene) -> Scene:
    """The scene without forces. Its loops are cut at the joints with the fewest given start values, among those joints that may be
    cut."""
    bare, wish = without_forces(scene), {0: True, 1: None, 2: False}
    return with_cuts(bare, {n: wish[len(_given(scene, n))] for n in bare.joints})


def _tree_starts(
    built: Built, elsewhere: Scene, points: dict[str, tuple[Path, Joint]], light: bool
) -> tuple[np.ndarray, np.ndarray, list[str]] | None:
    """(q, v, notes): start values of the tree joints, from the start of the scene that is cut elsewhere and whose points are held.
    None if that scene uses no more of the given values than ``built``, or if that scene cannot start. light: whether the cuts of
    ``built`` depend on masses; the start is then computed with cuts that do not depend on masses. Raises SceneError if the points
    cannot be held."""
    holders = {name: joint for name, (_, joint) in points.items()}
    there = build(replace(elsewhere, joints=elsewhere.joints | holders))
    if not all(may_be_cut(elsewhere.joints[j.name]) for j in there.system.joints if j.cut and j.name not in holders):
        return None
    if not points and not light and not _given_at_cuts(elsewhere, there) < _given_at_cuts(elsewhere, built):
        return None
    chosen = select(columns(there.system), ("*.q[*]", "*.qd[*]"))
    block = _block(there, chosen)
    if block.assemble() != 1:
        if points and _block(build(elsewhere), []).assemble() == 1:
            raise SceneError(_unreached(there, block, points))
        return None
    notes = [note for note in assembly_notes(there, block) if note not in there.numbers.ignored]
    row = np.zeros(block.width)
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


def _block(built: Built, chosen: list[Column]) -> bl.Block:
    parameters = np.array(built.parameters.values)
    block = bl.Block(parts_kernel(built.system, len(parameters), chosen, False, False), built.numbers, parameters)
    block.configure(bl.Settings())
    return block


def _unreached(there: Built, block: bl.Block, points: dict[str, tuple[Path, Joint]]) -> list[Problem]:
    """A problem for every point that is not at its start position in the nearest pose found."""
    residuals, _ = block.gap()
    far = {c.name: abs(float(residuals[c.rows])) for c in there.system.cuts}
    most = max(far[name] for name in points)
    hint = "correct the position, or the start values of joints with which it disagrees"
    return [
        Problem(dotted(path), f"no pose with closed loops brings the point here: it stays {far[name]:.3g} m away", hint)
        for name, (path, _) in points.items()
        if far[name] >= 0.5 * most
    ]
