"""The server runs a scene immediately, without a job. It reports the positions of the scene's numbers in the scene's text."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from tests.service.http_servers import InProcess
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.file_format.yaml_scalars import plain
from trunnion.scene.library.model_folders import bundled_names, model_file
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_workers import worker_tasks
from trunnion.simulation.run import simulate


def test_the_place_of_a_scalar_holds_its_text() -> None:
    for name in bundled_names():
        text = model_file(name).read_text(encoding="utf-8")
        doc = read(text)
        for path, (first, end) in doc.places.items():
            value = doc.data
            for step in path:
                value = value[step]
            written = text[first:end]
            assert value == (written[1:-1] if written[0] in "\"'" else plain(written)), (name, path)


def test_places_are_counted_as_browsers_count() -> None:
    text = "title: 🜁 door\nbodies: {a: {mass: 3 kg}}\n"
    first, end = worker_tasks.number_places(text)["bodies.a.mass"]
    assert text.encode("utf-16-le")[2 * first : 2 * end].decode("utf-16-le") == "3 kg"


def test_a_run_at_once_is_the_run_of_the_scene(server: InProcess) -> None:
    answer = server.post("/v1/scenes/run", {"scene": "door_closer", "overrides": {"parameters.damper": 40}})
    assert answer.status_code == 200
    data, right = answer.json(), simulate("door_closer", overrides={"parameters.damper": 40}, every=0.012)
    rows = np.frombuffer(base64.b64decode(data["rows"]), "<f4").reshape(-1, data["width"])
    np.testing.assert_array_equal(np.frombuffer(base64.b64decode(data["times"]), "<f8"), right.time)
    for k, name in enumerate(data["sources"]):
        if name in right:
            np.testing.assert_array_equal(rows[:, k], right[name].astype("f4"))
    assert data["outcome"] == "done at t = 12 s"
    refused = server.post("/v1/scenes/run", {"scene_text": "bodies: {a: {mass: -1}}"})
    assert refused.status_code == 422
    assert any(p["where"] == "bodies.a.mass" for p in refused.json()["problems"])


def test_a_run_that_takes_too_long_is_shown_up_to_then(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = iter(range(10**9))
    monkeypatch.setattr(worker_tasks, "thread_time", lambda: float(next(ticks)))
    monkeypatch.setattr(worker_tasks, "RUN_SECONDS", 0.0)
    body = json.dumps({"scene": "double_pendulum"}).encode()
    data = json.loads(worker_tasks.run_scene(body, "application/json", Limits(), True))
    times = np.frombuffer(base64.b64decode(data["times"]), "<f8")
    assert data["outcome"].startswith("cancelled at t = ")
    assert 0.0 < times[-1] < data["until"]
