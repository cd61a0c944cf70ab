"""The animation is one file that shows the run's own numbers."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.engine.mechanisms.rod_ladder import LENGTH, ladder
from trunnion.basics.errors import SceneError
from trunnion.plots import animate, mechanism
from trunnion.plots.animation.html_or_film import page
from trunnion.plots.animation.viewer_data import MOST_BYTES, MOST_ROWS, content, thinned
from trunnion.plots.geometry.motion_and_view import motion
from trunnion.plots.mechanism_pictures.instant_picture import needed
from trunnion.scene import load_scene
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate


def test_the_page_fetches_nothing(swing: Result) -> None:
    text = page(swing)
    assert not re.findall(r"https?://|@import|<link|<img|src=", text)
    assert "default-src 'none'" in text


def test_the_page_carries_the_rows_of_the_run(swing: Result) -> None:
    data = content(swing)
    times = np.frombuffer(base64.b64decode(data["times"]), "<f8")
    rows = np.frombuffer(base64.b64decode(data["rows"]), "<f4").reshape(-1, data["width"])
    np.testing.assert_array_equal(times, swing.time)
    contact = data["joints"][0]["contacts"][0]
    np.testing.assert_allclose(rows[:, contact["force"]], swing["ball.contact[1].normal_force"], rtol=1e-6)
    np.testing.assert_allclose(rows[:, data["parts"][0]["channel"]], swing["pendulum.position[1]"], rtol=1e-5, atol=1e-7)
    assert json.dumps(data["events"][0]["text"], ensure_ascii=False) in page(swing)


def test_springs_between_points_are_shown_from_end_to_end() -> None:
    """Both springs of the governor are shown as the parts that the scene names. Their initial length equals the length that the
    geometry gives."""
    run = simulate("governor", until=0.01)
    data = content(run)
    parts = [p["name"] for p in data["parts"]]
    moved = motion(run, parts)
    assert len(data["springs"]) == 2
    for ends, spring in zip(data["springs"], run.scene.forces.values(), strict=True):
        assert [parts[e["part"]] for e in ends] == [b.split(".")[0] for b in spring.between]
        (p, r), (q, t) = (moved.pose(e["part"], 0) for e in ends)
        line = q + t @ ends[1]["point"] - p - r @ ends[0]["point"]
        # the spring closes a triangle with two sides of 0.5 at 60 degrees
        assert np.linalg.norm(line) == pytest.approx(0.5, abs=1e-9)
    assert "[run.springs, run.rods].map" in page(run)


def test_rods_are_shown_as_lines_of_their_length() -> None:
    """The viewer's data contain the rods, and a picture shows them."""
    run = simulate(ladder(), until=0.4, every=0.1, outputs=(*needed(ladder()), "r0.*"))
    data = content(run)
    moved = motion(run, [p["name"] for p in data["parts"]])
    [ends] = data["rods"]
    for row in range(len(run)):
        p, q = (r @ e["point"] + x for e in ends for x, r in (moved.pose(e["part"], row),))
        assert np.linalg.norm(q - p) == pytest.approx(LENGTH, rel=1e-6)
    lines = [line.get_xydata() for line in mechanism(run, 0.2).axes[0].lines]
    assert any(len(line) == 2 and np.linalg.norm(line[1] - line[0]) == pytest.approx(LENGTH, rel=0.3) for line in lines)


def test_long_runs_are_thinned_but_keep_both_sides_of_every_event(pendulum: Result) -> None:
    t = np.linspace(0, 4, 50_001)
    data = np.zeros((len(t), pendulum.data.shape[1]))
    data[:, 0] = t
    long = replace(pendulum, data=data)
    rows = thinned(long, 40)
    assert len(rows) <= MOST_ROWS
    assert (rows[0], rows[-1]) == (0, len(t) - 1)
    for e in long.events:
        after = int(np.searchsorted(t, e.time))
        assert {after - 1, after} <= set(rows)
    assert len(thinned(long, 10_000)) * 4 * 10_000 <= 2 * MOST_BYTES


def test_titles_cannot_break_out_of_the_page(pendulum: Result) -> None:
    evil = replace(pendulum, scene=replace(pendulum.scene, title="</script><script>alert(1)</script>"))
    assert "<script>alert" not in page(evil)


def test_a_result_without_positions_is_a_problem(pendulum: Result, tmp_path: Path) -> None:
    few = replace(pendulum, data=pendulum.data[:, :2], columns=pendulum.columns[:1])
    with pytest.raises(SceneError, match="orientation"):
        animate(few, tmp_path / "x.html")
    assert list(tmp_path.iterdir()) == []


def chromium() -> str:
    """The browser. Without a browser the test is skipped, or fails if the browser is required."""
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not found:
        if "chromium" in os.environ.get("TRUNNION_REQUIRE", ""):
            pytest.fail("chromium is required (TRUNNION_REQUIRE) and not installed")
        pytest.skip("chromium is not installed (apt-get install chromium)")
    return found


def shown(browser: str, file: Path, query: str, tmp_path: Path) -> str:
    """The page's text after its scripts have run."""
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    command = [browser, *flags, profile, "--virtual-time-budget=2000", "--dump-dom", f"file://{file}{query}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr[-1000:]
    return done.stdout


@pytest.mark.parametrize("query", ["?t=1.5", "#t=1.5"])
def test_a_browser_opens_a_viewer_file_from_disk_at_the_time_asked_for(swing: Result, tmp_path: Path, query: str) -> None:
    browser = chromium()
    text = shown(browser, animate(swing, tmp_path / "swing.html"), query, tmp_path)
    row = int(np.argmin(np.abs(swing.time - 1.5)))
    assert "t = 1.50" in text
    cells = re.findall(r"<td>([^<]*)</td>", text)
    force = float(cells[cells.index("contact[1].normal_force") + 1])
    angle = float(cells[cells.index("contact[1].angle") + 1])
    assert force == pytest.approx(swing["ball.contact[1].normal_force"][row], rel=1e-3)
    assert angle == pytest.approx(np.degrees(swing["ball.contact[1].angle"][row]), rel=1e-3)
    assert len(re.findall(r"<span[^>]*left:", text)) == len(swing.events)
    assert "slipping" in text


def test_friction_that_follows_no_load_needs_no_contacts_to_be_seen() -> None:
    """The page refuses patterns without a match, so it must not require contacts. A door whose seal has friction can then be
    animated."""
    scene = load_scene("door_closer")
    run = simulate(scene, until=0.05, every=0.05, outputs=needed(scene))
    assert content(run)["joints"][0]["contacts"] == []


def test_joints_that_have_no_values_take_no_place_beside_the_picture() -> None:
    """The 15 fixed joints of a robot of 30 joints must not come first, open and empty."""
    pivots = {f"pivot{k}": sm.Joint("revolute", f"base{k}", f"arm{k}", axis="y") for k in range(2)}
    mounts = {f"mount{k}": sm.Joint("fixed", "ground", f"base{k}") for k in range(6)}
    body = sm.Body(mass=1.0, inertia=(1.0, 1.0, 1.0), center=(0.1, 0.0, 0.0))
    scene = sm.Scene({**{f"base{k}": body for k in range(6)}, "arm0": body, "arm1": body}, mounts | pivots, "robot")
    joints = content(simulate(scene, until=0.01, outputs=needed(scene)))["joints"]
    assert {j["name"] for j in joints if j["panel"]} == {j["name"] for j in joints if j["values"]} == set(pivots)
