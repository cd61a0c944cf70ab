"""``/``: the page and its files."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from fastapi import APIRouter
from starlette.responses import Response

HERE = Path(__file__).parent
KINDS = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
FILES = {f.name: f for f in sorted(HERE.glob("*")) if f.suffix in KINDS}
POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; frame-src 'self'; base-uri 'none'; "
    "frame-ancestors 'none'"
)
router = APIRouter(include_in_schema=False)


STAGE = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "frame-ancestors 'self'"
)
"""Of the empty page into which a picture is put: as the picture itself has it, it may fetch nothing."""


@router.get("/")
@router.get("/jobs")
@router.get("/jobs/{job}")
@router.get("/compare")
def index() -> Response:
    """The web page; its script looks at the address."""
    said = {"Content-Security-Policy": POLICY, "X-Frame-Options": "DENY"}
    return Response((HERE / "index.html").read_text(encoding="utf-8"), 200, said, "text/html")


@router.get("/docs")
def docs() -> Response:
    """The API's description as a page."""
    said = {"Content-Security-Policy": POLICY, "X-Frame-Options": "DENY"}
    return Response((HERE / "docs.html").read_text(encoding="utf-8"), 200, said, "text/html")


@router.get("/page/plotly.min.js")
def plotly() -> Response:
    """Plotly's JavaScript as it lies in the installed package."""
    return Response(_plotly(), 200, {"Cache-Control": "max-age=86400"}, "text/javascript")


@lru_cache(maxsize=1)
def _plotly() -> bytes:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs().encode()


@router.get("/page/stage.html")
def stage() -> Response:
    """An empty page, into which the picture of a scene is put."""
    return Response((HERE / "stage.html").read_text(encoding="utf-8"), 200, {"Content-Security-Policy": STAGE}, "text/html")


@router.get("/favicon.ico")
def icon() -> Response:
    """What browsers ask for beside tables and pictures that are opened in a window of their own."""
    return file("icon.svg")


@router.get("/page/{name}")
def file(name: str) -> Response:
    """One of the page's files."""
    if name not in FILES:
        return Response("there is no such file", 404, media_type="text/plain")
    return Response(FILES[name].read_bytes(), 200, {"Cache-Control": "no-cache"}, KINDS[FILES[name].suffix])
