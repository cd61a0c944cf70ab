"""API keys with roles (stored as hashes), access from this machine without keys, rate limits."""

from __future__ import annotations

import hashlib
import hmac
import math
import secrets
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request, Security
from fastapi.concurrency import run_in_threadpool
from fastapi.security import APIKeyHeader, HTTPAuthorizationCredentials, HTTPBearer
from limits import parse
from limits.storage import MemoryStorage
from limits.strategies import SlidingWindowCounterRateLimiter

from trunnion.service.api.documents.problem_documents import Refusal
from trunnion.service.api.server_state.server_components import Service, service
from trunnion.service.store.store_records import Key

COOKIE = "trunnion_key"
ROLES = ("read", "submit", "admin")
"""Roles. Each role includes the rights of all roles before it."""
FAILURES = "30/minute"
"""Limit of the rate at which an address may send wrong keys."""
bearer = HTTPBearer(auto_error=False, scheme_name="bearer", description="An API key.")
header = APIKeyHeader(name="X-API-Key", auto_error=False, scheme_name="header", description="An API key.")


@dataclass(frozen=True)
class Caller:
    """The caller of a request: id of the key ("local" on a server without keys) and role."""

    id: str
    role: str


LOCAL = Caller("local", "admin")
"""The caller of a server without keys."""


def new_key(name: str, role: str) -> tuple[Key, str]:
    """A new key: the record to store, and the text of the key, which is shown once. The secret has 256 random bits and cannot be
    guessed. Therefore the record may hold a plain digest of the secret."""
    identity, secret = secrets.token_hex(6), secrets.token_urlsafe(32)
    return Key(identity, name, role, _digest(secret), time.time(), None), f"tr_{identity}_{secret}"


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode("utf-8", "replace")).hexdigest()


def valid_key(s: Service, text: str) -> Key | None:
    """The active key with this text, else None."""
    mark, _, rest = text.partition("_")
    identity, _, secret = rest.partition("_")
    key = s.store.key(identity) if mark == "tr" and identity.isalnum() and len(identity) == 12 and identity.isascii() else None
    right = hmac.compare_digest(key.hash if key else "0" * 64, _digest(secret))
    return key if key and right and key.revoked is None else None


def need(role: str) -> Callable[..., Awaitable[Caller]]:
    """A FastAPI dependency that returns the caller; Refusal (403) if the caller's role is lower than ``role``."""

    async def caller(
        request: Request,
        token: Annotated[HTTPAuthorizationCredentials | None, Security(bearer)] = None,
        named: Annotated[str | None, Security(header)] = None,
    ) -> Caller:
        s: Service = request.app.state.service
        cookie = request.cookies.get(COOKIE) if request.method == "GET" else None  # links and images send no headers
        address = request.client.host if request.client else "unknown"
        text = token.credentials if token else named or cookie
        found = LOCAL if s.settings.open else await run_in_threadpool(_find_caller, s, text, request.app.state.failures, address)
        _check_rate(s, request, found.id if found.id != "local" else address)
        if ROLES.index(found.role) < ROLES.index(role):
            raise Refusal(403, f"this request needs a key with the role {role}; your key has the role {found.role}")
        return found

    return caller


ServerState = Annotated[Service, Depends(service)]
Reader = Annotated[Caller, Depends(need("read"))]
Submitter = Annotated[Caller, Depends(need("submit"))]
Admin = Annotated[Caller, Depends(need("admin"))]


def _find_caller(s: Service, text: str | None, failures: Rates, address: str) -> Caller:
    key = valid_key(s, text) if text else None
    if text and key is None and (seconds := failures.wait(address)):
        raise Refusal(429, "too many unknown keys came from this address", headers={"Retry-After": str(seconds)})
    if key is None:
        what = "unknown or revoked key" if text else "send Authorization: Bearer KEY, or X-API-Key: KEY"
        raise Refusal(401, what, headers={"WWW-Authenticate": "Bearer"})
    return Caller(key.id, key.role)


class Rates:
    """Limits the rate of requests of each caller. text: a rate such as "20/second", or "" for no limit."""

    def __init__(self, text: str):
        self.item = parse(text) if text else None
        self.window = SlidingWindowCounterRateLimiter(MemoryStorage())

    def wait(self, who: str) -> int:
        """Count a request. Returns 0 for an allowed request, else the seconds until the next request is allowed."""
        if self.item is None or self.window.hit(self.item, who):
            return 0
        return max(1, math.ceil(self.window.get_window_stats(self.item, who).reset_time - time.time()))


def _check_rate(s: Service, request: Request, who: str) -> None:
    rates: Rates = request.app.state.rates
    if seconds := rates.wait(who):
        raise Refusal(429, f"more than {s.settings.limits.rate}", headers={"Retry-After": str(seconds)})
