"""Limits of joints become end stops when the user gives a stiffness. Every interface treats limits alike."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

import trunnion
from trunnion.cli import main
from trunnion.importers import scene_of

STIFFNESS = 2e4
MJCF = """<mujoco><worldbody><body name="car">
  <joint name="track" type="slide" axis="0 0 1" ref="0.1" {said}/><geom size="0.1" mass="3"/></body></worldbody></mujoco>"""
URDF = """<robot name="lift"><link name="base"/>
  <link name="car"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="track" type="prismatic"><parent link="base"/><child link="car"/><axis xyz="0 0 1"/>
    <limit lower="-0.3" upper="0.2" effort="1" velocity="1"/></joint></robot>"""
SDF = """<sdf version="1.9"><model name="lift"><link name="car"><inertial><mass>3</mass></inertial></link>
  <joint name="track" type="prismatic"><parent>world</parent><child>car</child>
    <axis><xyz>0 0 1</xyz><limit><lower>-0.3</lower>{upper}</limit></axis></joint></model></sdf>"""
FILES = {
    "lift.urdf": URDF, "lift.xml": MJCF.format(said='range="-0.2 0.3"'), "lift.sdf": SDF.format(upper="<upper>0.2</upper>"),
}  # fmt: skip
"""The same mechanism in three formats. The coordinate of MJCF is 0.1 m where the coordinates of the other formats are zero."""
Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(name: str, text: str) -> Path:
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return written


@pytest.mark.parametrize("name", FILES)
def test_limits_are_stops_with_a_stiffness_and_a_note_without(name: str, write: Write) -> None:
    file = write(name, FILES[name])
    scene, notes = scene_of(file)
    assert scene.joints["track"].end_stops is None
    assert [n for n in notes if "limits of 1 joints left out" in n and n.endswith("track")]
    scene, notes = scene_of(file, stops=STIFFNESS)
    stops = scene.joints["track"].end_stops
    assert (stops.lower, stops.upper) == pytest.approx((-0.3, 0.2), abs=1e-15)
    assert not [n for n in notes if "limits" in n]
    deepest = trunnion.simulate(scene, until=0.4, every=1e-3, outputs=("track.q[1]",))["track.q[1]"].min()
    weight = 3 * 9.81  # the body falls 0.3 m onto its stop: m g (0.3 + x) = k x²/2
    want = -(weight + math.sqrt(weight**2 + 0.6 * STIFFNESS * weight)) / STIFFNESS
    missed = STIFFNESS * abs(want) / 3 * 0.5e-3**2 / 2  # largest depth that rows a millisecond apart can miss
    assert want <= deepest + 0.3 <= want + missed


def test_a_limit_may_be_on_one_side(write: Write) -> None:
    for upper in ("", "<upper>1e16</upper>"):
        stops = scene_of(write("lift.sdf", SDF.format(upper=upper)), stops=STIFFNESS)[0].joints["track"].end_stops
        assert (stops.lower, stops.upper) == (-0.3, None)


def test_ranges_count_as_the_file_says(write: Write) -> None:
    """In MJCF, "auto" enables a range unless the compiler element states otherwise."""
    for said, there in (('range="-1 1" limited="false"', False), ('range="-1 1" limited="true"', True), ("", False)):
        scene, notes = scene_of(write("lift.xml", MJCF.format(said=said)), stops=STIFFNESS)
        assert (scene.joints["track"].end_stops is not None) is there
        assert not [n for n in notes if "limits" in n]


def test_the_command_takes_a_stiffness(write: Write, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = write("lift.urdf", URDF)
    assert main(["import", str(file), "--end-stops", "2e4", "-o", str(tmp_path / "lift.yaml")]) == 0
    assert trunnion.load_scene(tmp_path / "lift.yaml").joints["track"].end_stops.stiffness == STIFFNESS
    assert "limits" not in capsys.readouterr().out
    for wrong in ("0", "-1", "stiff", "nan", "inf"):
        assert main(["import", str(file), f"--end-stops={wrong}"]) == 2
        assert f"{wrong!r} is not a stiffness" in capsys.readouterr().err
