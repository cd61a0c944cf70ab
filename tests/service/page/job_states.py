"""Each state of a job that the page can show (``page_states.py``)."""

from __future__ import annotations

from functools import partial
from typing import Any

from tests.service.page.chromium_tab import until
from tests.service.page.page_states import GUIDE, STATES, There, go, looked, state


def report_stages(page: Any, there: There, now: dict[str, Any]) -> None:
    """Open the page of a running job. Its document has the fields ``now``, so that a short stage stays visible for a picture."""
    job = there.job("one")
    begun = {"state": "running", "finished": None, "done": 0, "outcomes": {}, "progress": 0.0, "eta_seconds": None}
    document = job.document | begun | now
    columns = there.served.get(f"/v1/jobs/{job.id}/results?count=1").json()
    page.route(f"**/v1/jobs/{job.id}", lambda r: r.fulfill(json=document))
    page.route(f"**/v1/jobs/{job.id}/events", lambda r: r.fulfill(body=": nothing new\n\n", content_type="text/event-stream"))
    if not document["done"]:
        page.route(f"**/v1/jobs/{job.id}/results**", lambda r: r.fulfill(json=columns | {"rows": []}))
    go(page, there, f"/jobs/{job.id}")
    page.wait_for_selector("#stages .now")


@state
def job_waiting(page: Any, there: There) -> None:
    report_stages(page, there, {"state": "queued", "stage": "waiting", "started": None})
    assert page.is_hidden("#moving"), "no case, no choice"


@state
def job_deriving(page: Any, there: There) -> None:
    report_stages(page, there, {"stage": "deriving"})


@state
def job_compiling(page: Any, there: There) -> None:
    report_stages(page, there, {"stage": "compiling"})


@state
def job_running(page: Any, there: There) -> None:
    now = {"stage": "running", "done": 26, "cases": 400, "progress": 0.065, "eta_seconds": 74.2, "outcomes": {"done": 26}}
    report_stages(page, there, now)
    page.wait_for_selector("#timeplot .scatterlayer .trace")


@state
def job_in_trouble(page: Any, there: There) -> None:
    what = "tried 5 times: OSError: [Errno 28] No space left on device"
    now = {"state": "failed", "stage": "failed", "done": 20, "lost": 6, "outcomes": {"done": 20}}
    now["problems"] = [{"where": "cases 20 to 25", "what": what, "hint": "run them again"}]
    job = there.job("one")
    page.route(f"**/v1/jobs/{job.id}", lambda r: r.fulfill(json=job.document | now))
    looked(page, there, "one")


@state
def job_gone(page: Any, there: There) -> None:
    go(page, there, f"/jobs/{'0' * 24}")


@state
def no_page(page: Any, there: There) -> None:
    go(page, there, "/jobs/nothing")


for _name in ("one", "two", "three", "large", "failed", "crossed", "best", "where"):
    STATES[f"done-{_name}"] = partial(looked, name=_name)


@state
def done_contour(page: Any, there: There) -> None:
    looked(page, there, "two")
    page.select_option("#kind", "contour")
    until(page, "document.getElementById('sweepplot').data[0].type === 'contour'")


@state
def done_selection(page: Any, there: There) -> None:
    looked(page, there, "three")
    page.click("#parallel summary")
    page.fill(f'#parallel input[aria-label="most {GUIDE}"]', "0.3")
    page.keyboard.press("Tab")
    page.wait_for_selector("#selected:visible")
    page.wait_for_timeout(300)


@state
def done_large_density(page: Any, there: There) -> None:
    looked(page, there, "large")
    page.select_option("#kind", "points")
    page.wait_for_timeout(600)


@state
def done_cases_over_each_other(page: Any, there: There) -> None:
    looked(page, there, "one", "?cases=0,10,25&columns=ball.contact[1].normal_force+pendulum.position[3]")
    page.evaluate("(() => { const a = document.getElementById('at'); a.value = 1.3; a.dispatchEvent(new Event('input')); })()")
    page.locator("#closer").scroll_into_view_if_needed()
    page.wait_for_timeout(300)


@state
def done_table(page: Any, there: There) -> None:
    looked(page, there, "failed")
    page.click("#casetable summary")
    page.wait_for_selector("#caserows tbody tr")


@state
def compare(page: Any, there: There) -> None:
    go(page, there, f"/compare?jobs={','.join(there.job(n).id for n in ('two', 'three', 'other'))}")
    page.wait_for_selector("#compareplot .trace")


@state
def compare_differences(page: Any, there: There) -> None:
    compare(page, there)
    page.select_option("#comparekind", "difference")
    page.wait_for_function("document.getElementById('comparenote').textContent.startsWith('No case of')")
    assert page.is_hidden("#compareplot"), "no differences, no diagram"
