"""Reduced models of a scene: joints without friction, simpler friction laws, and planar joints where the motion is planar."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from trunnion.analysis.work_precision.benchmark_model import exact_law
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import twin_of
from trunnion.elements.joints import REVOLUTE, SPHERICAL
from trunnion.scene.data_classes.field_types import AxisName
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply, law_changes
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

PLANAR = 1e-9
"""A motion counts as planar if its part out of the plane is below this multiple of its part in the plane."""


@dataclass(frozen=True)
class FrictionForm:
    """A form of friction. law: name of the friction law; adams: whether the normal force is Adams' approximation instead of the
    exact value."""

    law: str
    adams: bool

    def __str__(self) -> str:
        return f"{self.law}, {'Adams’ normal force' if self.adams else 'exact contacts'}"


def friction_forms(scene: Scene) -> list[FrictionForm]:
    """The forms of friction that ``advise`` tries, from the coarsest form to the form of the scene."""
    exact = exact_law(scene)
    order = [law for law in (twin_of(exact), exact) if law]
    own = {law for j in scene.joints.values() if j.friction and (law := scene.law_of(j.friction))}
    if not own <= set(order):
        order = sorted(own)
    return [FrictionForm(law, adams) for law in dict.fromkeys(order) for adams in (True, False)]


def frictional_joints(scene: Scene) -> list[str]:
    """Names of the joints with friction."""
    return [n for n, j in scene.joints.items() if j.friction is not None]


def keep_friction(scene: Scene, keep: Iterable[str]) -> Scene:
    """The scene with friction only in the joints ``keep``."""
    kept = set(keep)
    return replace(scene, joints={n: j if n in kept else replace(j, friction=None) for n, j in scene.joints.items()})


def apply_form(scene: Scene, form: FrictionForm) -> Scene:
    """The scene with this form of friction in all its frictional joints."""
    normal = "adams" if form.adams else "exact"
    own = [n for n, j in scene.joints.items() if j.friction is not None and j.friction.normal_force is not None]
    forces = {"friction.normal_force": normal, **{f"joints.{n}.friction.normal_force": normal for n in own}}
    return apply(scene, law_changes(scene, form.law) | forces)


def make_planar(scene: Scene, until: float) -> tuple[Scene, list[str]]:
    """The scene with ideal ball joints replaced by revolutes about the normal of the plane of motion, and the names of these
    joints.

    until: end of the run that tests the motion, s. If the motion is not planar, returns the scene itself and [].
    """
    ideal = [n for n, j in scene.joints.items() if j.type == SPHERICAL.name and j.friction is None and j.drive is None]
    able = [n for n in ideal if scene.joints[n].start is None]  # with start values, a joint's two frames may differ
    axis = _plane_normal(scene, until) if able else None
    if axis is None:
        return scene, []
    return replace(scene, joints=scene.joints | {n: replace(scene.joints[n], type=REVOLUTE.name, axis=axis) for n in able}), able


def _plane_normal(scene: Scene, until: float) -> AxisName | None:
    """The normal of the plane of motion. All rotations turn about this world axis, and no velocity has a component along it. None
    if there is no such axis, or if some body's frame has no axis along the normal.
    """
    model = Model(scene, ["*.velocity[*", "*.angular_velocity[*", "*.orientation[*"])
    result = run(model, until, until / 50, Settings(rtol=1e-8))
    if not result.outcome.ok:
        return None
    v = np.array([[result[f"{b}.velocity[{k}]"] for k in (1, 2, 3)] for b in scene.bodies])
    w = np.array([[result[f"{b}.angular_velocity[{k}]"] for k in (1, 2, 3)] for b in scene.bodies])
    names: tuple[AxisName, ...] = ("x", "y", "z")
    for k, name in enumerate(names):
        others = [i for i in range(3) if i != k]
        turned = max(np.abs(result[f"{b}.orientation[{i + 2}]"]).max() for b in scene.bodies for i in others)
        out, across = np.abs(v[:, k]).max(), np.abs(w[:, others]).max()
        if out <= PLANAR * np.abs(v).max() and across <= PLANAR * max(np.abs(w).max(), 1e-30) and turned <= PLANAR:
            return name
    return None
