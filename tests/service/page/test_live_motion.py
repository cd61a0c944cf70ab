"""The scene runs beside the editor. If the user drags a number or a point, the page writes the new value into the text, and shows
the motion of this text."""

from __future__ import annotations

import base64
import difflib
from typing import Any

import numpy as np
import pytest

from tests.service.page.chromium_tab import picture
from trunnion.plots.animation.viewer_data import content
from trunnion.plots.mechanism_pictures.instant_picture import needed
from trunnion.scene.scene_loader import scene_from_text
from trunnion.simulation.run import simulate

PLANAR = {
    "crank_slider": "crank.pin", "andrews": "K1.end", "crank_slider_free": "rod.end", "drawer": "drawer.handle",
    "friction_identification": "arm.tip", "hatch": "ground.foot", "n_four_bar": "crank0.tip", "quick_return": "ram.tool",
    "robot_arm": "fore.tool", "winch": "load.rope", "caught_carriage": "frame.foot", "spherical_pendulum": "pendulum.tip",
}  # fmt: skip
"""A point of each plane bundled mechanism whose scene gives points as numbers."""
PLACE = """(name) => {
  const all = handles.map((h) => `${h.part || "ground"}.${h.name}`), there = handleAt(handles[all.indexOf(name)], shown.m);
  return shown.cam.project(there.world).slice(0, 2);
}"""


def opened(page: Any, model: str) -> str:
    """Choose a model, and wait for its motion; returns its text."""
    page.wait_for_selector("#jobverdict.good")
    page.select_option("#model", model)
    settled(page)
    return str(page.input_value("#scene"))


def settled(page: Any) -> None:
    """Wait until the page has checked the text and shows its motion."""
    page.wait_for_timeout(700)  # the page waits for a pause in typing
    page.wait_for_selector("#jobverdict.good")
    page.wait_for_selector("#preview[aria-busy=false]")


def shown(page: Any) -> tuple[np.ndarray, np.ndarray]:
    """The times and rows of the motion in the picture."""
    times, rows, width = page.frames[-1].evaluate("[Array.from(times), Array.from(rows), width]")
    return np.array(times), np.reshape(rows, (-1, width))


def computed(text: str) -> tuple[np.ndarray, np.ndarray]:
    """The times and rows of a scene's run, as the viewer gets them."""
    scene = scene_from_text(text, name="scene")
    every = max(float(scene.simulation.every or 0.0), float(scene.simulation.until) / 1000)
    data = content(simulate(scene, every=every, outputs=needed(scene), kernel="parts"))
    times, rows = (np.frombuffer(base64.b64decode(data[k]), kind) for k, kind in (("times", "<f8"), ("rows", "<f4")))
    return times, rows.reshape(-1, data["width"])


def changed_words(old: str, new: str) -> list[tuple[str, str]]:
    """The differing lines of two texts."""
    lines = list(difflib.ndiff(old.splitlines(), new.splitlines()))
    return list(zip([x[2:] for x in lines if x[0] == "-"], [x[2:] for x in lines if x[0] == "+"], strict=True))


def agrees(page: Any) -> None:
    """Check that the picture shows the motion of the scene in the text, to the last bit of the rows."""
    for seen, right in zip(shown(page), computed(page.input_value("#scene")), strict=True):
        np.testing.assert_array_equal(seen, right)


def test_a_slider_writes_its_number_the_motion_follows_and_undo_restores_the_text(page: Any) -> None:
    text = opened(page, "spherical_pendulum")
    agrees(page)
    before = shown(page)[1]
    slider = page.locator("[id='slide-joints.ball.friction.mu']")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    for k in range(1, 9):
        page.mouse.move(box["x"] + box["width"] * (0.5 - 0.04 * k), box["y"] + box["height"] / 2)
    page.wait_for_selector("#preview[aria-busy=false]")
    assert np.abs(shown(page)[1] - before).max() > 0.1  # the motion changes while the mouse button is down
    agrees(page)
    picture(page, "dragged")
    page.mouse.up()
    settled(page)
    (old, new), = changed_words(text, page.input_value("#scene"))
    value = page.inner_text("output[for='slide-joints.ball.friction.mu']")
    assert old.replace("mu: 0.6", f"mu: {value}") == new != old
    agrees(page)
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    settled(page)
    agrees(page)
    while page.is_enabled("#undo"):
        page.keyboard.press("Control+Z")
    assert page.input_value("#scene") == text
    settled(page)
    np.testing.assert_array_equal(shown(page)[1], before)
    page.click("#redo")
    assert page.input_value("#scene") != text


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", PLANAR)
def test_a_point_dragged_on_the_grid_changes_its_coordinates_only_and_the_motion_is_that_of_the_text(page: Any, model: str) -> None:
    text = opened(page, model)
    page.click("#drag")
    frame = page.frames[-1]
    frame.wait_for_selector("#clock")
    page.locator("#preview").scroll_into_view_if_needed()
    (x, y), box = frame.evaluate(PLACE, PLANAR[model]), page.locator("#preview iframe").bounding_box()
    x, y = x + box["x"], y + box["y"]
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, 7):
        page.mouse.move(x + 2 * k, y - 2 * k)
    page.mouse.up()
    settled(page)
    (old, new), = changed_words(text, page.input_value("#scene"))
    name = PLANAR[model].split(".")[1]
    place = old.index("[", old.index(f"{name}:")), old.index("]", old.index(f"{name}:"))
    assert old[: place[0]] == new[: place[0]]
    assert new.endswith(old[place[1] :])
    was, now = (x[place[0] + 1 : x.index("]", place[0])].split(", ") for x in (old, new))
    assert 1 <= sum(a != b for a, b in zip(was, now, strict=True)) <= 2
    agrees(page)
    page.click("#undo")
    assert page.input_value("#scene") == text
    assert page.is_disabled("#undo")


@pytest.mark.slow
@pytest.mark.parametrize(("model", "path"), [("spherical_pendulum", "joints.ball.friction.mu"), ("drawer", "parameters.mu")])
def test_the_browser_runs_a_drag_by_webassembly_as_the_server_would(page: Any, model: str, path: str) -> None:
    opened(page, model)
    slider = page.locator(f"[id='slide-{path}']")
    with page.expect_response(lambda r: "scenes/module" in r.url, timeout=600_000) as answer:
        slider.press("ArrowRight")
    assert answer.value.status == 200
    settled(page)
    asked: list[str] = []
    page.on("request", lambda r: asked.append(r.url) if r.url.endswith("held=true") else None)
    box = slider.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.3, box["y"] + box["height"] / 2)
    page.wait_for_timeout(500)
    times, rows = shown(page)
    assert asked == []
    right = computed(page.input_value("#scene"))
    np.testing.assert_allclose(times, right[0], atol=1e-12)
    assert np.all(np.abs(rows - right[1]).max(axis=0) <= 1e-4 * np.abs(right[1]).max(axis=0) + 1e-6)
    page.mouse.up()
    settled(page)
    agrees(page)
