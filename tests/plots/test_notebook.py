"""A notebook shows a result without further code."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from tests.plots.webgl_browser import COARSE, DESK, Opened
from trunnion.plots import view
from trunnion.simulation.results.outcome import Outcome
from trunnion.simulation.results.result import Result


def test_the_text_of_a_result_shows_outcome_curves_and_events(pendulum: Result) -> None:
    text = pendulum._repr_html_()
    ElementTree.fromstring(text)
    assert "done at t = 4 s" in text
    assert text.count("<polyline") >= 3
    assert "2 reversal" in text
    assert "a note" in text


def test_the_text_of_a_result_has_no_scripts_and_fetches_nothing(pendulum: Result) -> None:
    text = pendulum._repr_html_()
    assert "<script" not in text
    assert "http" not in text


def test_titles_in_a_notebook_are_escaped(pendulum: Result) -> None:
    named = replace(pendulum, scene=replace(pendulum.scene, title="<b>&</b>"))
    ElementTree.fromstring(named._repr_html_())
    assert "<b>&</b>" not in named._repr_html_()


def test_a_result_with_one_column_or_no_rows_has_a_text(pendulum: Result) -> None:
    few = replace(pendulum, data=pendulum.data[:, :2], columns=pendulum.columns[:1], events=())
    none = replace(pendulum, data=pendulum.data[:0], outcome=Outcome("no_solution", 0.0, "ball", "jams"))
    for result in (few, none):
        ElementTree.fromstring(result._repr_html_())
    assert "no_solution" in none._repr_html_()


def test_a_view_is_the_page_in_a_frame_that_reaches_nothing(swing: Result) -> None:
    text = view(swing)._repr_html_()
    assert text.startswith('<iframe srcdoc="')
    assert 'sandbox="allow-scripts"' in text
    assert "<" not in text[1:].removesuffix("></iframe>")
    assert "http:" not in text
    assert "https:" not in text


def test_a_view_moves_inside_the_notebook_and_opens_as_asked(swing: Result, chrome: Any, tmp_path: Path) -> None:
    file = tmp_path / "notebook.html"
    file.write_text(f"<!DOCTYPE html><title>notebook</title><div>{view(swing, 't=1.5&names=1', 480)._repr_html_()}</div>")
    page = chrome.new_context(viewport=DESK, device_scale_factor=COARSE).new_page()
    told = Opened(page)
    page.goto(f"file://{file}")
    inner = page.frame_locator("iframe")
    inner.locator("html[data-drawn=depth]").wait_for(state="attached")
    assert inner.locator("#clock").inner_text() == "t = 1.500 s"
    assert inner.locator("#labels").get_attribute("aria-pressed") == "true"
    frame = page.frames[1]
    assert frame.evaluate("shown.m.poses[0].p")[0] == swing["pendulum.position[1]"][150].astype(np.float32)
    inner.locator("#stage").press("ArrowRight")
    assert frame.evaluate("times.indexOf(clock.t)") == 151
    assert [w for w in told.wrong if w != "about:srcdoc"] == []
    page.context.close()
