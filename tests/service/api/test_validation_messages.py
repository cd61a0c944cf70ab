"""The server reports problems of requests in its own words, not in the words of its validation library."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from trunnion.basics.errors import Problem, SceneError
from trunnion.service.request_models.job_request import JobRequest
from trunnion.service.request_workers.worker_tasks import read_request

LIBRARY = re.compile("Input should|should be a valid|Extra inputs|Field required|Value error|pydantic|String should|List should")
PATH = "joints.ball.friction.mu"
WRONG: dict[str, tuple[Any, str, str]] = {
    "no tuple": ({"sample": {"ranges": {PATH: 3}, "count": 5}}, "3 is not a list", ""),
    "short tuple": ({"optimise": {"bounds": {PATH: [1]}, "minimise": "x"}}, "is not given", ""),
    "unknown field": ({"varry": {}}, "there is no such field", "correct its name"),
    "missing": ({"sample": {"count": 5}}, "is not given", "add this field"),
    "bound": ({"sample": {"ranges": {}, "count": 0}}, "0 is out of range", "≥ 1"),
    "kind": ({"vary": 5}, "5 is not an object with fields", ""),
    "text": ({"label": 5}, "5 is not a text", ""),
    "whole": ({"sample": {"ranges": {}, "count": 1.5}}, "1.5 is not a whole number", ""),
    "choice": ({"certify": "perhaps"}, '"perhaps" is not true or false', ""),
    "hidden": ({"label": "\u202ex"}, "a character that is not allowed", "direction of writing"),
    "tag": ({"tags": ["a b"]}, '"a b" has a character', "letters, digits"),
    "many": ({"tags": ["a"] * 21}, "has too many entries", "at most 20 entries"),
    "long": ({"label": "a" * 201}, "has too many characters", "at most 200 characters"),
    "few": ({"cases": []}, "has too few entries", "at least 1 entries"),
    "infinite": ({"budget": 1e999}, "is not finite", "a finite number"),
    "surrogate": ({"label": "\ud800"}, "half of a surrogate pair", ""),
}


def problems(body: Any) -> list[Problem]:
    with pytest.raises(SceneError) as error:
        read_request(JobRequest, json.dumps({"scene": "spherical_pendulum"} | body).encode(), "application/json")
    return list(error.value.problems)


@pytest.mark.parametrize("name", WRONG)
def test_no_word_of_the_library_reaches_the_user(name: str) -> None:
    body, what, hint = WRONG[name]
    told = problems(body)
    assert any(what in p.what and hint in p.hint for p in told), told
    assert not [p for p in told if LIBRARY.search(str(p))]
