"""The starter scene loads without problems, explains the whole format, and never overwrites anything."""

from __future__ import annotations

import re

import pytest

from trunnion.basics.errors import SceneError
from trunnion.scene import load_scene, scene_from_text
from trunnion.scene.data_classes.type_tree import keys_at
from trunnion.scene.library.starter_scene import starter_text, write_starter


def test_a_new_scene_loads_without_problems_under_its_name(tmp_path):
    folder = write_starter("my_machine", tmp_path)
    assert sorted(p.name for p in folder.iterdir()) == ["README.md", "scene.yaml"]
    scene = load_scene(folder)
    assert scene.name == "my_machine"
    assert scene.joints["hinge"].friction is not None
    assert "my_machine" in (folder / "README.md").read_text()


def uncommented(text: str, pattern: str) -> str:
    """The text with the comment marks of some lines removed."""
    return re.sub(rf"^(\s*)# ({pattern})", r"\1\2", text, flags=re.M)


@pytest.mark.parametrize("line", ["damping:", "spring:", "end_stops:"])
def test_each_device_in_a_comment_works_when_the_mark_is_removed(line):
    scene = scene_from_text(uncommented(starter_text("a"), line))
    assert getattr(scene.joints["hinge"], line.rstrip(":")) is not None


def test_the_loads_and_inputs_in_comments_work_together():
    text = uncommented(starter_text("a"), "forces:|inputs:|effort:|friction:|outputs:|  push:|  rubber:|  motor:")
    scene = scene_from_text(text)
    assert set(scene.forces) == {"push", "rubber"}
    assert scene.inputs["motor"].unit == "N*m"
    assert scene.outputs == ("pendulum.*", "hinge.*")


def test_the_drive_in_a_comment_of_the_starter_scene_works():
    scene = scene_from_text(uncommented(starter_text("a"), "drive:"))
    assert scene.joints["hinge"].drive.constant.rate == pytest.approx(3.141592653589793)


def test_the_second_link_in_a_comment_works():
    text = starter_text("a")
    lines = [m[1] for m in re.finditer(r"^#  (   (?:link|elbow): .*)$", text, re.M)]
    assert len(lines) == 2
    text = text.replace("\njoints:\n", f"\n{lines[0].removeprefix(' ')}\njoints:\n{lines[1].removeprefix(' ')}\n")
    scene = scene_from_text(text)
    assert set(scene.bodies) == {"pendulum", "link"}


def test_the_starter_mentions_every_key_a_scene_can_have():
    text = starter_text("a")
    hidden = {"schema", "tunable", "ground"}
    for key in set(keys_at(())) - hidden:
        assert re.search(rf"\b{key}\b", text), key
    for key in set(keys_at(("joints", "*"))) - {"reference", "pitch", "cut", "pin"}:
        assert re.search(rf"\b{key}\b", text), key


def test_nothing_is_ever_overwritten(tmp_path):
    folder = write_starter("a", tmp_path)
    (folder / "scene.yaml").write_text("mine")
    with pytest.raises(SceneError, match="exists already"):
        write_starter("a", tmp_path)
    assert (folder / "scene.yaml").read_text() == "mine"


@pytest.mark.parametrize("name", ["", "1a", "a b", "../a", "a/b", "a.b", "é", "-x"])
def test_a_name_that_could_not_be_used_later_is_refused(name, tmp_path):
    with pytest.raises(SceneError, match="cannot be the name"):
        write_starter(name, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_is_a_problem(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SceneError, match="cannot write"):
        write_starter("a", tmp_path / "file")
