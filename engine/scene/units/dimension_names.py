"""Names of dimensions: the quantity that each SI unit measures, with an example. This module also checks whether a unit fits."""

from __future__ import annotations

from trunnion.scene.units.unit_parser import NONE, Dimension, parse_unit

QUANTITIES: dict[str, tuple[str, str]] = {
    "1": ("a plain number", "0.3"),
    "m": ("a length", "30 mm"),
    "rad": ("an angle", "45 deg"),
    "s": ("a time", "10 ms"),
    "kg": ("a mass", "2 kg"),
    "m/s": ("a velocity", "1e-4 m/s"),
    "rad/s": ("an angular velocity", "60 rpm"),
    "m/s^2": ("an acceleration", "9.81 m/s^2"),
    "rad/s^2": ("an angular acceleration", "3 rad/s^2"),
    "kg/m^3": ("a density", "7.8 g/cm^3"),
    "kg*m^2": ("a moment of inertia", "0.2 kg*m^2"),
    "N": ("a force", "2 kN"),
    "N*m": ("a torque", "5 N*m"),
    "N/m": ("a stiffness", "2 kN/m"),
    "N*m/rad": ("a rotational stiffness", "3 N*m/rad"),
    "N*s/m": ("a damping", "20 N*s/m"),
    "N*m*s/rad": ("a rotational damping", "0.1 N*m*s/rad"),
    "N*s^2/m^2": ("a quadratic damping", "3 N*s^2/m^2"),
    "N*m*s^2/rad^2": ("a quadratic rotational damping", "0.1 N*m*s^2/rad^2"),
    "Hz": ("a frequency", "2 Hz"),
    "s/m": ("a time per length", "0.2 s/m"),
    "s/rad": ("a time per angle", "0.2 s/rad"),
    "1/s": ("a rate", "2 1/s"),
    "1/m": ("a number per length", "1e5 1/m"),
    "m^2": ("an area", "4 mm^2"),
    "m^3": ("a volume", "2 cm^3"),
    "m^3/s^2": ("a gravitational constant times a mass", "3.986e14 m^3/s^2"),
    "W": ("a power", "10 W"),
    "m^2/N": ("a wear coefficient", "1e-6 mm^3/(N*m)"),
}
"""{SI unit: (name of the quantity, an example)}."""

_NAMED = {parse_unit(unit if unit != "1" else "").dimension: unit for unit in QUANTITIES}


def si_text(dimension: Dimension) -> str:
    """The SI unit of a dimension as text."""
    if dimension in _NAMED:
        return _NAMED[dimension]
    parts = [f"{b}^{e}" if e != 1 else b for b, e in zip(("kg", "m", "s", "rad", "cycle"), dimension, strict=True) if e]
    return "*".join(parts)


def unit_of(dimension: Dimension) -> str:
    """The SI unit of a dimension as text that ``parse_unit`` accepts; '' for a plain number."""
    unit = si_text(dimension)
    if unit == "1" or not unit:
        return ""
    a, b, c, d, e = dimension
    if unit in QUANTITIES or not e:
        return unit
    return "*".join([si_text((a, b, c + e, d, 0)), f"Hz^{e}"]).removeprefix("1*")


def described(dimension: Dimension) -> str:
    """The quantity that a dimension measures, such as "a length"; a dimension without a name is described by its unit."""
    unit = si_text(dimension)
    return QUANTITIES[unit][0] if unit in QUANTITIES else f"a quantity in {unit}"


def fits(given: Dimension, wanted: Dimension) -> bool:
    """Whether dimension ``given`` is accepted where ``wanted`` is required. Both dimensions must agree, except that rad or cycle
    may be omitted (1/s for rad/s, N*m for N*m/rad)."""
    return given == wanted or (given[:3] == wanted[:3] and given[3:] == (0, 0) and given != NONE)
