"""Sections, transparency and traces of the animation; the flat picture without WebGL; the size of the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.plots.webgl_browser import NO_WEBGL, Opened, opened
from trunnion.plots.animation.html_or_film import SCRIPTS, VIEWER, page
from trunnion.plots.animation.viewer_data import MOST_BYTES, content
from trunnion.simulation.results.result import Result


@pytest.mark.slow
def test_a_section_leaves_out_what_is_beyond_it(shown: Opened) -> None:
    """With the plane at its far end, no body is visible. With the plane at its near end, all bodies are visible. With the plane
    half way, only the parts behind the plane are visible."""
    shown.do("run.joints.forEach((j) => { j.pins = []; j.contacts = []; }); run.rails.length = 0; things = prepared()")
    shown.do("look.parallel = true; along('side'); section('x')")

    def seen(cut: float) -> np.ndarray:
        shown.do(f"look.cutAt = {cut}")
        picture = shown.pixels()[..., :3]
        return np.asarray(np.ptp(picture, axis=2) > 25)  # coloured pixels show a body

    none, half, whole = (seen(c) for c in (0.0, 0.5, 1.0))
    shown.do("look.cut = ''")
    np.testing.assert_array_equal(seen(1.0), whole)
    assert none.sum() == 0
    assert 0.05 * whole.sum() < half.sum() < whole.sum()


@pytest.mark.slow
def test_glass_shows_what_is_inside(chrome: Any, press: Path) -> None:
    """Where arrows are within the links, the picture shows the arrows' colour faintly through solid bodies, and fully through
    glass."""
    page = opened(chrome, press, dots=1)
    arrows = "shown.m.contacts.map((c) => shown.cam.project(add(c.point, c.normal, 0.6 * c.force * run.arrow)))"
    inner = [tuple(map(int, p[:2])) for p in page.ask(arrows)]

    def strength() -> float:
        picture = page.pixels()[..., :3]
        return float(np.mean([picture[y, x, [0, 2]].sum() - 2 * picture[y, x, 1] for x, y in inner]))

    solid = strength()
    page.do("look.xray = true")
    assert strength() > solid + 20


def test_traces_pass_through_the_places_of_their_points(shown: Opened) -> None:
    shown.do("look.traces = true")
    traced = "{part: run.parts[t.part].name, path: t.path, past: past(t, times[10]).length}"
    found = shown.ask(f"paths().map((t) => ({traced}))")
    assert {t["part"] for t in found} == {"carriage", "knee", "ram", "upper", "lower"}
    carriage = next(t for t in found if t["part"] == "carriage")
    x = [p[0] for p in carriage["path"]]
    np.testing.assert_allclose(np.diff(x), -0.02 * 0.01, atol=1e-7)  # the drive moves the point at 20 mm/s; rows are 10 ms apart
    assert carriage["past"] == 12


# -- without a graphics card -----------------------------------------------------------------------------------------------------


def test_without_webgl_the_picture_is_flat_and_has_a_message(starts: Callable[..., Any], press: Path) -> None:
    plain = starts(*NO_WEBGL)
    page = opened(plain, press)
    assert page.ask("document.documentElement.dataset.drawn") == "flat"
    assert "no WebGL 2" in page.page.inner_text("#note")
    before = page.pixels("over")
    assert np.ptp(before[..., :3]) > 100
    page.page.focus("#stage")
    page.page.keyboard.press("d")
    assert np.abs(page.pixels("over") - before).max() > 50
    assert [w for w in page.wrong if "WebGL" not in w] == []


def test_a_lost_graphics_card_is_stood_in_for_until_it_is_back(chrome: Any, press: Path) -> None:
    page = opened(chrome, press)
    page.page.evaluate("window.lose = card.gl.getExtension('WEBGL_lose_context'); window.lose.loseContext()")
    page.until("card.gl.isContextLost()")
    page.do("")
    assert (page.pixels("over")[..., 3] > 200).mean() > 0.01
    page.page.evaluate("window.lose.restoreContext()")
    page.until("card && !card.gl.isContextLost()")
    assert np.ptp(page.pixels()[..., :3], axis=2).max() > 50
    assert (page.pixels("over")[..., 3] > 200).mean() < 0.01


# -- the file --------------------------------------------------------------------------------------------------------------------


def test_the_file_is_the_rows_and_less_than_a_hundred_kilobytes_of_program(swing: Result) -> None:
    program = sum((VIEWER / name).stat().st_size for name in (*SCRIPTS, "page.html", "style.css"))
    assert program < 100_000
    data = content(swing)
    rows = len(data["rows"]) + len(data["times"])
    assert rows <= MOST_BYTES * 4 / 3 * 1.1
    assert len(page(swing).encode()) < program + rows + 200_000


def test_every_script_is_short_and_in_the_page(swing: Result) -> None:
    text = page(swing)
    for name in SCRIPTS:
        lines = (VIEWER / name).read_text(encoding="utf-8").splitlines()
        assert len(lines) < 250
        assert lines[0].startswith("// ")
        assert lines[0] in text
    assert {f.name for f in VIEWER.glob("*.js")} == set(SCRIPTS)
