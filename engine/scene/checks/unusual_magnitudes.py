"""Notes about valid numbers of unusual magnitude, such as 90 rad instead of 90 deg, or a box of 1,000 m. Such numbers are valid, so
the notes are not errors."""

from __future__ import annotations

import math

from trunnion.basics.errors import MOST
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.name_patterns import matcher
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.findings.findings_and_paths import dotted
from trunnion.scene.queries.numbers_by_path import numbers
from trunnion.scene.units.numbers_with_units import Computed, Quantity


@dataclass(frozen=True)
class Usual:
    """The usual magnitudes of numbers at some paths, in the SI unit ``unit``: 0, or between ``least`` and ``most``.

    places: patterns of the paths; because: the reason for the bounds. meant: the unit that the user may have meant if the number is
    outside the bounds.
    """

    places: tuple[str, ...]
    unit: str
    least: float
    most: float
    because: str
    meant: str


USUAL = (
    Usual(("joints.*.start.q*", "joints.*.end_stops*", "joints.*.spring*.rest", "joints.*.nonlinear*.at*",
           "joints.*.latch*.at", "joints.*.latch*.pitch", "joints.*.drive*.start", "joints.*.drive*.origin",
           "joints.*.drive*.phase", "joints.*.drive*.amplitude"), "rad", 0.0, 2 * math.pi,
          "an angle of more than one turn", "deg"),
    Usual(("bodies.*.box*", "bodies.*.cylinder.*", "bodies.*.sphere", "bodies.*.points*", "bodies.*.center*"), "m", 1e-6, 100.0,
          "parts of machines are between a thousandth of a millimetre and 100 m", "mm"),
    Usual(("joints.*.friction.*",), "m", 1e-6, 1.0, "bearings are between a thousandth of a millimetre and 1 m", "mm"),
    Usual(("bodies.*.density",), "kg/m^3", 15.0, 23e3, "the lightest foams have 15 kg/m^3, osmium 22,600", "g/cm^3"),
    Usual(("bodies.*.mass",), "kg", 1e-9, 1e6, "a part of a machine weighs less than a thousand tonnes", "g"),
    Usual(("bodies.*.inertia*",), "kg*m^2", 0.0, 1e8, "a rod of 30 m and a thousand tonnes has 1e8 kg*m^2", "kg*mm^2"),
    Usual(("gravity*",), "m/s^2", 0.0, 30.0, "Jupiter, the strongest of the planets, has 25 m/s^2", "cm/s^2"),
    Usual(("joints.*.friction.mu*",), "1", 0.0, 2.0, "rubber on dry asphalt has about 1", "%"),
    Usual(("joints.*.start.qd*", "joints.*.drive*.rate"), "rad/s", 0.0, 1e5, "the fastest turbines turn at 1e5 rad/s", "deg/s"),
    Usual(("joints.*.start.qd*", "joints.*.drive*.rate"), "m/s", 0.0, 1e4, "rockets reach 1e4 m/s", "mm/s"),
)  # fmt: skip
"""The first row that matches the path and the unit of a number applies."""
_ROWS = tuple((matcher(u.places), u) for u in USUAL)


def magnitude_notes(scene: Scene) -> list[str]:
    """A note for each of the first hundred numbers of unusual magnitude, then a note with the count of further such numbers."""
    notes = []
    for path, value, unit in numbers(scene):
        if not value or (isinstance(value, Quantity) and (isinstance(value, Computed) or unit not in value.text)):
            continue  # the user wrote another unit or an expression, so the value is intended
        place = dotted(path)
        usual = next((u for fits, u in _ROWS if u.unit == unit and fits(place)), None)
        if usual is not None and not usual.least <= abs(value) <= usual.most:
            said = f"{value:g} {unit}".removesuffix(" 1")
            notes.append(f"{place}: {said}; {usual.because}. Is {value:g} {usual.meant} meant?")
    more = len(notes) - MOST
    return [*notes[:MOST], f"and {more} more numbers of this kind"] if more > 0 else notes
