"""/v1/keys, /healthz, /readyz, /metrics."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body
from pydantic import Field
from starlette.responses import PlainTextResponse, Response

from trunnion.basics.control_characters import visible
from trunnion.basics.version import version
from trunnion.service.api.documents.job_document import rfc3339
from trunnion.service.api.documents.problem_documents import Json, Refusal, content_schema, error_responses
from trunnion.service.api.transport.api_keys_and_rates import Admin, Reader, ServerState, new_key
from trunnion.service.request_models.job_request import PlainText, RequestModel
from trunnion.service.store.store_records import Key

router = APIRouter()
KEYS: Any = {"robot": {"summary": "For a script that submits", "value": {"name": "nightly sweep", "role": "submit"}}}


class KeyRequest(RequestModel):
    """Name and role of a new key."""

    name: PlainText = Field(min_length=1, description="Name of the owner.")
    role: Literal["read", "submit", "admin"]


class KeyItem(RequestModel):
    """A key without its secret."""

    id: str
    name: str
    role: str
    created: str
    revoked: str | None


class KeyMade(KeyItem):
    """A new key with its secret. Only this response contains the secret."""

    key: str


def _item(k: Key) -> dict[str, object]:
    return {"id": k.id, "name": visible(k.name), "role": k.role, "created": rfc3339(k.created), "revoked": rfc3339(k.revoked)}


@router.post("/v1/keys", tags=["keys"], status_code=201, response_model=KeyMade, responses=error_responses(413))
def make_key(request: Annotated[KeyRequest, Body(openapi_examples=KEYS)], caller: Admin, s: ServerState) -> Response:
    """Make an API key. Only this response contains its secret."""
    key, text = new_key(request.name, request.role)
    s.store.add_key(key)
    s.store.note(caller.id, "made a key", key.id, name=key.name, role=key.role)
    return Json(_item(key) | {"key": text}, 201)


@router.get("/v1/keys", tags=["keys"], response_model=list[KeyItem], responses=error_responses())
def list_keys(caller: Admin, s: ServerState) -> Response:
    """List all keys, without their secrets."""
    return Json([_item(k) for k in s.store.all_keys()])


@router.delete("/v1/keys/{key}", tags=["keys"], status_code=204, responses=error_responses(404))
def revoke_key(key: str, caller: Admin, s: ServerState) -> Response:
    """Revoke a key."""
    plain = len(key) == 12 and key.isascii() and key.isalnum()
    if not plain or not s.store.revoke(key):
        raise Refusal(404, "there is no such key in use")
    s.store.note(caller.id, "revoked a key", key)
    return Response(status_code=204)


@router.get("/healthz", tags=["health"])
async def get_health() -> dict[str, str]:
    """Return the version. A response shows that the server is running."""
    return {"status": "ok", "version": version()}


@router.get(
    "/readyz",
    tags=["health"],
    responses={
        200: content_schema("application/json"),
        503: {"description": "Not ready.", **content_schema("application/json")},
    },
)
async def get_readiness(s: ServerState) -> Response:
    """Report whether the server can accept and run jobs: state of database, cluster and results."""
    checks = {"database": await s.database_state(), "workers": s.cluster.counted, "trouble": s.dispatcher.trouble}
    good = checks["database"] == "ok" and not s.dispatcher.trouble and s.dispatcher.thread.is_alive()
    return Json({"status": "ready" if good else "not ready", **checks}, 200 if good else 503)


@router.get("/metrics", tags=["health"], response_class=PlainTextResponse, responses=error_responses())
def get_metrics(caller: Reader, s: ServerState) -> Response:
    """Return counters and gauges in the text format of Prometheus."""
    return Response(s.metrics.text(s.store.states(), s.cluster.counted), media_type="text/plain; version=0.0.4; charset=utf-8")
