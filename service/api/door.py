"""Before anything else of a request: its size, the time its body takes, where it comes from, HEAD; and what every answer says."""

from __future__ import annotations

import asyncio
import time
from typing import Any
from urllib.parse import urlsplit

from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.api.problems import problem_response
from service.settings import is_loopback

BODY_SECONDS = 60.0
"""Time for all of a body to come in."""
SMALL, SMALL_BODY = (("POST", "/v1/keys"), ("PATCH", "/v1/jobs/")), 10_000
"""Methods, and beginnings of paths, whose bodies are read by the server itself, and how long these may be."""
SAID: dict[bytes, bytes] = {
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"x-frame-options": b"SAMEORIGIN",
    b"content-security-policy": b"frame-ancestors 'self'",
}
"""What every answer says, unless it says otherwise itself."""


class Door:
    """Lets requests in. When no key is needed, only those meant for this machine's own address (a page elsewhere could otherwise
    have a visitor's browser send them)."""

    def __init__(self, app: ASGIApp, most: int, open: bool):
        self.app, self.most, self.open = app, most, open

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let the request in, or refuse it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        small = any(scope["method"] == method and scope["path"].startswith(path) for method, path in SMALL)
        most = min(self.most, SMALL_BODY) if small else self.most
        headers = {k.lower(): v.decode("latin-1") for k, v in scope["headers"]}
        refusal = self._refusal(scope, headers, most)
        answer = guarded(send)
        if refusal is not None:
            await refusal(scope, receive, answer)
        elif scope["method"] == "HEAD":
            await headed(self.app, scope, receive, answer)
        else:
            await self.app(scope, counted(receive, most), answer)

    def _refusal(self, scope: Scope, headers: dict[bytes, str], most: int) -> Any:
        length = headers.get(b"content-length", "0")
        if length.isascii() and length.isdigit() and int(length[:20]) > most:
            return problem_response(413, f"at most {most} bytes", headers={"Connection": "close"})
        host, origin = headers.get(b"host", ""), headers.get(b"origin")
        if self.open and not is_loopback(_name(f"//{host}")):
            return problem_response(403, "without keys, only requests to this machine's own address are answered")
        if origin is not None and scope["method"] not in ("GET", "HEAD", "OPTIONS") and _place(origin) != host:
            return problem_response(403, "requests from other sites are not answered")
        return None


def counted(receive: Receive, most: int) -> Receive:
    """The same, as long as a body is not too large and does not take too long."""
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


def guarded(send: Send) -> Send:
    """The same, with the headers that every answer has."""

    async def said(message: Message) -> None:
        if message["type"] == "http.response.start":
            there = {k.lower() for k, _ in message["headers"]}
            message["headers"] = [*message["headers"], *((k, v) for k, v in SAID.items() if k not in there)]
        await send(message)

    return said


async def headed(app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
    """Answer HEAD as GET is answered, without the body, which is not even made."""
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


def _name(url: str) -> str:
    try:
        return urlsplit(url).hostname or ""
    except ValueError:
        return ""


def _place(url: str) -> str:
    try:
        return urlsplit(url).netloc
    except ValueError:
        return ""
