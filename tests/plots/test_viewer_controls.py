"""The animation works with mouse, touch and keyboard, in light and dark, on a desktop and on a phone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.plots.webgl_browser import DESK, PHONE, Opened, opened
from trunnion.plots import animate
from trunnion.plots.mechanism_pictures.instant_picture import needed
from trunnion.scene import load_scene
from trunnion.simulation.run import simulate

READABLE = 4.5
"""Contrast of text that readers with weak sight need (WCAG 2.1, 1.4.3)."""
FINGER = 44
"""Smallest size in pixels of a button for fingers (WCAG 2.1, 2.5.5)."""
FIT = {"wishbone_corner": 0.5, "governor": 0.5}
"""A wide mechanism, and a tall one that spins, with the times of their runs, s."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fits")
    out = {}
    for name, until in FIT.items():
        scene = load_scene(name)
        out[name] = animate(simulate(scene, until=until, every=until / 50, outputs=needed(scene)), folder / f"{name}.html")
    return out


def test_every_control_is_reached_and_used_by_the_keyboard(shown: Opened) -> None:
    inputs = "[...document.querySelectorAll('button, select, input, #stage')]"
    controls = set(shown.ask(f"{inputs}.filter((e) => e.offsetParent).map((e) => e.id)"))
    reached = set()
    for _ in range(3 * len(controls)):
        shown.page.keyboard.press("Tab")
        reached.add(shown.ask("document.activeElement.id"))
    assert {"stage", "play", "scrub", "speed", "xray", "section", "traces", "night", "help"} <= controls <= reached
    for name in ("labels", "xray", "section", "traces", "follow", "parallel", "numbers", "night"):
        shown.page.focus(f"#{name}")
        before = shown.page.get_attribute(f"#{name}", "aria-pressed")
        shown.page.keyboard.press("Space")
        assert {before, shown.page.get_attribute(f"#{name}", "aria-pressed")} == {"true", "false"}


def test_keys_turn_move_zoom_and_step(shown: Opened) -> None:
    shown.page.focus("#stage")

    def changed(key: str, what: str) -> bool:
        before = shown.ask(f"JSON.stringify({what})")
        shown.page.keyboard.press(key)
        return bool(shown.ask(f"JSON.stringify({what})") != before)

    assert all(changed(k, "view.toward") for k in "adws")
    assert all(changed(f"Shift+{k}", "view.shift") for k in "ADWS")
    assert all(changed(k, "view.zoom") for k in "+-")
    assert changed("ArrowRight", "clock.t")
    assert shown.ask("clock.t === times[1]")
    assert changed("End", "clock.t")
    assert all(changed(k, "view.toward") for k in ("1", "2", "3", "r"))
    assert changed("]", "look.arrows")
    shown.page.keyboard.press("?")
    assert shown.ask("document.getElementById('keys').open")
    shown.page.keyboard.press("Escape")
    assert not shown.ask("document.getElementById('keys').open")


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", ["front", "side", "top"])
def test_views_along_axes_are_right_handed_and_level(shown: Opened, which: str) -> None:
    shown.do(f"along('{which}')")
    axes = np.array(shown.ask("[view.right, view.up, view.toward]"))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert abs(axes[0] @ shown.ask("run.up")) < 1e-12


def test_one_finger_turns_the_view_and_two_fingers_zoom_it(chrome: Any, press: Path) -> None:
    page = opened(chrome, press, "", PHONE, has_touch=True, is_mobile=True)
    touch = page.page.context.new_cdp_session(page.page)

    def send(kind: str, *spots: tuple[float, float]) -> None:
        fingers = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(spots)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})

    before = page.ask("view.toward")
    send("touchStart", (150, 300))
    send("touchMove", (220, 330))
    send("touchEnd")
    assert np.linalg.norm(np.subtract(page.ask("view.toward"), before)) > 0.1
    send("touchStart", (150, 300), (200, 300))
    send("touchMove", (100, 300), (250, 300))
    send("touchEnd")
    assert page.ask("view.zoom") > 1.5


CORNERS = """Array.from(times, (t) => {
  const m = moment(t), cam = camera(m);
  return run.parts.flatMap((p, i) => {
    const v = run.meshes[p.mesh].v, out = [], b = m.poses[i];
    for (let k = 0; k < v.length; k += 3) out.push(cam.project(add(b.p, apply(b.r, [v[k], v[k + 1], v[k + 2]]))).slice(0, 2));
    return out;
  });
}).flat()"""


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
@pytest.mark.parametrize("name", FIT)
def test_the_whole_motion_fits_the_free_part_of_the_window(
    name: str, size: dict[str, int], chrome: Any, files: dict[str, Path]
) -> None:
    """At every row, every projected corner of every body is within the window and outside all controls. The picture is large
    enough: it takes more than half of the width or the height."""
    page = opened(chrome, files[name], "", size)
    f, spots = page.ask("free()"), np.array(page.ask(CORNERS))
    low, high = spots.min(axis=0), spots.max(axis=0)
    assert f["x"] <= low[0] <= high[0] <= f["x"] + f["w"]
    assert f["y"] <= low[1] <= high[1] <= f["y"] + f["h"]
    assert max((high[0] - low[0]) / f["w"], (high[1] - low[1]) / f["h"]) > 0.5
    assert page.wrong == []


def test_buttons_are_large_enough_for_fingers_and_nothing_is_wider_than_a_phone(chrome: Any, press: Path) -> None:
    page = opened(chrome, press, "?section=view", PHONE)
    inputs = "[...document.querySelectorAll('button, select, input')].filter((e) => e.offsetParent)"
    boxes = page.ask(f"{inputs}.map((e) => [e.id, e.getBoundingClientRect().width, e.getBoundingClientRect().height])")
    assert len(boxes) > 12
    assert [b for b in boxes if min(b[1:]) < FINGER] == []
    assert page.ask("document.documentElement.scrollWidth") <= PHONE["width"]
    assert not page.page.locator("#values").is_visible()
    page.page.click("#numbers")
    assert page.page.locator("#values").is_visible()
    assert page.ask("$('values').getBoundingClientRect().bottom <= $('foot').getBoundingClientRect().top")


def luminance(rgb: np.ndarray) -> float:
    """Relative luminance (WCAG 2.1)."""
    c = np.where(rgb / 255 <= 0.04045, rgb / 255 / 12.92, ((rgb / 255 + 0.055) / 1.055) ** 2.4)
    return float(c @ [0.2126, 0.7152, 0.0722])


def contrast(a: np.ndarray, b: np.ndarray) -> float:
    x, y = sorted((luminance(a), luminance(b)))
    return (y + 0.05) / (x + 0.05)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_and_arrows_stand_out_in_both_themes(scheme: str, chrome: Any, press: Path) -> None:
    page = opened(chrome, press, color_scheme=scheme)
    assert page.ask("document.documentElement.dataset.theme") == scheme
    colors = {k: np.array(v) * 255 for k, v in page.ask("inks()").items()}
    assert (luminance(colors["paper"]) < 0.5) == (scheme == "dark")
    corner = page.pixels()[30, 5, :3]
    np.testing.assert_allclose(corner, colors["paper"], atol=12)
    color = "getComputedStyle(document.querySelector(s)).color.match(/[0-9.]+/g).slice(0, 3).map(Number)"
    words = page.ask(f"['#title', '#caption', '#clock', '#values b', '#legend', '#xray'].map((s) => {color})")
    assert [w for w in words if contrast(np.array(w), colors["paper"]) < READABLE] == []
    ramp = [np.array(page.ask(f"ramp({x})")) * 255 for x in (0.3, 0.5, 0.75, 1.0)]
    assert [c for c in ramp if contrast(c, colors["paper"]) < 3.0] == []  # WCAG 2.1, 1.4.11: contrast of graphics


@pytest.mark.slow
def test_nothing_moves_by_itself_for_who_wants_less_motion(chrome: Any, press: Path) -> None:
    assert not opened(chrome, press, "?play=1", reduced_motion="reduce").ask("clock.playing")
    assert opened(chrome, press, "?play=1", reduced_motion="no-preference").ask("clock.playing")


def test_every_joint_has_its_values_and_closed_ones_are_reported(shown: Opened) -> None:
    count = shown.ask("run.joints.length")
    assert shown.page.locator("#values details").count() == count
    closed = shown.page.locator("#values details:not([open])").count()
    assert f"{closed} of {count} joints" in shown.page.inner_text("#values")
    shown.page.locator("#values details:not([open]) summary").first.click()
    shown.until(f"document.querySelectorAll('#values details[open] table').length === {count - closed + 1}")
    assert shown.page.locator("#values details[open] svg").count() == shown.page.locator("#values tr").count()
