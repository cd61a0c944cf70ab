"""Small defects of the page that were found in its pictures (``test_screenshots.py``)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.service.http_servers import Served
from tests.service.page.chromium_tab import show, until, vary
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
        until(page, f"{axis}[0] > 128")  # ink on dark is light
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
    assert not set(marks[0]) & set(curve[0])  # between its rows


@pytest.mark.slow
def test_while_a_check_takes_long_nothing_of_the_one_before_is_left_standing(page: Any) -> None:
    page.wait_for_selector("#jobverdict.good")
    held: list[Any] = []
    page.route("**/v1/jobs/check", lambda route: held.append(route))
    vary(page, "0.2, 0.4")
    until(page, "document.getElementById('jobverdict').textContent === 'Checking …'")
    assert page.inner_text("#count") == ""
    for route in held:
        route.continue_()
    page.unroute("**/v1/jobs/check")
    until(page, "document.getElementById('count').textContent === '2 cases'")


@pytest.mark.parametrize("size", [(1400, 900), (390, 844)])
def test_a_model_is_chosen_and_run_without_scrolling(page: Any, size: tuple[int, int]) -> None:
    wide = page.viewport_size
    page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    page.wait_for_selector("#preview iframe:not(.behind)")
    ends = [page.locator(x).bounding_box() for x in ("#model", "#submit", *(("#preview",) if size[0] > 900 else ()))]
    page.set_viewport_size(wide)
    assert all(b["y"] + b["height"] <= size[1] and b["x"] + b["width"] <= size[0] for b in ends)


def test_mistakes_in_what_is_to_be_best_are_told_where_they_were_made(page: Any) -> None:
    page.check("input[value=optimise]")
    page.select_option("#model", "double_pendulum")  # proposals for another model vanish with it
    until(page, "document.getElementById('goalof').value.includes('guide')")
    page.select_option("#goal", "reach")
    page.fill("#target", "4 kg")
    invalid = "[...document.querySelectorAll('[aria-invalid=true]')].map((x) => x.id)"
    until(page, f"{invalid}.join() === 'target' && document.getElementById('waynote').innerText.includes('4 kg')")
    page.fill("#target", "4 kN")
    page.fill("#within", "max:nothing = 1:2")
    until(page, f"{invalid}.join() === 'within'")
    page.fill("#within", "")
    until(page, f"!{invalid}.length && !document.getElementById('waynote').textContent")


def test_a_long_list_of_mistakes_is_reached_from_the_keyboard(page: Any) -> None:
    page.fill("#reductions", "max:nothing")
    page.wait_for_selector("#jobverdict.bad li")
    page.focus("#label")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.closest('#jobverdict')?.id") == "jobverdict"


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


def test_who_has_no_key_is_asked_for_one_and_sees_no_empty_form(page: Any, tab: tuple[Any, list[str]]) -> None:
    problem = {"title": "An API key is required", "status": 401, "problems": []}
    page.route("**/v1/**", lambda r: r.fulfill(status=401, json=problem, content_type="application/problem+json"))
    page.reload()
    page.wait_for_selector("#locked:visible")
    assert page.locator("#submit:visible").count() == 0
    assert page.evaluate("document.activeElement.id") == "key"
    page.unroute("**/v1/**")
    page.fill("#key", "anything")  # this server requires no key
    page.click("#keyform button")
    page.wait_for_selector("#submit:visible")
    tab[1][:] = [e for e in tab[1] if "401" not in e]


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
    assert page.evaluate(span, [1.0, 2.0, 1e6]) == {}  # too few rows for a usual range


def test_words_of_the_api_have_no_marks_of_markdown(page: Any) -> None:
    page.goto("/".join(page.url.split("/")[:3]) + "/docs")
    page.wait_for_selector("#operations[aria-busy=false]")
    assert "`" not in page.inner_text("#operations")
    assert page.locator("#operations > p code").count()
