"""Views of jobs on the page: the start of a scene, the cursor that moves the mechanism, maps, selections, comparison of jobs. The
tests also check messages while the server is unreachable, and accessibility."""

from __future__ import annotations

from typing import Any

import pytest

import trunnion
from tests.service.conftest import missing
from tests.service.http_servers import MU, ROOT, Served, eventually
from tests.service.page.chromium_tab import picture, run, show, told, until, vary
from trunnion.scene.library.model_folders import bundled_names
from trunnion.service.client.remote_jobs import Job, connect

GUIDE, HALF, RADIUS = (f"joints.guide.friction.{n}" for n in ("mu", "half_length", "radius"))
FORCE = "max:guide.contact[1].normal_force"


def submitted(served: Served, **body: Any) -> Job:
    given = {"scene": "double_pendulum", "reductions": [FORCE, "count:any"], "until": 0.1} | body
    return connect(str(served.client.base_url)).job(served.ended(served.submit(given))["id"])


@pytest.fixture(scope="module")
def grid(served: Served) -> Job:
    return submitted(served, vary={GUIDE: "0.05:0.9:9", HALF: "0.1:0.4:5"}, label="grid")


@pytest.fixture(scope="module")
def three(served: Served) -> Job:
    ranges = {GUIDE: [0.05, 0.9], HALF: [0.1, 0.4], RADIUS: [0.03, 0.06]}
    return submitted(served, sample={"ranges": ranges, "count": 60}, label="three")


def test_the_start_of_a_scene_is_drawn_beside_it_and_again_when_it_is_changed(page: Any) -> None:
    def drawn() -> Any:
        page.wait_for_selector("#preview[aria-busy=false]")
        return page.frames[-1].evaluate("[moment(0).poses[0].p, moment(0).contacts.map((c) => c.point), view.zoom]")

    result = trunnion.simulate("spherical_pendulum", until=0.01)
    middle, places, _ = drawn()
    assert middle == pytest.approx([result[f"pendulum.position[{k}]"][0] for k in (1, 2, 3)], abs=1e-6)
    normal = [result[f"ball.contact[1].normal[{k}]"][0] for k in (1, 2, 3)]
    assert places == [pytest.approx([0.05 * n for n in normal], abs=1e-5)]  # the contact is on the ball's surface
    page.frames[-1].evaluate("zoom(1.7)")
    page.fill("#scene", page.input_value("#scene").replace("center: [0.5, 0, 0]", "center: [0.4, 0, 0]"))
    moved = eventually(lambda: (d := drawn()) and d[0][0] < 0.45 and d)
    assert moved[0] == pytest.approx([0.4, 0, 0], abs=1e-6)
    assert moved[2] == pytest.approx(1.7)  # the view has not changed


@pytest.mark.slow
def test_a_map_of_two_numbers_shows_the_table(page: Any, grid: Job) -> None:
    show(page, f"/jobs/{grid.id}")
    until(page, "document.getElementById('sweepplot').data?.[0].type === 'heatmap'")
    shown = page.evaluate("(() => { const d = document.getElementById('sweepplot').data[0]; return [d.x, d.y, d.z]; })()")
    table = grid.to_arrow().to_pydict()
    at = {(a, b): v for a, b, v in zip(table[GUIDE], table[HALF], table[FORCE], strict=True)}
    assert shown[2] == [[at[a, b] for a in shown[0]] for b in shown[1]]
    marks = page.evaluate("document.getElementById('sweepplot').data.slice(1).map((t) => [t.name, t.mode, t.x.length])")
    assert marks == [["jammed", "markers", table["outcome"].count("jammed")]]
    page.select_option("#kind", "contour")
    until(page, "document.getElementById('sweepplot').data[0].type === 'contour'")
    picture(page, "contour")


@pytest.mark.slow
def test_a_selection_along_one_axis_is_seen_in_the_points(page: Any, three: Job) -> None:
    show(page, f"/jobs/{three.id}")
    page.wait_for_selector("#parallel canvas")
    page.click("#parallel summary")
    page.fill(f'#parallel input[aria-label="most {GUIDE}"]', "0.3")
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    few = sum(m <= 0.3 for m in three.to_arrow()[GUIDE].to_pylist())
    until(page, f"document.getElementById('selected').textContent.startsWith('{few} cases selected')")
    full = "document.getElementById('sweepplot').data.flatMap((t) => t.marker.opacity).filter((o) => o > 0.5).length"
    until(page, f"{full} === {few}")
    shown = "[...document.querySelectorAll('#sweepplot .legendpoints path')].map((p) => +getComputedStyle(p).opacity)"
    assert min(page.evaluate(shown)) > 0.5
    picture(page, "parallel")
    page.click("#selected button >> nth=0")
    until(page, "document.getElementById('selected').hidden")


@pytest.mark.slow
def test_cases_and_columns_lie_over_each_other_and_the_cursor_moves_the_mechanism(page: Any, served: Served) -> None:
    run(page, "0.2, 0.6", "1.5")
    told(page, "done: 2 of 2")
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    page.fill("#cases", "0-1")
    page.select_option("#column", "pendulum.position[3]")
    page.click("#addcolumn")
    lines = "document.getElementById('timeplot').data.filter((t) => t.mode === 'lines')"
    until(page, f"{lines}.length === 4")
    assert len(set(page.evaluate(f"{lines}.map((t) => t.yaxis)"))) == 2  # newtons and metres have separate axes
    own = trunnion.simulate("spherical_pendulum", overrides={MU: 0.6}, until=1.5)
    marks = page.evaluate("document.getElementById('timeplot').data.find((t) => t.name === 'events of case 1').x")
    assert marks == [e.time for e in own.events]
    page.wait_for_selector("#animation:visible")
    page.frame_locator("#animation").locator("#clock").wait_for()
    frame = page.locator("#animation").element_handle().content_frame()
    page.evaluate("(() => { const a = document.getElementById('at'); a.value = 0.75; a.dispatchEvent(new Event('input')); })()")
    eventually(lambda: frame.evaluate("clock.t") == 0.75)
    frame.evaluate("seek(0.5)")  # the motion's clock moves the cursor, too
    until(page, "document.getElementById('attime').textContent === '0.5 s'")
    place = page.evaluate("[parseFloat(document.querySelector('#timeplot .rule').style.left), timeplot._fullLayout.xaxis]")[0]
    expected = page.evaluate("timeplot._fullLayout.xaxis._offset + timeplot._fullLayout.xaxis.l2p(0.5)")
    assert place == pytest.approx(expected, abs=1)
    page.click("#wide")
    assert page.locator("#animation").bounding_box()["height"] > 0.8 * page.viewport_size["height"]
    page.keyboard.press("Escape")
    assert page.locator("#motion.wide").count() == 0
    picture(page, "cases")
    assert "cases=0%2C1" in page.url
    page.reload()
    until(page, f"document.getElementById('timeplot').data && {lines}.length === 4")


@pytest.mark.slow  # two minutes
def test_the_proposed_job_of_each_bundled_model_finishes(page: Any, served: Served) -> None:
    def checked() -> None:
        page.wait_for_timeout(700)
        page.wait_for_selector("#jobverdict.good")

    asked = {}
    for name in bundled_names():
        show(page, "/docs")
        page.evaluate("sessionStorage.clear()")
        show(page, "/")
        page.select_option("#model", name)
        checked()
        page.click("#submit")
        until(page, "location.pathname.startsWith('/jobs/')")
        asked[name] = page.url.split("/jobs/")[1][:24]
    ended = {name: served.ended(job, 600.0) for name, job in asked.items()}
    print({name: (d["outcomes"], d["stepping_seconds"]) for name, d in ended.items()})
    assert {name: (d["state"], d["done"]) for name, d in ended.items()} == dict.fromkeys(asked, ("done", 21))


@pytest.mark.slow
def test_a_jobs_scene_comes_back_into_the_form_and_gives_the_same_job(page: Any, grid: Job, served: Served) -> None:
    show(page, f"/jobs/{grid.id}")
    page.click("#edit")
    until(page, "document.getElementById('count').textContent === '45 cases'")
    assert "name: double_pendulum" in page.input_value("#scene")
    page.fill("#label", "the same again")
    page.wait_for_timeout(500)
    page.wait_for_selector("#jobverdict.good")
    page.click("#submit")
    until(page, "location.pathname.startsWith('/jobs/')")
    told(page, "done: 45 of 45")
    again = connect(str(served.client.base_url)).job(page.url.split("/jobs/")[1][:24])
    assert again.to_arrow().to_pydict() == grid.to_arrow().to_pydict()


LISTED = "[...document.querySelectorAll('#joblist li')].map((row) => row.textContent)"


@pytest.mark.slow
def test_jobs_are_found_dated_and_set_side_by_side(page: Any, grid: Job, three: Job) -> None:
    show(page, "/jobs")
    page.fill("#search", "grid")
    # each listed job contains the word in its label or in its tags
    until(page, f"{LISTED}.length && {LISTED}.every((row) => row.includes('grid'))")
    assert page.locator(f"#joblist li:has([data-job='{grid.id}']) time").get_attribute("datetime") == grid.document["created"]
    page.fill("#search", "")
    for name in ("grid", "three"):
        page.locator(f"#joblist input[aria-label^='compare {name} ']").first.check()
    page.click("#comparechosen")
    until(page, "document.getElementById('compareplot').data?.length === 2")
    assert page.locator("#differences th", has_text=f"sample.ranges.{RADIUS}").count() == 1
    values = [v for v in three.to_arrow()[FORCE].to_pylist() if v is not None]
    assert str(len(values)) in page.locator("#comparetable tr", has_text="three").inner_text().split("\t")
    picture(page, "compare")


def test_an_answer_that_a_new_search_has_overtaken_changes_nothing(page: Any, grid: Job, three: Job) -> None:
    held: list[Any] = []
    page.route("**/v1/jobs?limit=30", lambda route: held.append(route))  # the whole list is requested when the view opens
    page.goto("/".join(page.url.split("/")[:3]) + "/jobs")
    eventually(lambda: page.wait_for_timeout(20) or held)
    page.fill("#search", "grid")
    until(page, f"{LISTED}.length && {LISTED}.every((row) => row.includes('grid'))")
    with page.expect_response("**/v1/jobs?limit=30"):
        held[0].continue_()
    page.wait_for_timeout(300)  # a late answer would be listed within this time
    page.unroute("**/v1/jobs?limit=30")
    assert all("grid" in row for row in page.evaluate(LISTED))


def test_a_server_that_is_gone_or_cannot_work_is_reported_and_survived(page: Any, tab: tuple[Any, list[str]]) -> None:
    page.fill("#label", "written before it went")
    page.context.set_offline(True)
    vary(page, "0.2, 0.4")
    until(page, "document.getElementById('banner').textContent.includes('has not answered since')")
    until(page, "document.getElementById('jobverdict').textContent.includes('Not checked: the server')")
    assert page.inner_text("#count") == ""  # no text of the previous request remains
    picture(page, "gone")
    page.context.set_offline(False)
    until(page, "document.getElementById('banner').hidden")
    until(page, "document.getElementById('count').textContent === '2 cases'")
    assert page.input_value("#label") == "written before it went"
    full = '{"status": "not ready", "database": "ok", "workers": 1, "trouble": "No space left on device"}'
    page.route("**/readyz", lambda r: r.fulfill(status=503, body=full, content_type="application/json"))
    page.reload()
    until(page, "document.getElementById('banner').textContent.includes('No space left on device')")
    until(page, "document.getElementById('label').value === 'written before it went'")
    page.unroute("**/readyz")
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")
    until(page, "document.getElementById('banner').hidden")
    page.goto("about:blank")
    tab[1][:] = [e for e in tab[1] if "Failed to load resource" not in e]  # the errors that this test causes


NAMELESS = """[...document.querySelectorAll('button, a, input, select, textarea, iframe, canvas, progress, [role=group]')]
  .filter((e) => e.checkVisibility() && !e.closest('.modebar'))
  .filter((e) => !(e.labels?.length || e.ariaLabel || e.title || e.textContent.trim() || e.getAttribute('aria-labelledby')))
  .map((e) => e.outerHTML.slice(0, 120))"""
BEYOND = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
HEADINGS = "[...document.querySelectorAll('h1')].filter((h) => h.checkVisibility()).length"


def violations(page: Any) -> str:
    """The findings of axe; none if axe is not installed."""
    try:
        from axe_playwright_python.sync_playwright import Axe
    except ImportError:
        return ""
    page.wait_for_timeout(300)  # by then, fading elements have their final colours
    found = Axe().run(page, options={"resultTypes": ["violations"]})
    return str(found.generate_report()) if found.violations_count else ""


@pytest.mark.slow
def test_every_view_is_usable_by_all_and_on_a_narrow_screen(page: Any, grid: Job, three: Job) -> None:
    """If axe is installed, the views obey its rules. In any case, all elements have a name, there is one heading, and nothing is
    outside the screen."""
    views = {"/": "#count", "/jobs": "#joblist a"} | {f"/jobs/{j.id}": "#timeplot .trace" for j in (grid, three)}
    wide = page.viewport_size
    for address, ready in (views | {f"/compare?jobs={grid.id},{three.id}": "#compareplot .trace"}).items():
        show(page, address)
        page.wait_for_selector(ready, state="attached")
        assert (page.evaluate(NAMELESS), page.evaluate(HEADINGS), violations(page)) == ([], 1, ""), address
        page.set_viewport_size({"width": 320, "height": 640})
        until(page, f"{BEYOND} <= 0")
        until(page, "[...document.querySelectorAll('.stacked')].every((x) => x.scrollWidth <= x.parentElement.clientWidth)")
        page.set_viewport_size(wide)


def test_axe_is_installed_where_it_is_required() -> None:
    try:
        import axe_playwright_python  # noqa: F401
    except ImportError as e:
        missing("axe", str(e))


@pytest.mark.slow
def test_a_search_draws_its_target_its_constraint_and_the_nearest_miss(page: Any, served: Served) -> None:
    travel, most = "final:guide.q[1]", 900.0
    asked = {"bounds": {GUIDE: [0.05, 0.5]}, "reach": [travel, "4 m"], "within": {FORCE: [None, f"{most} N"]}, "cases": 20}
    job = submitted(served, optimise=asked, reductions=[], until=0.3)
    show(page, f"/jobs/{job.id}")
    plot = "document.getElementById('sweepplot').layout"
    page.wait_for_selector("#sweepplot .point")
    for result, level in ((travel, 4.0), (FORCE, most)):
        page.select_option("#up", result)
        until(page, f"{plot}.shapes?.[0]?.y0 === {level}")
        until(page, f"{plot}.annotations?.some((a) => a.text === 'nearest miss')")
    best = job.answer
    spot = page.evaluate(f"{plot}.annotations.find((a) => a.text === 'nearest miss')")
    assert (spot["x"], spot["y"]) == (best["numbers"][0]["value"], best["results"][FORCE])
    assert "off target by" in page.inner_text("#questionnote")
    picture(page, "search")


@pytest.mark.slow
def test_jobs_are_compared_as_differences_at_equal_numbers(page: Any, served: Served) -> None:
    made = [submitted(served, vary={GUIDE: "0.05:0.3:6"}, overrides={RADIUS: r}) for r in (0.05, 0.06)]
    show(page, f"/compare?jobs={','.join(j.id for j in made)}")
    page.wait_for_selector("#compareplot .trace")
    page.select_option("#comparekind", "difference")
    plot = "document.getElementById('compareplot')"
    until(page, f"{plot}.data.length === 1")
    first, second = (j.to_arrow()[FORCE].to_numpy() for j in made)
    assert page.evaluate(f"{plot}.data[0].y") == pytest.approx((second - first).tolist(), rel=1e-9)
    mean = page.locator("#comparetable tbody tr").nth(1).locator("td").last.inner_text()
    assert float(mean.split("\u00a0")[0]) == pytest.approx((second - first).mean(), rel=1e-5)


@pytest.mark.slow
def test_a_second_case_is_outlined_over_the_case_that_is_played(page: Any, grid: Job) -> None:
    show(page, f"/jobs/{grid.id}?cases=0,8")
    until(page, "document.getElementById('motionnote').textContent === 'Outlined: case 8.'")
    frame = page.locator("#animation").element_handle().content_frame()
    seen = frame.evaluate("bodiesBeside(0.1)[0].p")
    other = trunnion.simulate("double_pendulum", overrides={k: grid.to_arrow()[k][8].as_py() for k in (GUIDE, HALF)}, until=0.1)
    assert seen == pytest.approx([other[f"upper.position[{k}]"][-1] for k in (1, 2, 3)], abs=1e-6)
    assert seen != pytest.approx(frame.evaluate("moment(0.1).poses[0].p"), abs=1e-6)


@pytest.mark.slow
def test_measured_curves_of_a_file_are_fitted(page: Any) -> None:
    page.select_option("#model", "friction_identification")
    page.wait_for_timeout(700)
    page.wait_for_selector("#jobverdict.good")
    page.check("input[value=fit]")
    page.set_input_files("#measured", ROOT / "models" / "friction_identification" / "measured.csv")
    until(page, "document.getElementById('count').textContent === '1 case'")
    assert page.locator("#curvesof select").input_value() == "pivot.q[1]"
    page.click("#submit")
    page.wait_for_selector("#questions:visible")
    until(page, "document.getElementById('answers').textContent.includes('joints.pivot.friction.mu')")
    assert page.locator("#motion:visible").count() == 0
