"""Request bodies: their schemas in the OpenAPI document, and their checks by the worker pool."""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import Request
from pydantic import BaseModel
from starlette.requests import ClientDisconnect

from trunnion.basics.problems import Problem
from trunnion.service.api.documents.problem_documents import ProblemDocument, Refusal
from trunnion.service.api.server_state.server_components import Service
from trunnion.service.api.transport.api_keys_and_rates import Caller
from trunnion.service.request_workers.fair_queue import QueueFull
from trunnion.service.request_workers.worker_pool import WorkerPool
from trunnion.service.request_workers.worker_process import Ended, NotReady, TookTooLong

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


async def check_body(s: Service, request: Request, caller: Caller, task: str) -> Any:
    """The result of a worker pool task for the body of a request; SceneError with all problems of the body."""
    body, limits = await read_body(request), s.settings.limits
    return await run_in_worker(s.checks, caller, task, body, body_media_type(request), limits, seconds=limits.check_seconds)


def body_media_type(request: Request) -> str:
    return str(request.headers.get("content-type", ""))


async def read_body(request: Request) -> bytes:
    try:
        return await request.body()
    except ClientDisconnect:
        raise Refusal(400, "the body is incomplete") from None


async def run_in_worker(pool: WorkerPool, caller: Caller, task: str, *arguments: Any, seconds: float) -> Any:
    """The result of a worker pool task. Refusal (422) when the task needs too much time or memory, (429, 503) when too many tasks
    wait."""
    try:
        return await pool.ask(caller.id, task, *arguments, seconds=seconds)
    except asyncio.CancelledError:
        raise Refusal(503, "the server is shutting down; try again", headers={"Retry-After": "10"}) from None
    except QueueFull as e:
        raise Refusal(429 if e.own else 503, str(e), headers={"Retry-After": "5"}) from None
    except NotReady as e:
        raise Refusal(503, str(e), headers={"Retry-After": "10"}) from None
    except (TookTooLong, Ended) as e:
        raise Refusal(422, "", [Problem("body", str(e), "send a smaller scene or fewer values")]) from None
