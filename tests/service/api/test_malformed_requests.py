"""Malformed requests always give a problem document and never a server error. Memory and files stay bounded."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.service.http_servers import MU, Served
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.library.model_folders import model_file, model_names
from trunnion.scene.scene_loader import load_scene

PLACES = ("/v1/jobs", "/v1/jobs/check", "/v1/scenes/check", "/v1/sensitivities")
ODD: list[Any] = [
    None,
    True,
    -1,
    0,
    1e308,
    -1e-320,
    2**70,
    "",
    "x",
    "1 parsec",
    "\u0000",
    "\ud800",
    "../../etc/passwd",
    "http://127.0.0.1:1/",
    "a" * 5000,
    [],
    [[]],
    {},
    {"": {}},
    [1, 2],
    "!!python/object/apply:os.system [ls]",
    "${jndi}",
    {"$ref": "file:///etc/passwd"},
    "0x7f",
    "1e400",
    "nan",
]
GROWTH = 300_000_000
"""Bytes by which the server may grow: the memory of its libraries and caches at their first use, not a share of the sent bytes."""


def spoiled(chance: random.Random, value: Any, budget: list[int]) -> Any:
    """The data with a few parts changed, dropped, duplicated or swapped."""
    if budget[0] and chance.random() < 0.06:
        budget[0] -= 1
        return chance.choice(ODD)
    if isinstance(value, dict):
        out = {k: spoiled(chance, v, budget) for k, v in value.items() if chance.random() > 0.01}
        return out | ({chance.choice(["x", "mu", "\u2603", "axis"]): chance.choice(ODD)} if chance.random() < 0.03 else {})
    if isinstance(value, list):
        out_list = [spoiled(chance, v, budget) for v in value]
        return out_list * 2 if chance.random() < 0.02 else out_list
    return value


def rubbish(chance: random.Random, place: str) -> bytes:
    """A malformed body for an operation: random bytes, broken JSON, unusual YAML, or a request with a spoiled scene or sweep."""
    kind = chance.randrange(5)
    if kind == 0:
        return chance.randbytes(chance.randrange(2000))
    scene = scene_to_dict(load_scene(model_file(chance.choice(model_names()))))
    request: dict[str, Any] = {"scene": scene, "vary": {MU: [0.1, 0.2]}, "until": 0.1}
    if place == "/v1/sensitivities":
        request = {"scene": scene, "parameters": [MU], "outputs": ["ball.qd*"], "until": 0.1, "every": 0.05, "budget": 5}
    if kind == 1:
        text = bytearray(json.dumps(request).encode())
        for _ in range(chance.randrange(1, 6)):
            text[chance.randrange(len(text))] = chance.randrange(256)
        return bytes(text)
    if kind == 2:
        wild = [
            "a: &a [x,x]\nb: &b [*a,*a]\nc: [*b,*b]",
            "- " * 3000,
            "{" * 3000,
            "? " * 500,
            "!!set {a}",
            "a: *b",
            "%YAML 9",
            "\t- x",
            "a: |\n" * 50,
        ]
        return json.dumps(
            {"scene_text": chance.choice(wild) + chance.choice(["", "\x00", ": :", "\u2028"]), "vary": {MU: [1]}}
        ).encode()
    return json.dumps(spoiled(chance, request, [chance.randrange(1, 5)])).encode()


def files(folder: Path) -> int:
    return sum(1 for f in folder.rglob("*") if f.is_file() and "scratch" not in f.parts)


@pytest.mark.parametrize("count", [80, pytest.param(10_000, marks=pytest.mark.slow)])
def test_rubbish_is_refused_with_problems_and_leaves_nothing_behind(bounded: Served, count: int) -> None:
    assert bounded.process is not None
    server, chance = psutil.Process(bounded.process.pid), random.Random(count)
    statuses: dict[int, int] = {}
    memory, there = server.memory_info().rss, files(bounded.data)
    for i in range(count):
        place = PLACES[i % len(PLACES)]
        body = rubbish(chance, place)
        answer = bounded.client.post(place, content=body, headers={"Content-Type": "application/json"})
        statuses[answer.status_code] = statuses.get(answer.status_code, 0) + 1
        assert answer.status_code < 500, (place, body, answer.text)
        if answer.status_code >= 400:
            assert answer.headers["content-type"] == "application/problem+json"
            assert answer.json()["problems"] or answer.status_code in (400, 413), (body, answer.text)
        elif answer.status_code == 202:  # the change was harmless, so the server accepted the request
            bounded.client.delete(answer.headers["location"])
            there += 4  # allowed files of the job: its document, a part or two, and a marker
    assert sum(n for s, n in statuses.items() if s >= 400) > 0.5 * count
    assert server.memory_info().rss - memory < GROWTH
    assert files(bounded.data) <= there + 5


def test_the_first_hundred_of_thousands_of_mistakes_are_reported_and_all_are_counted(bounded: Served) -> None:
    scene = scene_to_dict(load_scene(model_file("spherical_pendulum")))
    next(iter(scene["bodies"].values())).update({f"masss{i}": 1 for i in range(4000)})
    answer = bounded.client.post("/v1/scenes/check", json={"scene": scene})
    document = answer.json()
    assert (answer.status_code, document["problem_count"], len(document["problems"])) == (422, 4000, 101)
    assert document["detail"] == "4000 problems"
    assert document["problems"][-1]["where"] == "and 3900 more"
    bad: dict[str, Any] = {"scene": "spherical_pendulum", "until": 0.5}
    bad["vary"] = dict.fromkeys([MU, "gravity[1]", "gravity[2]"], ["x"] * 4000)
    document = bounded.client.post("/v1/jobs", json=bad).json()
    assert document["problem_count"] == 12_000
    assert len(document["problems"]) <= 101
