"""Every state of the page in four formats, as pictures for inspection: ``TRUNNION_PICTURES=folder TRUNNION_REQUIRE=chromium,axe
python -m pytest tests/service/page/test_screenshots.py -m slow -n 0``. In every picture, all elements lie on the screen, and axe
finds no fault."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.service.http_servers import Served
from tests.service.page.chromium_tab import PICTURES
from tests.service.page.job_states import STATES
from tests.service.page.page_states import There
from tests.service.page.test_result_views import BEYOND, violations

pytestmark = pytest.mark.slow
SIZES: dict[str, dict[str, Any]] = {
    "desktop": {"viewport": {"width": 1400, "height": 900}},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True},
}


@pytest.fixture(scope="module")
def there(served: Served, tmp_path_factory: pytest.TempPathFactory) -> Iterator[There]:
    with Served(tmp_path_factory.mktemp("locked") / "data", "--workers", "1", "--keys") as locked:
        yield There(served, locked)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(PICTURES) if PICTURES else tmp_path_factory.mktemp("pictures")


@pytest.mark.parametrize("size", list(SIZES))
@pytest.mark.parametrize("name", list(STATES))
def test_each_state_of_the_page_fits_and_is_readable(browser: Any, there: There, folder: Path, name: str, size: str) -> None:
    context, errors = browser.new_context(**SIZES[size]), []
    context.set_default_timeout(60_000)
    page = context.new_page()
    page.on("pageerror", lambda e: errors.append(str(e)))
    STATES[name](page, there)
    found = []
    page.evaluate("window.scrollTo(0, 0)")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        high = page.evaluate("document.documentElement.scrollHeight")
        page.set_viewport_size(SIZES[size]["viewport"] | {"height": high})  # elements outside the screen are not redrawn
        page.wait_for_timeout(1000)  # plots and pictures need this time to change their colours
        page.screenshot(path=str(folder / f"{name}-{size}-{scheme}.png"))
        page.set_viewport_size(SIZES[size]["viewport"])
        found.append((scheme, page.evaluate(BEYOND), violations(page)))
    context.close()
    assert (found, errors) == ([("light", 0, ""), ("dark", 0, "")], [])
