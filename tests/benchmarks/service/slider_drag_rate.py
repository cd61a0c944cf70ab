"""Rate, delay and processor time of the runs that follow a number dragged on the page:
``python -m tests.benchmarks.service.slider_drag_rate``.

A mouse drags a slider of four scenes for some seconds, 60 times a second. A run counts when its picture is drawn. The delay of a
movement is the time until a picture shows the value of this or a later movement. The server computes the first drag. The browser
then gets the scene's WebAssembly module, and computes the second drag itself."""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil

from tests.service.http_servers import Served

SCENES = {
    "spherical_pendulum": "joints.ball.friction.mu",
    "door_closer": "parameters.damper",
    "drawer": "parameters.mu",
    "crank_slider": "joints.slider_pin.friction.mu",
}
SECONDS, RATE, CHANGE = 4.0, 60, 0.7
WATCH = """() => {
  const w = window.measured = { moved: [], sent: [], drawn: [] }, inside = document.querySelector("#preview iframe").contentWindow;
  document.addEventListener("input", () => w.moved.push(performance.now()), true);
  const ask = window.fetch, load = inside.load;
  window.fetch = (...a) => { if (String(a[0]).includes("scenes/run")) w.sent.push(performance.now()); return ask(...a); };
  inside.load = (...a) => { load(...a); w.drawn.push(performance.now()); };
}"""


def processor(processes: list[psutil.Process]) -> float:
    """The processor time of processes and their descendants, s."""
    total = 0.0
    for p in processes:
        for each in (p, *p.children(recursive=True)):
            try:
                used = each.cpu_times()
                total += used.user + used.system
            except psutil.Error:
                continue
    return total


def dragged(page: Any, path: str, server: psutil.Process, browser: psutil.Process) -> dict[str, float]:
    """Drag the page's slider of parameter ``path`` with the mouse. Measures runs per second, lag of the picture, processor time."""
    slider = page.locator(f"[id='slide-{path}']")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    page.evaluate(WATCH)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    before, began = (processor([server]), processor([browser])), time.monotonic()
    count = int(SECONDS * RATE)
    for k in range(count):
        share = abs((2 * k / count) % 1 - 0.5) * 2
        page.mouse.move(x - CHANGE * box["width"] / 2 * (1 - share), y)
        time.sleep(max(0.0, began + (k + 1) / RATE - time.monotonic()))
    spent, taken = (processor([server]) - before[0], processor([browser]) - before[1]), time.monotonic() - began
    page.mouse.up()
    page.wait_for_timeout(3000)
    seen = page.evaluate("window.measured")
    drawn = seen["drawn"]
    sent = seen["sent"] if len(seen["sent"]) > 1 else drawn  # the browser runs a scene text and draws its result without a pause
    lags = [min((d for s, d in zip(sent, drawn, strict=False) if s >= m), default=m) - m for m in seen["moved"]]
    runs = sum(d < sent[0] + 1e3 * taken for d in drawn)
    return {
        "movements": len(seen["moved"]), "runs a second": runs / taken,
        "longest lag ms": max(lags), "median lag ms": sorted(lags)[len(lags) // 2],
        "server ms a run": 1e3 * spent[0] / runs, "browser ms a picture": 1e3 * spent[1] / runs,
    }  # fmt: skip


def report(scene: str, where: str, figures: dict[str, float]) -> None:
    """Print the measurements of a drag of a slider on the page."""
    print(scene, where, ", ".join(f"{name} {value:.1f}" for name, value in figures.items()), flush=True)


def main() -> None:
    """Print the figures of the scenes, or of those that are named."""
    from playwright.sync_api import sync_playwright

    with Served(Path(tempfile.mkdtemp()) / "data", "--workers", "1") as served, sync_playwright() as p:
        browser = p.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        here = psutil.Process()
        chromium = next(c for c in here.children(recursive=True) if "chrom" in c.name() and "--type" not in " ".join(c.cmdline()))
        assert served.process is not None
        for scene in sys.argv[1:] or SCENES:
            page = browser.new_page(viewport={"width": 1500, "height": 1500}, reduced_motion="reduce")
            page.goto(f"http://127.0.0.1:{served.port}")
            page.wait_for_selector("#preview iframe:not(.behind)", timeout=300_000)
            page.select_option("#model", scene)
            page.wait_for_timeout(3000)
            with page.expect_response(lambda r: "scenes/module" in r.url, timeout=300_000):
                report(scene, "server", dragged(page, SCENES[scene], psutil.Process(served.process.pid), chromium))
            page.wait_for_timeout(2000)
            report(scene, "browser", dragged(page, SCENES[scene], psutil.Process(served.process.pid), chromium))
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
