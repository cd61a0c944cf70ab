"""The tighter run that a run is compared with: so tight that it costs half as much again, and with steps that end elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from engine.integrators import AUTO, REGISTRY, RK5, RK8, RODAS5P, Impulses
from engine.simulation.block import Settings

DEARER = {RK8.name: 1.33, RODAS5P.name: 1.34}
"""Steps of the tighter run over those of the first by the same method: fewer where each gets dearer."""
USUAL = 1.45
"""The same of other methods: both runs together cost 2.5 at most."""
TIGHTEST = 1e-14
"""No run is tighter: beyond, there is only round-off."""
WHOLE, FINER, SMOOTH = 1600.0, 6.5, 1e-12
"""A run of order 8 at the tolerance WHOLE rtol_5^(8/5) takes less than half of the evaluations of one by a method of order 5 for
stiff scenes; it is worth it where it is FINER times tighter, and not below SMOOTH, where steps of high order feel round-off."""
HIGHER, BEGUN = 1e-6, 50.0
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


def tightest(settings: Settings, chosen: Settings) -> float:
    """The tightest tolerance of a run that is compared with one of these settings, and begins with those chosen."""
    return min(chosen.rtol, max(NEEDED * settings.rtol, ROUND))


def higher(settings: Settings) -> Settings | None:
    """Those of a run of order 8 for one that was asked for by a method of order 5: where the scene is neither stiff nor full of events, it is
    far more exact at the same cost. None for other methods, and where it would not be."""
    at_first = {RODAS5P.name: WHOLE * settings.rtol**1.6, RK5.name: settings.rtol / BEGUN if settings.rtol <= HIGHER else np.inf}
    rtol = max(at_first.get(settings.method, np.inf), SMOOTH)
    return None if settings.step > 0.0 or rtol > settings.rtol / FINER else replace(settings, rtol=rtol, method="auto" if settings.method == RODAS5P.name else RK8.name)
