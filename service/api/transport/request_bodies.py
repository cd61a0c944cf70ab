"""Request bodies: their schemas in the OpenAPI document, and their checks by the worker pool."""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import Request
from pydantic import BaseModel
from starlette.requests import ClientDisconnect

from trunnion.service.api.documents.problem_documents import ProblemDocument, Refusal, shutting_down
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Caller
from trunnion.service.request_workers.worker_processes import Task, WorkerPool

BODY_MODELS: dict[str, type[BaseModel]] = {"ProblemDocument": ProblemDocument}
"""The problem document and the request models in the OpenAPI document, by name."""


def body_schema(model: type[BaseModel], examples: dict[str, Any]) -> dict[str, Any]:
    """The part of an operation's OpenAPI description that describes its body."""
    BODY_MODELS[model.__name__] = model
    content = {"schema": {"$ref": f"#/components/schemas/{model.__name__}"}, "examples": examples}
    return {"requestBody": {"required": True, "content": {"application/json": content}}}


def body_schemas() -> dict[str, Any]:
    """The schemas of ``BODY_MODELS`` and of the models that they contain."""
    schemas: dict[str, Any] = {}
    for name, model in BODY_MODELS.items():
        made = model.model_json_schema(ref_template="#/components/schemas/{model}")
        schemas |= made.pop("$defs", {})
        schemas[name] = made
    return schemas


async def check_body(
    s: Service, request: Request, caller: Caller, task: Task, *more: Any, pool: WorkerPool | None = None, seconds: float = 0.0
) -> Any:
    """The result of a worker pool task for the body of a request; SceneError with all problems of the body. more: further arguments
    of the task. pool, seconds: the worker pool and the time limit. The defaults are the pool that checks requests and its time
    limit."""
    limits, media = s.settings.limits, str(request.headers.get("content-type", ""))
    try:
        body = await request.body()
    except ClientDisconnect:
        raise Refusal(400, "the body is incomplete") from None
    try:
        return await (pool or s.checks).ask(caller.id, task, body, media, limits, *more, seconds=seconds or limits.check_seconds)
    except asyncio.CancelledError:
        raise shutting_down() from None
