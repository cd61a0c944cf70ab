"""Settings of the tighter run for an error estimate. Both runs together cost 2.5 times as much as the first run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from trunnion.runtime.integrators import AUTO, REGISTRY, RK5, RK8, RODAS5P, Impulses
from trunnion.simulation.runtime_interface.simulation_block import Settings

DEARER = {RK8.name: 1.33, RODAS5P.name: 1.34}
"""Number of steps of the tighter run divided by that of the first run, for methods whose steps get more expensive at a tighter
tolerance."""
USUAL = 1.45
"""Number of steps of the tighter run divided by that of the first run, for all other methods. Both runs together then cost at most
2.5 times as much as the first run."""
TIGHTEST = 1e-14
"""Tightest tolerance of any run. At a tighter tolerance, round-off dominates."""
WHOLE, FINER, SMOOTH = 1600.0, 6.5, 1e-12
"""A run of order 8 at the tolerance WHOLE · rtol_5^(8/5) takes less than half the evaluations of a stiff run of order 5 at rtol_5.
The run of order 8 is used if its tolerance is tighter by the factor FINER or more. SMOOTH is the tightest tolerance of
such a run, because steps of high order suffer from round-off."""
HIGHER, BEGUN = 1e-6, 50.0
"""HIGHER: loosest tolerance at which a run of order 5 is compared with a run of order 8. BEGUN: initial ratio of the two
tolerances."""
NEEDED, APART_AT_LEAST = 1e-4, 3.0
"""NEEDED: tightest useful tolerance of the tighter run, relative to that of the first run. APART_AT_LEAST: smallest ratio of the
first run's tolerance to the tighter run's tolerance."""
ROUND = 1e-13
"""Tightest tolerance to which a tighter run is limited. At tighter tolerances, round-off dominates the difference of the runs."""
ORDERS = {m.name: m.order for m in REGISTRY}


def companion(settings: Settings, steps: Mapping[str, int]) -> tuple[Settings, float]:
    """(settings of the tighter run; factor on the runs' difference that accounts for the tighter run's own error). steps: number of
    steps of the first run, by method."""
    known = settings.method if settings.method in ORDERS else AUTO.tight.name
    method = max(ORDERS, key=lambda name: steps.get(name, 0)) if any(steps.get(n, 0) for n in ORDERS) else known
    dearer = DEARER.get(method, USUAL)
    if settings.step > 0.0:
        order = next(m.fixed_order if isinstance(m, Impulses) else m.order for m in REGISTRY if m.name == method)
        return replace(settings, step=settings.step / dearer), 1.0 / (1.0 - dearer**-order)
    factor = dearer ** ORDERS[method]
    rtol = settings.rtol / factor
    if rtol < TIGHTEST:  # make the second run looser instead; the difference of the runs is then about the second run's error
        return replace(settings, rtol=settings.rtol * factor), 1.0
    return replace(settings, rtol=rtol), 1.0 / (1.0 - 1.0 / factor)


def dominant_order(settings: Settings, steps: Mapping[str, int]) -> int:
    """The order of the method that most steps of a run with these settings will use. steps: number of steps by method, counted in
    another run."""
    if settings.method in ORDERS:
        return ORDERS[settings.method]
    return ORDERS[max(ORDERS, key=lambda name: steps.get(name, 0))]


def tightest(settings: Settings, chosen: Settings) -> float:
    """The tightest tolerance of a tighter run. settings: settings of the first run; chosen: settings with which the tighter run
    begins."""
    return min(chosen.rtol, max(NEEDED * settings.rtol, ROUND))


def higher(settings: Settings) -> Settings | None:
    """Settings with a method of order 8, for comparison with a run by a method of order 5. For smooth motion, order 8 is more exact
    at the same cost. None if the run has another method, or a tolerance at which order 8 has no advantage."""
    stiff = settings.method == RODAS5P.name
    at_first = WHOLE * settings.rtol**1.6 if stiff else settings.rtol / BEGUN
    rtol = max(at_first, SMOOTH)
    fit = stiff or (settings.method == RK5.name and settings.rtol <= HIGHER)
    if settings.step > 0.0 or not fit or rtol > settings.rtol / FINER:
        return None
    return replace(settings, rtol=rtol, method="auto" if stiff else RK8.name)
