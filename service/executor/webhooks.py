"""A thread that sends webhooks when jobs end. Webhooks are signed, are retried after a failure, and go only to allowed
addresses."""

from __future__ import annotations

import hashlib
import hmac
import json
import logging
import secrets
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

import httpx

from trunnion.service.basics.server_settings import Settings
from trunnion.service.store.database_connection import Unreachable
from trunnion.service.store.job_store import Store, Webhook
from trunnion.service.store.store_records import Job

log = logging.getLogger("trunnion.service")
ATTEMPTS, FIRST_DELAY = 10, 5.0
"""ATTEMPTS: largest number of attempts. FIRST_DELAY: pause after the first attempt, s. Each next pause is twice as long. All pauses
together are 43 min."""
ANSWER_SECONDS = 10.0
LOOK_SECONDS = 1.0
SIGNATURE, IDENTITY = "Trunnion-Signature", "Trunnion-Delivery"


def is_allowed(url: str, prefixes: tuple[str, ...]) -> bool:
    """Whether an address is below one of the prefixes. Such an address has the scheme, host and port of the prefix, and a path
    equal to or below the prefix's path. Encoded characters are compared in decoded form, because a server may decode them."""
    try:
        asked = httpx.URL(url)
        there = _segments(asked)
        for own in map(httpx.URL, prefixes):
            base = _segments(own)
            if (own.scheme, own.host, _port(own)) == (asked.scheme, asked.host, _port(asked)) and there[: len(base)] == base:
                return asked.scheme in PORTS and not asked.userinfo
    except (httpx.InvalidURL, ValueError):
        return False
    return False


PORTS = {"http": 80, "https": 443}


def _port(url: httpx.URL) -> int | None:
    return url.port or PORTS.get(url.scheme)


def _segments(url: httpx.URL) -> list[bytes]:
    """The decoded segments of a path, without empty segments at its ends. ValueError for a segment that could mean another path.
    These are dot segments, and segments with a slash, backslash or control character, also if encoded several times."""
    found = []
    for segment in url.raw_path.partition(b"?")[0].strip(b"/").split(b"/"):
        decoded, before = unquote_to_bytes(segment), segment
        while decoded != before:
            decoded, before = unquote_to_bytes(decoded), decoded
        if decoded in (b".", b"..") or any(x < 32 or x in b"/\\" for x in decoded):
            raise ValueError("ambiguous path")
        found.append(decoded)
    return [] if found == [b""] else found


def signing_secret(settings: Settings) -> bytes:
    """The secret in the settings. Settings without a secret give a generated secret, which is stored in the data folder."""
    if settings.webhook_secret:
        return settings.webhook_secret.encode()
    file = Path(settings.data) / "webhook.secret"
    if not file.exists():
        file.touch(mode=0o600)
        file.write_text(secrets.token_urlsafe(32))
    return file.read_text().strip().encode()


def signature(secret: bytes, body: bytes) -> str:
    """The value of the signature header: the HMAC-SHA256 of a body."""
    return "sha256=" + hmac.new(secret, body, hashlib.sha256).hexdigest()


class WebhookSender:
    """Sends webhooks that are due. document: function that makes the JSON document of a job."""

    def __init__(self, store: Store, settings: Settings, document: Callable[[Job], dict[str, Any]]):
        self.store, self.settings, self.document = store, settings, document
        self.stopping = threading.Event()
        self.thread = threading.Thread(target=self._run, name="teller", daemon=True)

    def start(self) -> None:
        """Start the thread, if the settings allow any address."""
        if self.settings.webhooks:
            self.thread.start()

    def stop(self) -> None:
        """Stop the thread. The next server sends the remaining webhooks."""
        self.stopping.set()

    def _run(self) -> None:
        secret = signing_secret(self.settings)
        with httpx.Client(timeout=ANSWER_SECONDS, follow_redirects=False, trust_env=False) as http:
            while not self.stopping.is_set():
                try:
                    while not self.stopping.is_set() and (hook := self.store.next_webhook()) is not None:
                        self.send(http, hook, secret)
                except Unreachable as e:
                    log.warning("webhooks: %s", e)
                self.stopping.wait(LOOK_SECONDS)

    def send(self, http: httpx.Client, hook: Webhook, secret: bytes) -> None:
        """Send a webhook and store the result of the attempt."""
        body = json.dumps({"event": hook.kind, "delivery": hook.id, "job": self.document(hook.job)}).encode()
        said = {"Content-Type": "application/json", SIGNATURE: signature(secret, body), IDENTITY: str(hook.id)}
        try:
            if not is_allowed(hook.url, self.settings.webhooks):
                raise ValueError("webhook address is no longer allowed")
            answer = http.post(hook.url, content=body, headers=said)
            result = "told" if answer.is_success else f"status {answer.status_code}"
        except (httpx.HTTPError, httpx.InvalidURL, ValueError) as e:
            result = f"{type(e).__name__}: {e}"
        delay = None if result == "told" or hook.attempts >= ATTEMPTS else FIRST_DELAY * 2.0 ** (hook.attempts - 1)
        self.store.record_delivery(hook, result, delay)
        if result != "told":
            log.info("webhook of job %s: %s", hook.job.id, result)
