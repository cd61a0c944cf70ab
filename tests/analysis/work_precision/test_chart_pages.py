"""The committed chart pages contain no copy of the viewer. A browser can open them from disk."""

from __future__ import annotations

import pytest

from tests.benchmarks.chart_pages import CHARTS, share_viewer
from tests.plots.webgl_browser import browsers

PAGES = sorted(CHARTS.glob("*/chart.html"))


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.parent.name)
def test_a_committed_page_links_to_the_viewer_and_its_data(page, tmp_path) -> None:
    (tmp_path / "chart.html").write_text(page.read_text())
    share_viewer(tmp_path)
    assert (tmp_path / "chart.html").read_text() == page.read_text(), "run `python -m tests.benchmarks.chart_pages`"
    assert page.with_name("data.js").read_text().startswith("const study = {")


def test_a_page_with_viewer_and_data_inside_is_split(tmp_path) -> None:
    (tmp_path / "chart.html").write_text('<title>a &amp; b</title><script>const study = {"curves":[{"label":"x"}]};</script>')
    share_viewer(tmp_path)
    assert (tmp_path / "data.js").read_text() == 'const study = {"curves":[\n{"label":"x"}]};\n'
    assert "<title>a &amp; b</title>" in (tmp_path / "chart.html").read_text()


def test_committed_pages_open_from_disk() -> None:
    with browsers() as start:
        page = start("--no-sandbox").new_page()
        wrong: list[str] = []
        page.on("console", lambda m: wrong.append(m.text))
        page.on("pageerror", lambda e: wrong.append(str(e)))
        for file in PAGES:
            page.goto(f"file://{file}")
            assert page.evaluate("document.querySelectorAll('#chart circle').length") > 10
        assert not wrong
