"""The tighter run that a run is compared with: so tight that it costs half as much again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from engine.integrators import AUTO, REGISTRY, Impulses
from engine.simulation.block import Settings

DEARER = 1.45
"""Steps of the tighter run over those of the first: both together cost 2.5 runs at most."""
TIGHTEST = 1e-14
"""No run is tighter: beyond, there is only round-off."""
ORDERS = {m.name: m.order for m in REGISTRY}


def companion(settings: Settings, steps: Mapping[str, int]) -> tuple[Settings, float]:
    """(settings of the tighter run; by how much the difference of the two is to be enlarged for the error of that). steps: how many
    steps the first run took by each method."""
    method = max(ORDERS, key=lambda name: steps.get(name, 0)) if any(steps.get(n, 0) for n in ORDERS) else AUTO.tight.name
    if settings.step > 0.0:
        order = next(m.fixed_order if isinstance(m, Impulses) else m.order for m in REGISTRY if m.name == method)
        return replace(settings, step=settings.step / DEARER), 1.0 / (1.0 - DEARER**-order)
    factor = DEARER ** ORDERS[method]
    rtol = settings.rtol / factor
    if rtol < TIGHTEST:  # a looser one then: what differs is its error, which is the larger
        return replace(settings, rtol=settings.rtol * factor), 1.0
    return replace(settings, rtol=rtol), 1.0 / (1.0 - 1.0 / factor)
