"""Expressions have the documented value, dimension and derivative. They cannot run any other code."""

from __future__ import annotations

import cmath
import math
import random

import pytest

from tests.scene.valid_scene import ARM as TEXT
from tests.scene.valid_scene import problems_in
from trunnion.scene import scene_from_text
from trunnion.scene.expressions.formula_parser import FUNCTIONS, parse_formula, rename_names
from trunnion.scene.expressions.formula_values_and_dimensions import slope, value
from trunnion.scene.units.unit_parser import UNITS

SMOOTH = [f for f in FUNCTIONS if f not in ("atan2", "abs", "min", "max")]
ACCURACY = 1e-12  # a few dozen operations on numbers near one, each rounded once


def grown(rng: random.Random, depth: int) -> str:
    """A random expression of x and y whose parts stay near one, so that all functions are defined."""
    if depth == 0:
        return rng.choice(["x", "y", f"{rng.uniform(0.5, 1.5):.3f}"])
    kind = rng.choice(["+", "-", "*", "/", "^", "neg", "call", "call"])
    a, b = grown(rng, depth - 1), grown(rng, depth - 1)
    if kind == "call":
        return f"{rng.choice(SMOOTH)}(0.4 + 0.1*sin({a}))"
    if kind == "neg":
        return f"-({a})"
    return f"({a})^{rng.choice([2, 3])}" if kind == "^" else f"({a}) {kind} (2.5 + sin({b}))"


@pytest.mark.parametrize("seed", range(30))
def test_random_expressions_have_the_value_python_gives_and_the_slope_of_a_complex_step(seed: int) -> None:
    rng = random.Random(seed)
    text = grown(rng, 4)
    at = {"x": rng.uniform(0.3, 0.9), "y": rng.uniform(0.3, 0.9)}
    root = parse_formula(text).root
    python = text.replace("^", "**")
    plain = eval(python, {f: getattr(math, f) for f in SMOOTH if f != "abs"} | at)
    assert value(root, at) == pytest.approx(plain, rel=ACCURACY)
    found, by = slope(root, at, {n: {n: 1.0} for n in at})
    assert found == value(root, at)
    for name in at:
        step = 1e-30  # a complex step forms no difference, so it may be this small
        moved = {f: getattr(cmath, f) for f in SMOOTH} | at | {name: at[name] + step * 1j}
        exact = complex(eval(python, moved)).imag / step
        assert by.get(name, 0.0) == pytest.approx(exact, rel=ACCURACY, abs=ACCURACY)


@pytest.mark.parametrize(
    ("text", "x", "wanted"),
    [("abs(x)", -2.0, -1.0), ("min(x, 3)", 2.0, 1.0), ("max(x, 3)", 2.0, 0.0), ("atan2(x, 2)", 1.0, 0.4),
     ("2^x", 1.0, 2 * math.log(2)), ("x^0", 0.0, 0.0), ("atan2(3, x)", 4.0, -0.12)],
)  # fmt: skip
def test_slopes_of_the_other_functions_are_exact(text: str, x: float, wanted: float) -> None:
    found = slope(parse_formula(text).root, {"x": x}, {"x": {"x": 1.0}})[1]
    assert found["x"] == pytest.approx(wanted, rel=1e-15, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("2 + 3*4", 14), ("2*3^2", 18), ("-2^2", -4), ("2^-1", 0.5), ("8/2/2", 2), ("7-2-1", 4), ("2^3^2", 512), ("35 mm", 0.035),
     ("7.8 g/cm^3", 7800), ("2.5 kN/m * 2", 5000), ("90 deg / 2", math.pi / 4), ("min(3, 1, 2)", 1), ("2**3", 8), ("1e3", 1000),
     ("3 − 1", 2), ("( 1 + 2 )*3", 9), ("sqrt(9)*pi", 3 * math.pi), ("+3", 3), ("0.5 SI", 0.5)],
)  # fmt: skip
def test_a_formula_has_the_value_of_its_grammar(text: str, wanted: float) -> None:
    assert value(parse_formula(text).root, {}) == wanted


def test_renaming_touches_parameters_alone() -> None:
    names = {"a": "leg_a", "mm": "no", "e3": "no", "b": "leg_b"}
    assert rename_names("a/2 + 5 kg*aa^2 - 2e3*b + sin(a)", names) == "leg_a/2 + 5 kg*aa^2 - 2e3*leg_b + sin(leg_a)"


# -- mistakes --------------------------------------------------------------------------------------------------------------------

WRONG = {
    "a": '"{a}" is a length; a plain number is expected',
    "pin/a*1 kg": "a mass; a plain number",
    "mu + a": "a plain number cannot be added to a length",
    "a - 3 deg": "an angle cannot be subtracted from a length",
    "max(a, mu)": "cannot be compared with",
    "sin(a)/1": "sin needs an angle, not a length",
    "acos(a)": "acos needs a plain number",
    "a^mu": "the exponent of something with a unit cannot depend on a parameter",
    "2^a": "an exponent is a plain number, not a length",
    "muu": 'there is no parameter "muu" (did you mean "mu"?)',
    "mu mu": "cannot read",
    "2 mu": "a product is written 2*mu",
    "3 kgs": 'unknown unit "kgs"',
    "mm": '"mm" alone is not a number',
    "sin": '"sin" alone is not a number',
    "1/0": "1 / 0 has no value",
    "sqrt(-1)": "sqrt(-1) has no value",
    "(-8)^(1/3)": "has no value",
    "10^400": "has no value",
    "sin(1, 2)": "sin: 1 argument(s), not 2",
    "sinh(1)": 'there is no function "sinh"',
    "(1": "it ends too early",
    "1)": 'from ")" on',
    "": "it ends too early",
    "(" * 60 + "1" + ")" * 60: "deep",
    "-" * 60 + "1": "deep",
    "1+" * 2000 + "1": "characters",
    "__import__('os')": "there is no function",
    "a.b": 'from ".b" on',
    "[1]": "cannot read",
    "a if a else a": "cannot read",
    "lambda: 1": "cannot read",
    "'x'": "cannot read",
    "a; a": "cannot read",
    "a == a": "cannot read",
    "9**9**9**9": "has no value",
}


@pytest.mark.default_cases(31)
@pytest.mark.parametrize("expression", WRONG)
def test_a_wrong_expression_is_reported_at_its_line_and_alone(expression: str) -> None:
    found = problems_in(TEXT.replace('mu: "{mu}"', f'mu: "{{{expression}}}"'))
    assert [(p.where, p.line) for p in found] == [("joints.pivot.friction.mu", 16)], found
    assert WRONG[expression] in str(found[0])


PLAIN = ["a/1 m", "a*pin/1 m^2", "sin(lift)", "sin(0.3)", "lift/1 rad", "cos(a/pin)", "3/4", "(2 m)/a", "mu"]


@pytest.mark.parametrize("expression", PLAIN)
def test_an_expression_without_a_unit_is_a_plain_number(expression: str) -> None:
    assert problems_in(TEXT.replace('mu: "{mu}"', f'mu: "{{abs({expression})}}"')) == []


FREE_OF_RADIANS = [("q", "a/pin/100"), ("q", "pi/6"), ("radius", "pin*lift"), ("radius", "sqrt(pin*a)"), ("q", "atan2(pin, a)"),
                   ("q", "acos(mu)")]  # fmt: skip


@pytest.mark.parametrize(("key", "expression"), FREE_OF_RADIANS)
def test_angles_are_ratios_and_radians_need_not_be_taken_out(key: str, expression: str) -> None:
    old = {"q": '"{lift}"', "radius": '"{pin}"'}[key]
    assert problems_in(TEXT.replace(f"{key}: {old}", f'{key}: "{{{expression}}}"')) == []


@pytest.mark.parametrize(("written", "meant"), [("{mu}", "{mu}"), ("{mu/2}", "{mu/2}"), ("{min(mu, 0.2)}", "{min(mu, 0.2)}")])
def test_braces_without_quotes_are_reported(written: str, meant: str) -> None:
    (found,) = problems_in(TEXT.replace('mu: "{mu}"', f"mu: {written}"))
    assert (found.where, found.line) == ("joints.pivot.friction.mu", 16)
    assert f'put it in quotes: "{meant}"' in str(found)


PARAMETERS = {
    "b: 1, c: '{d}', d: '{c}'": ["parameters.c", "parameters.d"],
    "h: 1 m": ["parameters.h"],
    "max: 2": ["parameters.max"],
    "2nd: 2": ["parameters.2nd"],
    "b: [1]": ["parameters.b"],
    "b: 3 parsecs": ["parameters.b"],
    "b: '{1/0}', c: '{b}', d: '{c + 1}'": ["parameters.b"],
}


@pytest.mark.parametrize("given", PARAMETERS)
def test_a_wrong_parameter_is_reported_once_and_not_where_it_is_used(given: str) -> None:
    assert [p.where for p in problems_in(TEXT.replace("mu: 0.12,", f"mu: 0.12, {given},"))] == PARAMETERS[given]


def test_no_unit_may_name_a_parameter() -> None:
    for unit in UNITS:
        assert problems_in(TEXT.replace("mu: 0.12,", f"mu: 0.12, {unit}: 1,"))


def test_long_chains_of_parameters_need_no_recursion() -> None:
    n = 3000
    chain = ", ".join([*(f'p{k}: "{{p{k + 1} + 0}}"' for k in range(n)), f"p{n}: 0.25"])
    found = scene_from_text(TEXT.replace("mu: 0.12,", f'mu: "{{p0}}", {chain},'))
    assert found.joints["pivot"].friction.mu == 0.25
