"""How much each joint's friction matters to outputs, from exact sensitivities: the change when its coefficient goes to zero, to
first order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine.basics.problems import SceneError, SimulationError
from engine.chart.measures import Measure
from engine.friction import REGISTRY as LAWS
from engine.scene.model import Scene
from engine.sensitivities import sensitivity


@dataclass(frozen=True)
class Influence:
    """A joint with friction. predicted: relative change of the outputs without its friction; NaN when there is no sensitivity."""

    joint: str
    predicted: float


def influences(scene: Scene, joints: list[str], measure: Measure, until: float, samples: int) -> tuple[list[Influence], str]:
    """The joints sorted by falling influence, and notes about the sensitivities, which say why when there are none."""
    names = {j: _coefficient(scene, j) for j in joints}
    given = {j: n for j, n in names.items() if n}
    try:
        s = sensitivity(scene, [n for n, _ in given.values()], measure.names, until, until / samples, rtol=1e-8)
    except (SceneError, SimulationError) as e:
        return [Influence(j, float("nan")) for j in joints], str(e).splitlines()[0]
    out = []
    for j in joints:
        if j not in given:
            out.append(Influence(j, float("nan")))
            continue
        path, value = given[j]
        change = s.derivatives[:, :, s.parameters.index(path)] * value
        out.append(Influence(j, measure.error(s.values - change, s.values)))
    return sorted(out, key=lambda i: -i.predicted if np.isfinite(i.predicted) else -np.inf), "; ".join(s.notes)


def _coefficient(scene: Scene, joint: str) -> tuple[str, float] | None:
    """(path, value) of the number that scales a joint's friction."""
    friction = scene.joints[joint].friction
    assert friction is not None
    scale = LAWS[scene.law_of(friction)].scale
    value = getattr(friction, scale)
    return (f"joints.{joint}.friction.{scale}", float(value)) if value else None
