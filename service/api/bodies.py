"""Bodies of requests: described in the OpenAPI document, read and checked by the desk."""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import Request
from pydantic import BaseModel
from starlette.requests import ClientDisconnect

from engine.basics.problems import Problem
from service.api.problems import Refusal
from service.api.security import Caller
from service.api.service import Service
from service.desk.clerk import Ended, NotReady, TookTooLong
from service.desk.desk import Desk
from service.desk.row import Crowded

MODELS: dict[str, type[BaseModel]] = {}
"""The requests that are described, by name."""


def asks(model: type[BaseModel], examples: dict[str, Any]) -> dict[str, Any]:
    """The part of an operation's description that says what its body is."""
    MODELS[model.__name__] = model
    content = {"schema": {"$ref": f"#/components/schemas/{model.__name__}"}, "examples": examples}
    return {"requestBody": {"required": True, "content": {"application/json": content}}}


def described() -> dict[str, Any]:
    """The schemas of the requests, and of what they hold."""
    schemas: dict[str, Any] = {}
    for name, model in MODELS.items():
        made = model.model_json_schema(ref_template="#/components/schemas/{model}")
        schemas |= made.pop("$defs", {})
        schemas[name] = made
    return schemas


async def told(s: Service, request: Request, caller: Caller, task: str) -> Any:
    """What the desk makes of the body of a request; SceneError with all its problems."""
    body, limits = await body_of(request), s.settings.limits
    return await at_desk(s.checks, caller, task, body, media_of(request), limits, seconds=limits.check_seconds)


def media_of(request: Request) -> str:
    """The media type of a request's body."""
    return str(request.headers.get("content-type", ""))


async def body_of(request: Request) -> bytes:
    """The body of a request."""
    try:
        return await request.body()
    except ClientDisconnect:
        raise Refusal(400, "the body did not come whole") from None


async def at_desk(desk: Desk, caller: Caller, task: str, *arguments: Any, seconds: float) -> Any:
    """What a desk makes of something. Refusal (422, 429, 503) where that takes too much, or too many wait."""
    try:
        return await desk.ask(caller.id, task, *arguments, seconds=seconds)
    except asyncio.CancelledError:
        raise Refusal(503, "the server ends; ask again", headers={"Retry-After": "10"}) from None
    except Crowded as e:
        raise Refusal(429 if e.own else 503, str(e), headers={"Retry-After": "5"}) from None
    except NotReady as e:
        raise Refusal(503, str(e), headers={"Retry-After": "10"}) from None
    except (TookTooLong, Ended) as e:
        raise Refusal(422, "", [Problem("body", str(e), "ask for less: a smaller scene, fewer values")]) from None
