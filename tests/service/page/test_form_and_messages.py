"""The form of the page and its messages: size, fields with mistakes, request for a key, words of the API."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.page.chromium_tab import until, vary


@pytest.mark.slow
def test_a_long_check_leaves_no_text_of_the_check_before(page: Any) -> None:
    page.wait_for_selector("#jobverdict.good")
    held: list[Any] = []
    page.route("**/v1/jobs/check", lambda route: held.append(route))
    vary(page, "0.2, 0.4")
    until(page, "document.getElementById('jobverdict').textContent === 'Checking …'")
    assert page.inner_text("#count") == ""
    for route in held:
        route.continue_()
    page.unroute("**/v1/jobs/check")
    until(page, "document.getElementById('count').textContent === '2 cases'")


@pytest.mark.parametrize("size", [(1400, 900), (390, 844)])
def test_a_model_is_chosen_and_run_without_scrolling(page: Any, size: tuple[int, int]) -> None:
    wide = page.viewport_size
    page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    page.wait_for_selector("#preview iframe:not(.behind)")
    ends = [page.locator(x).bounding_box() for x in ("#model", "#submit", *(("#preview",) if size[0] > 900 else ()))]
    page.set_viewport_size(wide)
    assert all(b["y"] + b["height"] <= size[1] and b["x"] + b["width"] <= size[0] for b in ends)


def test_mistakes_in_the_goal_of_a_study_are_shown_at_their_fields(page: Any) -> None:
    page.check("input[value=optimise]")
    page.select_option("#model", "double_pendulum")  # proposals for the previous model vanish with the model
    until(page, "document.getElementById('goalof').value.includes('guide')")
    page.select_option("#goal", "reach")
    page.fill("#target", "4 kg")
    invalid = "[...document.querySelectorAll('[aria-invalid=true]')].map((x) => x.id)"
    until(page, f"{invalid}.join() === 'target' && document.getElementById('waynote').innerText.includes('4 kg')")
    page.fill("#target", "4 kN")
    page.fill("#within", "max:nothing = 1:2")
    until(page, f"{invalid}.join() === 'within'")
    page.fill("#within", "")
    until(page, f"!{invalid}.length && !document.getElementById('waynote').textContent")


def test_a_long_list_of_mistakes_is_reached_from_the_keyboard(page: Any) -> None:
    page.fill("#reductions", "max:nothing")
    page.wait_for_selector("#jobverdict.bad li")
    page.focus("#label")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.closest('#jobverdict')?.id") == "jobverdict"


def test_a_page_without_a_key_asks_for_one_and_shows_no_form(page: Any, tab: tuple[Any, list[str]]) -> None:
    problem = {"title": "An API key is required", "status": 401, "problems": []}
    page.route("**/v1/**", lambda r: r.fulfill(status=401, json=problem, content_type="application/problem+json"))
    page.reload()
    page.wait_for_selector("#locked:visible")
    assert page.locator("#submit:visible").count() == 0
    assert page.evaluate("document.activeElement.id") == "key"
    page.unroute("**/v1/**")
    page.fill("#key", "anything")  # this server requires no key
    page.click("#keyform button")
    page.wait_for_selector("#submit:visible")
    tab[1][:] = [e for e in tab[1] if "401" not in e]


def test_descriptions_of_the_api_have_no_marks_of_markdown(page: Any) -> None:
    page.goto("/".join(page.url.split("/")[:3]) + "/docs")
    page.wait_for_selector("#operations[aria-busy=false]")
    assert "`" not in page.inner_text("#operations")
    assert page.locator("#operations > p code").count()
