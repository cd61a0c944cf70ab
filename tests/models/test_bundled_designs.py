"""Every bundled design has a short scene, starts in its given position, and agrees with its hand calculation."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

import trunnion
from tests.models.reference_file_reader import columns_of, evaluate, expected
from tests.models.test_model_folders import LINK
from tests.models.test_reference_numbers import row
from tests.pictures.designer_model_picture_settings import DESIGNS
from tests.pictures.model_pictures import CURVES, MECHANISM
from trunnion.importers import scene_of_urdf
from trunnion.scene import load_scene, scene_from_text, scene_to_yaml
from trunnion.scene.library.model_folders import bundled_names, design_names, model_file, model_folder
from trunnion.scene.overrides import apply

PAGE = 60
CASES = [(m, i) for m in design_names() for i, _ in enumerate(expected(m))]
ALL = [
    "door_closer", "drawer", "folding_panel", "gear_train", "quick_return", "robot_arm", "scissor_lift", "stewart_platform",
    "toggle_press", "winch", "wishbone_corner",
]  # fmt: skip


def test_the_designs_are_all_there() -> None:
    assert design_names() == sorted(DESIGNS) == ALL
    assert bundled_names()[-len(ALL) :] == ALL


@pytest.mark.default_cases(8)
@pytest.mark.parametrize("name", design_names())
def test_a_design_fits_on_a_page_and_begins_with_its_question(name: str) -> None:
    lines = model_file(name).read_text(encoding="utf-8").splitlines()
    assert len(lines) <= PAGE
    assert lines[0].startswith("# ")
    assert lines[0].endswith("?")
    scene = load_scene(name)
    assert scene.name == name
    assert scene.title
    assert scene.parameters
    assert f"| [{name}]({name}/README.md)" in (model_folder(name).parent / "README.md").read_text(encoding="utf-8")
    assert f"| {len(lines)} |" in (model_folder(name).parent / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", design_names())
def test_the_readme_of_a_design_shows_both_pictures_and_how_to_run_it(name: str) -> None:
    text = (model_folder(name) / "README.md").read_text(encoding="utf-8")
    shown = {a or b for a, b in LINK.findall(text)}
    assert {MECHANISM, CURVES} <= shown
    assert all((model_folder(name) / file).is_file() for file in (MECHANISM, CURVES))
    assert f"    trunnion simulate {name}" in text
    assert "## Reference numbers" in text


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", design_names())
def test_a_design_starts_where_its_bodies_are_placed(name: str) -> None:
    scene = load_scene(name)
    run = trunnion.simulate(scene, until=1e-6, every=1e-6, outputs=["*.position*"])
    for body, b in scene.bodies.items():
        if b.position is not None and not any(b.center):
            assert [run[f"{body}.position[{k}]"][0] for k in (1, 2, 3)] == pytest.approx(b.position, abs=1e-14)


@pytest.mark.default_cases(5)
@pytest.mark.parametrize("name", design_names())
def test_a_design_written_out_is_the_same(name: str) -> None:
    scene = load_scene(name)
    assert scene_from_text(scene_to_yaml(scene)) == scene


@pytest.mark.default_cases(3)
@pytest.mark.parametrize(("name", "index"), CASES, ids=[f"{m}-{i}" for m, i in CASES])
def test_a_design_agrees_with_its_hand_calculation(name: str, index: int) -> None:
    e = expected(name)[index]
    names = tuple(dict.fromkeys(c for x in expected(name) for c in columns_of(x.value)))
    assert e.at is not None
    values = row(name, json.dumps(dict(e.set)), names, e.at)
    got = evaluate(e.value, values.__getitem__)
    assert e.origin.startswith("EXACT")
    assert abs(got - e.expect) <= e.tolerance, f"{e.value} at {e.at}: {got!r}, expected {e.expect!r} ({e.origin})"


# -- hand calculations at other sizes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [3.0, 25.0, 50.0])
def test_a_toggle_at_any_angle_leans_its_forces_by_the_friction_circles(degrees: float) -> None:
    lean = math.asin(2 * 0.02 * 0.15 / math.hypot(1, 0.15) / 0.4)
    sizes = {"parameters.mu": 0.15, "parameters.radius": 0.02, "parameters.length": "40 cm"}
    changes = sizes | {"parameters.angle": math.radians(degrees)}
    run = trunnion.simulate("toggle_press", until=1e-3, overrides=changes, outputs=["push.*"])
    assert run["push.drive.effort[1]"][0] == pytest.approx(-2e4 * math.tan(math.radians(degrees) + lean), rel=1e-12)


@pytest.mark.parametrize("degrees", [10.0, 30.0])
def test_a_lift_of_any_size_takes_the_torque_of_a_wedge(degrees: float) -> None:
    a, lead, rub = math.radians(degrees), math.atan(5 / (2 * math.pi * 9)), 0.2 / math.cos(math.radians(15))
    force = 9.81 * (2 * (350 + 2) + 4 * 15) / math.tan(a)
    wanted = force * 9e-3 * (math.tan(lead) + rub) / (1 - math.tan(lead) * rub)
    sizes = {"parameters.length": 1.4, "parameters.load": 350, "parameters.link": "15 kg"}
    changes = sizes | {"parameters.angle": a, "parameters.mu": 0.2}
    run = trunnion.simulate("scissor_lift", until=1e-3, overrides=changes, outputs=["motor.*"])
    assert run["motor.drive.effort[1]"][0] == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(("mu", "module", "sense"), [(0.1, 0.003, 1), (0.03, 0.001, -1)])
def test_a_hoist_of_any_size_takes_the_torque_of_its_wheels_moments(mu: float, module: float, sense: int) -> None:
    pinion, wheel, sun, planet = (module * z / 2 for z in (20, 50, 21, 30))
    rub = sense * mu * math.pi * module / 4
    inside = 350 * 9.81 * 0.03 / (3 * (1 + (planet - rub) / (planet + rub)) * (sun + planet))
    wanted = (pinion + rub) / (wheel - rub) * 3 * inside * (sun + rub)
    sizes = {"pinion": 20, "wheel": 50, "sun": 21, "planet": 30, "out": 15, "load": 350, "mu": mu, "module": module}
    changes = {f"parameters.{k}": v for k, v in (sizes | {"speed": 30 * sense}).items()}
    run = trunnion.simulate("gear_train", until=0.01, overrides=changes, outputs=["bearing.*"])
    assert run["bearing.drive.effort[1]"][-1] == pytest.approx(wanted, rel=1e-8)


def test_the_robot_arm_is_its_urdf() -> None:
    """The scene holds the imported contents of the file. It adds what URDF cannot express: load, motions, rotors, colours."""
    given, made = load_scene("robot_arm"), scene_of_urdf(model_folder("robot_arm") / "arm.urdf")[0]
    assert {n: replace(b, color=None) for n, b in given.bodies.items() if n != "carried"} == made.bodies
    bare = {n: replace(j, drive=None, rotor_inertia=None) for n, j in given.joints.items() if n != "grip"}
    assert bare == made.joints


def test_the_spring_of_a_wishbone_follows_the_load_and_the_arms() -> None:
    changes = {"parameters.load": "6 kN", "parameters.seat": 0.3, "parameters.arm": 0.45, "parameters.upright": 50}
    scene = apply(load_scene("wishbone_corner"), changes)
    run = trunnion.simulate(scene, until=1e-3, outputs=["corner*.drive.*"])
    assert abs(run["corner1_pivot.drive.effort[1]"][0]) < 1e-9
    assert abs(run["corner2_pivot.drive.effort[1]"][0]) < 1e-9
