"""Includes, assemblies and copies equal the scene for which they stand. Mistakes are reported at the place where the user wrote
them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.scene.valid_scene import problems_in, problems_of
from trunnion.basics.errors import Problem, SceneError
from trunnion.scene import load_scene, scene_from_dict, scene_from_text, scene_to_dict, scene_to_yaml
from trunnion.scene.composition import data_with_source_lines
from trunnion.scene.file_format.yaml_reader import MOST
from trunnion.scene.overrides import apply

ARM = """
parameters: {length: 0.5 m, mu: 0.1}
bodies:
  rod: {box: ["{length}", 20 mm, 20 mm], density: 7800, position: ["{length/2}", 0, 0], points: {end: ["{length/2}", 0, 0]}}
joints:
  pivot:
    {type: revolute, axis: y, inboard: ground, outboard: rod, at: [0, 0, 0],
     friction: {mu: "{mu}", radius: 8 mm, half_length: 2 cm}}
forces: {push: {type: force, on: rod.end, force: [0, 0, {input: load}]}}
inputs: {load: {start: 1 N, unit: N}}
points: {tip: rod.end}
"""
LEGS = """
parameters: {reach: 0.6 m}
assemblies:
  arm: {use: arm.yaml, with: {length: "{reach/2}"}, position: [0, 1, 0]}
bodies: {bob: {sphere: 30 mm, density: 7800, position: ["{reach/2}", 1, 0]}}
joints: {hook: {type: spherical, inboard: arm.tip, outboard: bob}}
simulation: {until: 0.2}
"""
HAND = """
parameters: {reach: 0.6 m, arm_length: "{reach/2}", arm_mu: 0.1}
bodies:
  bob: {sphere: 30 mm, density: 7800, position: ["{reach/2}", 1, 0]}
  arm_rod:
    box: ["{arm_length}", 20 mm, 20 mm]
    density: 7800
    position: ["{arm_length/2}", 1, 0]
    points: {end: ["{arm_length/2}", 0, 0]}
joints:
  hook: {type: spherical, inboard: arm_rod.end, outboard: bob}
  arm_pivot:
    {type: revolute, axis: y, inboard: ground, outboard: arm_rod, at: [0, 1, 0],
     friction: {mu: "{arm_mu}", radius: 8 mm, half_length: 2 cm}}
forces: {arm_push: {type: force, on: arm_rod.end, force: [0, 0, {input: arm_load}]}}
inputs: {arm_load: {start: 1 N, unit: N}}
simulation: {until: 0.2}
name: scene
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "arm.yaml").write_text(ARM)
    (tmp_path / "scene.yaml").write_text(LEGS)
    return tmp_path


def told(file: Path) -> list[Problem]:
    """The problems of a file."""
    with pytest.raises(SceneError) as e:
        load_scene(file)
    return list(e.value.problems)


def test_an_assembly_from_a_file_is_the_scene_written_out_to_the_last_bit(folder: Path) -> None:
    used, hand = load_scene(folder / "scene.yaml"), scene_from_text(HAND)
    assert {**scene_to_dict(used), "name": "scene"} == scene_to_dict(hand)
    again = scene_from_text(scene_to_yaml(used))
    first, *others = (trunnion.simulate(s).data for s in (used, hand, again))
    assert all(np.array_equal(first, o) for o in others)


def test_parameters_of_an_assembly_are_set_and_swept_and_follow_those_around_it(folder: Path) -> None:
    scene = load_scene(folder / "scene.yaml")
    assert apply(scene, {"parameters.reach": 1.0}).bodies["arm_rod"].box[0] == 0.5
    assert apply(scene, {"parameters.arm_mu": 0.3}).joints["arm_pivot"].friction.mu == 0.3
    table = trunnion.sweep(scene, vary={"parameters.reach": [0.5, 0.7]}, reductions=["final:arm_pivot.q[1]"]).table
    one = trunnion.simulate(apply(scene, {"parameters.reach": 0.7}))
    assert table["final:arm_pivot.q[1]"][1].as_py() == one["arm_pivot.q[1]"][-1]


def test_a_group_below_use_is_the_same_as_a_file(folder: Path) -> None:
    import yaml

    data = yaml.safe_load(LEGS)
    data["assemblies"]["arm"]["use"] = yaml.safe_load(ARM)
    assert scene_to_dict(scene_from_dict(data)) == {**scene_to_dict(load_scene(folder / "scene.yaml")), "name": "scene"}


# -- include -----------------------------------------------------------------------------------------------------------------------


def test_a_mimic_in_an_assembly_follows_the_joint_of_its_own_copy() -> None:
    wheel = "{mass: 1, inertia: [0.01, 0.01, 0.01], position: [0, 0, 0]}"
    shaft = "{type: revolute, axis: z, inboard: ground, outboard: BODY, at: [0, 0, 0]"
    text = f"""
bodies: {{}}
joints: {{}}
assemblies:
  g:
    use:
      bodies: {{a: {wheel}, b: {wheel}}}
      joints:
        lead: {shaft.replace("BODY", "a")}, start: {{qd: 1}}}}
        follow: {shaft.replace("BODY", "b")}, mimic: {{joint: lead, ratio: 2}}}}
    copies: {{line: {{times: 3, step: [0.1, 0, 0]}}}}
"""
    run = trunnion.simulate(scene_from_text(text), until=0.5, outputs=["*.q[1]"], overrides={"joints.g2_lead.start.qd": 3.0})
    assert [run[f"g{k}_follow.q[1]"][-1] for k in (1, 2, 3)] == pytest.approx([1.0, 3.0, 1.0], abs=1e-6)


def test_included_files_fill_what_the_scene_does_not_say(tmp_path: Path) -> None:
    (tmp_path / "world.yaml").write_text("title: world\ngravity: [0, 0, -1.62]\nfriction: {law: viscous, normal_force: adams}\n")
    (tmp_path / "more").mkdir()
    bodies = "bodies: {a: {sphere: 1, mass: 2}, b: {sphere: 1, mass: 1}}"
    (tmp_path / "more" / "bodies.yaml").write_text(f"include: ../inputs.json\n{bodies}")
    (tmp_path / "inputs.json").write_text(json.dumps({"inputs": {"u": {}}, "title": "from inputs"}))
    (tmp_path / "scene.yaml").write_text(
        "include: [world.yaml, more/bodies.yaml]\nbodies: {a: {mass: 3}}\nfriction: {law: coulomb}\n"
        "joints: {j: {type: free, inboard: ground, outboard: a}, k: {type: free, inboard: ground, outboard: b}}\n"
    )
    scene = load_scene(tmp_path)
    assert (scene.title, scene.gravity[2]) == ("from inputs", -1.62)
    assert (scene.friction.law, scene.friction.normal_force) == ("coulomb", "adams")
    assert (scene.bodies["a"].mass, scene.bodies["a"].sphere, scene.bodies["b"].mass, list(scene.inputs)) == (3, 1, 1, ["u"])
    assert scene.include == ()


def test_mistakes_inside_files_are_reported_with_their_file_and_line(folder: Path) -> None:
    arm, main = folder / "arm.yaml", folder / "scene.yaml"
    arm.write_text(ARM.replace("density: 7800", "densty: 7800").replace("radius: 8 mm", "radius: 8 kg"))
    main.write_text(LEGS.replace("sphere: 30 mm", "sphere: -30 mm"))
    found = [(p.where, Path(p.file).name, p.line) for p in told(main)]
    assert found == [
        ("bodies.bob.sphere", "scene.yaml", 5),
        ("bodies.arm_rod.densty", "arm.yaml", 4),
        ("joints.arm_pivot.friction.radius", "arm.yaml", 8),
    ]


def test_a_mistake_in_what_is_copied_is_reported_once(folder: Path) -> None:
    (folder / "arm.yaml").write_text(ARM.replace("radius: 8 mm", "radius: 8 kg"))
    (folder / "scene.yaml").write_text("assemblies: {arm: {use: arm.yaml, copies: {line: {times: 6, step: [0, 1, 0]}}}}")
    found = [(p.where, Path(p.file).name, p.line) for p in told(folder)]
    assert found == [("joints.arm1_pivot.friction.radius", "arm.yaml", 8)]


def test_a_file_that_cannot_be_read_as_yaml_is_reported_at_its_line(folder: Path) -> None:
    (folder / "arm.yaml").write_text("bodies:\n  a: [1\n")
    found = told(folder)
    assert (Path(found[0].file).name, found[0].line) == ("arm.yaml", 3)


FILES = {
    "no such file": ("include: nowhere.yaml", "cannot read"),
    "no scene file": ("include: /etc/passwd", "is not a scene file"),
    "itself": ("include: scene.yaml", "includes itself"),
    "a circle": ("include: circle.yaml", "includes itself"),
    "a list": ("include: list.yaml", "holds no group of keys"),
    "a number": ("include: 3", "the name of a file, or a list of them"),
    "a folder": ("include: folder.yaml", "cannot read"),
}


@pytest.mark.parametrize("case", FILES)
def test_a_file_that_cannot_be_included_gives_the_reason(case: str, tmp_path: Path) -> None:
    text, says = FILES[case]
    rest = "bodies: {a: {sphere: 1, mass: 2}}\njoints: {j: {type: free, inboard: ground, outboard: a}}\n"
    (tmp_path / "circle.yaml").write_text("include: scene.yaml\n")
    (tmp_path / "list.yaml").write_text("[1]\n")
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "scene.yaml").write_text(f"{text}\n{rest}")
    found = told(tmp_path)
    assert len(found) == 1
    assert says in str(found[0])


def test_text_and_data_read_no_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    for given in (problems_in(LEGS), problems_of({"include": ["arm.yaml"], "bodies": {}, "joints": {}})):
        assert "trunnion check FILE -o whole.yaml" in str(given[0])
        assert "is not read" in str(given[0])


WRONG = {
    "use: 3": ("assemblies.arm", "needs use"),
    "use: {bodies: {}}, wth: {}": ("assemblies.arm.wth", 'did you mean "with"?'),
    "use: {bodis: {}}": ("bodis", 'did you mean "bodies"?'),
    "use: {bodies: {}}, with: {a: 1}": ("assemblies.arm.with.a", "has no parameter"),
    "use: {bodies: {}}, copies: {times: 3}": ("assemblies.arm.copies", "one of mirror, rotate, line"),
    "use: {bodies: {}}, copies: {rotate: {times: 2.5}}": ("assemblies.arm.copies.rotate", "whole number"),
    "use: {bodies: {}}, copies: {rotate: {times: 3, ax: z}}": ("assemblies.arm.copies.rotate", 'did you mean "axis"?'),
    "use: {bodies: {}}, copies: {rotate: {times: 3, by: 2 kg}}": ("assemblies.arm.copies.rotate", "an angle is expected"),
    "use: {bodies: {}}, copies: {line: {times: 3}}": ("assemblies.arm.copies.line", '"step" is missing'),
    "use: {bodies: {}}, copies: {mirror: w}": ("assemblies.arm.copies.mirror", "is not an axis"),
    "use: {bodies: {}}, orientation: {axis: [1, 1, 0], angle: 1}": ("assemblies.arm", "about x, y or z"),
    "use: {bodies: {b: {sphere: 1, mass: 1}}}, copies: {mirror: x}": ("assemblies.arm.copies", "only placed bodies"),
    "use: {bodies: {rod: {sphere: 1, mass: 1}}}": ("assemblies.arm", "already used"),
    "use: {joints: {j: {type: free, inboard: ground, outboard: 'x{k}'}}}, copies: {line: {times: 2, step: [1, 0, 0]}}": (
        "assemblies.arm", "use only i"),
    "use: {joints: {j: {type: planar, axis: z, inboard: ground, outboard: b, start: {qd: [1, 2, 3]}}}}, copies: {mirror: x}": (
        "assemblies.arm.copies", "no mirror image"),
    "use: {forces: {f: {type: force, on: arm_rod, force: [{input: u}, 0, 0]}}}, copies: {rotate: {times: 2}}": (
        "assemblies.arm.copies", "cannot be turned"),
    "use: {joints: {j: {type: prismatic, axis: ['{u}', 1, 0], inboard: a, outboard: b, friction: {}}}}, copies: {mirror: x}": (
        "assemblies.arm.copies", "give it a reference"),
}  # fmt: skip


@pytest.mark.parametrize("spec", WRONG)
def test_a_wrong_assembly_is_reported_at_its_place(spec: str) -> None:
    where, says = WRONG[spec]
    rest = "bodies: {arm_rod: {sphere: 1, mass: 2}}\njoints: {j: {type: free, inboard: ground, outboard: arm_rod}}\n"
    found = problems_in(f"{rest}inputs: {{u: {{}}}}\nassemblies: {{arm: {{{spec}}}}}\n")
    assert any(p.where == where and says in str(p) for p in found), found
    assert {p.line for p in found} == {4}


def test_a_point_that_an_assembly_does_not_offer_is_reported_once(folder: Path) -> None:
    (folder / "scene.yaml").write_text(LEGS.replace("arm.tip", "arm.tp"))
    found = told(folder)
    assert [p.where for p in found] == ["joints.hook.inboard"]
    assert 'did you mean "tip"?' in str(found[0])


def test_copies_of_copies_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data_with_source_lines, "MOST", 10_000)  # building the scene would take seconds
    inner = "{use: {bodies: {b: {sphere: 1, mass: 1, position: [0, 0, 0]}}}, copies: {line: {times: 1000, step: [1, 0, 0]}}}"
    outer = f"{{use: {{assemblies: {{a: {inner}}}}}, copies: {{line: {{times: 1000, step: [0, 1, 0]}}}}}}"
    found = problems_in(f"assemblies: {{c: {outer}}}")
    assert f"more than {MOST} values" in str(found[0])
