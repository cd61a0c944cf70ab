"""Endpoints of the web pages and of their files."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from fastapi import APIRouter
from starlette.responses import Response

HERE = Path(__file__).parent
KINDS = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
FILES = {f.relative_to(HERE).as_posix(): f for f in sorted(HERE.rglob("*")) if f.suffix in KINDS}
POLICY = (
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "frame-src 'self'; base-uri 'none'; frame-ancestors 'none'"
)
router = APIRouter(include_in_schema=False)


STAGE = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "frame-ancestors 'self'"
)
"""Content security policy of the empty frame for animations. Neither the frame nor an animation in it may fetch anything."""


@router.get("/")
@router.get("/jobs")
@router.get("/jobs/{job}")
@router.get("/compare")
def index() -> Response:
    """The main web page. Its script chooses the view by the address."""
    said = {"Content-Security-Policy": POLICY, "X-Frame-Options": "DENY"}
    return Response((HERE / "index.html").read_text(encoding="utf-8"), 200, said, "text/html")


@router.get("/docs")
def docs() -> Response:
    """The page that describes the API."""
    said = {"Content-Security-Policy": POLICY, "X-Frame-Options": "DENY"}
    return Response((HERE / "api_docs.html").read_text(encoding="utf-8"), 200, said, "text/html")


@router.get("/page/plotly.min.js")
def plotly() -> Response:
    """Plotly's JavaScript, from the installed package."""
    return Response(_plotly(), 200, {"Cache-Control": "max-age=86400"}, "text/javascript")


@lru_cache(maxsize=1)
def _plotly() -> bytes:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs().encode()


@router.get("/page/blank_frame.html")
def stage() -> Response:
    """An empty page, into which the main page writes an animation."""
    return Response((HERE / "blank_frame.html").read_text(encoding="utf-8"), 200, {"Content-Security-Policy": STAGE}, "text/html")


@router.get("/favicon.ico")
def icon() -> Response:
    """The icon. Browsers request this address for documents that name no icon, such as tables."""
    return file("icon.svg")


@router.get("/page/{name:path}")
def file(name: str) -> Response:
    """A file of the web pages."""
    if name not in FILES:
        return Response("there is no such file", 404, media_type="text/plain")
    return Response(FILES[name].read_bytes(), 200, {"Cache-Control": "no-cache"}, KINDS[FILES[name].suffix])
