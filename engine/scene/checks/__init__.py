"""Mistakes that show only when several fields of a scene are compared. Each module finds those of one topic; a new topic is a new
module and one name in TOPICS."""

from __future__ import annotations

from trunnion.basics.problems import Problem
from trunnion.scene.checks import (
    bodies,
    bodiless_joints,
    body_placement,
    cam_profiles,
    input_and_speed_curves,
    joint_devices,
    joint_frames,
    joint_friction,
    joint_mimics,
    loads,
    names,
    number_bounds,
    output_patterns,
    point_curves,
    start_values,
    topology,
    wheel_teeth,
)
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Finding, error_of

TOPICS = (
    names, bodies, topology, joint_frames, body_placement, wheel_teeth, cam_profiles, point_curves, joint_mimics, bodiless_joints,
    joint_friction, start_values, joint_devices, input_and_speed_curves, loads, number_bounds, output_patterns,
)  # fmt: skip
"""Modules in the order of their findings."""


def findings(scene: Scene) -> list[Finding]:
    """All mistakes of meaning, topic by topic, each once."""
    return list(dict.fromkeys(f for topic in TOPICS for f in topic.check(scene)))


def problems(scene: Scene) -> list[Problem]:
    """All mistakes of meaning as an error lists them: the first ones, and how many more there are. A scene made in Python has
    no lines."""
    return list(error_of(findings(scene), {}).problems)


def checked(scene: Scene) -> Scene:
    """The scene itself; SceneError when it has problems."""
    found = findings(scene)
    if found:
        raise error_of(found, {})
    return scene
