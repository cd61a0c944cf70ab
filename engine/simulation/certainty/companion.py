"""The tighter run that a run is compared with: so tight that it costs half as much again, and with steps that end elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from itertools import pairwise

import numpy as np

from engine.integrators import AUTO, REGISTRY, RK5, RK8, RODAS5P, Impulses
from engine.simulation.block import Block, Settings
from engine.simulation.model import Model

DEARER = {RK8.name: 1.33, RODAS5P.name: 1.34}
"""Steps of the tighter run over those of the first by the same method: fewer where each gets dearer."""
CHEAPER = 1.7
"""Steps of the first run over those of a looser one."""
USUAL = 1.45
"""The same of other methods: both runs together cost 2.5 at most."""
TIGHTEST = 1e-14
"""No run is tighter: beyond, there is only round-off."""
WHOLE, FINER, SMOOTH = 1600.0, 6.5, 1e-12
"""A run of order 8 at the tolerance WHOLE rtol_5^(8/5) takes less than half of the evaluations of one by a method of order 5 for
stiff scenes; it is worth it where it is FINER times tighter, and not below SMOOTH, where steps of high order feel round-off."""
APART = 0.41
"""Part of the time between two kinks of signals, at both of which steps end, where the tighter run ends another: two runs of few
steps in between would else have the same ones, and tell nothing of their errors."""
FEW = (0.5, 4.0)
"""Steps in such a stretch, on average: along many, two runs go apart by themselves."""
MORE = 0.1
"""Of the first run's steps: no more are added so, the longest stretches first."""
HIGHER, BEGUN = 3e-6, 20.0
"""Tolerance up to which a run of order 5 is compared with one of order 8, and how much tighter that begins."""
NEEDED, APART_AT_LEAST = 1e-4, 3.0
"""Part of the tolerance below which a tighter run need not go, and by which it is tighter at least."""
ROUND = 1e-13
"""Tolerance of a tighter run below which it finds little but round-off."""
ORDERS = {m.name: m.order for m in REGISTRY}


def companion(settings: Settings, steps: Mapping[str, int]) -> tuple[Settings, float]:
    """(settings of the tighter run; by how much the difference of the two is to be enlarged for the error of that). steps: how many
    steps the first run took by each method."""
    known = settings.method if settings.method in ORDERS else AUTO.tight.name
    method = max(ORDERS, key=lambda name: steps.get(name, 0)) if any(steps.get(n, 0) for n in ORDERS) else known
    dearer = DEARER.get(method, USUAL)
    if settings.step > 0.0:
        order = next(m.fixed_order if isinstance(m, Impulses) else m.order for m in REGISTRY if m.name == method)
        return replace(settings, step=settings.step / dearer), 1.0 / (1.0 - dearer**-order)
    factor = dearer ** ORDERS[method]
    rtol = settings.rtol / factor
    if rtol < TIGHTEST:  # a looser one then: what differs is its error, which is the larger
        return replace(settings, rtol=settings.rtol * factor), 1.0
    return replace(settings, rtol=rtol), 1.0 / (1.0 - 1.0 / factor)


def order_of(settings: Settings, steps: Mapping[str, int]) -> int:
    """The order of the method that most steps of a run are made by. steps: how many another run took by each method."""
    if settings.method in ORDERS:
        return ORDERS[settings.method]
    return ORDERS[max(ORDERS, key=lambda name: steps.get(name, 0))]


def finer(settings: Settings, steps: Mapping[str, int]) -> tuple[Settings, float]:
    """Like ``companion``, but by a method of higher order where that is far tighter at the same cost."""
    if settings.method == RK5.name and settings.step <= 0.0:
        rtol = max(settings.rtol / BEGUN, SMOOTH)
        if rtol <= settings.rtol / FINER and settings.rtol <= HIGHER:
            return replace(settings, rtol=rtol, method=RK8.name), 1.0 / (1.0 - rtol / settings.rtol)
    return companion(settings, steps)


def between(settings: Settings, chosen: Settings) -> tuple[float, float]:
    """The tightest and the loosest tolerance of a run that is compared with one of these settings, and begins with those chosen."""
    return min(chosen.rtol, max(NEEDED * settings.rtol, ROUND)), settings.rtol / APART_AT_LEAST


def explicit(settings: Settings) -> tuple[Settings, float] | None:
    """The same of a run of order 8 for one that was asked for by a method for stiff scenes: where the scene is not stiff, it is far
    more exact and costs less. None for other methods."""
    rtol = max(WHOLE * settings.rtol**1.6, SMOOTH)
    if settings.method != RODAS5P.name or settings.step > 0.0 or rtol > settings.rtol / FINER:
        return None
    return replace(settings, rtol=rtol, method=RK8.name), 1.0 / (1.0 - rtol / settings.rtol)


def looser(settings: Settings) -> tuple[Settings, float]:
    """The same of a run by a method for stiff scenes that takes fewer steps, where there is no time for more: what differs is its
    error, which falls by one order less where a scene is stiff."""
    return replace(settings, rtol=settings.rtol * CHEAPER**RODAS5P.order), 1.0 / (CHEAPER ** (RODAS5P.order - 1) - 1.0)


def elsewhere(model: Model, until: float, steps: int) -> Model:
    """The model of the tighter run: the same, but for ends of steps between kinks of signals. steps: of the first run."""
    numbers = model.built.numbers
    ends = [0.0, *(t for t in numbers.breaks if 0.0 < t < until), until]
    step = until / max(steps, 1)
    short = [(a, b) for a, b in pairwise(ends) if FEW[0] * step <= b - a <= FEW[1] * step]
    some = sorted(short, key=lambda x: x[0] - x[1])[: max(1, int(MORE * steps))]
    if not some:
        return model
    numbers = replace(numbers, breaks=tuple(sorted({*numbers.breaks, *(a + APART * (b - a) for a, b in some)})))
    other = copy(model)
    other.built = replace(model.built, numbers=numbers)
    other.block = Block(model.kernel, numbers, np.array(model.block.parameters))
    return other
