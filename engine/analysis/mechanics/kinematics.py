"""``kinematics``: positions, velocities and accelerations that driven joints prescribe, without masses, loads or friction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from trunnion.analysis.mechanics.mechanism_at_rest import MechanismAtRest
from trunnion.basics.errors import Problem, SceneError
from trunnion.kernel.interface.output_columns import columns, select
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.queries.mechanism_without_forces import without_forces
from trunnion.scene.queries.unilateral_joints import refuse_unilateral
from trunnion.scene.units.python_arguments import Amount, Names, names_given
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import build

MOTION = (
    "*.q[*]", "*.qd[*]", "*.qdd[*]", "*.position[*]", "*.velocity[*]", "*.acceleration[*]", "*.orientation[*]",
    "*.angular_velocity[*]", "*.length", "*.offset[*]", "*.turn[*]",
)  # fmt: skip
"""Patterns of the columns that do not depend on masses."""


def kinematics(
    scene: Given, until: Amount | None = None, every: Amount | None = None, rtol: Amount | None = None,
    outputs: Names | None = None, overrides: Mapping[str, Any] | None = None,
) -> Result:  # fmt: skip
    """The motion that a scene's drives prescribe: positions, velocities and accelerations of joints, bodies and points.

    Loops are closed. Bodies need no mass; friction, springs, loads and gravity are ignored.

    Args:
        scene: as for ``simulate``.
        until: end time, s.
        every: spacing of the rows, s.
        rtol: relative tolerance.
        outputs: patterns of columns of motion; default: all columns of motion.
        overrides: changes of the scene, {path: value}.

    Returns:
        The motion.

    Raises:
        SceneError: for wrong input, and if a freedom is not determined by the drives.
    """
    loaded = scene_given(scene, overrides, massless=True)
    refuse_unilateral(loaded, "prescribed motion: it may close a contact, but no impact is computed")
    bare = prescribed(loaded)
    wanted = moving_columns(bare) if outputs is None else names_given(outputs)
    return simulate(bare, until, every, rtol, outputs=wanted)


def prescribed(scene: sm.Scene) -> sm.Scene:
    """The scene without loads, friction and stiffnesses. Raises SceneError if a freedom is not determined by the drives."""
    bare = without_forces(scene)
    still = MechanismAtRest(bare)
    left = still.allowed()
    if left.size:
        free = [n for n, moves in zip(still.freedoms, np.abs(left).max(axis=1) > 1e-9, strict=True) if moves]
        names = ", ".join(n.replace(".qd", ".q") for n in free)
        what = f"{left.shape[1]} freedom{'s are' if left.shape[1] > 1 else ' is'} not driven, among {names}"
        raise SceneError([Problem("joints", what, "add that many drives to these joints (constant, ramp, move, harmonic, table)")])
    return bare


def moving_columns(scene: sm.Scene) -> tuple[str, ...]:
    """The columns of motion of the scene."""
    return tuple(c.name for c in select(columns(build(scene).system), MOTION))
