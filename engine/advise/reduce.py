"""Lesser models of a scene: joints without friction, simpler laws, planar joints where the motion is planar."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from engine.chart.runs import exact_law
from engine.friction import twin_of
from engine.joints import REVOLUTE, SPHERICAL
from engine.scene.model import Scene
from engine.scene.overrides import apply
from engine.scene.values import AxisName
from engine.simulation.block import Settings
from engine.simulation.run import Model, run

PLANAR = 1e-9
"""Motion out of a plane, relative to the motion in it, below which a mechanism is planar."""


@dataclass(frozen=True)
class Form:
    """How friction is modelled: law, and normal force exact (the paper) or as Adams computes it."""

    law: str
    adams: bool

    def __str__(self) -> str:
        return f"{self.law}, {'Adams’ normal force' if self.adams else 'exact contacts'}"


def forms(scene: Scene) -> list[Form]:
    """Forms of friction to try, from the coarsest to the one the scene itself asks for."""
    exact = exact_law(scene)
    order = [law for law in (twin_of(exact), exact) if law]
    own = {law for j in scene.joints.values() if j.friction and (law := scene.law_of(j.friction))}
    if not own <= set(order):
        order = sorted(own)
    return [Form(law, adams) for law in dict.fromkeys(order) for adams in (True, False)]


def rubbing(scene: Scene) -> list[str]:
    """Names of the joints with friction."""
    return [n for n, j in scene.joints.items() if j.friction is not None]


def with_friction_in(scene: Scene, keep: Iterable[str]) -> Scene:
    """The scene with friction in these joints only."""
    kept = set(keep)
    return replace(scene, joints={n: j if n in kept else replace(j, friction=None) for n, j in scene.joints.items()})


def in_form(scene: Scene, form: Form) -> Scene:
    """The scene with all its friction in this form."""
    normal = "adams" if form.adams else "exact"
    changes: dict[str, object] = {"friction.law": form.law, "friction.normal_force": normal}
    for name, j in scene.joints.items():
        if j.friction is not None:
            changes |= {f"joints.{name}.friction.law": form.law} if j.friction.law is not None else {}
            changes |= {f"joints.{name}.friction.normal_force": normal} if j.friction.normal_force is not None else {}
    return apply(scene, changes)


def planar(scene: Scene, until: float) -> tuple[Scene, list[str]]:
    """(scene with every ideal spherical joint a revolute about the normal of the plane all bodies move in, those joints); the scene
    itself and nothing when the motion is not planar."""
    able = [n for n, j in scene.joints.items() if j.type == SPHERICAL.name and j.friction is None and j.drive is None]
    axis = _normal(scene, until) if able else None
    if axis is None:
        return scene, []
    chosen = [n for n in able if not _turned(scene, n)]
    joints = {n: replace(j, type=REVOLUTE.name, axis=axis, start=None) if n in chosen else j for n, j in scene.joints.items()}
    return (replace(scene, joints=joints), chosen) if chosen else (scene, [])


def _turned(scene: Scene, name: str) -> bool:
    """Whether the joint is given a start of its own (then its parts' frames need not agree)."""
    return scene.joints[name].start is not None


def _normal(scene: Scene, until: float) -> AxisName | None:
    """The world axis along which nothing moves and about which everything turns; None when there is none, or when the frame of
    some body is not aligned with it."""
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
