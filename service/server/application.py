"""The web application of a server."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from trunnion.basics.version import version
from trunnion.service.api.documents.problem_documents import install_error_handlers
from trunnion.service.api.routes.router_list import ROUTERS
from trunnion.service.api.server_state.server_components import Service, create_service
from trunnion.service.api.transport import request_bodies
from trunnion.service.api.transport.api_keys_and_rates import FAILURES, Rates
from trunnion.service.api.transport.guard_middleware import GuardMiddleware
from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.basics.server_settings import Settings
from trunnion.service.page import page_routes

ABOUT = """Batches of simulations over REST. Every error is a problem document (RFC 9457) with the list of problems that the command
line prints. Numbers are in SI units. Where a scene accepts texts with units (`"30 deg"`), requests also accept them."""


def create_app(settings: Settings) -> FastAPI:
    """Create the web application of a server. The components of the server start and end with the application."""
    return build_application(create_service(settings))


FIRST: Scope = {"type": "http", "method": "GET", "path": "/", "root_path": "", "headers": []}
"""A request that makes FastAPI prepare all routes, which takes 80 ms, before the first request comes."""


def build_application(service: Service) -> FastAPI:

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        for route in app.routes:
            route.matches(FIRST)
        service.dispatcher.start()
        service.checks.start()
        service.runs.start()
        service.retention.start()
        service.webhook_sender.start()
        yield
        service.close()

    about: dict[str, Any] = {"title": "Trunnion", "version": version(), "description": ABOUT}
    app = FastAPI(**about, docs_url=None, redoc_url=None, lifespan=lifespan, generate_unique_id_function=lambda route: route.name)
    app.state.service = service
    app.state.rates = Rates(service.settings.limits.rate)
    app.state.failures = Rates(FAILURES)
    install_error_handlers(app)
    for router in (*ROUTERS, page_routes.router):
        app.include_router(router)
    app.add_middleware(GuardMiddleware, most=service.settings.limits.body, open=service.settings.open)
    app.add_middleware(MetricsMiddleware, metrics=service.metrics)
    app.openapi = lambda: _openapi(app)  # type: ignore[method-assign]
    return app


def _openapi(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document. Its schemas include the problem document and the request models."""
    if app.openapi_schema is None:
        document = get_openapi(title=app.title, version=app.version, description=app.description, routes=app.routes)
        schemas = document["components"]["schemas"]
        schemas |= request_bodies.body_schemas()
        for name in ("HTTPValidationError", "ValidationError"):
            schemas.pop(name, None)
        app.openapi_schema = document
    return app.openapi_schema


class MetricsMiddleware:
    """Counts requests and measures their times, by route."""

    def __init__(self, app: ASGIApp, metrics: Metrics):
        self.app, self.metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
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
