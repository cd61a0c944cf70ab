"""The twenty-eight places where methods fail (METHOD, "Where methods fail"): a scene for each, as a function of how far it is
beyond its threshold, and what is to be said of it on both sides. The rows stand in one module for each kind of mechanism."""

from __future__ import annotations

from tests.stability import brakes, corners, guides, journals, loops, pendulums, presses, rests, shares, solids

KINDS = (brakes, corners, guides, journals, loops, pendulums, presses, rests, shares, solids)
ROWS = tuple(sorted((row for kind in KINDS for row in kind.ROWS), key=lambda r: r.number))
