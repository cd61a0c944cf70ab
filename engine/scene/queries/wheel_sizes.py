"""Sizes of wheels that roll on each other, from what a scene says: teeth and module (or pitch), or radii."""

from __future__ import annotations

import math
from fractions import Fraction

from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.joint_kind import Rolls
from trunnion.elements.joints.wheel_pairs import Sizes
from trunnion.scene.data_classes.scene import Joint

FINEST = 1000
"""Most teeth that radii are counted in: how far wheels have rolled on each other is known but for whole ones."""
CLOSE = 1e-12
"""How nearly, as a part, radii must be to each other as whole numbers are."""


def counted(radii: tuple[float, ...]) -> tuple[int, ...] | None:
    """Whole numbers (of at most ``FINEST``) that are to each other as two radii are; None where there are none."""
    if len(radii) == 1:
        return (1,)
    ratio = Fraction(radii[0] / radii[1]).limit_denominator(FINEST)
    if not 0 < ratio.numerator <= FINEST or abs(radii[0] * ratio.denominator / (radii[1] * ratio.numerator) - 1) > CLOSE:
        return None
    return ratio.numerator, ratio.denominator


def rolls_of(j: Joint) -> Rolls:
    """How the wheels of a pair roll on each other."""
    rolls = REGISTRY[j.type].rolls
    assert rolls is not None
    return rolls


def outer(j: Joint) -> tuple[int, int]:
    """Sense of each wheel, −1 for the larger of two that turn the same way: its teeth are inside, or a belt runs around both."""
    rolls, given = rolls_of(j), j.teeth or j.radii or ()
    chosen = bool(rolls.choice) and bool(getattr(j, rolls.choice))
    if rolls.opposite != chosen or len(given) < 2:
        return 1, 1
    return (-1, 1) if float(given[0]) > float(given[1]) else (1, -1)


def sizes(j: Joint) -> Sizes:
    """Module and signed numbers of teeth of a checked pair."""
    count = rolls_of(j).wheels
    if j.teeth is not None:
        teeth = tuple(round(float(z)) for z in j.teeth)
        module = j.module if j.module is not None else (j.pitch or 0.0) / math.pi
    else:
        radii = tuple(float(r) for r in j.radii or ())
        teeth = counted(radii) or (1,) * count
        module = 2 * radii[0] / teeth[0]
    sense = outer(j)
    return Sizes(float(module), (sense[0] * teeth[0], sense[1] * teeth[1] if count == 2 else 0))
