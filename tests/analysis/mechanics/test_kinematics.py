"""Driven mechanisms move as geometry requires, for any masses and without masses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from trunnion import SceneError, kinematics, load_scene, simulate
from trunnion.cli import main

CRANK, ROD, RATE = 0.1, 0.35, 7.0
SLIDER = f"""
schema: 1
bodies:
  crank: {{points: {{pin: [{CRANK}, 0, 0]}}}}
  rod: {{points: {{end: [{ROD}, 0, 0]}}}}
  slider: {{}}
joints:
  pivot: {{type: revolute, axis: z, inboard: ground, outboard: crank, drive: {{constant: {{rate: {RATE}}}}}}}
  pin: {{type: revolute, axis: z, inboard: crank.pin, outboard: rod, start: {{q: 0}}}}
  wrist: {{type: revolute, axis: z, inboard: rod.end, outboard: slider}}
  guide:
    {{type: prismatic, axis: x, inboard: ground, outboard: slider, friction: {{mu: 0.3, half_length: 0.05, RUB}}}}
""".replace("RUB", "half_width: 0.02, half_height: 0.02")


def test_a_crank_slider_without_masses_goes_where_geometry_takes_it(tmp_path: Path) -> None:
    file = tmp_path / "slider.yaml"
    file.write_text(SLIDER)
    r = kinematics(str(file), until=2.0)
    q = RATE * r.time
    sine, cosine, root = np.sin(q), np.cos(q), np.sqrt(ROD**2 - CRANK**2 * np.sin(q) ** 2)
    place = CRANK * cosine + root
    slope = -CRANK * sine - CRANK**2 * sine * cosine / root
    bend = -CRANK * cosine - CRANK**2 * (cosine**2 - sine**2) / root - CRANK**4 * sine**2 * cosine**2 / root**3
    assert r["guide.q[1]"] == pytest.approx(place, abs=1e-9)
    assert r["guide.qd[1]"] == pytest.approx(RATE * slope, abs=1e-8)
    assert r["guide.qdd[1]"] == pytest.approx(RATE**2 * bend, abs=1e-7)
    assert not [n for n in r.names if "reaction" in n or "friction" in n or "energy" in n]
    with pytest.raises(SceneError, match="no mass"):
        load_scene(str(file))


def test_masses_friction_and_loads_do_not_change_the_kinematics() -> None:
    scene = load_scene("crank_slider")
    a, b = kinematics(scene, until=0.5), simulate(scene, until=0.5)
    names = [n for n in a.names if ".q" in n or "position" in n or "acceleration" in n]
    for n in names:
        assert a[n] == pytest.approx(b[n], abs=1e-5 * max(1.0, np.abs(b[n]).max())), n  # the tolerance of the run is 1e-6


def test_freedoms_that_nothing_drives_are_reported() -> None:
    with pytest.raises(SceneError, match=r"not driven, among .*guide\.q\[1\]"):
        kinematics("double_pendulum")
    driven = load_scene("crank_slider")
    loose = replace(driven, joints={n: replace(j, drive=None) for n, j in driven.joints.items()})
    with pytest.raises(SceneError, match="1 freedom is not driven"):
        kinematics(loose)


def test_the_command_writes_tables_and_pictures(tmp_path: Path) -> None:
    file, out, picture = tmp_path / "slider.yaml", tmp_path / "motion.csv", tmp_path / "motion.png"
    file.write_text(SLIDER)
    assert main(["kinematics", str(file), "--until", "0.5", "-o", str(out), "--plot", str(picture)]) == 0
    assert "guide.qdd[1]" in out.read_text()
    assert picture.stat().st_size > 10_000
    assert main(["kinematics", "double_pendulum"]) == 2
