"""The web page in headless Chromium. A scene is drawn and run, and its results are viewed. The page loads nothing from other
servers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import trunnion
from tests.service.http_servers import MU, ROOT, SMALL, Served, eventually
from tests.service.page.chromium_tab import PICTURES, picture, run, show, told, until, vary
from trunnion.kernel.interface.output_columns import columns
from trunnion.scene import load_scene
from trunnion.system.construction.system_builder import build

PLACE = """(() => {
  const box = document.querySelector("%s"), { xaxis: x, yaxis: y } = box._fullLayout, at = box.getBoundingClientRect();
  const t = box.data[0], [u, v] = [%s];
  return [at.left + x._offset + x.l2p(u), at.top + y._offset + v];
})()"""
FORCE = "max:ball.contact[1].normal_force"


def test_a_sweep_is_run_and_its_answers_are_plotted(page: Any) -> None:
    run(page, "0.1:0.6:26", "3")
    told(page, "done: 26 of 26")
    assert re.fullmatch(r".*/jobs/[0-9a-f]{24}(\?.*)?", page.url)
    until(page, "document.getElementById('sweepplot').data?.[0].x.length === 26")
    page.select_option("#up", FORCE)
    title = "document.getElementById('sweepplot').layout.{}axis.title.text.replaceAll('<br>', ' ')"
    until(page, f"{title.format('y')} === 'largest normal force at contact 1 of ball (N)'")
    assert page.evaluate(title.format("x")) == "coefficient of friction of ball"
    expected = trunnion.sweep("spherical_pendulum", {MU: "0.1:0.6:26"}, reductions=[FORCE], until=3.0)
    trace = page.evaluate("document.getElementById('sweepplot').data.map((t) => [t.mode, t.y, t.marker.symbol])")
    assert trace == [["markers", expected.table[FORCE].to_pylist(), "circle"]]  # no lines join the points
    page.fill("#cases", "25")
    until(page, "document.getElementById('casevalues').textContent.includes('= 0.6')")
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    picture(page, "sweep")
    for selector, place in (("#sweepplot", "t.x[9], y.l2p(t.y[9])"), ("#timeplot", "1.2, y._length / 2")):
        page.locator(selector).scroll_into_view_if_needed()
        page.mouse.click(*page.evaluate(PLACE % (selector, place)))
    until(page, "document.getElementById('moving').value === '9'")  # a click on a point plays the case of the point
    assert page.evaluate("document.getElementById('sweepplot').layout.annotations.length") == 1
    assert float(page.input_value("#at")) == pytest.approx(1.2, abs=0.01)
    page.click("#casetable summary")
    page.locator("#caserows thead button", has_text="largest").first.dblclick()  # the first double click sorts by the largest force
    page.fill("#filter", "done")
    until(page, "document.getElementById('caserowsnote').textContent === '26 cases'")
    first = page.locator("#caserows tbody input").first
    best = expected.table[FORCE].to_numpy().argmax()
    assert page.locator("#caserows tbody label").first.inner_text().strip() == str(best)
    first.check()
    until(page, f"document.getElementById('casevalues').textContent.includes('case {best}')")
    offered = page.eval_on_selector_all(".modebar-btn", "x => x.map((b) => b.dataset.title)")
    assert offered  # there are buttons, and none of them sends the plot to Plotly
    assert not [t for t in offered if "hare" in t or "loud" in t or "Studio" in t]
    assert page.evaluate("document.getElementById('sweepplot')._context.plotlyServerURL") == ""
    links = page.eval_on_selector_all("#downloads a", "x => x.map(a => a.getAttribute('href'))")
    assert [x.split("=")[1] for x in links[:4]] == ["csv", "parquet", "arrow", "json"]
    assert links[4].endswith("/request")
    for link, rows in (("#downloads", 26), ("#casedownloads", 3 * 100 + 1)):
        with page.expect_download() as d:
            page.click(f"{link} a:first-of-type")
        assert Path(d.value.path()).read_text().count("\n") == 1 + rows


def test_a_scene_is_run_once_and_its_motion_shown(page: Any) -> None:
    page.wait_for_selector("#jobverdict.good")
    page.check("input[value=once]")
    until(page, "document.getElementById('count').textContent === '1 case'")
    assert page.locator("#axes:visible, #addaxis:visible").count() == 0
    page.fill("#until", "0.5")
    page.click("#submit")
    told(page, "done: 1 of 1")
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    page.frame_locator("#animation").locator("#play").wait_for()
    picture(page, "once")
    page.click("#edit")
    page.wait_for_selector("#jobverdict.good")
    assert page.is_checked("input[value=once]")
    assert page.inner_text("#count") == "1 case"


def test_the_fields_of_a_range_and_its_text_say_the_same(page: Any) -> None:
    row = page.locator(".axis").first
    page.wait_for_selector("#jobverdict.good")
    for field, value in (("from", "0.2"), ("to", "0.4"), ("steps", "3")):
        row.locator(f".{field}").fill(value)
    until(page, "document.getElementById('count').textContent === '3 cases'")
    vary(page, "0.2, 0.3")
    until(page, "document.getElementById('count').textContent === '2 cases'")
    assert row.locator(".text").is_disabled()  # a list of values has no fields for a range
    page.check("input[value=sample]")
    vary(page, "0.2:0.3")
    row.locator(".text").click()
    assert row.locator(".range input:visible").evaluate_all("(all) => all.map((n) => n.value)") == ["0.2", "0.3"]
    assert "coefficient of friction of ball: now 0.6" in row.inner_text()


def test_the_start_is_shown_while_a_job_waits_and_then_its_first_finished_case_is_played(page: Any, served: Served) -> None:
    page.route("**/v1/jobs/*/results**", lambda r: r.fulfill(json={"columns": [], "rows": []}))
    job = served.submit(SMALL | {"vary": {MU: "0.1:0.6:3"}, "label": "watched"})
    show(page, f"/jobs/{job}")
    page.frame_locator("#animation").locator("#stage").wait_for()
    until(page, "document.getElementById('motionnote').textContent.startsWith('The start of the mechanism')")
    page.unroute("**/v1/jobs/*/results**")
    served.ended(job)
    page.reload()
    until(page, "document.getElementById('moving').value === '0'")
    until(page, "document.getElementById('sweepplot').layout?.annotations?.length === 1")


@pytest.mark.slow
def test_a_long_job_is_drawn_whole_while_it_grows_and_can_be_cancelled(page: Any, served: Served) -> None:
    """While the job runs, any column of the scene can be viewed. Missing cases are shown as missing."""
    run(page, "0.1:0.6:200000", "2")
    counted = "document.getElementById('sweepnote').textContent"
    until(page, f"{counted}.startsWith('All ')")
    before = page.inner_text("#sweepnote")
    until(page, f"{counted} !== {before!r}")
    assert page.locator("#stages .now").inner_text() == "Running"
    until(page, "document.getElementById('column').options.length > 0")
    offered = page.eval_on_selector_all("#column option", "x => x.map(o => o.value)")
    assert offered == [c.name for c in columns(build(load_scene("spherical_pendulum")).system)]
    page.select_option("#column", "pendulum.position[3]")
    page.click("#addcolumn")
    until(page, "document.getElementById('timeplot').data?.some((t) => t.name.startsWith('mass centre'))")
    page.fill("#cases", "199999")
    until(page, "document.getElementById('casevalues').textContent.includes('no result yet')")
    assert page.inner_text("#state").startswith("running")
    page.click("#cancel")
    told(page, "cancelled")
    job = page.url.split("/jobs/")[1][:24]
    done = served.job(job)["done"]
    until(page, f"{counted}.startsWith('All {done:,} cases, counted in cells')")
    picture(page, "long")


def test_mistakes_are_written_at_their_lines_and_fields_and_can_be_gone_to(page: Any) -> None:
    good = page.input_value("#scene")
    page.fill("#scene", good.replace("type: spherical", "type: sperical"))
    page.wait_for_selector("#verdict.bad li")
    line = 1 + good[: good.index("type: spherical")].count("\n")
    mark = page.locator("#marks .mark")
    assert "sperical" in mark.inner_text()
    box, text = mark.bounding_box(), page.locator("#scene").bounding_box()
    height, scrolled = page.evaluate("[parseFloat(getComputedStyle(document.getElementById('scene')).lineHeight), scene.scrollTop]")
    assert box["y"] - text["y"] + scrolled == pytest.approx(8 + (line - 1) * height, abs=3)  # 8 pixels are the editor's own margin
    assert page.is_disabled("#submit")
    assert "Correct the problems of the scene first" in page.inner_text("#jobverdict")
    picture(page, "mistakes")
    page.click("#verdict button >> nth=0")
    assert page.evaluate("[document.activeElement.id, String(getSelection())]") == ["scene", "    type: sperical"]
    page.fill("#scene", good)
    page.wait_for_selector("#verdict.good")
    assert page.locator("#marks .mark").count() == 0
    vary(page, "0.1:0.6")
    page.fill("#until", "-1")
    until(page, "document.getElementById('until').getAttribute('aria-invalid') === 'true'")  # the field before may be checked first
    assert page.locator("#jobverdict.bad li").count()
    assert "first:last:count" in page.inner_text(".axis .now")


@pytest.fixture(scope="module")
def earlier(served: Served) -> str:
    """A job that is in the list before the page loads."""
    return served.submit(SMALL | {"label": "an earlier one"})


@pytest.mark.slow
def test_everything_can_be_done_from_the_keyboard(earlier: str, page: Any) -> None:
    reached, on = set(), "(() => { const a = document.activeElement; return a.id || a.className || a.tagName; })()"
    page.wait_for_selector("#preview iframe:not(.behind)")
    page.evaluate("document.activeElement.blur()")
    while "label" not in reached:  # the label is the last field
        page.keyboard.press("Tab")
        reached.add(page.evaluate(on))
        assert page.evaluate("document.activeElement !== document.body")
    assert {"model", "submit", "scene", "path", "from", "to", "steps", "addaxis", "reductions", "until", "IFRAME"} <= reached
    for field, value in (("from", "0.2"), ("to", "0.3"), ("steps", "2")):
        page.locator(f".axis .{field}").focus()
        page.keyboard.press("Control+A")
        page.keyboard.type(value)
    page.fill("#until", "0.5")
    until(page, "document.getElementById('count').textContent === '2 cases'")
    page.locator("#until").press("Enter")
    told(page, "done: 2 of 2")
    assert page.evaluate("document.activeElement.id") == "jobtitle"
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    page.locator("#at").focus()
    page.keyboard.press("End")
    clock = "document.getElementById('animation').contentDocument?.getElementById('clock')?.textContent"
    until(page, f"{clock} === 't = 0.5000 s'")
    page.locator("nav a", has_text="Jobs").press("Enter")
    page.wait_for_selector("#joblist a")
    page.locator("#joblist a").first.focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    until(page, "document.getElementById('jobtitle').textContent !== '…' && location.pathname.startsWith('/jobs/')")
    page.go_back()
    page.wait_for_selector("#joblist a:visible")


TIMES = (0.3, 0.9, 1.4)


@pytest.mark.slow
def test_a_case_is_seen_moving_with_contact_points_in_place_and_forces_to_scale(page: Any, served: Served) -> None:
    run(page, "0.6", "2")
    told(page, "done: 1 of 1")
    page.wait_for_selector("#animation:visible")
    page.frame_locator("#animation").locator("#clock").wait_for()
    picture(page, "animation")
    address = page.get_attribute("#animationlink", "href")
    result = trunnion.simulate("spherical_pendulum", until=2.0)
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
        # the axis of the block points at its middle
        assert [seen["turn"][i] / 2 for i in (0, 3, 6)] == pytest.approx(middle, abs=1e-5)
        normal = [result[f"ball.contact[1].normal[{k}]"][row] for k in (1, 2, 3)]
        assert seen["normal"] == pytest.approx(normal, abs=1e-4)
        assert seen["point"] == pytest.approx([0.05 * n for n in normal], abs=1e-5)  # the contact is on the ball's surface
        force = result["ball.contact[1].normal_force"][row]
        assert seen["force"] == pytest.approx(force, rel=1e-4)
        assert 0.05 < seen["arrow"] * force < 1.0  # the arrow has a visible length beside a block of 1 m


def test_the_page_names_no_other_place() -> None:
    for file in (ROOT / "service" / "page").rglob("*.*"):
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
