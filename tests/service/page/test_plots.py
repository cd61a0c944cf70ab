"""Plots of the page: colours, marks of events, titles, scales."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.service.http_servers import Served
from tests.service.page.chromium_tab import show, until
from tests.service.page.page_states import GUIDE
from tests.service.page.test_result_views import grid, submitted, three
from trunnion.service.client.remote_jobs import Job

__all__ = ["grid", "three"]
DATA = "document.getElementById('{}').data"


@pytest.mark.slow
def test_drawings_change_to_the_dark_colours_with_the_page(page: Any, three: Job) -> None:
    show(page, f"/jobs/{three.id}")
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    first = "getComputedStyle(document.documentElement).getPropertyValue('--c0').trim()"
    drawn = (f"{DATA.format('sweepplot')}[0].marker.color", f"{DATA.format('timeplot')}[0].line.color",
             "document.querySelector('#outcomes li:nth-child({}) path').getAttribute('fill')")  # fmt: skip
    chip = drawn[2].format(1 + list(three.document["outcomes"]).index("done"))
    axis = "[...document.querySelector('#parallel canvas').getContext('2d').getImageData(76, 200, 1, 1).data].slice(0, 3)"
    light = page.evaluate(f"[{first}, {axis}]")
    assert page.evaluate(f"[{drawn[0]}, {drawn[1]}, {chip}]") == [light[0]] * 3
    try:
        page.emulate_media(color_scheme="dark")
        assert page.evaluate(first) != light[0]
        for what in (*drawn[:2], chip):
            until(page, f"{what} === {first}")
        until(page, f"{axis}[0] > 128")  # axes on a dark page are light
        assert light[1][0] < 128
    finally:
        page.emulate_media(color_scheme="light")


@pytest.mark.slow
def test_marks_of_events_lie_on_the_curve_however_far_apart_its_rows_are(page: Any, served: Served) -> None:
    over = {GUIDE: [0.1]}
    job = submitted(served, vary=over, until=0.5, every=0.05)
    show(page, f"/jobs/{job.id}")
    until(page, f"{DATA.format('timeplot')}?.length === 2")
    curve, marks = page.evaluate(f"{DATA.format('timeplot')}.map((t) => [t.x, t.y])")
    assert len(marks[0]) > 0
    assert marks[1] == pytest.approx(np.interp(marks[0], *curve))
    assert not set(marks[0]) & set(curve[0])  # the events are between rows of the curve


@pytest.mark.slow
def test_a_scale_of_colours_below_a_map_leaves_its_titles_alone(page: Any, grid: Job) -> None:
    wide = page.viewport_size
    page.set_viewport_size({"width": 390, "height": 844})
    try:
        show(page, f"/jobs/{grid.id}")
        page.wait_for_selector("#sweepplot .colorbar")
        title = page.locator("#sweepplot .xtitle").bounding_box()
        words, scale = (page.locator(f"#sweepplot {s}").bounding_box() for s in (".cbtitle", ".cbfills"))
        plot = page.locator("#sweepplot").bounding_box()
        assert title["y"] + title["height"] <= words["y"]
        assert words["y"] + words["height"] <= scale["y"] + 1
        assert page.locator("#sweepplot .colorbar").bounding_box()["height"] + words["y"] <= plot["y"] + plot["height"]
    finally:
        page.set_viewport_size(wide)


def test_titles_are_broken_into_like_lines_and_notes_are_sentences(page: Any) -> None:
    words = "import('/page/basics/axis_labels.js').then((w) => w.{})"
    title = "largest normal force at contact 1 of guide (N)"
    lines = page.evaluate(words.format(f"lines('{title}')")).split("<br>")
    assert " ".join(lines) == title
    assert min(map(len, lines)) > 0.6 * max(map(len, lines))
    assert page.evaluate(words.format("lines('short (m)')")) == "short (m)"
    parts = "import('/page/basics/requests_and_dom.js').then((m) => m.breaking('a.b: 0.15').filter((x) => typeof x === 'string'))"
    assert page.evaluate(parts) == ["a.", "b:", " 0.15"]
    assert page.evaluate(words.format("sentences(['none is left', '', 'So it is.'])")) == "None is left. So it is."


def test_a_few_values_far_beyond_the_others_do_not_take_all_colours(page: Any) -> None:
    values = [float(x) for x in np.linspace(100.0, 300.0, 99)]
    span = "(values) => import('/page/plots/heat_map.js').then((m) => m.span(values))"
    assert page.evaluate(span, values) == {}
    got = page.evaluate(span, [*values, 13_000.0, None])
    assert got["zmin"] == 100.0
    assert 290.0 < got["zmax"] <= 300.0
    assert page.evaluate(span, [1.0, 2.0, 1e6]) == {}  # three values are too few for a usual range
