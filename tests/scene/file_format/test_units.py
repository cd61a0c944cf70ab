"""Units: numbers with units are converted to SI exactly; wrong units are refused in plain words."""

from __future__ import annotations

import copy
import math
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.scene.valid_scene import edited, problems_of
from trunnion.scene.data_classes.scene import Body, Spring
from trunnion.scene.units.dimension_names import QUANTITIES, fits, si_text
from trunnion.scene.units.numbers_with_units import Per, Quantity, parse_quantity
from trunnion.scene.units.unit_parser import UNITS, UnitError, parse, parse_unit

EXACT = {
    "45 deg": math.pi / 4,
    "-90°": -math.pi / 2,
    "60 rpm": 2 * math.pi,
    "0.5 turn": math.pi,
    "35 mm": 0.035,
    "3.e1 cm": 0.3,
    ".5 m": 0.5,
    "+2 kN/m": 2000.0,
    "7.8 g/cm^3": 7800.0,
    "1e-4 m/s": 1e-4,
    "9.81 m/s²": 9.81,
    "9.81 m/s**2": 9.81,
    "36 km/h": 10.0,
    "2 N m": 2.0,
    "2 N·m": 2.0,
    "3 kg*m^2": 3.0,
    "3 kg m²": 3.0,
    "4 s⁻¹": 4.0,
    "4 1/s": 4.0,
    "3 N*m/(rad/s)": 3.0,
    "3 N*s*m/rad": 3.0,
    "2 lb": 0.90718474,
    "1 in": 0.0254,
    "1 lbf": 4.4482216152605,
    "12": 12.0,
    "−3": -3.0,
}


@pytest.mark.parametrize("text", EXACT)
def test_a_number_with_a_unit_becomes_si_exactly(text):
    assert parse_quantity(text) == EXACT[text]


REFUSED = {
    "": "not a number",
    "deg": "not a number",
    "nan": "not a number",
    "inf m": "not a number",
    "1e999": "too large",
    "1e300 km^9": "too large",
    "3 furlong": "unknown unit",
    "3 m/": "missing",
    "3 m^": "not a unit",
    "3 m^22": "not a unit",
    "3 (m": "closing parenthesis",
    "3 m)": "not a unit",
    "3 */ m": "missing",
    "1_000 m": "not a unit",
    "3 4": "not a unit",
    "1 " + "(" * 50: "missing",
    "1 " + "m*" * 50 + "m": "too long",
    "1 ((((km^9)^9)^9)^9)^9": "out of range",
    "1 ((((mm^9)^9)^9)^9)^9": "out of range",
    "1 ((((mm^-9)^9)^9)^9)^9": "out of range",
    "1 ((((deg^9)^9)^9)^9)^9": "out of range",
}


@pytest.mark.parametrize("text", REFUSED)
def test_a_text_that_is_not_a_quantity_is_refused(text):
    with pytest.raises(UnitError) as e:
        parse(text)
    assert REFUSED[text] in f"{e.value.what} {e.value.hint}"


@given(st.text(max_size=80) | st.from_regex(r"[0-9.e+-]{1,20} ?[a-zA-Z*/^() 0-9-]{0,30}", fullmatch=True))
def test_any_text_is_a_finite_number_or_a_unit_error(text):
    try:
        value = parse_quantity(text)
    except UnitError:
        return
    assert math.isfinite(value)


@pytest.mark.parametrize(
    ("wrong", "right"), [("kn", "kN"), ("Deg", "deg"), ("NM", "N"), ("meter", ""), ("kgs", "kg"), ("RPM", "rpm")]
)
def test_a_unit_nearly_right_gets_a_hint(wrong, right):
    with pytest.raises(UnitError) as e:
        parse_unit(wrong)
    assert right in e.value.hint


def test_an_unspoken_radian_or_cycle_is_accepted_but_never_swapped():
    def dimension(text):
        return parse_unit(text).dimension

    assert fits(dimension("1/s"), dimension("rad/s"))
    assert fits(dimension("1/s"), dimension("Hz"))
    assert fits(dimension("N*m"), dimension("N*m/rad"))
    assert not fits(dimension("Hz"), dimension("rad/s"))
    assert not fits(dimension("rpm"), dimension("Hz"))
    assert not fits(dimension("N*m/rad"), dimension("N*m"))
    assert not fits(dimension("m"), dimension("rad"))
    assert not fits(dimension("m/m"), dimension("rad"))


@pytest.mark.parametrize("unit", QUANTITIES)
def test_every_example_in_a_hint_is_itself_accepted(unit):
    assert math.isfinite(Per(unit)(QUANTITIES[unit][1]))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 10**400, True, None, [1], {"a": 1}, "nan", "1e999", b"1"])
def test_only_finite_numbers_are_numbers(bad):
    for validate in (Per("m"), Spring):
        with pytest.raises(ValueError, match=r"expected|finite|number|large"):
            validate(bad)


def test_a_wrong_dimension_says_what_it_is_and_what_is_wanted():
    (problem,) = problems_of(edited({"joints.socket.friction.radius": "30 deg"}))
    assert problem.where == "joints.socket.friction.radius"
    assert (problem.what, problem.hint) == ('"30 deg" is an angle; a length is expected', 'for example "30 mm"')


def test_typed_fields_hold_plain_floats_and_open_ones_remember_their_dimension():
    assert type(Body(sphere="30 mm", mass=1).sphere) is float
    rest = Spring(stiffness=1, rest="30 mm").rest
    assert isinstance(rest, Quantity)
    assert (rest, rest.text, rest.dimension) == (0.03, "30 mm", parse_unit("m").dimension)


def test_a_quantity_survives_copying_and_pickling():
    a = parse_quantity("30 mm")
    for b in (copy.deepcopy(a), pickle.loads(pickle.dumps(a))):
        assert (float(b), b.text, b.dimension) == (0.03, "30 mm", a.dimension)


def test_the_table_of_units_is_complete_and_true():
    for symbol, (name, unit) in UNITS.items():
        si = si_text(unit.dimension)
        assert name
        assert parse_quantity(f"1 {symbol}") == pytest.approx(unit.factor, rel=1e-15)
        assert parse_unit(si).dimension == parse_unit(symbol).dimension
        assert parse_unit(si).factor == 1.0
