"""Checks that compare several fields of a scene. Each module checks one topic; a new topic needs a new module and an entry in
TOPICS."""

from __future__ import annotations

from trunnion.basics.errors import Problem
from trunnion.scene.checks import (
    bodiless_joints,
    body_placement,
    body_shapes_and_masses,
    cam_profiles,
    force_fields,
    gearboxes,
    joint_devices,
    joint_frames,
    joint_friction,
    joint_mimics,
    load_ends,
    names,
    nonlinear_forces,
    number_bounds,
    outputs_tunables_and_date,
    point_curves,
    rods,
    start_values,
    time_formulas,
    topology,
    unilateral_contacts,
    variable_friction_and_input_curves,
    wheel_pair_sizes,
)
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import Finding, error_of

TOPICS = (
    names, body_shapes_and_masses, topology, joint_frames, body_placement, wheel_pair_sizes, cam_profiles, point_curves, rods,
    joint_mimics, gearboxes, bodiless_joints, joint_friction, start_values, joint_devices, variable_friction_and_input_curves,
    time_formulas, load_ends, nonlinear_forces, unilateral_contacts, force_fields, number_bounds, outputs_tunables_and_date,
)  # fmt: skip
"""The modules in the order in which their findings are listed."""


def findings(scene: Scene) -> list[Finding]:
    """All findings of the checks, topic by topic, without repetition."""
    return list(dict.fromkeys(f for topic in TOPICS for f in topic.check(scene)))


def problems(scene: Scene) -> list[Problem]:
    """The problems of a scene that Python code made, without file and line: the first ``MOST`` problems, then a problem with the
    number of further problems."""
    return list(error_of(findings(scene), {}).problems)


def checked(scene: Scene) -> Scene:
    """The scene itself; raises SceneError when it has problems."""
    found = findings(scene)
    if found:
        raise error_of(found, {})
    return scene
