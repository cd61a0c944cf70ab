"""Joints that only push: analyses and methods that do not support such joints refuse the scene."""

from __future__ import annotations

from trunnion.basics.errors import Problem, raise_problems
from trunnion.scene.data_classes.scene import Scene

NOT_LOCATED = "time stepping does not locate the beginning and end of a contact, so parts would enter each other by speed × step"
LOCATED = "choose auto, or leave out the key unilateral"
"""Reason and remedy where time stepping is refused."""


def has_unilateral(scene: Scene) -> bool:
    """Whether the scene has joints that only push."""
    return any(j.unilateral is not None for j in scene.joints.values())


def unilateral_problems(scene: Scene, what: str) -> list[Problem]:
    """A problem for each joint that only pushes. what: the analysis that does not support such joints."""
    hint = "leave out the key unilateral where the contact stays closed"
    names = [name for name, j in scene.joints.items() if j.unilateral is not None]
    return [Problem(f"joints.{n}.unilateral", f"contacts that begin and end are not supported in {what}", hint) for n in names]


def refuse_unilateral(scene: Scene, what: str) -> None:
    """Raise SceneError if the scene has joints that only push."""
    raise_problems(unilateral_problems(scene, what))
