"""Formulas for entries of flat rows, from a body's density or mass, gravity, or the start angle of a ball.

Each formula repeats the floating-point operations by which a scene is built. The caller tests a formula on some of the values, and
uses the formula only if all bits agree with the built scenes (``parameters_without_scene_builds``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.scene.data_classes.joints import AxisAngle
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import parse_path
from trunnion.scene.queries.mass_properties import volume_and_moments
from trunnion.system.construction.start_values_and_scales import coordinates
from trunnion.system.construction.system_builder import Built
from trunnion.system.structure.bodies_and_joints import state_coordinates

GYRATION = ("xx", "yy", "zz")


@dataclass(frozen=True)
class Entries:
    """The entries that follow from a group's values.

    Attributes:
        numbers: function from values (n × paths) to entries (n × entries), in the order parameters, states, pull.
        parameters: names of the entries in the table of parameters.
        states: indices of the entries among the start coordinates.
        pull: whether the last entry is the norm of gravity.
    """

    numbers: Callable[[np.ndarray], np.ndarray]
    parameters: tuple[str, ...] = ()
    states: tuple[int, ...] = ()
    pull: bool = False


def entries_of(built: Built, paths: Sequence[str]) -> Entries | None:
    """The entries of a group of paths of one owner; None if there is no formula."""
    steps = [parse_path(p) or () for p in paths]
    if all(s[0] == "gravity" and len(s) == 2 for s in steps):
        return _gravity(built.scene, [int(s[1]) for s in steps])
    if len(steps) > 1:
        return None
    if steps[0][0] == "bodies" and steps[0][2:] in (("density",), ("mass",)):
        return _mass(built.scene, str(steps[0][1]), str(steps[0][2]))
    if steps[0][0] == "joints" and steps[0][2:] == ("start", "q", "angle"):
        return _angle(built, str(steps[0][1]))
    return None


def _gravity(scene: Scene, at: list[int]) -> Entries:
    def numbers(values: np.ndarray) -> np.ndarray:
        whole = np.repeat(np.array(scene.gravity, float)[None, :], len(values), axis=0)
        whole[:, at] = values
        return np.column_stack([values, [float(np.linalg.norm(g)) for g in whole]])

    return Entries(numbers, tuple(f"gravity[{k + 1}]" for k in at), pull=True)


def _mass(scene: Scene, name: str, what: str) -> Entries | None:
    """The mass of a body, and its inertia divided by mass if the shape determines it; None if there is no formula."""
    body = scene.bodies[name]
    if body.inertia is not None:
        return Entries(lambda values: values, (f"bodies.{name}.mass",)) if what == "mass" else None
    if (body.density if what == "mass" else body.mass) is not None:
        return None
    volume, gyration = volume_and_moments(body)

    def numbers(values: np.ndarray) -> np.ndarray:
        mass = values * volume if what == "density" else values
        return np.column_stack([mass, *(mass * k / mass for k in gyration)])

    return Entries(numbers, (f"bodies.{name}.mass", *(f"bodies.{name}.gyration.{n}" for n in GYRATION)))


def _angle(built: Built, name: str) -> Entries | None:
    """The start coordinates of a ball whose start is given by axis and angle; None for other starts."""
    start = built.scene.joints[name].start
    found = [j for j in built.system.tree if j.name == name]
    if not found or start is None or not isinstance(start.q, AxisAngle):
        return None
    joint, given = found[0], start.q
    states = list(state_coordinates(joint))

    def numbers(values: np.ndarray) -> np.ndarray:
        all_q = [coordinates(replace(given, angle=float(v)), joint.kind.nq, joint.kind.quaternion) for v in values[:, 0]]
        return np.array(all_q).reshape(len(values), -1)[:, states]

    return Entries(numbers, states=tuple(range(joint.q0, joint.q0 + len(states))))


def total_mass(built: Built, flat: np.ndarray) -> np.ndarray:
    """The total mass of all bodies (n), kg, from flat rows (n × numbers) that begin with the table of parameters."""
    index = {p: k for k, p in enumerate(built.parameters.paths)}
    masses = flat[:, [index[f"bodies.{name}.mass"] for name in built.scene.bodies]]
    return np.array([sum(row) for row in masses.tolist()], float)
