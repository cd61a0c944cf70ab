"""Cases that ended early do not count as results. Buttons also work at the end of a motion and while the server is unreachable."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.http_servers import MU, SMALL, Served, eventually
from tests.service.page.chromium_tab import picture, show, until
from tests.service.page.job_states import report_stages
from tests.service.page.page_states import There
from tests.service.page.test_result_views import FORCE, GUIDE, HALF, grid, submitted
from trunnion.service.client.remote_jobs import Job

__all__ = ["grid"]
DATA = "document.getElementById('sweepplot').data"
AMBER = "getComputedStyle(document.documentElement).getPropertyValue('--amber').trim()"
CHIPS = """() => {
  const part = (x) => (x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
  const mixed = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
  const light = (color) => mixed(color.match(/[0-9.]+/g).map((x) => part(x / 255)));
  const clear = "rgba(0, 0, 0, 0)", back = (n) => getComputedStyle(n).backgroundColor;
  const ground = (n) => (back(n) === clear ? ground(n.parentElement) : back(n));
  const chips = document.querySelectorAll(".pill, .chips li, .chips button, .outcomes li, .stages li");
  return [...chips].filter((n) => n.offsetParent).map((n) => {
    const [a, b] = [light(getComputedStyle(n).color), light(ground(n))];
    return [n.className + n.textContent, (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05)];
  });
}"""
"""[text, contrast of the text] of each visible chip."""
SAME_COLOR = """(node, color) => {
  const other = document.createElement("p");
  other.style.color = color;
  document.body.append(other);
  return getComputedStyle(node).color === getComputedStyle(other).color;
}"""


@pytest.fixture(scope="module")
def early(served: Served) -> Job:
    """A job whose cases all end early."""
    return submitted(served, **SMALL | {"vary": {MU: "0.1:0.6:20"}, "until": 10, "max_steps": 20, "label": "early"})


def test_a_job_whose_cases_ended_early_is_amber_with_one_count_everywhere(page: Any, early: Job) -> None:
    assert early.document["outcomes"] == {"max_steps": 20}
    show(page, f"/jobs/{early.id}")
    until(page, f"{DATA}?.length")
    assert "20 of 20 ended early" in page.inner_text("#state")
    assert page.inner_text("#stages .early") == "Done"
    assert page.evaluate(f"{DATA}.map((t) => t.marker.symbol)") == ["triangle-up-open"]
    assert page.locator("#outcomes path[fill=none]").count() == 1
    assert "ended early" in page.inner_text("#sweepnote")
    picture(page, "early")
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)
        for address in (f"/jobs/{early.id}", "/jobs"):
            show(page, address)
            page.wait_for_selector(".stages li:visible, .pill:visible")
            faint = [(name, x) for name, x in page.evaluate(CHIPS) if x < 4.5]
            assert faint == [], (scheme, address)
    pill = page.locator(f".jobrow:has(a[data-job='{early.id}']) .pill")
    assert pill.inner_text() == "20 of 20 ended early"
    assert pill.evaluate(SAME_COLOR, page.evaluate(AMBER))


def test_cases_that_ended_early_have_hollow_marks_and_no_part_in_the_colours(page: Any, grid: Job) -> None:
    show(page, f"/jobs/{grid.id}?")
    page.wait_for_selector("#sweepplot .hm, #sweepplot .heatmaplayer")
    field, *marks = page.evaluate(f"{DATA}.map((t) => [t.x, t.y, t.z ?? t.marker.symbol])")
    rows = grid.to_arrow().to_pylist()
    whole = {(r[GUIDE], r[HALF]): r[FORCE] for r in rows if r["outcome"] == "done"}
    cells = ((x, y, z) for y, line in zip(field[1], field[2], strict=True) for x, z in zip(field[0], line, strict=True))
    drawn = {(x, y): z for x, y, z in cells if z is not None}
    assert drawn == pytest.approx(whole)
    assert 0 < len(whole) < len(rows)
    assert sum(len(m[0]) for m in marks) == len(rows) - len(whole)
    assert {m[2].endswith("-open") for m in marks} == {True}


def test_the_motion_plays_again_after_its_end_and_its_speeds_fit_a_narrow_screen(page: Any, grid: Job) -> None:
    wide = page.viewport_size
    page.set_viewport_size({"width": 320, "height": 700})
    try:
        show(page, f"/jobs/{grid.id}")
        play = page.frame_locator("#animation").locator("#play")
        play.wait_for()
        inside = "document.getElementById('animation').contentWindow"
        speed = page.evaluate(f"{inside}.document.getElementById('speed').getBoundingClientRect().toJSON()")
        assert 0 <= speed["left"] < speed["right"] <= page.evaluate(f"{inside}.innerWidth")
        for _ in range(2):
            # one call, because a slow machine would see the end of the motion before a second call
            button = f"{inside}.document.getElementById('play')"
            assert page.evaluate(f"({button}.click(), {button}.ariaPressed)") == "true"
            page.evaluate(f"{inside}.seek(1e9)")
            until(page, f"{inside}.document.getElementById('play').ariaPressed === 'false'")
    finally:
        page.set_viewport_size(wide)


def test_the_lit_stage_is_the_stage_of_the_job(page: Any, served: Served, early: Job) -> None:
    there = There(served, served, {"one": early})
    report_stages(page, there, {"stage": "starting"})
    show(page, f"/jobs/{early.id}")
    page.wait_for_selector("#stages .now")
    assert page.inner_text("#stages .now") == "Starting"
    assert page.locator("#stages .past").all_inner_texts() == ["Waiting"]
    page.unroute_all()


def test_a_job_cancelled_while_the_server_is_away_is_cancelled_when_it_answers(page: Any, tab: Any, served: Served) -> None:
    job = served.submit(SMALL | {"vary": {MU: "0.1:0.6:5000"}, "until": 1000.0, "every": 0.01})
    eventually(lambda: served.job(job)["state"] == "running")
    show(page, f"/jobs/{job}")
    page.wait_for_selector("#cancel:visible")
    page.route("**/*", lambda r: r.abort())
    page.click("#cancel")
    until(page, "document.getElementById('trouble').textContent.includes('as soon as the server answers')")
    assert served.job(job)["state"] == "running"
    page.unroute("**/*")
    assert served.ended(job)["state"] == "cancelled"
    until(page, "document.getElementById('state').textContent.startsWith('cancelled')")
    tab[1][:] = [e for e in tab[1] if "ERR_FAILED" not in e]


def test_a_setting_that_only_one_of_two_requests_names_is_the_default_of_the_other(page: Any, served: Served, early: Job) -> None:
    other = submitted(served, **SMALL | {"vary": {MU: "0.1:0.6:20"}, "rtol": 1e-5})
    show(page, f"/compare?jobs={early.id},{other.id}")
    page.wait_for_selector("#differences td:has-text('default')")
    assert "–" not in page.inner_text("#differences")
