"""Each state of the page: the way to reach the state, and a condition that is true in the state."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from tests.service.http_servers import MU, ROOT, Served
from tests.service.page.chromium_tab import until, vary
from trunnion.service.client.remote_jobs import Job, connect

GUIDE, HALF, RADIUS = (f"joints.guide.friction.{n}" for n in ("mu", "half_length", "radius"))
FORCE, TRAVEL = "max:guide.contact[1].normal_force", "final:guide.q[1]"
PRESSED = "max:ball.contact[1].normal_force"
OVER: dict[str, Any] = {"vary": {GUIDE: "0.05:0.9:15", HALF: "0.1:0.4:9"}}
RANGES: dict[str, Any] = {GUIDE: [0.05, 0.9], HALF: [0.1, 0.4], RADIUS: [0.03, 0.06]}
CROSSED: dict[str, Any] = {GUIDE: "normal(0.1, 0.01)", HALF: [0.25, 0.35], RADIUS: "triangular(40 mm, 50 mm, 60 mm)"}
ASKED: dict[str, dict[str, Any]] = {
    "one": {"scene": "spherical_pendulum", "vary": {MU: "0.1:0.6:26"}, "reductions": [PRESSED], "until": 3},
    "two": OVER,
    "three": {"sample": {"ranges": RANGES, "count": 120}, "tags": ["guide", "sample"]},
    "other": {"sample": {"ranges": RANGES, "count": 90, "seed": 2}, "until": 0.15},
    "large": {"sample": {"ranges": {GUIDE: [0.05, 0.9], HALF: [0.1, 0.4]}, "count": 6000}, "until": 0.05},
    "failed": {"vary": {GUIDE: "0.05:0.9:40"}},
    "crossed": {"sample": {"ranges": CROSSED, "count": 32, "method": "saltelli"}, "reductions": [TRAVEL], "until": 0.5},
    "best": {"optimise": {"bounds": {GUIDE: [0.05, 0.5], HALF: [0.1, 0.4]}, "reach": [TRAVEL, "4 m"], "cases": 60}, "until": 0.5},
    "where": {"refine": {"bounds": {GUIDE: [0.05, 0.9], HALF: [0.1, 0.4]}, "of": TRAVEL, "cases": 60}, "until": 0.5, "every": 0.05},
}
GUIDED: dict[str, Any] = {"scene": "double_pendulum", "reductions": [FORCE, "count:any"], "until": 0.1}


@dataclass
class There:
    """A server, a second server that requires a key, and finished jobs. Each job runs at its first use."""

    served: Served
    locked: Served
    jobs: dict[str, Job] = field(default_factory=dict)

    def job(self, name: str) -> Job:
        if name not in self.jobs:
            asked = GUIDED | {"label": name} | ASKED[name]
            if "optimise" in asked or "refine" in asked:
                del asked["reductions"]
            self.jobs[name] = connect(str(self.served.client.base_url)).job(self.served.ended(self.served.submit(asked), 600)["id"])
        return self.jobs[name]


Show = Callable[[Any, There], None]
STATES: dict[str, Show] = {}


def state(show: Show) -> Show:
    """A state of the page, named by the function that produces it."""
    STATES[show.__name__.strip("_").replace("_", "-")] = show
    return show


def go(page: Any, there: There, address: str, ready: str = "body[data-ready]") -> None:
    page.goto(f"http://127.0.0.1:{there.served.port}{address}")
    page.wait_for_selector(ready)


def form(page: Any, there: There, model: str = "") -> None:
    """The form as a first-time visitor sees it."""
    go(page, there, "/")
    page.evaluate("sessionStorage.clear()")
    go(page, there, "/")
    if model:
        page.select_option("#model", model)
        page.wait_for_timeout(600)
    page.wait_for_selector("#jobverdict.good")
    start(page)


def start(page: Any) -> None:
    page.wait_for_selector("#preview iframe:not(.behind)")
    until(page, "document.getElementById('preview').getAttribute('aria-busy') === 'false'")


def looked(page: Any, there: There, name: str, more: str = "") -> None:
    """A finished job, with all of its views drawn."""
    go(page, there, f"/jobs/{there.job(name).id}{more}")
    page.wait_for_selector("#timeplot .scatterlayer .trace")
    page.frame_locator("#animation").locator("#clock").wait_for()
    page.wait_for_timeout(300)


@state
def new_run(page: Any, there: There) -> None:
    form(page, there)


@state
def new_run_empty(page: Any, there: There) -> None:
    form(page, there)
    page.fill("#scene", "")
    page.wait_for_selector("#verdict.bad")
    page.wait_for_timeout(300)


@state
def new_run_typed(page: Any, there: There) -> None:
    form(page, there)
    page.fill("#scene", page.input_value("#scene").replace("center: [0.5, 0, 0]", "center: [0.3, 0, 0]"))
    page.click("#addaxis")
    page.locator(".path").last.fill("joints.ball.friction.radius")
    page.locator(".path").last.dispatch_event("change")
    page.fill("#label", "shorter")
    until(page, "document.getElementById('count').textContent === '441 cases'")
    start(page)


@state
def new_run_problems(page: Any, there: There) -> None:
    form(page, there)
    text = page.input_value("#scene").replace("type: spherical", "type: sperical").replace("density:", "densty:")
    page.fill("#scene", text)
    page.wait_for_selector("#verdict.bad li")
    page.wait_for_timeout(300)


@state
def new_run_request_problems(page: Any, there: There) -> None:
    form(page, there)
    vary(page, "0.1:0.6")
    page.fill("#until", "-1")
    page.fill("#reductions", "max:ball.nothing\nfirst:of all")
    page.wait_for_selector("#jobverdict.bad li")
    page.wait_for_timeout(300)


@state
def new_run_sample(page: Any, there: There) -> None:
    form(page, there, "double_pendulum")
    page.check("input[value=sample]")
    page.wait_for_timeout(600)
    page.wait_for_selector("#jobverdict.good")


@state
def new_run_best(page: Any, there: There) -> None:
    form(page, there, "double_pendulum")
    page.check("input[value=optimise]")
    page.select_option("#goal", "reach")
    page.fill("#target", "4 m")
    page.wait_for_timeout(600)
    page.wait_for_selector("#jobverdict.good, #jobverdict.bad")


@state
def new_run_fit(page: Any, there: There) -> None:
    form(page, there, "friction_identification")
    page.check("input[value=fit]")
    page.set_input_files("#measured", ROOT / "models" / "friction_identification" / "measured.csv")
    until(page, "document.getElementById('count').textContent === '1 case'")


@state
def preview(page: Any, there: There) -> None:
    form(page, there, "crank_slider")
    page.frame_locator("#preview iframe").locator("canvas").first.focus()
    for k in ("ArrowLeft", "ArrowLeft", "ArrowUp"):
        page.keyboard.press(k)
    page.wait_for_timeout(300)


@state
def list_(page: Any, there: There) -> None:
    for name in ("one", "two", "three", "failed", "best"):
        there.job(name)
    go(page, there, "/jobs")
    page.wait_for_selector("#joblist a")


@state
def list_searched(page: Any, there: There) -> None:
    list_(page, there)
    page.fill("#search", "guide")
    page.wait_for_timeout(800)


@state
def list_empty(page: Any, there: There) -> None:
    page.route("**/v1/jobs?**", lambda r: r.fulfill(json={"jobs": [], "next": None}))
    go(page, there, "/jobs")
    page.wait_for_selector("#joblist .empty")


@state
def server_gone(page: Any, there: There) -> None:
    form(page, there)
    page.context.set_offline(True)
    vary(page, "0.2, 0.4")
    until(page, "document.getElementById('banner').textContent.includes('has not answered since')")


@state
def disk_full(page: Any, there: There) -> None:
    full = {"status": "not ready", "database": "ok", "workers": 1, "trouble": "No space left on device"}
    page.route("**/readyz", lambda r: r.fulfill(status=503, body=json.dumps(full), content_type="application/json"))
    form(page, there)
    until(page, "document.getElementById('banner').textContent.includes('No space left on device')")


@state
def key_asked(page: Any, there: There) -> None:
    page.goto(f"http://127.0.0.1:{there.locked.port}/")
    page.wait_for_selector("#locked:visible")
    page.wait_for_timeout(300)


@state
def docs(page: Any, there: There) -> None:
    go(page, there, "/docs", "#operations[aria-busy=false] details")


@state
def docs_tried(page: Any, there: There) -> None:
    docs(page, there)
    page.locator("#check_job summary").first.click()
    page.locator("#check_job button.main").click()
    until(page, "document.querySelector('#check_job pre')?.textContent.includes('columns')")
    page.wait_for_timeout(200)
