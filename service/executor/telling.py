"""A thread that tells others when jobs have ended: signed, tried again for a while, only to addresses the server was started
with."""

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
from urllib.parse import urlsplit

import httpx

from service.settings import Settings
from service.store.database import Unreachable
from service.store.hooks import Hook, HookStore
from service.store.rows import Job

log = logging.getLogger("trunnion.service")
ATTEMPTS, FIRST_DELAY = 10, 5.0
"""How often it is tried, and s after the first attempt to the second; from one to the next the pause doubles: 85 min in all."""
ANSWER_SECONDS = 10.0
LOOK_SECONDS = 1.0
SIGNATURE, IDENTITY = "Trunnion-Signature", "Trunnion-Delivery"


def allowed(url: str, prefixes: tuple[str, ...]) -> bool:
    """Whether a server that was started with these addresses tells one: same scheme, host and port, and a path below theirs."""
    try:
        asked = urlsplit(url)
        port = asked.port
        if asked.scheme not in ("http", "https") or asked.username is not None or ".." in asked.path or "\\" in url:
            return False
        for prefix in prefixes:
            own = urlsplit(prefix)
            same = (own.scheme, own.hostname, own.port) == (asked.scheme, asked.hostname, port)
            if same and (own.path.rstrip("/") == asked.path.rstrip("/") or asked.path.startswith(own.path.rstrip("/") + "/")):
                return True
    except ValueError:
        return False
    return False


def secret_of(settings: Settings) -> bytes:
    """The secret by which messages are signed: that of the settings, else one that is made once and kept in the data folder."""
    if settings.webhook_secret:
        return settings.webhook_secret.encode()
    file = Path(settings.data) / "webhook.secret"
    if not file.exists():
        file.touch(mode=0o600)
        file.write_text(secrets.token_urlsafe(32))
    return file.read_text().strip().encode()


def signature(secret: bytes, body: bytes) -> str:
    """HMAC-SHA256 of a message's body, as it stands in its header."""
    return "sha256=" + hmac.new(secret, body, hashlib.sha256).hexdigest()


class Teller:
    """Tells what is to be told. document: how a job is described to clients."""

    def __init__(self, store: HookStore, settings: Settings, document: Callable[[Job], dict[str, Any]]):
        self.store, self.settings, self.document = store, settings, document
        self.stopping = threading.Event()
        self.thread = threading.Thread(target=self._run, name="teller", daemon=True)

    def start(self) -> None:
        """Start the thread, where there is anybody to tell."""
        if self.settings.webhooks:
            self.thread.start()

    def stop(self) -> None:
        """Let it end; what was not told is told by the next server."""
        self.stopping.set()

    def _run(self) -> None:
        secret = secret_of(self.settings)
        with httpx.Client(timeout=ANSWER_SECONDS, follow_redirects=False, trust_env=False) as http:
            while not self.stopping.is_set():
                try:
                    while not self.stopping.is_set() and (hook := self.store.due_hook()) is not None:
                        self.tell(http, hook, secret)
                except Unreachable as e:
                    log.warning("webhooks: %s", e)
                self.stopping.wait(LOOK_SECONDS)

    def tell(self, http: httpx.Client, hook: Hook, secret: bytes) -> None:
        """Send one message, and record what became of it."""
        body = json.dumps({"event": hook.kind, "delivery": hook.id, "job": self.document(hook.job)}).encode()
        said = {"Content-Type": "application/json", SIGNATURE: signature(secret, body), IDENTITY: str(hook.id)}
        try:
            if not allowed(hook.url, self.settings.webhooks):
                raise ValueError("this server does not tell that address any more")
            answer = http.post(hook.url, content=body, headers=said)
            result = "told" if answer.is_success else f"status {answer.status_code}"
        except (httpx.HTTPError, httpx.InvalidURL, ValueError) as e:
            result = f"{type(e).__name__}: {e}"
        delay = None if result == "told" or hook.attempts >= ATTEMPTS else FIRST_DELAY * 2.0 ** (hook.attempts - 1)
        self.store.hook_told(hook, result, delay)
        if result != "told":
            log.info("webhook of job %s: %s", hook.job.id, result)
