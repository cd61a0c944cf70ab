"""The page in headless Chromium, for tests, with actions that tests repeat. All tests of the page share one browser and one tab.
Any other module that imports this module has its own browser and tab."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.service.conftest import missing
from tests.service.http_servers import Served, eventually

PICTURES = os.environ.get("TRUNNION_PICTURES", "")
"""A folder for screenshots that a person inspects."""


def launched() -> Iterator[Any]:
    """A browser. While it exists, no other event loop can run in this thread."""
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


browser = pytest.fixture(launched, scope="module", name="browser")


def opened(browser: Any, served: Served) -> Iterator[tuple[Any, list[str]]]:
    """A tab, with the errors that its pages log and their requests to other servers. All tests share the tab, because a new tab
    compiles all scripts again."""
    context = browser.new_context(viewport={"width": 1500, "height": 1000}, reduced_motion="reduce")
    context.set_default_timeout(60_000)
    p = context.new_page()
    errors: list[str] = []
    home = f"http://127.0.0.1:{served.port}"
    p.on("console", lambda m: errors.append(m.text) if m.type == "error" and "422" not in m.text else None)
    p.on("pageerror", lambda e: errors.append(str(e)))
    p.on("request", lambda r: None if r.url.startswith((home, "data:", "blob:")) else errors.append(f"asked for {r.url}"))
    yield p, errors
    context.close()


tab = pytest.fixture(opened, scope="module", name="tab")


@pytest.fixture
def page(tab: tuple[Any, list[str]], served: Served) -> Iterator[Any]:
    """The page, loaded again. The test fails if the page logs an error or sends a request to another server."""
    p, errors = tab
    errors.clear()
    p.goto(f"http://127.0.0.1:{served.port}/page/icon.svg")  # the icon is the smallest file of the page
    p.evaluate("sessionStorage.clear()")  # this removes a draft of the previous test
    p.goto(f"http://127.0.0.1:{served.port}")
    p.wait_for_selector("body[data-ready]")
    yield p
    p.goto("about:blank")  # this ends the page's remaining work
    assert errors == []


def until(page: Any, true: str) -> None:
    """Wait until an expression is true. The test evaluates it from here, because the page's policy forbids repeated evaluation in
    the page."""
    eventually(lambda: page.evaluate(f"() => {true}"), 60.0)


def picture(page: Any, name: str) -> None:
    if PICTURES:
        page.screenshot(path=str(Path(PICTURES) / f"{name}.png"), full_page=True)


def vary(page: Any, values: str) -> None:
    """Write the values of the first varied number as a text."""
    first = page.locator(".axis").first
    if first.locator(".range:visible").count():
        first.locator(".text").click()
    page.locator(".values").first.fill(values)


def run(page: Any, values: str, end: str, model: str = "") -> None:
    """Choose a model, the range of its first number and its end time; run it."""
    if model:
        page.select_option("#model", model)
        page.wait_for_timeout(500)
    page.wait_for_selector("#jobverdict.good")
    vary(page, values)
    page.fill("#until", end)
    page.wait_for_timeout(500)
    page.wait_for_selector("#jobverdict.good")
    page.click("#submit")


def told(page: Any, start: str) -> None:
    """Wait until the selected job reports this state."""
    until(page, f"document.getElementById('state').textContent.startsWith({start!r})")


def show(page: Any, address: str) -> None:
    """Go to an address of the page."""
    page.goto("/".join(page.url.split("/")[:3]) + address)
    if not address.startswith("/docs"):
        page.wait_for_selector("body[data-ready]")
