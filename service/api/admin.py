"""Keys, health, readiness, metrics."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Depends
from pydantic import Field
from starlette.responses import PlainTextResponse, Response

from engine.basics.version import version
from service.api.documents import stamp
from service.api.jobs import Here
from service.api.problems import Json, Refusal, documented
from service.api.security import Caller, need, new_key
from service.request import Asked, Plain
from service.store.rows import Key

router = APIRouter()
KEYS: Any = {"robot": {"summary": "For a script that submits", "value": {"name": "nightly sweep", "role": "submit"}}}
Admin = Annotated[Caller, Depends(need("admin"))]


class KeyRequest(Asked):
    """What the key to make shall be: its name and role."""

    name: Plain = Field(min_length=1, description="Whose it is.")
    role: Literal["read", "submit", "admin"]


class KeyItem(Asked):
    """A key without its secret."""

    id: str
    name: str
    role: str
    created: str
    revoked: str | None


class KeyMade(KeyItem):
    """A new key; it is shown this once."""

    key: str


def _item(k: Key) -> dict[str, object]:
    return {"id": k.id, "name": k.name, "role": k.role, "created": stamp(k.created), "revoked": stamp(k.revoked)}


@router.post("/v1/keys", tags=["keys"], status_code=201, response_model=KeyMade, responses=documented(413))
def make_key(request: Annotated[KeyRequest, Body(openapi_examples=KEYS)], caller: Admin, s: Here) -> Response:
    """Make an API key; its secret is in this answer only."""
    key, text = new_key(request.name, request.role)
    s.store.add_key(key)
    s.store.note(caller.id, "made a key", key.id, name=key.name, role=key.role)
    return Json(_item(key) | {"key": text}, 201)


@router.get("/v1/keys", tags=["keys"], response_model=list[KeyItem], responses=documented())
def list_keys(caller: Admin, s: Here) -> Response:
    """List all keys, without their secrets."""
    return Json([_item(k) for k in s.store.all_keys()])


@router.delete("/v1/keys/{key}", tags=["keys"], status_code=204, responses=documented(404))
def revoke_key(key: str, caller: Admin, s: Here) -> Response:
    """Revoke a key."""
    plain = len(key) == 12 and key.isascii() and key.isalnum()
    if not plain or not s.store.revoke(key):
        raise Refusal(404, "there is no such key in use")
    s.store.note(caller.id, "revoked a key", key)
    return Response(status_code=204)


@router.get("/healthz", tags=["health"])
async def health() -> dict[str, str]:
    """Whether the server is up: any answer says so."""
    return {"status": "ok", "version": version()}


@router.get(
    "/readyz",
    tags=["health"],
    responses={
        200: {"content": {"application/json": {"schema": {"type": "object"}}}},
        503: {"description": "Not now.", "content": {"application/json": {"schema": {"type": "object"}}}},
    },
)
async def ready(s: Here) -> Response:
    """Whether jobs can be taken and worked on: database, cluster, results."""
    checks = {"database": await s.pulse.database(), "workers": s.cluster.counted, "trouble": s.dispatcher.trouble}
    good = checks["database"] == "ok" and not s.dispatcher.trouble and s.dispatcher.thread.is_alive()
    return Json({"status": "ready" if good else "not ready", **checks}, 200 if good else 503)


@router.get("/metrics", tags=["health"], response_class=PlainTextResponse, responses=documented())
def metrics(caller: Annotated[Caller, Depends(need("read"))], s: Here) -> Response:
    """Counters and gauges in the text format of Prometheus."""
    return Response(s.metrics.text(s.store.states(), s.cluster.counted), media_type="text/plain; version=0.0.4; charset=utf-8")
