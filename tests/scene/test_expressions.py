"""Expressions have the value, dimension and derivative they say, change with their parameters, and can do nothing else."""

from __future__ import annotations

import cmath
import math
import random

import numpy as np
import pytest

import engine
from engine.basics.problems import SceneError
from engine.cli import main
from engine.scene import scene_from_dict, scene_from_text, scene_to_dict, scene_to_yaml
from engine.scene.following import Following
from engine.scene.model import Scene
from engine.scene.overrides import apply, list_parameters, parse_assignment
from engine.scene.units import UNITS
from engine.scene.written.formula import FUNCTIONS, formula, renamed
from engine.scene.written.values import slope, value

from .making import problems_in

A, RADIUS, MU = 0.6, 8e-3, 0.12
TEXT = """
schema: 1
gravity: [0, -9.81, 0]
parameters: {a: 600 mm, thick: "{a/15}", mu: 0.12, pin: 8 mm, lift: 30 deg}
bodies:
  arm:
    box: ["{a}", "{thick}", "{thick}"]
    density: 7800
    points: {pivot: ["{-a/2}", 0, 0]}
joints:
  pivot:
    type: revolute
    axis: z
    inboard: ground
    outboard: arm.pivot
    friction: {mu: "{mu}", radius: "{pin}", half_length: "{2*pin - 1 mm}"}
    start: {q: "{lift}"}
simulation: {until: 0.2}
"""
WRITTEN = {
    "a": repr(A), "thick": repr(A / 15), "-a/2": repr(-A / 2), "mu": repr(MU), "pin": repr(RADIUS),
    "2*pin - 1 mm": repr(2 * RADIUS - 1e-3), "lift": repr(math.pi / 6),
}  # fmt: skip


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_from_text(TEXT)


def written_out() -> Scene:
    """The same scene with every number typed in."""
    text = TEXT.replace('parameters: {a: 600 mm, thick: "{a/15}", mu: 0.12, pin: 8 mm, lift: 30 deg}', "")
    for expression, number in WRITTEN.items():
        text = text.replace('"{' + expression + '}"', number)
    assert '"' not in text
    return scene_from_text(text)


def test_a_scene_of_expressions_runs_to_the_same_bits_as_the_one_written_out(scene: Scene) -> None:
    plain = written_out()
    own = {p.path: p.value for p in list_parameters(scene) if not p.path.startswith("parameters.")}
    assert own == {p.path: p.value for p in list_parameters(plain)}
    assert np.array_equal(engine.simulate(scene).data, engine.simulate(plain).data)


def test_numbers_follow_their_parameters_and_one_that_is_set_itself_does_not(scene: Scene) -> None:
    changed = apply(scene, {"parameters.a": "900 mm"})
    assert changed.bodies["arm"].box == (0.9, 0.9 / 15, 0.9 / 15)
    assert changed.bodies["arm"].points["pivot"] == (-0.45, 0.0, 0.0)
    assert apply(scene, {"parameters.a": 0.9}) == changed, "plain numbers are SI"
    fixed = apply(changed, {"bodies.arm.box[2]": "50 mm"})
    assert apply(fixed, {"parameters.a": 0.6}).bodies["arm"].box == (0.6, 0.05, 0.04)
    assert apply(scene, {"parameters.thick": 0.1}).bodies["arm"].box == (0.6, 0.1, 0.1), "one that follows another may be set"
    assert apply(scene, dict([parse_assignment("parameters.a=900mm")])) == changed
    assert apply(scene, {"parameters.a": "{2*pin}"}).bodies["arm"].box[0] == 2 * RADIUS


@pytest.mark.parametrize("again", ["yaml", "dict"])
def test_expressions_survive_being_written_and_read(scene: Scene, again: str) -> None:
    copy = scene_from_text(scene_to_yaml(scene)) if again == "yaml" else scene_from_dict(scene_to_dict(scene))
    assert copy == scene
    change = {"parameters.a": 0.9, "parameters.lift": "10 deg"}
    assert apply(copy, change) == apply(scene, change)
    assert apply(apply(scene, change), {"parameters.a": A, "parameters.lift": math.pi / 6}) == scene


# -- values and derivatives -----------------------------------------------------------------------------------------------------

SMOOTH = [f for f in FUNCTIONS if f not in ("atan2", "abs", "min", "max")]
ACCURACY = 1e-12  # a few dozen operations, each rounded once, of numbers near one


def grown(rng: random.Random, depth: int) -> str:
    """A random expression of x and y whose parts stay near one, so that all functions have values."""
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
    root = formula(text).root
    python = text.replace("^", "**")
    plain = eval(python, {f: getattr(math, f) for f in SMOOTH if f != "abs"} | at)
    assert value(root, at) == pytest.approx(plain, rel=ACCURACY)
    found, by = slope(root, at, {n: {n: 1.0} for n in at})
    assert found == value(root, at)
    for name in at:
        step = 1e-30  # no difference is taken, so that it can be as small as one likes
        moved = {f: getattr(cmath, f) for f in SMOOTH} | at | {name: at[name] + step * 1j}
        exact = complex(eval(python, moved)).imag / step
        assert by.get(name, 0.0) == pytest.approx(exact, rel=ACCURACY, abs=ACCURACY)


@pytest.mark.parametrize(
    ("text", "x", "wanted"),
    [("abs(x)", -2.0, -1.0), ("min(x, 3)", 2.0, 1.0), ("max(x, 3)", 2.0, 0.0), ("atan2(x, 2)", 1.0, 0.4),
     ("2^x", 1.0, 2 * math.log(2)), ("x^0", 0.0, 0.0), ("atan2(3, x)", 4.0, -0.12)],
)  # fmt: skip
def test_slopes_of_the_other_functions(text: str, x: float, wanted: float) -> None:
    found = slope(formula(text).root, {"x": x}, {"x": {"x": 1.0}})[1]
    assert found["x"] == pytest.approx(wanted, rel=1e-15, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("2 + 3*4", 14), ("2*3^2", 18), ("-2^2", -4), ("2^-1", 0.5), ("8/2/2", 2), ("7-2-1", 4), ("2^3^2", 512), ("35 mm", 0.035),
     ("7.8 g/cm^3", 7800), ("2.5 kN/m * 2", 5000), ("90 deg / 2", math.pi / 4), ("min(3, 1, 2)", 1), ("2**3", 8), ("1e3", 1000),
     ("3 − 1", 2), ("( 1 + 2 )*3", 9), ("sqrt(9)*pi", 3 * math.pi), ("+3", 3), ("0.5 SI", 0.5)],
)  # fmt: skip
def test_grammar(text: str, wanted: float) -> None:
    assert value(formula(text).root, {}) == wanted


def test_renaming_touches_parameters_alone() -> None:
    names = {"a": "leg_a", "mm": "no", "e3": "no", "b": "leg_b"}
    assert renamed("a/2 + 5 kg*aa^2 - 2e3*b + sin(a)", names) == "leg_a/2 + 5 kg*aa^2 - 2e3*leg_b + sin(leg_a)"


# -- mistakes --------------------------------------------------------------------------------------------------------------------

WRONG = {
    "a": '"{a}" is a length; a plain number is wanted',
    "pin/a*1 kg": "a mass; a plain number",
    "mu + a": "a plain number cannot be added to a length",
    "a - 3 deg": "an angle cannot be subtracted from a length",
    "max(a, mu)": "cannot be compared with",
    "sin(a)/1": "sin is of an angle, not of a length",
    "acos(a)": "acos is of a plain number",
    "a^mu": "the exponent of something with a unit cannot depend on a parameter",
    "2^a": "an exponent is a plain number, not a length",
    "muu": 'there is no parameter "muu" (did you mean "mu"?)',
    "mu mu": "cannot read",
    "2 mu": "a product is written 2*mu",
    "3 kgs": 'unknown unit "kgs"',
    "mm": '"mm" alone is no number',
    "sin": '"sin" alone is no number',
    "1/0": "1 / 0 has no value",
    "sqrt(-1)": "sqrt(-1) has no value",
    "(-8)^(1/3)": "has no value",
    "10^400": "has no value",
    "sin(1, 2)": "sin takes 1, not 2",
    "exp(1)": 'there is no function "exp"',
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


@pytest.mark.parametrize("expression", WRONG)
def test_a_wrong_expression_is_told_at_its_line_and_alone(expression: str) -> None:
    found = problems_in(TEXT.replace('mu: "{mu}"', f'mu: "{{{expression}}}"'))
    assert [(p.where, p.line) for p in found] == [("joints.pivot.friction.mu", 16)], found
    assert WRONG[expression] in str(found[0])


PLAIN = ["a/1 m", "a*pin/1 m^2", "sin(lift)", "sin(0.3)", "lift/1 rad", "cos(a/pin)", "3/4", "(2 m)/a", "mu"]


@pytest.mark.parametrize("expression", PLAIN)
def test_what_comes_out_as_a_plain_number_is_one(expression: str) -> None:
    assert problems_in(TEXT.replace('mu: "{mu}"', f'mu: "{{abs({expression})}}"')) == []


FREE_OF_RADIANS = [("q", "a/pin/100"), ("q", "pi/6"), ("radius", "pin*lift"), ("radius", "sqrt(pin*a)"), ("q", "atan2(pin, a)"),
                   ("q", "acos(mu)")]  # fmt: skip


@pytest.mark.parametrize(("key", "expression"), FREE_OF_RADIANS)
def test_angles_are_ratios_and_radians_need_not_be_taken_out(key: str, expression: str) -> None:
    old = {"q": '"{lift}"', "radius": '"{pin}"'}[key]
    assert problems_in(TEXT.replace(f"{key}: {old}", f'{key}: "{{{expression}}}"')) == []


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
def test_a_wrong_parameter_is_told_once_and_not_where_it_is_used(given: str) -> None:
    assert [p.where for p in problems_in(TEXT.replace("mu: 0.12,", f"mu: 0.12, {given},"))] == PARAMETERS[given]


def test_no_unit_may_name_a_parameter() -> None:
    for unit in UNITS:
        assert problems_in(TEXT.replace("mu: 0.12,", f"mu: 0.12, {unit}: 1,"))


def test_a_parameter_keeps_its_dimension_when_it_is_set(scene: Scene) -> None:
    with pytest.raises(SceneError, match=r"parameters\.a: .*an angle; a length is wanted"):
        apply(scene, {"parameters.a": "3 deg"})
    with pytest.raises(SceneError, match=r"bodies\.arm\.box\[1\]: box\[1\] must be positive"):
        apply(scene, {"parameters.a": -1})


def test_long_chains_of_parameters_need_no_recursion() -> None:
    n = 3000
    chain = ", ".join([*(f'p{k}: "{{p{k + 1} + 0}}"' for k in range(n)), f"p{n}: 0.25"])
    found = scene_from_text(TEXT.replace("mu: 0.12,", f'mu: "{{p0}}", {chain},'))
    assert found.joints["pivot"].friction.mu == 0.25


# -- sweeps, derivatives, commands ------------------------------------------------------------------------------------------------


def test_a_sweep_over_a_parameter_is_the_sweep_over_the_numbers_that_follow_it(scene: Scene) -> None:
    keep = ["final:pivot.q[1]", "max:pivot.contact[1].normal_force"]
    lengths, mus = [0.5, 0.6, 0.7], [0.1, 0.2]
    swept = engine.sweep(scene, over={"parameters.a": lengths, "parameters.mu": mus}, reductions=keep)
    following = {"box[1]": 1.0, "box[2]": 15.0, "box[3]": 15.0, "points.pivot[1]": -2.0}
    cases = [{f"bodies.arm.{k}": a / by for k, by in following.items()} | {"joints.pivot.friction.mu": mu}
             for a in lengths for mu in mus]  # fmt: skip
    listed = engine.sweep(written_out(), cases=cases, reductions=keep)
    assert all(swept.table[k].to_pylist() == listed.table[k].to_pylist() for k in keep)
    assert swept.table.schema.field("parameters.a").metadata[b"unit"] == b"m"
    again = swept.trajectory(4)
    assert again["pivot.q[1]"][-1] == swept.table[keep[0]][4].as_py()


def test_a_case_without_a_value_is_a_row_that_says_so(scene: Scene) -> None:
    rooted = apply(scene, {"joints.pivot.friction.mu": "{sqrt(mu)}"})
    table = engine.sweep(rooted, over={"parameters.mu": [0.1, -0.1, 0.2]}, reductions=["final:pivot.q[1]"]).table
    assert [o != "done" for o in table["outcome"].to_pylist()] == [False, True, False]
    assert "has no value" in table["outcome.advice"][1].as_py()


def test_the_derivative_by_a_parameter_is_the_chain_rule_over_what_follows_it(scene: Scene) -> None:
    by = Following(scene).slopes("a")
    sizes = {f"bodies.arm.box[{k}]": 1.0 if k == 1 else 1 / 15 for k in (1, 2, 3)}
    assert by == sizes | {"bodies.arm.points.pivot[1]": -0.5}
    one = engine.sensitivity(scene, ["parameters.a", *by], ["pivot.q[1]"], every=0.1)
    d = one.derivatives[:, 0]
    assert d[:, 0] == pytest.approx(d[:, 1:] @ np.array(list(by.values())), rel=1e-9)  # differences of what a run starts from
    assert one.parameter_units[0] == "m"
    assert abs(d[-1, 0]) > 0.1


def test_a_derivative_that_an_expression_does_not_have_is_refused_by_name(scene: Scene) -> None:
    flat = apply(scene, {"joints.pivot.friction.mu": "{abs(mu - 0.12)}"})
    with pytest.raises(SceneError, match=r"joints\.pivot\.friction\.mu: abs has no derivative"):
        engine.sensitivity(flat, ["parameters.mu"], ["pivot.q[1]"], until=0.1)
    with pytest.raises(SceneError, match=r"parameters\.mu acts on simulation\.until, a setting of the run"):
        engine.sensitivity(apply(scene, {"simulation.until": "{mu*1 s}"}), ["parameters.mu"], ["pivot.q[1]"])


def test_parameters_are_found_from_measured_curves(scene: Scene) -> None:
    measured = engine.simulate(apply(scene, {"parameters.a": 0.7}), every=0.01, rtol=1e-9)
    found = engine.fit(scene, "parameters.a", measured.time, {"pivot.q[1]": measured["pivot.q[1]"]})
    assert found.values["parameters.a"] == pytest.approx(0.7, abs=1e-6)


def test_the_command_sets_a_parameter(tmp_path, capsys) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(TEXT)
    assert main(["simulate", str(file), "--set", "parameters.a=900mm", "-o", str(tmp_path / "arm.csv")]) == 0
    assert main(["simulate", str(file), "--set", "parameters.a=3 deg"]) == 2
    assert "a length is wanted" in capsys.readouterr().err
