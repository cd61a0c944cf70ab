"""HTTP features for large responses: ETag, Range, gzip."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from fastapi import Request
from starlette.responses import Response, StreamingResponse

from trunnion.service.api.documents.problem_documents import header_schema, problem_response
from trunnion.service.api.server_state.row_read_queue import ReadTurns
from trunnion.service.api.server_state.server_components import Make, Service
from trunnion.service.basics.json_text import text_of
from trunnion.service.executor.part_file_format import digest_of

TEXTS = ("application/json", "text/csv")
RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})")
CONDITIONAL_RESPONSES: dict[int | str, dict[str, Any]] = {
    206: {
        "description": "The requested Range of the content.",
        **header_schema("Content-Range", "Range of the sent bytes, and the number of all bytes."),
    },
    304: {"description": "The entity tag in If-None-Match belongs to the present content."},
}
"""Documented responses that do not contain the whole content."""


def etag_of(*facts: Any) -> str:
    """The entity tag of a response. facts: values that completely determine the bytes of the response."""
    return digest_of(text_of(list(facts)))[:32]


@dataclass(frozen=True)
class Answer:
    """The content of a response. make: creates the bytes. tag: entity tag, or None while the content can change. Content without a
    tag is always sent as a whole."""

    make: Make
    media: str
    headers: dict[str, str]
    tag: str | None


async def respond(request: Request, who: str, s: Service, answer: Callable[[], Answer]) -> Response:
    """Create and send the response to a request, in the caller's read turns. answer: creates the content."""
    found = await s.reads.run(who, answer)
    make, media, tag = found.make, found.media, found.tag
    plain = "gzip" not in accepted_encodings(request.headers.get("accept-encoding", "")) or media not in TEXTS
    asked = RANGE.fullmatch(request.headers.get("range", "").strip())
    said = found.headers | {"Vary": "Accept, Accept-Encoding, Authorization, X-API-Key", "Cache-Control": "private, no-cache"}
    sending = partial(stream_response, s.reads, who, media=media)
    if tag is None:
        return await sending(whole_answer(make, said, plain), headers=said)
    strong = f'"{tag}"' if plain or asked else f'"{tag}-gzip"'
    said |= {"ETag": strong, "Accept-Ranges": "bytes"}
    known = [t.strip().removeprefix("W/") for t in request.headers.get("if-none-match", "").split(",")]
    if strong in known or "*" in known:
        return Response(status_code=304, headers=said)
    if asked is None or request.headers.get("if-range", strong) != strong:
        return await sending(whole_answer(make, said, plain), headers=said)
    length = await s.reads.run(who, lambda: s.lengths.of(tag, lambda: sum(map(len, make()))))
    ends = range_ends(asked[1], asked[2], length)
    if ends is None:
        return problem_response(416, f"the content has {length} bytes", headers={"Content-Range": f"bytes */{length}"})
    first, stop = ends
    said |= {"Content-Range": f"bytes {first}-{stop - 1}/{length}", "Content-Length": str(stop - first)}
    return await sending(byte_range(make(), first, stop), headers=said, status=206)


def whole_answer(make: Make, headers: dict[str, str], plain: bool) -> Iterator[bytes]:
    """All bytes, compressed unless ``plain``. Adds the header Content-Encoding for compressed bytes."""
    if plain:
        return make()
    headers["Content-Encoding"] = "gzip"
    return gzip_pieces(make())


async def stream_response(
    reads: ReadTurns, who: str, pieces: Iterator[bytes], media: str, headers: dict[str, str], status: int = 200
) -> Response:
    """Stream the pieces. The first piece is created before the response starts, so that an error in this piece gives an error
    status."""
    first = await reads.run(who, lambda: next(pieces, b""))
    return StreamingResponse(reads.stream(who, first, pieces), status, headers, media)


def accepted_encodings(text: str) -> set[str]:
    found = set()
    for part in text.lower().split(","):
        name, *more = (p.strip() for p in part.split(";"))
        if not any(re.fullmatch(r"q=0(\.0*)?", p) for p in more):
            found.add(name)
    return found


def gzip_pieces(pieces: Iterator[bytes]) -> Iterator[bytes]:
    packer = zlib.compressobj(1, wbits=31)
    for piece in pieces:
        if packed := packer.compress(piece):
            yield packed
    yield packer.flush()


def range_ends(first: str, last: str, length: int) -> tuple[int, int] | None:
    """The first byte and the end (exclusive) of a Range; None when the range is empty."""
    if not first:
        start, stop = (max(0, length - int(last)), length) if last else (length, length)
    else:
        start, stop = int(first), min(length, int(last) + 1 if last else length)
    return (start, stop) if start < stop else None


def byte_range(pieces: Iterator[bytes], first: int, stop: int) -> Iterator[bytes]:
    """The bytes first … stop − 1 of the pieces."""
    at = 0
    for piece in pieces:
        if at >= stop:
            return
        if at + len(piece) > first:
            yield piece[max(0, first - at) : stop - at]
        at += len(piece)
