"""The web application of one server."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from engine.basics.version import version
from service.api import admin, bodies, following, jobs, keeping, looking, problems, questions, results, scenes, sensitivities
from service.api.door import Door
from service.api.operations import named
from service.api.problems import ProblemDocument
from service.api.security import FAILURES, Rates
from service.api.service import Service, made
from service.metrics import Metrics
from service.page import page
from service.settings import Settings

ABOUT = """Batches of simulations over REST. Every error is a problem document (RFC 9457) with the list of problems the command line
prints. Numbers are SI; texts with units (`"30 deg"`) are understood where a scene takes them."""


def create_app(settings: Settings) -> FastAPI:
    """The application; its parts start with it and end with it."""
    return app_of(made(settings))


def app_of(service: Service) -> FastAPI:
    """The application around the parts of a server."""

    @asynccontextmanager
    async def life(_: FastAPI) -> AsyncIterator[None]:
        service.dispatcher.start()
        service.checks.start()
        service.keeper.start()
        service.teller.start()
        yield
        service.close()

    about: dict[str, Any] = {"title": "Trunnion", "version": version(), "description": ABOUT, "generate_unique_id_function": named}
    app = FastAPI(**about, docs_url=None, redoc_url=None, lifespan=life)
    app.state.service = service
    app.state.rates = Rates(service.settings.limits.rate)
    app.state.failures = Rates(FAILURES)
    problems.install(app)
    for part in (jobs, following, results, looking, questions, scenes, sensitivities, keeping, admin, page):
        app.include_router(part.router)
    app.add_middleware(Door, most=service.settings.limits.body, open=service.settings.open)
    app.add_middleware(Counting, metrics=service.metrics)
    app.openapi = lambda: _openapi(app)  # type: ignore[method-assign]
    return app


def _openapi(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document, with the problem document among its schemas."""
    if app.openapi_schema is None:
        document = get_openapi(title=app.title, version=app.version, description=app.description, routes=app.routes)
        schemas = document["components"]["schemas"]
        made = ProblemDocument.model_json_schema(ref_template="#/components/schemas/{model}")
        schemas |= made.pop("$defs", {})
        schemas["ProblemDocument"] = made
        schemas |= bodies.described()
        for name in ("HTTPValidationError", "ValidationError"):
            schemas.pop(name, None)
        app.openapi_schema = document
    return app.openapi_schema


class Counting:
    """Counts and times requests by route."""

    def __init__(self, app: ASGIApp, metrics: Metrics):
        self.app, self.metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, then count and time it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        status, began = 500, time.perf_counter()

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self.app(scope, receive, noted)
        finally:
            route = getattr(scope.get("route"), "path", "other")
            self.metrics.requests.labels(scope["method"] if scope["method"] in KNOWN else "other", route, str(status)).inc()
            self.metrics.latency.labels(route).observe(time.perf_counter() - began)


KNOWN = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")
