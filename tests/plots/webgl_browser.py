"""Chromium that draws WebGL in software, and its opened pages: their values, pixels, console messages and requests to servers."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

SOFTWARE = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
NO_WEBGL = ("--no-sandbox", "--disable-3d-apis")
DESK, PHONE = {"width": 900, "height": 640}, {"width": 390, "height": 844}


def missing(why: str) -> None:
    """Skip, or fail if the browser is required."""
    if "chromium" in os.environ.get("TRUNNION_REQUIRE", ""):
        pytest.fail(f"chromium is required (TRUNNION_REQUIRE): {why}")
    pytest.skip(f"chromium: {why}")


@contextmanager
def browsers() -> Iterator[Callable[..., Any]]:
    """A function of flags that starts Chromium through Playwright. A process can have one Playwright."""
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError as e:
        missing(f"playwright cannot be imported: {e}")
    system = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with sync_playwright() as p:

        def start(*flags: str) -> Any:
            try:
                return p.chromium.launch(executable_path=system, args=list(flags))
            except Error as e:
                return missing(f"no browser: {str(e).splitlines()[0]}")

        yield start


class Opened:
    """A page that shows a run. wrong: messages of its console, and its requests to other servers."""

    def __init__(self, page: Any):
        self.page, self.wrong = page, []
        page.on("console", lambda m: self.wrong.append(m.text))
        page.on("pageerror", lambda e: self.wrong.append(str(e)))
        page.on("request", lambda r: None if r.url.startswith("file://") else self.wrong.append(r.url))

    def ask(self, script: str) -> Any:
        """The value of an expression in the page."""
        return self.page.evaluate(f"(() => ({script}))()")

    def until(self, what: str) -> None:
        """Wait until an expression is true. (The page's policy forbids Playwright's own repeated waiting.)"""
        for _ in range(600):
            if self.ask(what):
                return
            self.page.wait_for_timeout(50)
        pytest.fail(f"the condition never held: {what}")

    def do(self, script: str) -> None:
        """Run statements in the page, then draw."""
        self.page.evaluate(f"(() => {{ {script}; render(); }})()")

    def pixels(self, canvas: str = "stage") -> np.ndarray:
        """Pixels of a canvas, drawn now: height × width × 3, 0 to 255."""
        import base64

        from PIL import Image

        text = self.page.evaluate(f"(() => {{ render(); return document.getElementById('{canvas}').toDataURL('image/png'); }})()")
        with Image.open(io.BytesIO(base64.b64decode(text.split(",")[1]))) as picture:
            return np.asarray(picture.convert("RGBA"), float)


OPEN: list[Any] = []
"""Pages that end with the test. A page that plays would slow down all later pages."""


COARSE = 0.25
"""Dots of the screen for each pixel of the page, where a test needs only numbers. A graphics card in software fills few dots
faster."""


def opened(
    browser: Any,
    file: Path,
    query: str = "",
    size: dict[str, int] = DESK,
    kept: bool = False,
    dots: float = COARSE,
    **context: Any,
) -> Opened:
    """The shown page of a file. The page is closed when the test ends unless it is ``kept``. dots: dots of the screen for each
    pixel of the page."""
    page = browser.new_context(viewport=size, device_scale_factor=dots, **context).new_page()
    if not kept:
        OPEN.append(page.context)
    out = Opened(page)
    page.goto(f"file://{file}{query}")
    out.until("document.documentElement.dataset.drawn !== undefined")
    return out
