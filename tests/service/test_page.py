"""The web page in headless Chromium: a scene is chosen, a sweep run, its answers looked at. Nothing comes from elsewhere."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import engine
from engine.kernel.columns import columns
from engine.scene import load_scene
from engine.system.build import build
from tests.service.conftest import missing
from tests.service.serving import MU, ROOT, SMALL, Served, eventually

PICTURES = os.environ.get("TRUNNION_PICTURES", "")
"""A folder to leave screenshots in, to be looked at."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError as e:
        missing("chromium", f"playwright cannot be imported: {e}")
    system = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with sync_playwright() as p:
        try:
            b = p.chromium.launch(executable_path=system, args=["--no-sandbox"])
        except Error as e:
            missing("chromium", f"no browser: {str(e).splitlines()[0]}")
        yield b
        b.close()


@pytest.fixture(scope="module")
def tab(browser: Any, served: Served) -> Iterator[tuple[Any, list[str]]]:
    """A tab, and what its pages log as errors or ask anyone else for. One for all tests: a new one compiles all scripts anew."""
    context = browser.new_context(viewport={"width": 1500, "height": 1000})
    context.set_default_timeout(60_000)
    p = context.new_page()
    errors: list[str] = []
    home = f"http://127.0.0.1:{served.port}"
    p.on("console", lambda m: errors.append(m.text) if m.type == "error" and "422" not in m.text else None)
    p.on("pageerror", lambda e: errors.append(str(e)))
    p.on("request", lambda r: None if r.url.startswith((home, "data:", "blob:")) else errors.append(f"asked for {r.url}"))
    yield p, errors
    context.close()


@pytest.fixture
def page(tab: tuple[Any, list[str]], served: Served) -> Iterator[Any]:
    """The page, loaded anew; the test fails when it logs an error or asks anyone else for anything."""
    p, errors = tab
    errors.clear()
    p.goto(f"http://127.0.0.1:{served.port}")
    p.wait_for_selector("body[data-ready]")
    yield p
    p.goto("about:blank")  # what it still does ends here
    assert errors == []


def until(page: Any, true: str) -> None:
    """Wait until an expression holds (asked from here: the page's policy lets nothing be evaluated in it again and again)."""
    eventually(lambda: page.evaluate(f"() => {true}"), 60.0)


def picture(page: Any, name: str) -> None:
    if PICTURES:
        page.screenshot(path=str(Path(PICTURES) / f"{name}.png"), full_page=True)


def run(page: Any, values: str, until: str) -> None:
    page.locator(".values").first.fill(values)
    page.fill("#until", until)
    page.wait_for_selector("#jobverdict.good")
    page.wait_for_timeout(500)
    page.wait_for_selector("#jobverdict.good")
    page.click("#submit")


def test_a_sweep_is_run_and_its_answers_are_plotted(page: Any) -> None:
    page.wait_for_selector("#verdict.good")
    run(page, "0.1:0.6:26", "3")
    until(page, "document.getElementById('state').textContent.startsWith('done: 26 of 26')")
    page.wait_for_selector("#sweepplot .scatterlayer .trace")
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    until(page, "document.getElementById('sweepplot').data[0].x.length === 26")
    page.select_option("#up", "max:ball.contact[1].normal_force")
    page.fill("#case", "25")
    until(page, "document.getElementById('casevalues').textContent.includes('0.6')")
    expected = engine.sweep("spherical_pendulum", {MU: "0.1:0.6:26"}, reductions=["max:ball.contact[1].normal_force"], until=3.0)
    shown = page.evaluate("document.getElementById('sweepplot').data[0].y")
    assert shown == expected.table["max:ball.contact[1].normal_force"].to_pylist()
    page.wait_for_timeout(600)
    picture(page, "sweep")
    links = page.eval_on_selector_all("#downloads a", "x => x.map(a => a.getAttribute('href'))")
    assert [x.split("=")[1] for x in links[:4]] == ["csv", "parquet", "arrow", "json"]
    assert links[4].endswith("/request")
    for link, rows in (("#downloads", 26), ("#casedownloads", 3 * 100 + 1)):
        with page.expect_download() as d:
            page.click(f"{link} a:first-of-type")
        assert Path(d.value.path()).read_text().count("\n") == 1 + rows


def test_a_long_job_is_seen_growing_and_can_be_cancelled(page: Any) -> None:
    """Any column of the scene can be looked at meanwhile, and cases that are not there yet are said to be not there."""
    page.wait_for_selector("#verdict.good")
    run(page, "0.1:0.6:200000", "2")
    drawn = "document.getElementById('sweepplot').data?.[0].x.length ?? 0"
    until(page, f"({drawn}) > 0")
    before = page.evaluate(f"() => {drawn}")
    until(page, f"({drawn}) > {before}")
    until(page, "document.getElementById('column').options.length > 0")
    offered = page.eval_on_selector_all("#column option", "x => x.map(o => o.value)")
    assert offered == [c.name for c in columns(build(load_scene("spherical_pendulum")).system)]
    page.select_option("#column", "pendulum.position[3]")
    until(page, "document.querySelector('#timeplot .ytitle')?.textContent === 'pendulum.position[3] (m)'")
    page.fill("#case", "199999")
    until(page, "document.getElementById('casevalues').textContent.includes('not there')")
    assert page.inner_text("#state").startswith("running")
    page.click("#cancel")
    until(page, "document.getElementById('state').textContent.startsWith('cancelled')")
    assert "Cases 0 to 19,999 of 200,000" in page.inner_text("#sweepnote")
    picture(page, "long")


def test_mistakes_are_shown_as_they_are_typed_and_can_be_gone_to(page: Any) -> None:
    good = page.input_value("#scene")
    page.fill("#scene", good.replace("mu: 0.6", "mu: -0.6").replace("type: spherical", "type: sperical"))
    page.wait_for_selector("#verdict.bad li")
    text = page.inner_text("#verdict")
    assert "spherical" in text
    assert page.is_disabled("#submit")
    assert "scene has to be right first" in page.inner_text("#jobverdict")
    picture(page, "mistakes")
    page.click("#verdict button >> nth=0")
    assert page.evaluate("document.activeElement.id") == "scene"
    page.fill("#scene", good)
    page.wait_for_selector("#verdict.good")
    page.locator(".values").first.fill("0.1:0.6")
    page.wait_for_selector("#jobverdict.bad li")
    assert "first:last:count" in page.inner_text("#jobverdict")


@pytest.fixture(scope="module")
def earlier(served: Served) -> str:
    """A job that is in the list before the page is loaded."""
    return served.submit(SMALL)


def test_everything_can_be_done_from_the_keyboard(earlier: str, page: Any) -> None:
    reached = set()
    page.evaluate("document.activeElement.blur()")
    for _ in range(45):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate("document.activeElement.id || document.activeElement.className || document.activeElement.dataset.job")
        )
    assert {"model", "scene", "path", "values", "addaxis", "reductions", "until", "submit"} <= reached
    page.locator(".values").first.focus()
    page.keyboard.press("Control+A")
    page.keyboard.type("0.2, 0.3")
    page.fill("#until", "0.5")
    until(page, "document.getElementById('jobverdict').textContent === '2 cases'")
    page.locator("#until").press("Enter")
    until(page, "document.getElementById('state').textContent.startsWith('done: 2 of 2')")
    assert page.evaluate("document.activeElement.id") == "jobtitle"
    page.locator("#joblist button").first.focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    page.wait_for_selector("#joblist li:nth-child(2) button[aria-current=true]")


TIMES = (0.3, 0.9, 1.4)


def test_a_case_is_seen_moving_with_contact_points_in_place_and_forces_to_scale(page: Any, served: Served) -> None:
    page.wait_for_selector("#verdict.good")
    run(page, "0.6", "2")
    until(page, "document.getElementById('state').textContent.startsWith('done: 1 of 1')")
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    page.click("#animate")
    page.wait_for_selector("#animation:visible")
    frame = page.frame_locator("#animation")
    frame.locator("#clock").wait_for()
    picture(page, "animation")
    address = page.get_attribute("#animationlink", "href")
    result = engine.simulate("spherical_pendulum", until=2.0)
    for t in TIMES:
        page.goto(f"http://127.0.0.1:{served.port}{address}?t={t}")
        page.wait_for_selector("#clock")
        if PICTURES:
            page.screenshot(path=str(Path(PICTURES) / f"moving-{t}.png"))
        seen = page.evaluate(
            f"(() => {{ const m = moment({t}); const c = m.contacts[0]; return {{turn: m.poses[0].r, middle: m.poses[0].p, "
            "point: c.point, normal: c.normal, force: c.force, arrow: run.arrow}; })()"
        )
        row = int(abs(result.time - t).argmin())
        middle = [result[f"pendulum.position[{k}]"][row] for k in (1, 2, 3)]
        assert seen["middle"] == pytest.approx(middle, abs=1e-5)
        assert [seen["turn"][i] / 2 for i in (0, 3, 6)] == pytest.approx(middle, abs=1e-5)  # the block's axis points at its middle
        normal = [result[f"ball.contact[1].normal[{k}]"][row] for k in (1, 2, 3)]
        assert seen["normal"] == pytest.approx(normal, abs=1e-4)
        assert seen["point"] == pytest.approx([0.05 * n for n in normal], abs=1e-5)  # on the ball's surface
        force = result["ball.contact[1].normal_force"][row]
        assert seen["force"] == pytest.approx(force, rel=1e-4)
        assert 0.05 < seen["arrow"] * force < 1.0  # metres of arrow beside a block of 1 m


def test_the_page_names_no_other_place() -> None:
    for file in (ROOT / "service" / "page").glob("*.*"):
        if file.suffix in (".html", ".js", ".css"):
            assert not re.findall(r"https?://(?!www\.w3\.org)", file.read_text()), file


def test_the_api_is_described_and_tried_on_a_page_that_needs_nothing_from_elsewhere(browser: Any, served: Served) -> None:
    page, elsewhere = browser.new_page(viewport={"width": 1000, "height": 900}), []
    page.on("request", lambda r: None if r.url.startswith(str(served.client.base_url)) else elsewhere.append(r.url))
    page.on("pageerror", lambda e: elsewhere.append(str(e)))
    page.goto(f"{served.client.base_url}/docs")
    page.locator("#check_job summary").first.click()
    page.locator("#check_job button.main").click()
    eventually(lambda: "columns" in page.locator("#check_job pre").first.inner_text())
    page.locator("#list_models summary").click()
    page.locator("#list_models button.main").click()
    eventually(lambda: "spherical_pendulum" in page.locator("#list_models pre").first.inner_text())
    if PICTURES:
        page.screenshot(path=f"{PICTURES}/docs.png", full_page=True)
    names = page.evaluate("[...document.querySelectorAll('main details[id]')].map((d) => d.id)")
    assert len(names) == len(set(names)) > 20
    assert elsewhere == []
    page.close()
