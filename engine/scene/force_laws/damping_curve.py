"""A damper by a curve: its force over the rate, as of a shock absorber."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from trunnion.basics.lazy_casadi import SX, ca
from trunnion.basics.lazy_data_classes import validated
from trunnion.basics.monotone_curves import KNOTS, pieces_below, straight_beyond
from trunnion.scene.data_classes.field_types import STRICT
from trunnion.scene.findings.findings_and_paths import Finding, Path
from trunnion.scene.force_laws.declaration import ForceLaw, faults_of_points, points
from trunnion.scene.units.numbers_with_units import Number


@validated(frozen=True, config=STRICT)
class DampingCurve:
    """A damper by points of its characteristic. The curve through the points has no kink, is monotone between neighbouring points,
    and continues straight beyond its ends. If the first speed is 0, both directions have the same curve."""

    speed: tuple[Number, ...]
    """Two to twelve increasing rates, one of them 0."""
    effort: tuple[Number, ...]
    """The effort of the damper at each rate, against the motion. The effort has the sign of the rate, and is 0 at the rate 0."""


class DampingCurveLaw(ForceLaw):
    """Leaves of the law: rates, then efforts."""

    key, data, text = "damping_curve", DampingCurve, "Damper whose effort is a curve over the rate."
    units, count, elastic, pieces = {"speed": "{x}/s", "effort": "{f}"}, 2 * KNOTS, False, True

    def numbers(self, data: DampingCurve) -> Sequence[tuple[str, float]]:
        return points(("speed", "effort"), data)

    def force(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        sign = _side(n, rate)
        return sign * straight_beyond(sign * rate, n[:KNOTS], n[KNOTS:])[0]

    def passed(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        return pieces_below(_side(n, rate) * rate, n[:KNOTS])

    def findings(self, path: Path, data: DampingCurve) -> Iterator[Finding]:
        yield from faults_of_points(path, "speed", data.speed, data.effort)
        if data.speed and 0.0 not in data.speed:
            hint = "add the speed 0 with the effort 0: a damper at rest exerts nothing"
            yield Finding((*path, "speed"), "the curve has no point at the speed 0", hint)
        elif data.speed and data.speed[-1] <= 0.0:
            yield Finding(
                (*path, "speed"),
                "no speed is above 0",
                "add a positive speed; if the first speed is 0, the curve is used for both directions",
            )
        for i, (v, f) in enumerate(zip(data.speed, data.effort, strict=False)):
            if (v == 0.0 and f != 0.0) or v * f < 0.0:
                wanted = "0 at the speed 0" if v == 0.0 else f"not {'negative' if v > 0.0 else 'positive'} at the speed {v:g}"
                yield Finding((*path, "effort", i), f"a damper only takes energy: its effort must be {wanted}, not {f:g}",
                              "give the effort the sign of its speed")  # fmt: skip


def _side(n: Sequence[SX], rate: SX) -> SX:
    """−1 if a negative rate uses the curve of positive rates, otherwise 1."""
    return ca.if_else(ca.logic_and(n[0] >= 0, rate < 0), -1, 1)
