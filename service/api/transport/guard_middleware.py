"""Checks of every request (size and duration of the body, host, origin), HEAD requests, and default headers of every response."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from typing import Any
from urllib.parse import SplitResult, quote, urlsplit

from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from trunnion.basics.renamed_words import deprecation_notes
from trunnion.service.api.documents.problem_documents import problem_response
from trunnion.service.basics.server_settings import is_loopback

BODY_SECONDS = 60.0
"""Longest time in which a whole body must arrive, s."""
SMALL, SMALL_BODY = (("POST", "/v1/keys"), ("PATCH", "/v1/jobs/")), 10_000
"""SMALL: methods and path prefixes of requests whose bodies the server process parses itself. SMALL_BODY: largest size of such
bodies, bytes."""
SECURITY_HEADERS: dict[bytes, bytes] = {
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"x-frame-options": b"SAMEORIGIN",
    b"content-security-policy": b"frame-ancestors 'self'",
}
"""Default headers of every response."""
WARNING, SAFE = b'299 trunnion "%s"', " !#$&'()*+,/:;=?@[]~"
"""WARNING: form of the Warning header (RFC 7234). SAFE: characters of a note that are not percent-encoded."""


class GuardMiddleware:
    """Admits or refuses requests. A server without keys admits only requests whose Host is a loopback address. Without this rule, a
    page of another site could send requests to the server through the browser of a user."""

    def __init__(self, app: ASGIApp, most: int, open: bool):
        self.app, self.most, self.open = app, most, open

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request to the application, or refuse it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        small = any(scope["method"] == method and scope["path"].startswith(path) for method, path in SMALL)
        most = min(self.most, SMALL_BODY) if small else self.most
        headers = {k.lower(): v.decode("latin-1") for k, v in scope["headers"]}
        refusal = self._refusal(scope, headers, most)
        with deprecation_notes() as notes:
            await self._answer(scope, receive, add_headers(send, notes), refusal, most)

    async def _answer(self, scope: Scope, receive: Receive, answer: Send, refusal: Any, most: int) -> None:
        if refusal is not None:
            await refusal(scope, receive, answer)
        elif scope["method"] == "HEAD":
            await answer_head(self.app, scope, receive, answer)
        else:
            await self.app(scope, limit_body(receive, most), answer)

    def _refusal(self, scope: Scope, headers: dict[bytes, str], most: int) -> Any:
        length = headers.get(b"content-length", "0")
        if length.isascii() and length.isdigit() and int(length[:20]) > most:
            return problem_response(413, f"at most {most} bytes", headers={"Connection": "close"})
        host, origin = headers.get(b"host", ""), headers.get(b"origin")
        if self.open and not is_loopback(_parts_of(f"//{host}").hostname or ""):
            return problem_response(
                403,
                "a server without keys accepts only requests to a local address; to share the server, start it with --keys",
            )
        if origin is not None and scope["method"] not in ("GET", "HEAD", "OPTIONS") and _parts_of(origin).netloc != host:
            return problem_response(403, "requests from other sites are refused")
        return None


def limit_body(receive: Receive, most: int) -> Receive:
    """The ASGI function ``receive``, with limits of the body's size and of the time until the whole body has arrived."""
    got, end, whole = 0, time.monotonic() + BODY_SECONDS, False

    async def next_one() -> Message:
        nonlocal got, whole
        if whole:
            return await receive()
        try:
            message = await asyncio.wait_for(receive(), max(0.0, end - time.monotonic()))
        except TimeoutError:
            raise HTTPException(408, f"the body took longer than {BODY_SECONDS:g} s", {"Connection": "close"}) from None
        got += len(message.get("body", b""))
        whole = not message.get("more_body", False)
        if got > most:
            raise HTTPException(413, f"at most {most} bytes")
        return message

    return next_one


def add_headers(send: Send, notes: Sequence[str] = ()) -> Send:
    """The ASGI function ``send``, which also adds the default headers, and a Warning header for each note about a deprecated
    word."""

    async def said(message: Message) -> None:
        if message["type"] == "http.response.start":
            there = {k.lower() for k, _ in message["headers"]}
            message["headers"] = [*message["headers"], *((k, v) for k, v in SECURITY_HEADERS.items() if k not in there)]
            message["headers"] += [(b"warning", WARNING % quote(note, safe=SAFE).encode()) for note in notes]
        await send(message)

    return said


async def answer_head(app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
    """Respond to HEAD with the headers of GET, without generating a body."""
    begun = asyncio.Event()

    async def first(message: Message) -> None:
        if message["type"] == "http.response.start" and not begun.is_set():
            await send(message)
            begun.set()

    scope["method"] = "GET"
    work = asyncio.ensure_future(app(scope, receive, first))
    try:
        waiting = asyncio.ensure_future(begun.wait())
        await asyncio.wait({work, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        if not begun.is_set():
            await work
        await send({"type": "http.response.body", "body": b""})
    finally:
        work.cancel()
        scope["method"] = "HEAD"


def _parts_of(url: str) -> SplitResult:
    """The parts of a URL. The parts of an invalid URL are empty."""
    try:
        return urlsplit(url)
    except ValueError:
        return urlsplit("")
