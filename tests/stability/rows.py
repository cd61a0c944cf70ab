"""The nineteen places where methods fail (method, section 6): a scene for each, as a function of how far it is beyond its
threshold, and what is to be said of it on both sides. They are kept by mechanism."""

from __future__ import annotations

from tests.stability import guides, journals, loops, pendulums, solids

ROWS = tuple(sorted((*guides.ROWS, *journals.ROWS, *loops.ROWS, *pendulums.ROWS, *solids.ROWS), key=lambda r: r.number))
