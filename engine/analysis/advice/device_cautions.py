"""Known weaknesses of models and methods with the devices of a scene (rows 29 to 40 of the stability gallery)."""

from __future__ import annotations

import math
from collections.abc import Iterable

from trunnion.elements.joints import REGISTRY as JOINTS
from trunnion.scene.data_classes.joints import Joint
from trunnion.scene.data_classes.scene import Scene

LOCKS = "self-locking: without friction, the device runs back; with smoothed friction, the device creeps"
CURVES = "springs or dampers given by curves: at sharp points, the errors of all methods are many times rtol; choose a smaller rtol"
PASSAGE = "an attracting point: in a close passage, moreau and fixed steps have large errors"
FIELDS = "a field: with fixed steps, or if the field has no width, a step may miss a hill narrower than a hundredth of the path"
JUMPS = "a load that jumps: with fixed steps, moreau lets parts continue to slide for a fraction of a step after the jump"


def device_cautions(scene: Scene) -> list[str]:
    """A sentence for each kind of device with a known weakness, with the names of the devices of this kind."""
    curves = [n for n, x in (*scene.joints.items(), *scene.forces.items()) if _has_curve(x)]
    found = (
        ([n for n, j in scene.joints.items() if locks_itself(j)], LOCKS),
        (curves, CURVES),
        ([n for n, load in scene.forces.items() if load.type == "point_gravity"], PASSAGE),
        ([n for n, load in scene.forces.items() if load.type == "field"], FIELDS),
        ([n for n, x in (*scene.joints.items(), *scene.forces.items()) if _jumps(x)], JUMPS),
    )
    return [f"{', '.join(names)}: {text}" for names, text in found if names]


def locks_itself(joint: Joint) -> bool:
    """Whether the output of a gear unit, or the wheel of a worm, can never turn the input."""
    g = joint.friction
    if g is None or JOINTS[joint.type].friction is None:
        return False
    if joint.lead_angle is not None:
        mu = g.mu_static if g.mu_static is not None else g.mu
        return isinstance(mu, float | int) and float(mu) >= math.tan(abs(joint.lead_angle)) * math.cos(g.pressure_angle or 0.0)
    if g.efficiency is None:
        return False
    if g.efficiency_backward is not None:
        return g.efficiency_backward == 0.0
    return isinstance(g.efficiency, float | int) and float(g.efficiency) <= 0.5


def _has_curve(device: object) -> bool:
    groups = getattr(device, "nonlinear", None)
    return any(g.spring_curve or g.damping_curve for g in _each(groups))


def _jumps(device: object) -> bool:
    loads = [x for key in ("effort", "force", "torque") for x in _each(getattr(device, key, None))]
    return any(getattr(x, "step", None) or getattr(x, "pulse", None) for x in loads)


def _each(value: object) -> Iterable:
    """The entries of a list that are not None. A single object counts as a list with one entry."""
    return [x for x in (value if isinstance(value, tuple | list) else (value,)) if x is not None]
