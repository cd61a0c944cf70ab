"""POST /v1/sensitivities gives the result of ``trunnion.sensitivity``, within its limits, and delays no other request."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from typing import Any

import httpx
import numpy as np
import pytest

import trunnion
from tests.analysis.sensitivities.test_input_derivatives import SCENES
from tests.service.http_servers import MU, ROOT, SMALL, InProcess, Served, unstarted
from trunnion.scene.file_format.yaml_writer import scene_to_yaml
from trunnion.service.api.routes.sensitivities import ANSWER, SensitivityDocument
from trunnion.service.api.transport.cluster_calls import MOST_WAITING
from trunnion.service.basics.server_settings import Limits, Settings

ASKED: dict[str, Any] = {
    "scene": "spherical_pendulum",
    "parameters": [MU, "joints.ball.friction.radius"],
    "outputs": ["ball.qd*", "ball.contact[1].normal_force"],
    "until": 0.3,
    "every": 0.05,
}
LONG = ASKED | {"overrides": {MU: 1e-4}, "until": 5000, "every": 5}
"""A request that takes minutes."""


def problems(answer: Any) -> list[str]:
    assert answer.headers["content-type"] == "application/problem+json"
    return [p["where"] for p in answer.json()["problems"]]


def test_a_request_returns_the_engines_numbers_to_the_last_bit(server: InProcess) -> None:
    answer = server.post("/v1/sensitivities", ASKED)
    assert answer.status_code == 200, answer.text
    s, got = trunnion.sensitivity(**ASKED), answer.json()
    for document in (got, ANSWER):
        SensitivityDocument.model_validate(document)
    assert np.array_equal(got["derivatives"], s.derivatives)
    assert np.array_equal(got["values"], s.values)
    assert (got["time"], got["outputs"], got["parameters"]) == (s.time.tolist(), list(s.names), list(s.parameters))
    units = {(o, p): got["derivative_units"][i][k] for i, o in enumerate(s.names) for k, p in enumerate(s.parameters)}
    assert units["ball.qd[2]", MU] == "rad/s"
    assert units["ball.contact[1].normal_force", "joints.ball.friction.radius"] == "N/m"


def test_a_scene_may_come_whole_with_changes(server: InProcess) -> None:
    text = server.get("/v1/models/spherical_pendulum").json()["text"]
    changed = {k: v for k, v in ASKED.items() if k != "scene"} | {"scene_text": text, "overrides": {MU: 0.2}}
    got = server.post("/v1/sensitivities", changed).json()
    assert np.array_equal(got["derivatives"], trunnion.sensitivity(**ASKED, overrides={MU: 0.2}).derivatives)


def test_a_scene_with_an_input_has_derivatives_too(server: InProcess) -> None:
    scene, names = SCENES["all at once"]
    asked = {"parameters": names, "outputs": ["shoulder.q*"], "until": 0.2, "every": 0.1}
    answer = server.post("/v1/sensitivities", asked | {"scene_text": scene_to_yaml(scene)})
    assert answer.status_code == 200, answer.text
    assert np.array_equal(answer.json()["derivatives"], trunnion.sensitivity(scene, **asked).derivatives)


def test_events_come_with_how_far_they_move(server: InProcess) -> None:
    asked = {"scene": "spherical_pendulum", "parameters": [MU], "outputs": ["ball.qd[2]"], "until": 1.0, "every": 0.5}
    got, s = server.post("/v1/sensitivities", asked).json(), trunnion.sensitivity(**asked)
    assert [(e["time"], e["joint"], e["shift"]) for e in got["events"]] == [(e.time, e.joint, [*e.shift]) for e in s.events]


def test_every_mistake_is_reported_at_once(server: InProcess) -> None:
    asked = ASKED | {
        "parameters": [MU, "joints.bal.friction.mu", "simulation.until"],
        "outputs": ["nothing*", "ball.friction.state[1]"],
        "every": 2.0,
        "rtol": 5.0,
    }
    answer = server.post("/v1/sensitivities", asked)
    assert answer.status_code == 422
    assert problems(answer) == ["parameters", "parameters", "outputs", "outputs", "every", "rtol"]
    assert 'did you mean "joints.ball.friction.mu"' in answer.text.replace("\\", "")


@pytest.mark.parametrize("empty", ["parameters", "outputs"])
def test_nothing_to_differentiate_is_a_mistake(server: InProcess, empty: str) -> None:
    assert problems(server.post("/v1/sensitivities", ASKED | {empty: []})) == [empty]


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(
    ("limits", "asked", "where"),
    [
        ({"duration": 0.2}, {}, "until"),
        ({"rows": 5}, {}, "every"),
        ({}, {"every": 1e-300}, "every"),
        ({}, {"every": 1e-6}, "outputs"),
        ({"answer_seconds": 5.0}, {"budget": 6}, "budget"),
        ({"bodies": 0}, {}, "bodies"),
    ],
)
def test_a_request_beyond_the_limits_is_refused_at_once(
    tmp_path_factory: pytest.TempPathFactory, limits: dict[str, Any], asked: dict[str, Any], where: str
) -> None:
    with unstarted(Settings(tmp_path_factory.mktemp("limited"), limits=Limits(**limits))) as s:
        answer = s.post("/v1/sensitivities", ASKED | asked)
        assert answer.status_code == 422
        assert where in problems(answer)


def test_a_run_that_ends_early_gives_the_reason(server: InProcess) -> None:
    """Painlevé's rod jams. The answer is a problem document with the outcome and its advice."""
    text = (ROOT / "models/stability/07_painleve.yaml").read_text()
    name = next(p for p in server.post("/v1/scenes/check", {"scene_text": text}).json()["parameters"] if p["path"].endswith(".mu"))
    asked = {"scene_text": text, "parameters": [name["path"]], "outputs": ["*.qd*"]}
    answer = server.post("/v1/sensitivities", asked)
    assert answer.status_code == 422
    assert "the run ends early" in answer.text or "cannot start" in answer.text


def test_a_request_beyond_its_budget_is_ended_and_frees_its_worker(server: InProcess) -> None:
    server.post("/v1/sensitivities", ASKED)
    answer = server.post("/v1/sensitivities", LONG | {"budget": 0.5})
    assert answer.status_code == 422
    assert problems(answer) == ["budget"]
    assert server.post("/v1/sensitivities", ASKED).status_code == 200


def test_long_requests_hold_up_no_others_and_end_when_their_clients_disconnect(served: Served) -> None:
    """The test sends more requests than the queue accepts, on one worker. The server answers other requests and refuses those
    beyond the queue. When the clients disconnect, the worker is free for a job."""
    assert served.post("/v1/sensitivities", ASKED).status_code == 200

    async def crowd() -> list[httpx.Response]:
        async with httpx.AsyncClient(base_url=served.client.base_url, timeout=None) as c:
            asked = {asyncio.create_task(c.post("/v1/sensitivities", json=LONG)) for _ in range(MOST_WAITING + 18)}
            refused: set[Any] = set()
            while len(refused) < 18:
                refused, waiting = await asyncio.wait(asked, return_when=asyncio.FIRST_COMPLETED)
                asked = waiting | refused
                await asyncio.sleep(0.05)
            for _ in range(20):
                assert (await c.get("/v1/jobs")).status_code == 200
            for task in waiting:
                task.cancel()
            await asyncio.gather(*waiting, return_exceptions=True)
            return [task.result() for task in refused]

    assert {(a.status_code, a.headers["retry-after"]) for a in asyncio.run(crowd())} == {(503, "10")}
    assert served.ended(served.submit(SMALL))["state"] == "done"


@pytest.mark.slow
def test_jobs_continue_beside_sensitivity_requests(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Requests for sensitivities take at most half of the workers."""
    with Served(tmp_path_factory.mktemp("beside") / "data", "--workers", "2") as s:
        assert s.post("/v1/sensitivities", ASKED).status_code == 200

        def ask() -> None:
            with httpx.Client(base_url=s.client.base_url, timeout=None) as c, suppress(httpx.HTTPError):
                c.post("/v1/sensitivities", json=LONG)

        threads = [threading.Thread(target=ask) for _ in range(3)]
        for t in threads:
            t.start()
        assert s.ended(s.submit(SMALL))["state"] == "done"
        assert all(t.is_alive() for t in threads)
        s.kill()  # a normal end would let the requests continue for a while
    for t in threads:
        t.join()
