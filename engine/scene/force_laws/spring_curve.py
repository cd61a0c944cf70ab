"""A spring by a curve: its force over a coordinate or a length."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from trunnion.basics.lazy_casadi import SX
from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.monotone_curves import KNOTS, pieces_below, straight_beyond
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.force_laws.declaration import ForceLaw, faults_of_points, points
from trunnion.scene.units.numbers_with_units import Number


@validated(frozen=True, config=STRICT)
class SpringCurve:
    """A spring by points of its characteristic. The curve through the points has no kink, is monotone between neighbouring points,
    and continues straight beyond its ends. The energy of the spring is 0 at the first point."""

    at: tuple[Number, ...]
    """Two to twelve increasing coordinates, or distances of two points."""
    effort: tuple[Number, ...]
    """The effort of the spring at each coordinate: positive if it acts against the coordinate, or pulls the points together."""


class SpringCurveLaw(ForceLaw):
    """Leaves of the law: positions, then efforts."""

    key, data, text = "spring_curve", SpringCurve, "Spring whose effort is a curve over the coordinate or length."
    units, count, elastic, pieces = {"at": "{x}", "effort": "{f}"}, 2 * KNOTS, True, True

    def numbers(self, data: SpringCurve) -> Sequence[tuple[str, float]]:
        return points(("at", "effort"), data)

    def force(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        return straight_beyond(x, n[:KNOTS], n[KNOTS:])[0]

    def stored(self, n: Sequence[SX], x: SX) -> SX:
        return straight_beyond(x, n[:KNOTS], n[KNOTS:])[1]

    def passed(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        return pieces_below(x, n[:KNOTS])

    def findings(self, path: Path, data: Any) -> Iterator[Finding]:
        yield from faults_of_points(path, "at", data.at, data.effort)
