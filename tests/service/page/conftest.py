"""The browser and its tab, shared by all tests of the page."""

from __future__ import annotations

import pytest

from tests.service.page.chromium_tab import launched, opened, page

__all__ = ["page"]
browser = pytest.fixture(launched, scope="package", name="browser")
tab = pytest.fixture(opened, scope="package", name="tab")
