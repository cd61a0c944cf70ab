"""Webhooks report the ends of jobs. Reports are signed, are repeated after failures, and go only to addresses that were given at
the server's start."""

from __future__ import annotations

import hashlib
import hmac
import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from tests.service.http_servers import MU, SMALL, InProcess, eventually
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor import webhooks
from trunnion.service.executor.webhooks import SIGNATURE, is_allowed, signing_secret

BELOW = ("https://hooks.example/trunnion", "http://127.0.0.1:9")


@pytest.mark.parametrize(
    ("url", "told"),
    [
        ("https://hooks.example/trunnion", True),
        ("https://hooks.example/trunnion/a?b=c", True),
        ("http://127.0.0.1:9/x", True),
        ("https://hooks.example/trunnion-evil", False),
        ("https://hooks.example/trunnion/../admin", False),
        ("https://hooks.example/trunnion/%2e%2e/admin", False),
        ("https://hooks.example/trunnion/%252E%252e/admin", False),
        ("https://hooks.example/trunnion/..%2fadmin", False),
        ("https://hooks.example/trunnion/a%5c..%5cadmin", False),
        ("https://hooks.example/trunnion%2f../admin", False),
        ("https://hooks.example/%74runnion/a%20b", True),
        ("https://hooks.example:443/trunnion/a..b", True),
        ("http://hooks.example/trunnion", False),
        ("https://hooks.example:444/trunnion", False),
        ("https://me@hooks.example/trunnion", False),
        ("https://hooks.example.org/trunnion", False),
        ("http://127.0.0.1:90/x", False),
        ("http://169.254.169.254/", False),
        ("file:///etc/passwd", False),
        ("nonsense", False),
        ("http://[", False),
    ],
)
def test_webhooks_go_only_to_addresses_below_those_of_the_server(url: str, told: bool) -> None:
    assert is_allowed(url, BELOW) is told
    assert not is_allowed(url, ())


class Listener:
    """A listener that answers with the given statuses in turn, and then always with the last status."""

    def __init__(self, *statuses: int):
        self.got: list[tuple[dict[str, str], bytes]] = []
        answers, got = list(statuses), self.got

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                got.append(({k.lower(): v for k, v in self.headers.items()}, body))
                self.send_response(answers.pop(0) if len(answers) > 1 else answers[0])
                self.end_headers()

            def log_message(self, *words: object) -> None:
                """Do nothing: the listener prints no log."""

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/told"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[InProcess, Listener]]:
    """A server of one worker, and a listener to which it may report. The first two answers of the listener are errors."""
    listener = Listener(500, 302, 200)
    patch = pytest.MonkeyPatch()
    patch.setattr(webhooks, "FIRST_DELAY", 0.05)
    with InProcess(Settings(tmp_path_factory.mktemp("told"), workers=1, webhooks=(listener.url,))) as s:
        yield s, listener
    patch.undo()
    listener.server.shutdown()


def test_the_end_of_a_job_is_delivered_until_accepted_and_signed(told: tuple[InProcess, Listener]) -> None:
    s, listener = told
    job = s.submit(SMALL | {"notify": listener.url + "/x"})
    s.ended(job)
    eventually(lambda: len(listener.got) == 3)
    eventually(lambda: [e.kind for e in s.service.store.events(job)][-3:] == ["webhook_waiting"] * 2 + ["webhook_told"])
    secret = signing_secret(s.service.settings)
    for headers, body in listener.got:
        assert headers[SIGNATURE.lower()] == "sha256=" + hmac.new(secret, body, hashlib.sha256).hexdigest()
    message = json.loads(listener.got[-1][1])
    assert (message["event"], message["job"]["id"], message["job"]["state"]) == ("done", job, "done")
    # all deliveries have one identifier, so that the listener recognises a repeated delivery
    assert len({h["trunnion-delivery"] for h, _ in listener.got}) == 1
    assert (s.service.settings.data / "webhook.secret").stat().st_mode & 0o077 == 0


def test_a_cancelled_job_is_delivered_and_a_job_without_a_webhook_is_not(told: tuple[InProcess, Listener]) -> None:
    s, listener = told
    quiet = s.submit(SMALL | {"vary": {MU: [0.1]}})
    s.ended(quiet)
    job = s.submit(SMALL | {"vary": {MU: "0.1:0.6:5000"}, "until": 1000.0, "every": 0.01, "notify": listener.url})
    s.client.delete(f"/v1/jobs/{job}")
    heard = eventually(lambda: [m for m in (json.loads(b) for _, b in listener.got) if m["job"]["id"] == job])
    assert [m["event"] for m in heard] == ["cancelled"]
    assert quiet not in [json.loads(b)["job"]["id"] for _, b in listener.got]


def test_an_address_that_is_not_allowed_is_a_problem_of_the_request(told: tuple[InProcess, Listener]) -> None:
    s, _ = told
    answer = s.post("/v1/jobs", SMALL | {"notify": "http://169.254.169.254/latest"})
    assert (answer.status_code, answer.json()["problems"][0]["where"]) == (422, "notify")
