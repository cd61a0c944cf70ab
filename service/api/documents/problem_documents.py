"""RFC 9457 problem documents for errors. A document contains the list of problems that the command line would print."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from functools import partial
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Match

from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.service.basics.json_text import text_of
from trunnion.service.executor.dask_cluster import NoCluster
from trunnion.service.executor.parquet_parts import StorageError
from trunnion.service.executor.part_file_format import CorruptPart
from trunnion.service.request_models.validation_messages import problem_of
from trunnion.service.request_workers.fair_queue import QueueFull
from trunnion.service.request_workers.worker_processes import NotReady, ProcessEnded, TookTooLong
from trunnion.service.store.database_connection import Unreachable
from trunnion.service.store.job_store import BadCursor, Conflict

log = logging.getLogger("trunnion.service")
MEDIA = "application/problem+json"
TITLES = {
    400: "The request cannot be read",
    401: "An API key is required",
    403: "Not allowed",
    404: "Not found",
    405: "Method not allowed",
    406: "Format not available",
    408: "The body took too long to arrive",
    409: "Not possible in the present state",
    413: "The request is too large",
    415: "The body must be JSON",
    416: "The range is outside the content",
    422: "The request has problems",
    429: "Too many requests",
    500: "Internal error",
    501: "Not installed",
    503: "Temporarily unavailable",
}


def title_of(status: int) -> str:
    try:
        return TITLES.get(status) or HTTPStatus(status).phrase
    except ValueError:
        return "An error"


class ProblemItem(BaseModel):
    """One mistake: its place, cause and remedy."""

    where: str
    what: str
    hint: str = ""
    file: str = ""
    line: int = 0


class ProblemDocument(BaseModel):
    """A problem document of RFC 9457, with a list of problems."""

    type: str = Field("about:blank", description="urn:trunnion:… or about:blank")
    title: str
    status: int
    detail: str = ""
    problems: list[ProblemItem] = Field([], description="The first problems; if there are more, the last entry states how many.")
    problem_count: int = Field(0, description="Number of all problems.")

    model_config = {
        "json_schema_extra": {
            "examples": [
                {
                    "type": "urn:trunnion:problems",
                    "title": "The request has problems",
                    "status": 422,
                    "detail": "1 problem",
                    "problem_count": 1,
                    "problems": [
                        {
                            "where": "joints.ball.friction.mu",
                            "what": "-1 is negative",
                            "hint": "a coefficient ≥ 0",
                            "file": "",
                            "line": 0,
                        }
                    ],
                }
            ]
        }
    }


class Refusal(Exception):
    """Ends a request with a problem document."""

    def __init__(self, status: int, detail: str, problems: Iterable[Problem] = (), headers: dict[str, str] | None = None):
        super().__init__(detail)
        self.status, self.detail, self.problems, self.headers = status, detail, tuple(problems), headers or {}


def shutting_down() -> Refusal:
    return Refusal(503, "the server is shutting down; try again", headers={"Retry-After": "10"})


class Json(Response):
    """A JSON response written by ``text_of``."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """The bytes of the body for this content."""
        return text_of(content)


def problem_response(
    status: int, detail: str = "", problems: Iterable[Problem] = (), headers: dict[str, str] | None = None
) -> Response:
    """A response with a problem document. If ``detail`` is empty, the detail is the number of problems."""
    error = SceneError(problems)
    kind = "urn:trunnion:problems" if error.total else "about:blank"
    body = {
        "type": kind, "title": title_of(status), "status": status,
        "detail": detail or (counted(error.total) if error.total else ""),
        "problems": [p.as_dict() for p in error.problems], "problem_count": error.total,
    }  # fmt: skip
    return Response(text_of(body), status, headers, MEDIA)


def counted(n: int) -> str:
    """The number of problems as text, such as "3 problems"."""
    return f"{n} problem{'' if n == 1 else 's'}"


OUTAGES: tuple[tuple[type[Exception], str, str, int], ...] = (
    (Unreachable, "database", "the database is unavailable; try again", 5),
    (NoCluster, "cluster", "the cluster is unavailable; try again", 5),
    (StorageError, "results", "the storage of the results is unavailable; try again", 10),
    (CorruptPart, "results", "a stored part is damaged and is being recomputed; try again", 10),
)
"""Errors of components that are temporarily unavailable. A row has the exception, the name in the log, the detail for clients, and
the seconds until a retry."""


async def _outage_response(name: str, words: str, seconds: int, _: Request, e: Exception) -> Response:
    """The response while a component (database, cluster, stored part) is unavailable."""
    log.warning("%s: %s", name, e)
    return problem_response(503, words, headers={"Retry-After": str(seconds)})


RESPONSES: dict[type[Exception], Callable[[Any], Response]] = {
    Refusal: lambda e: problem_response(e.status, e.detail, e.problems, e.headers),
    SceneError: lambda e: problem_response(422, problems=e.problems),
    SimulationError: lambda e: problem_response(422, problems=[Problem("run", str(e))]),
    RequestValidationError: lambda e: problem_response(422, problems=map(_of_validation, e.errors())),
    Conflict: lambda e: problem_response(409, str(e)),
    BadCursor: lambda e: problem_response(422, problems=[Problem("cursor", str(e), "use the cursor of the previous page")]),
    QueueFull: lambda e: problem_response(429 if e.own else 503, str(e), headers={"Retry-After": "5"}),
    NotReady: lambda e: problem_response(503, str(e), headers={"Retry-After": "10"}),
    **dict.fromkeys(
        (TookTooLong, ProcessEnded),
        lambda e: problem_response(422, problems=[Problem("body", str(e), "send a smaller scene or fewer values")]),
    ),
}
"""Responses to errors that the request causes, by type of exception."""


async def _response(respond: Callable[[Any], Response], _: Request, e: Exception) -> Response:
    return respond(e)


def install_error_handlers(app: FastAPI) -> None:
    """Turn every error that the application raises into a problem document."""
    for error, respond in RESPONSES.items():
        app.add_exception_handler(error, partial(_response, respond))
    for kind, name, words, seconds in OUTAGES:
        app.add_exception_handler(kind, partial(_outage_response, name, words, seconds))

    @app.exception_handler(HTTPException)
    def http(request: Request, e: HTTPException) -> Response:
        detail, more = str(e.detail), dict(e.headers or {})
        if e.status_code == 405:
            more["Allow"] = ", ".join(allowed(app, request))
            detail = f"{request.method} is not allowed here: use {more['Allow']}"
        return problem_response(e.status_code, detail, headers=more)

    @app.exception_handler(Exception)
    def defect(_: Request, e: Exception) -> Response:
        log.error("internal error", exc_info=e)
        return problem_response(500, f"internal error ({type(e).__name__}); please report it with the request")


METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")


def allowed(app: FastAPI, request: Request) -> list[str]:
    """The HTTP methods that the path of a request accepts."""
    found = {m for m in METHODS if any(r.matches(dict(request.scope) | {"method": m})[0] == Match.FULL for r in app.routes)}
    return sorted(found | ({"HEAD"} if "GET" in found else set()))


def _of_validation(e: Any) -> Problem:
    """The problem that describes an error of pydantic."""
    if e["type"] == "json_invalid":
        return Problem("body", f"invalid JSON: {e['ctx']['error']}, at character {e['loc'][-1]}"[:500])
    if e["loc"] == ("body",) and isinstance(e.get("input"), bytes | str):
        return Problem("body", "the body is not declared as JSON", "add the header Content-Type: application/json")
    inside = len(e["loc"]) > 1 and e["loc"][0] in ("body", "query", "path", "header")
    return problem_of({**e, "loc": e["loc"][1:] if inside else e["loc"]})


def error_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The entries of an operation's ``responses`` in the OpenAPI document, for these statuses and for the errors that every
    operation can return."""
    every = sorted({*statuses, 400, 401, 403, 422, 429, 503} | ({408} if 413 in statuses else set()))
    content = {MEDIA: {"schema": {"$ref": "#/components/schemas/ProblemDocument"}}}
    again = header_schema("Retry-After", "Seconds after which to try again.", "integer")
    headers = {401: header_schema("WWW-Authenticate", "Bearer."), 429: again, 503: again}
    return {s: {"description": TITLES[s], "content": content, **headers.get(s, {})} for s in every}


def content_schema(media: str, kind: str = "object", **more: str) -> dict[str, Any]:
    """The part of a documented response that describes the response's content. kind, more: JSON Schema of the content."""
    return {"content": {media: {"schema": {"type": kind, **more}}}}


def header_schema(name: str, words: str, kind: str = "string") -> dict[str, Any]:
    """The part of a documented response that describes a header."""
    return {"headers": {name: {"description": words, "schema": {"type": kind}}}}
