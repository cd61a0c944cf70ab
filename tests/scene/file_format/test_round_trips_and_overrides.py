"""A scene that is written and read again is the same scene. Overrides change only the values that they name."""

from __future__ import annotations

import dataclasses
import json
import random

import pytest

from tests.scalable_mechanisms import n_four_bar, revolute_chain
from tests.scene.valid_scene import VALID
from trunnion.basics.errors import SceneError
from trunnion.scene import load_scene, model_names, scene_from_dict, scene_from_text, scene_to_dict, scene_to_yaml
from trunnion.scene.data_classes.scene import AxisAngle
from trunnion.scene.overrides import apply, list_parameters, parse_assignment

SCENES = {
    **{name: load_scene(name) for name in model_names()},
    "one of everything": scene_from_dict(VALID),
    "n_four_bar(3)": n_four_bar(3),
    "chain(5)": revolute_chain(5),
}


@pytest.mark.default_cases(11)
@pytest.mark.parametrize("name", SCENES)
def test_a_scene_written_as_yaml_json_or_dict_reads_back_the_same(name):
    scene = SCENES[name]
    assert scene_from_text(scene_to_yaml(scene)) == scene
    assert scene_from_dict(scene_to_dict(scene)) == scene
    assert scene_from_text(json.dumps(scene_to_dict(scene)), is_json=True) == scene


@pytest.mark.parametrize("name", SCENES)
def test_writing_twice_gives_the_same_text(name):
    text = scene_to_yaml(SCENES[name])
    assert scene_to_yaml(scene_from_text(text)) == text


def test_random_numbers_survive_exactly():
    rng = random.Random(1)
    for _ in range(50):
        numbers = [rng.uniform(-1, 1) * 10 ** rng.randint(-300, 300) for _ in range(3)]
        scene = apply(SCENES["simple_pendulum"], {"bodies.bob.center": numbers})
        assert scene_from_text(scene_to_yaml(scene)).bodies["bob"].center == tuple(numbers)


@pytest.mark.parametrize(
    "title", ["", "yes", "1e3", "- x", "a: b", "#1", "it's", '"q"', "ünï\n\tcode", "null", " x ", "😀", "[", "\\"]
)
def test_any_title_survives(title):
    scene = dataclasses.replace(SCENES["simple_pendulum"], title=title)
    assert scene_from_text(scene_to_yaml(scene)).title == title


CHANGES = {
    "joints.ball.friction.mu": (0.5, 0.5),
    "joints.ball.friction.radius": ("30 mm", 0.03),
    "bodies.pendulum.density": ("2.7 g/cm^3", 2700.0),
    "bodies.pendulum.center[1]": (0.4, 0.4),
    "bodies.pendulum.points.tip[3]": (0.1, 0.1),
    "gravity[3]": (-1.62, -1.62),
    "joints.ball.start.qd[2]": ("3 rpm", pytest.approx(0.1 * 3.141592653589793)),
    "simulation.rtol": (1e-9, 1e-9),
    "friction.v_eps": ("1 mm/s", 1e-3),
}


@pytest.mark.parametrize("path", CHANGES)
def test_an_override_changes_the_number_it_names_and_no_other(path):
    value, expected = CHANGES[path]
    before = {p.path: p.value for p in list_parameters(SCENES["spherical_pendulum"])}
    after = {p.path: p.value for p in list_parameters(apply(SCENES["spherical_pendulum"], {path: value}))}
    assert after.pop(path) == expected
    before.pop(path)
    assert after == before


def test_overrides_take_words_lists_and_groups_and_fill_what_is_empty():
    scene = apply(
        SCENES["spherical_pendulum"],
        {
            "friction.normal_force": "adams",
            "joints.ball.friction.v_eps": "1 mm/s",
            "joints.ball.start.q": {"axis": "y", "angle": "88 deg"},
            "joints.ball.damping": [1, 1, 1],
        },
    )
    assert scene.friction.normal_force == "adams"
    assert scene.joints["ball"].friction.v_eps == 1e-3
    assert isinstance(scene.joints["ball"].start.q, AxisAngle)
    assert scene.joints["ball"].damping == (1.0, 1.0, 1.0)


def test_the_only_coordinate_may_be_named_with_or_without_its_index():
    one, two = (apply(SCENES["crank_slider"], {f"joints.guide.start.q{i}": "1400 mm"}) for i in ("", "[1]"))
    assert one == two
    assert one.joints["guide"].start.q == 1.4


WRONG = {
    "joints.bal.friction.mu": 'did you mean "ball"?',
    "joints.ball.frction.mu": 'did you mean "friction"?',
    "joints.ball.friction.nu": 'did you mean "joints.ball.friction.mu"?',
    "ball.friction.mu": 'did you mean "joints.ball.friction.mu"?',
    "gravity[4]": "has 3 entries",
    "gravity[0]": "not a path",
    "gravity": "a list of 3 is expected",
    "gravity.x": "is a list",
    "bodies.pendulum.density.x": "has no parts",
    "bodies[1]": "is not a list",
    "": "not a path",
    "a..b": "not a path",
    "joints.ball.start.q[2].x": "has no parts",
    "joints.ball.friction.law": "not known here",
    "joints.ball.friction.mu": "is a length; a plain number is expected",
    "joints.ball.start.qd[1]": "an angular velocity is expected",
}


@pytest.mark.parametrize("path", WRONG)
def test_a_wrong_override_says_what_is_wrong(path):
    with pytest.raises(SceneError) as e:
        apply(SCENES["spherical_pendulum"], {path: "3 m"})
    assert WRONG[path] in str(e.value)


def test_all_wrong_overrides_are_reported_at_once_and_the_result_is_checked():
    with pytest.raises(SceneError) as e:
        apply(SCENES["spherical_pendulum"], {"a.b": 1, "joints.ball.x": 2, "gravity[3]": 0})
    assert len(e.value.problems) == 2
    with pytest.raises(SceneError, match=r"joints\.ball\.friction\.mu: mu must not be negative"):
        apply(SCENES["spherical_pendulum"], {"joints.ball.friction.mu": -1})


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("joints.ball.friction.mu=0.5", ("joints.ball.friction.mu", 0.5)),
        (" gravity = [0, 0, -1.62 m/s^2] ", ("gravity", [0, 0, "-1.62 m/s^2"])),
        ("joints.ball.start.q[2] = 3 deg", ("joints.ball.start.q[2]", "3 deg")),
        ("friction.law=viscous", ("friction.law", "viscous")),
    ],
)
def test_an_assignment_is_read_as_it_would_stand_in_a_file(text, result):
    assert parse_assignment(text) == result


@pytest.mark.parametrize("text", ["mu", "mu=", "=3", "a=[1", "a={b: c: d}"])
def test_a_text_that_is_not_an_assignment_is_refused(text):
    with pytest.raises(SceneError):
        apply(SCENES["spherical_pendulum"], dict([parse_assignment(text)]))


def test_every_number_of_a_scene_is_listed_with_its_unit():
    units = {p.path: p.unit for p in list_parameters(SCENES["one of everything"])}
    assert units["bodies.arm.box[2]"] == "m"
    assert units["joints.hinge.start.q"] == "rad"
    assert units["joints.hinge.spring.stiffness"] == "N*m/rad"
    assert units["joints.hinge.end_stops.damping"] == "s/rad"
    assert units["joints.shaft.start.q[1]"] == "m"
    assert units["joints.shaft.start.qd[2]"] == "rad/s"
    assert units["joints.shaft.drive[2].constant.rate"] == "rad/s"
    assert units["joints.shaft.spring[1].stiffness"] == "N/m"
    assert units["joints.socket.start.q.axis[2]"] == "1"
    assert units["joints.socket.friction.viscosity"] == "s/m"
    assert units["joints.cross.friction.radius[2]"] == "m"
    assert units["joints.cross.effort[1].harmonic.amplitude"] == "N*m"
    assert units["joints.cross.effort[1].harmonic.frequency"] == "Hz"
    assert units["joints.flight.start.q[1]"] == "m"
    assert units["joints.flight.start.q[4]"] == "1"
    assert units["joints.rail.drive.table.value[2]"] == "m"
    assert units["forces.push.force[3]"] == "N"
    assert units["forces.twist.torque[3].ramp.end"] == "N*m"
    assert units["inputs.motor.start"] == "N*m"
    assert len(units) == len(list_parameters(SCENES["one of everything"]))


@pytest.mark.parametrize("name", SCENES)
def test_setting_any_number_to_itself_changes_nothing(name):
    scene = SCENES[name]
    assert apply(scene, {p.path: p.value for p in list_parameters(scene)}) == scene
