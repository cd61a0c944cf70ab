"""Common variants of input by people and their tools: decimal commas, ``on`` for true, folders without a scene, other units."""

from __future__ import annotations

import math

import pytest

from tests.scene.valid_scene import VALID, edited, problems_in, problems_of
from trunnion.basics.errors import SceneError
from trunnion.scene import load_scene, model_names, scene_from_dict
from trunnion.scene.checks.unusual_magnitudes import USUAL, magnitude_notes
from trunnion.scene.file_format.yaml_writer import yaml_text

TEXT = yaml_text(VALID)


@pytest.mark.parametrize(("written", "meant"), [("2,5", "2.5"), ("2,5 kg", "2.5 kg"), ("-0,25", "-0.25"), ("1,250.5", "1250.5")])
def test_a_decimal_comma_is_reported(written, meant):
    (problem,) = problems_of(edited({"bodies.ball.mass": written}))
    assert "comma" in problem.what
    assert f'"{meant}"' in problem.hint


@pytest.mark.parametrize("written", ["2,5", "2,5 kg"])
def test_a_decimal_comma_between_braces_is_reported(written):
    (problem,) = problems_in(TEXT.replace("mass: 2,", f"mass: {written},"))
    assert "decimal comma" in problem.hint
    assert problem.line == 1 + TEXT[: TEXT.index("mass: 2,")].count("\n")


def test_the_key_on_is_read_as_other_yaml_tools_write_it():
    wanted = scene_from_dict(VALID)
    for word in (True, "True", "true"):
        data = edited({})
        for force in ("push", "twist"):
            data["forces"][force][word] = data["forces"][force].pop("on")
        assert scene_from_dict(data) == wanted
    for written in ("true:", "'on':", '"on":', "True:"):
        assert problems_in(TEXT.replace(" on:", f" {written}").replace("{on:", f"{{{written}")) == []


def test_a_scene_through_another_yaml_tool_is_the_same():
    yaml = pytest.importorskip("yaml")
    assert scene_from_dict(yaml.safe_load(TEXT)) == scene_from_dict(VALID)
    assert problems_in(yaml.safe_dump(yaml.safe_load(TEXT))) == []


def test_a_folder_without_a_scene_is_reported_with_the_files_it_has(tmp_path):
    with pytest.raises(SceneError) as e:
        load_scene(tmp_path)
    assert "the folder has no scene.yaml" in str(e.value)
    (tmp_path / "crane.yaml").write_text(TEXT)
    with pytest.raises(SceneError, match=r"crane\.yaml"):
        load_scene(str(tmp_path))


@pytest.mark.parametrize(("method", "hint"), [("euler", "rosenbrock"), ("rk4", "rk8"), ("", "rk5")])
def test_a_method_that_is_not_there_is_a_problem_of_the_scene(method, hint):
    (problem,) = problems_of(edited({"simulation.method": method}))
    assert problem.where == "simulation.method"
    assert hint in problem.hint


SELDOM = {
    "joints.hinge.start.q": (90, "90 deg"),
    "joints.shaft.start.q[2]": ("45 rad", "45 deg"),
    "bodies.arm.box[1]": (1000, "1000 mm"),
    "bodies.arm.points.tip[1]": (250, "250 mm"),
    "bodies.arm.density": (7.8, "7.8 g/cm^3"),
    "bodies.ball.mass": (1e9, "1e+09 g"),
    "gravity[3]": (-981, "-981 cm/s^2"),
    "joints.socket.friction.radius": (20, "20 mm"),
    "joints.hinge.friction.mu": (30, "30 %"),
    "bodies.block.inertia[1]": (2e9, "kg*mm^2"),
}


@pytest.mark.parametrize("path", SELDOM)
def test_a_number_that_is_allowed_but_seldom_meant_is_noted_and_is_no_problem(path):
    value, meant = SELDOM[path]
    changes = {path: value}
    if path.startswith("bodies.block"):
        changes |= {"bodies.block.inertia[2]": 2e9, "bodies.block.inertia[3]": 2e9}
    data = edited(changes)
    assert problems_of(data) == []
    notes = [n for n in magnitude_notes(scene_from_dict(data)) if n.startswith(f"{path}:")]
    assert len(notes) == 1
    assert meant in notes[0]


def test_usual_scenes_have_no_note_about_magnitudes():
    assert magnitude_notes(scene_from_dict(VALID)) == []
    assert [n for name in model_names() for n in magnitude_notes(load_scene(name))] == []


def test_an_angle_written_in_another_unit_is_meant():
    assert magnitude_notes(scene_from_dict(edited({"joints.hinge.start.q": "720 deg"}))) == []
    assert math.isclose(scene_from_dict(edited({"joints.hinge.start.q": "720 deg"})).joints["hinge"].start.q, 4 * math.pi)


def test_every_row_of_the_table_has_bounds_and_a_reason():
    assert all(u.least < u.most and u.because and u.meant for u in USUAL)


def test_notes_are_the_first_hundred():
    many = edited({f"bodies.arm.points.p{i}": [1000, 0, 0] for i in range(300)})
    notes = magnitude_notes(scene_from_dict(many))
    assert len(notes) == 101
    assert notes[-1] == "and 200 more numbers of this kind"


def test_a_folder_with_the_name_of_a_bundled_model_does_not_hide_it(tmp_path, monkeypatch):
    (tmp_path / "crank_slider").mkdir()
    monkeypatch.chdir(tmp_path)
    assert load_scene("crank_slider").name == "crank_slider"
