"""Settings of the tighter run for an error estimate: both runs together cost 2.5 times the first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from trunnion.runtime.integrators import AUTO, REGISTRY, RK5, RK8, RODAS5P, Impulses
from trunnion.simulation.runtime_interface.simulation_block import Settings

DEARER = {RK8.name: 1.33, RODAS5P.name: 1.34}
"""Steps of the tighter run over those of the first, by method: fewer where each step gets more expensive."""
USUAL = 1.45
"""The same for other methods: both runs together cost 2.5 times the first at most."""
TIGHTEST = 1e-14
"""Tightest tolerance of any run; below it round-off dominates."""
WHOLE, FINER, SMOOTH = 1600.0, 6.5, 1e-12
"""A run of order 8 at the tolerance WHOLE rtol_5^(8/5) takes less than half the evaluations of a stiff method of order 5. It is
used where its tolerance is FINER times tighter, and not below SMOOTH, where steps of high order suffer from round-off."""
HIGHER, BEGUN = 1e-6, 50.0
"""Loosest tolerance at which a run of order 5 is compared with one of order 8, and the first ratio of their tolerances."""
NEEDED, APART_AT_LEAST = 1e-4, 3.0
"""Tightest useful tolerance of a tighter run relative to the first, and the least ratio of the two."""
ROUND = 1e-13
"""Tolerance of a tighter run below which round-off dominates."""
ORDERS = {m.name: m.order for m in REGISTRY}


def companion(settings: Settings, steps: Mapping[str, int]) -> tuple[Settings, float]:
    """(settings of the tighter run; factor on the runs' difference that accounts for the tighter run's own error). steps: number
    of steps of the
    first run by method."""
    known = settings.method if settings.method in ORDERS else AUTO.tight.name
    method = max(ORDERS, key=lambda name: steps.get(name, 0)) if any(steps.get(n, 0) for n in ORDERS) else known
    dearer = DEARER.get(method, USUAL)
    if settings.step > 0.0:
        order = next(m.fixed_order if isinstance(m, Impulses) else m.order for m in REGISTRY if m.name == method)
        return replace(settings, step=settings.step / dearer), 1.0 / (1.0 - dearer**-order)
    factor = dearer ** ORDERS[method]
    rtol = settings.rtol / factor
    if rtol < TIGHTEST:  # a looser run instead: the difference is its error
        return replace(settings, rtol=settings.rtol * factor), 1.0
    return replace(settings, rtol=rtol), 1.0 / (1.0 - 1.0 / factor)


def order_of(settings: Settings, steps: Mapping[str, int]) -> int:
    """The order of the method that most steps of a run use. steps: number of steps of another run by method."""
    if settings.method in ORDERS:
        return ORDERS[settings.method]
    return ORDERS[max(ORDERS, key=lambda name: steps.get(name, 0))]


def tightest(settings: Settings, chosen: Settings) -> float:
    """The tightest tolerance of a tighter run that begins with the settings ``chosen``."""
    return min(chosen.rtol, max(NEEDED * settings.rtol, ROUND))


def higher(settings: Settings) -> Settings | None:
    """Settings with a method of order 8, for comparison with a run by a method of order 5. For smooth motion they are more exact
    at the same cost. None for other methods, and at tolerances at which they have no advantage."""
    stiff = settings.method == RODAS5P.name
    at_first = WHOLE * settings.rtol**1.6 if stiff else settings.rtol / BEGUN
    rtol = max(at_first, SMOOTH)
    fit = stiff or (settings.method == RK5.name and settings.rtol <= HIGHER)
    if settings.step > 0.0 or not fit or rtol > settings.rtol / FINER:
        return None
    return replace(settings, rtol=rtol, method="auto" if stiff else RK8.name)
