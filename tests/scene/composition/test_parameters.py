"""A scene with parameters equals the scene with all numbers written out: in runs, sweeps, derivatives, fits and commands."""

from __future__ import annotations

import math

import numpy as np
import pytest

import trunnion
from tests.scene.valid_scene import ARM as TEXT
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.scene import scene_from_dict, scene_from_text, scene_to_dict, scene_to_yaml
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.expressions.parameter_dependence import DependentNumbers, unused_notes
from trunnion.scene.overrides import apply, list_parameters, parse_assignment

A, RADIUS, MU = 0.6, 8e-3, 0.12
WRITTEN = {
    "a": repr(A), "thick": repr(A / 15), "-a/2": repr(-A / 2), "mu": repr(MU), "pin": repr(RADIUS),
    "2*pin - 1 mm": repr(2 * RADIUS - 1e-3), "lift": repr(math.pi / 6),
}  # fmt: skip


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_from_text(TEXT)


def written_out() -> Scene:
    """The same scene with every number written out."""
    text = TEXT.replace('parameters: {a: 600 mm, thick: "{a/15}", mu: 0.12, pin: 8 mm, lift: 30 deg}', "")
    for expression, number in WRITTEN.items():
        text = text.replace('"{' + expression + '}"', number)
    assert '"' not in text
    return scene_from_text(text)


def test_a_scene_of_expressions_runs_to_the_same_bits_as_the_one_written_out(scene: Scene) -> None:
    plain = written_out()
    own = {p.path: p.value for p in list_parameters(scene) if not p.path.startswith("parameters.")}
    assert own == {p.path: p.value for p in list_parameters(plain)}
    assert np.array_equal(trunnion.simulate(scene).data, trunnion.simulate(plain).data)


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


def test_a_parameter_keeps_its_dimension_when_it_is_set(scene: Scene) -> None:
    with pytest.raises(SceneError, match=r"parameters\.a: .*an angle; a length is expected"):
        apply(scene, {"parameters.a": "3 deg"})
    with pytest.raises(SceneError, match=r"bodies\.arm\.box\[1\]: box\[1\] must be positive"):
        apply(scene, {"parameters.a": -1})


def test_a_sweep_over_a_parameter_is_the_sweep_over_the_numbers_that_follow_it(scene: Scene) -> None:
    keep = ["final:pivot.q[1]", "max:pivot.contact[1].normal_force"]
    lengths, mus = [0.5, 0.6, 0.7], [0.1, 0.2]
    swept = trunnion.sweep(scene, vary={"parameters.a": lengths, "parameters.mu": mus}, reductions=keep)
    following = {"box[1]": 1.0, "box[2]": 15.0, "box[3]": 15.0, "points.pivot[1]": -2.0}
    cases = [{f"bodies.arm.{k}": a / by for k, by in following.items()} | {"joints.pivot.friction.mu": mu}
             for a in lengths for mu in mus]  # fmt: skip
    listed = trunnion.sweep(written_out(), cases=cases, reductions=keep)
    assert all(swept.table[k].to_pylist() == listed.table[k].to_pylist() for k in keep)
    assert swept.table.schema.field("parameters.a").metadata[b"unit"] == b"m"
    again = swept.trajectory(4)
    assert again["pivot.q[1]"][-1] == swept.table[keep[0]][4].as_py()


def test_a_case_without_a_value_is_a_row_with_this_outcome(scene: Scene) -> None:
    rooted = apply(scene, {"joints.pivot.friction.mu": "{sqrt(mu)}"})
    table = trunnion.sweep(rooted, vary={"parameters.mu": [0.1, -0.1, 0.2]}, reductions=["final:pivot.q[1]"]).table
    assert [o != "done" for o in table["outcome"].to_pylist()] == [False, True, False]
    assert "has no value" in table["outcome.advice"][1].as_py()


def test_the_derivative_by_a_parameter_is_the_chain_rule_over_what_follows_it(scene: Scene) -> None:
    by = DependentNumbers(scene).slopes("a")
    sizes = {f"bodies.arm.box[{k}]": 1.0 if k == 1 else 1 / 15 for k in (1, 2, 3)}
    assert by == sizes | {"bodies.arm.points.pivot[1]": -0.5}
    one = trunnion.sensitivity(scene, ["parameters.a", *by], ["pivot.q[1]"], every=0.1)
    d = one.derivatives[:, 0]
    # derivatives with respect to start values have the errors of difference quotients
    assert d[:, 0] == pytest.approx(d[:, 1:] @ np.array(list(by.values())), rel=1e-9)
    assert one.parameter_units[0] == "m"
    assert abs(d[-1, 0]) > 0.1


def test_a_derivative_that_an_expression_does_not_have_is_refused_by_name(scene: Scene) -> None:
    flat = apply(scene, {"joints.pivot.friction.mu": "{abs(mu - 0.12)}"})
    with pytest.raises(SceneError, match=r"joints\.pivot\.friction\.mu: abs has no derivative"):
        trunnion.sensitivity(flat, ["parameters.mu"], ["pivot.q[1]"], until=0.1)
    with pytest.raises(SceneError, match=r"parameters\.mu acts on simulation\.until, a setting of the run"):
        trunnion.sensitivity(apply(scene, {"simulation.until": "{mu*1 s}"}), ["parameters.mu"], ["pivot.q[1]"])


def test_parameters_are_found_from_measured_curves(scene: Scene) -> None:
    measured = trunnion.simulate(apply(scene, {"parameters.a": 0.7}), every=0.01, rtol=1e-9)
    found = trunnion.fit(scene, "parameters.a", measured.time, {"pivot.q[1]": measured["pivot.q[1]"]})
    assert found.values["parameters.a"] == pytest.approx(0.7, abs=1e-6)


def test_a_number_that_is_small_by_chance_does_not_spoil_the_others(scene: Scene) -> None:
    odd = apply(scene, {"bodies.arm.points.pivot[2]": "{a - 600 mm + 1e-12 m}"})
    found = trunnion.sensitivity(odd, "parameters.a", ["pivot.q[1]"], every=0.2).derivatives[-1, 0, 0]
    step = 1e-4
    runs = [trunnion.simulate(apply(odd, {"parameters.a": A + d}), rtol=1e-12)["pivot.q[1]"][-1] for d in (-step, step)]
    assert found == pytest.approx((runs[1] - runs[0]) / (2 * step), rel=1e-4)  # the error of a difference of second order


def test_a_parameter_that_nothing_follows_is_noted(scene: Scene) -> None:
    assert unused_notes(scene) == []
    more = scene_from_text(TEXT.replace("mu: 0.12,", 'mu: 0.12, spare: 3 mm, half: "{spare/2}",'))
    assert [n.split(":")[0] for n in unused_notes(more)] == ["parameters.spare", "parameters.half"]


def test_the_command_sets_a_parameter(tmp_path, capsys) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(TEXT)
    assert main(["simulate", str(file), "--set", "parameters.a=900mm", "-o", str(tmp_path / "arm.csv")]) == 0
    assert main(["simulate", str(file), "--set", "parameters.a=3 deg"]) == 2
    assert "a length is expected" in capsys.readouterr().err
