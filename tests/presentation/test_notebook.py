"""A notebook shows a result at a glance."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

from engine.simulation.outcome import Outcome
from engine.simulation.result import Result


def test_it_shows_outcome_curves_and_events(pendulum: Result) -> None:
    text = pendulum._repr_html_()
    ElementTree.fromstring(text)
    assert "done at t = 4 s" in text
    assert text.count("<polyline") >= 3
    assert "2 reversal" in text
    assert "a note" in text


def test_it_has_no_scripts_and_fetches_nothing(pendulum: Result) -> None:
    text = pendulum._repr_html_()
    assert "<script" not in text
    assert "http" not in text


def test_names_cannot_break_out_of_it(pendulum: Result) -> None:
    named = replace(pendulum, scene=replace(pendulum.scene, title="<b>&</b>"))
    ElementTree.fromstring(named._repr_html_())
    assert "<b>&</b>" not in named._repr_html_()


def test_it_makes_do_with_what_there_is(pendulum: Result) -> None:
    few = replace(pendulum, data=pendulum.data[:, :2], columns=pendulum.columns[:1], events=())
    none = replace(pendulum, data=pendulum.data[:0], outcome=Outcome("no_solution", 0.0, "ball", "jams"))
    for result in (few, none):
        ElementTree.fromstring(result._repr_html_())
    assert "no_solution" in none._repr_html_()
