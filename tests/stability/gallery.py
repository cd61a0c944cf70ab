"""The forty rows of the gallery (theory, "Where methods fail"). Each row has a scene, as a function of the distance from its
threshold, and the correct verdicts on both sides. Each kind of mechanism has one module of rows."""

from __future__ import annotations

from tests.stability.entries import (
    ball_pendulums,
    closed_loops,
    doors_and_marginal_stop,
    gear_units_and_loads,
    journal_bearings,
    loads_and_starts,
    mass_springs_spin,
    rest_and_dead_centres,
    self_tightening_brakes,
    sleeve_guides,
    toggle_press,
    wishbone_and_platform,
)

KINDS = (
    self_tightening_brakes,
    wishbone_and_platform,
    sleeve_guides,
    journal_bearings,
    closed_loops,
    ball_pendulums,
    toggle_press,
    rest_and_dead_centres,
    doors_and_marginal_stop,
    mass_springs_spin,
    gear_units_and_loads,
    loads_and_starts,
)
ROWS = tuple(sorted((row for kind in KINDS for row in kind.ROWS), key=lambda r: r.number))
