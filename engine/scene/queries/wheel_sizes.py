"""Sizes of wheels that roll on each other, from teeth and module (or pitch), or from radii."""

from __future__ import annotations

import math
from fractions import Fraction

from trunnion.elements.joints import REGISTRY
from trunnion.elements.joints.joint_kind import Rolls
from trunnion.elements.joints.wheel_pairs import Sizes
from trunnion.scene.data_classes.scene import Joint

FINEST = 1000
"""Largest number of virtual teeth for wheels that are given by radii. The rolling constraint repeats from tooth to tooth and
therefore needs whole numbers."""
CLOSE = 1e-12
"""Largest relative difference between the ratio of the radii and the ratio of whole numbers that replaces the ratio of the
radii."""


def whole_number_ratio(radii: tuple[float, ...]) -> tuple[int, ...] | None:
    """Whole numbers, at most ``FINEST``, whose ratio equals the ratio of the two radii; None if there are no such numbers. One
    radius gives (1,)."""
    if len(radii) == 1:
        return (1,)
    ratio = Fraction(radii[0] / radii[1]).limit_denominator(FINEST)
    if not 0 < ratio.numerator <= FINEST or abs(radii[0] * ratio.denominator / (radii[1] * ratio.numerator) - 1) > CLOSE:
        return None
    return ratio.numerator, ratio.denominator


def rolls_of(j: Joint) -> Rolls:
    """The rolling declaration of the joint type of a wheel pair."""
    rolls = REGISTRY[j.type].rolls
    assert rolls is not None
    return rolls


def outer(j: Joint) -> tuple[int, int]:
    """Sign of each wheel. The sign is −1 for the larger wheel if both wheels turn in the same sense (internal teeth, or an open
    belt)."""
    rolls, given = rolls_of(j), j.teeth or j.radii or ()
    chosen = bool(rolls.choice) and bool(getattr(j, rolls.choice))
    if rolls.opposite != chosen or len(given) < 2:
        return 1, 1
    return (-1, 1) if float(given[0]) > float(given[1]) else (1, -1)


def sizes(j: Joint) -> Sizes:
    """Module, m, and signed numbers of teeth of a checked pair. The rack in a pair of wheel and rack has the number 0."""
    count = rolls_of(j).wheels
    if REGISTRY[j.type].slips:
        (one, two), sense = map(float, j.radii or (1.0, 1.0)), outer(j)
        return Sizes(2 * one, (float(sense[0]), sense[1] * two / one))
    if j.teeth is not None:
        teeth = tuple(round(float(z)) for z in j.teeth)
        module = j.module if j.module is not None else (j.pitch or 0.0) / math.pi
    else:
        radii = tuple(float(r) for r in j.radii or ())
        teeth = whole_number_ratio(radii) or (1,) * count
        module = 2 * radii[0] / teeth[0]
    if rolls_of(j).touch == "skew":
        lead = j.lead_angle or 1.0
        return Sizes(float(module), (int(math.copysign(teeth[0], lead)), teeth[1]), lead)
    sense = outer(j)
    return Sizes(float(module), (sense[0] * teeth[0], sense[1] * teeth[1] if count == 2 else 0))
