"""Errors as RFC 9457 problem documents, with the same list of problems as the command line prints."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from functools import partial
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Match

from engine.basics.problems import Problem, SceneError, SimulationError
from service.executor.cluster import NoCluster
from service.executor.sealed import Spoiled
from service.plain import text_of
from service.store.database import Unreachable
from service.store.store import BadCursor, Conflict

log = logging.getLogger("trunnion.service")
MEDIA = "application/problem+json"
TITLES = {
    400: "The request cannot be read",
    401: "An API key is needed",
    403: "Not allowed",
    404: "There is no such thing here",
    405: "This cannot be done here",
    406: "No such format",
    408: "It took too long to come",
    409: "It cannot be done in this state",
    413: "The request is too large",
    415: "The body must be JSON",
    416: "It has not so many bytes",
    422: "The request has problems",
    429: "Too many requests",
    500: "A defect of the server",
    501: "Not installed",
    503: "Not possible now",
}


def title_of(status: int) -> str:
    """What a status means, in words."""
    try:
        return TITLES.get(status) or HTTPStatus(status).phrase
    except ValueError:
        return "An error"


class ProblemItem(BaseModel):
    """One mistake: where, what, and what to do."""

    where: str
    what: str
    hint: str = ""
    file: str = ""
    line: int = 0


class ProblemDocument(BaseModel):
    """RFC 9457, with the list of problems."""

    type: str = Field("about:blank", description="urn:trunnion:… or about:blank")
    title: str
    status: int
    detail: str = ""
    problems: list[ProblemItem] = Field([], description="The first; where there are more, a last one counts the others.")
    problem_count: int = Field(0, description="How many there are, those not listed included.")

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


class Json(Response):
    """A JSON response written by ``text_of``."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """The content as the body's bytes."""
        return text_of(content)


def problem_response(
    status: int, detail: str = "", problems: Iterable[Problem] = (), headers: dict[str, str] | None = None
) -> Response:
    """A problem document; its detail says how many problems there are, when nothing else is said."""
    error = SceneError(problems)
    kind = "urn:trunnion:problems" if error.total else "about:blank"
    body = {
        "type": kind, "title": title_of(status), "status": status,
        "detail": detail or (counted(error.total) if error.total else ""),
        "problems": [p.as_dict() for p in error.problems], "problem_count": error.total,
    }  # fmt: skip
    return Response(text_of(body), status, headers, MEDIA)


def counted(n: int) -> str:
    """A number of problems in words, such as "3 problems"."""
    return f"{n} problem{'' if n == 1 else 's'}"


AWAY: tuple[tuple[type[Exception], str, str, int], ...] = (
    (Unreachable, "database", "the database cannot be used now; try again", 5),
    (NoCluster, "cluster", "the cluster cannot be used now; try again", 5),
    (Spoiled, "results", "what was kept could not be read back, and is computed again; try again", 10),
)
"""What may be away for a while: its errors, its name in the log, what a client is told, and after how many s to come again."""


async def _away(name: str, words: str, seconds: int, _: Request, e: Exception) -> Response:
    """The answer while something is away."""
    log.warning("%s: %s", name, e)
    return problem_response(503, words, headers={"Retry-After": str(seconds)})


def install(app: FastAPI) -> None:
    """Every error the application can raise becomes a problem document."""

    @app.exception_handler(Refusal)
    def refused(_: Request, e: Refusal) -> Response:
        return problem_response(e.status, e.detail, e.problems, e.headers)

    @app.exception_handler(SceneError)
    def wrong(_: Request, e: SceneError) -> Response:
        return problem_response(422, problems=e.problems)

    @app.exception_handler(SimulationError)
    def failed(_: Request, e: SimulationError) -> Response:
        return problem_response(422, problems=[Problem("run", str(e))])

    @app.exception_handler(RequestValidationError)
    def invalid(_: Request, e: RequestValidationError) -> Response:
        return problem_response(422, problems=map(_of_validation, e.errors()))

    @app.exception_handler(HTTPException)
    def http(request: Request, e: HTTPException) -> Response:
        detail, more = str(e.detail), dict(e.headers or {})
        if e.status_code == 405:
            more["Allow"] = ", ".join(allowed(app, request))
            detail = f"{request.method} is none of {more['Allow']}"
        return problem_response(e.status_code, detail, headers=more)

    @app.exception_handler(Conflict)
    def conflict(_: Request, e: Conflict) -> Response:
        return problem_response(409, str(e))

    @app.exception_handler(BadCursor)
    def cursor(_: Request, e: BadCursor) -> Response:
        return problem_response(422, problems=[Problem("cursor", str(e), "take it from the answer before")])

    for kind, name, words, seconds in AWAY:
        app.add_exception_handler(kind, partial(_away, name, words, seconds))

    @app.exception_handler(Exception)
    def defect(_: Request, e: Exception) -> Response:
        log.error("internal error", exc_info=e)
        return problem_response(500, f"internal error ({type(e).__name__}); please report it with the request")


METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")


def allowed(app: FastAPI, request: Request) -> list[str]:
    """The methods by which a path can be asked."""
    found = {m for m in METHODS if any(r.matches(dict(request.scope) | {"method": m})[0] == Match.FULL for r in app.routes)}
    return sorted(found | ({"HEAD"} if "GET" in found else set()))


def _of_validation(e: Any) -> Problem:
    """One of pydantic's errors as a problem."""
    if e["type"] == "json_invalid":
        return Problem("body", f"it is no JSON: {e['ctx']['error']}, at character {e['loc'][-1]}"[:500])
    place = [str(x) for x in e["loc"]]
    where = ".".join(place[1:] if place and place[0] in ("body", "query", "path", "header") and len(place) > 1 else place)
    if e["loc"] == ("body",) and isinstance(e.get("input"), bytes | str):
        return Problem("body", "it was not sent as JSON", "add the header Content-Type: application/json")
    return Problem(where[:300] or "body", str(e["msg"])[:500])


def documented(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Entries of an operation's ``responses`` for these errors, and those any operation may give."""
    every = sorted({*statuses, 400, 401, 403, 422, 429, 503} | ({408} if 413 in statuses else set()))
    content = {MEDIA: {"schema": {"$ref": "#/components/schemas/ProblemDocument"}}}
    again = with_header("Retry-After", "Seconds after which to try again.", "integer")
    headers = {401: with_header("WWW-Authenticate", "Bearer."), 429: again, 503: again}
    return {s: {"description": TITLES[s], "content": content, **headers.get(s, {})} for s in every}


def with_header(name: str, words: str, kind: str = "string") -> dict[str, Any]:
    """The part of a documented response that names a header."""
    return {"headers": {name: {"description": words, "schema": {"type": kind}}}}
