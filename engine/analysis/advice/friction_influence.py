"""The influence of each joint's friction on the outputs. The influence is the first-order change of the outputs if the joint's
friction coefficient becomes zero."""

from __future__ import annotations

import numpy as np

from trunnion.analysis.sensitivities.sensitivity import sensitivity
from trunnion.analysis.work_precision.error_measure import ErrorMeasure
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import REGISTRY as LAWS
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import apply


@dataclass(frozen=True)
class FrictionInfluence:
    """A joint with friction. predicted: relative change of the outputs when the joint loses its friction, predicted from
    sensitivities; NaN if the sensitivities are missing."""

    joint: str
    predicted: float


def rank_influences(
    scene: Scene, joints: list[str], measure: ErrorMeasure, until: float, samples: int
) -> tuple[list[FrictionInfluence], str]:
    """(joints in order of decreasing influence; text). The text holds the notes of the sensitivity analysis, or the reason why it
    failed. until: end of the run, s."""
    scene = _with_ratios(scene, joints)
    names = {j: _friction_coefficient(scene, j) for j in joints}
    given = {j: n for j, n in names.items() if n}
    try:
        s = sensitivity(scene, [n for n, _ in given.values()], measure.names, until, until / samples, rtol=1e-8)
    except (SceneError, SimulationError) as e:
        return [FrictionInfluence(j, float("nan")) for j in joints], str(e).splitlines()[0]
    changes = {j: s.derivatives[:, :, s.parameters.index(path)] * value for j, (path, value) in given.items()}
    predicted = {j: measure.error(s.values - change, s.values) for j, change in changes.items()}
    out = [FrictionInfluence(j, predicted.get(j, float("nan"))) for j in joints]
    return sorted(out, key=lambda i: -i.predicted if np.isfinite(i.predicted) else -np.inf), "; ".join(s.notes)


def _with_ratios(scene: Scene, joints: list[str]) -> Scene:
    """The scene with the default coefficient 1 written at every joint that has no friction coefficient, such as a gear unit."""
    scales = {j: LAWS[scene.law_of(friction)].scale for j in joints if (friction := scene.joints[j].friction)}
    missing = {f"joints.{j}.friction.{x}": 1.0 for j, x in scales.items() if getattr(scene.joints[j].friction, x) is None}
    return apply(scene, missing) if missing else scene


def _friction_coefficient(scene: Scene, joint: str) -> tuple[str, float] | None:
    """(path, value) of the friction coefficient of a joint; None if the coefficient is zero."""
    friction = scene.joints[joint].friction
    assert friction is not None
    scale = LAWS[scene.law_of(friction)].scale
    value = getattr(friction, scale)
    return (f"joints.{joint}.friction.{scale}", float(value)) if value else None
