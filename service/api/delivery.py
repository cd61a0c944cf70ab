"""Large answers as HTTP has them: whether they have changed (ETag), a part of them (Range), compressed (gzip)."""

from __future__ import annotations

import re
import zlib
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from fastapi import Request
from starlette.responses import Response, StreamingResponse

from service.api.problems import problem_response, with_header
from service.api.reads import Reads
from service.executor.sealed import digest_of
from service.plain import text_of

if TYPE_CHECKING:
    from service.api.service import Service

Make = Callable[[], Iterator[bytes]]
TEXTS = ("application/json", "text/csv")
RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})")
KEPT = 256
DOCUMENTED: dict[int | str, dict[str, Any]] = {
    206: {"description": "The part asked for with Range.", **with_header("Content-Range", "Which bytes of how many.")},
    304: {"description": "It is what If-None-Match names."},
}
"""Answers beside the whole one."""


def tag_of(*facts: Any) -> str:
    """A name for what an answer with these facts holds, byte by byte."""
    return digest_of(text_of(list(facts)))[:32]


class Lengths:
    """How long answers were that are made as they are sent, by their tags."""

    def __init__(self) -> None:
        self.kept: OrderedDict[str, int] = OrderedDict()

    def of(self, tag: str, make: Make) -> int:
        """The number of bytes; the first time, the answer is made for that."""
        if tag not in self.kept:
            self.kept[tag] = sum(map(len, make()))
            while len(self.kept) > KEPT:
                self.kept.popitem(last=False)
        return self.kept[tag]


@dataclass(frozen=True)
class Answer:
    """What can be sent. make: its bytes; tag: its name, None while it may still change: then it is sent whole."""

    make: Make
    media: str
    headers: dict[str, str]
    tag: str | None


async def delivered(request: Request, who: str, s: Service, answer: Callable[[], Answer]) -> Response:
    """An answer, found out and made in the caller's turns."""
    found = await s.reads.do(who, answer)
    make, media, tag = found.make, found.media, found.tag
    plain = "gzip" not in accepted(request.headers.get("accept-encoding", "")) or media not in TEXTS
    asked = RANGE.fullmatch(request.headers.get("range", "").strip())
    said = found.headers | {"Vary": "Accept, Accept-Encoding, Authorization, X-API-Key", "Cache-Control": "private, no-cache"}
    sending = partial(sent, s.reads, who, media=media)
    if tag is None:
        return await sending(whole(make, said, plain), headers=said)
    strong = f'"{tag}"' if plain or asked else f'"{tag}-gzip"'
    said |= {"ETag": strong, "Accept-Ranges": "bytes"}
    known = [t.strip().removeprefix("W/") for t in request.headers.get("if-none-match", "").split(",")]
    if strong in known or "*" in known:
        return Response(status_code=304, headers=said)
    if asked is None or request.headers.get("if-range", strong) != strong:
        return await sending(whole(make, said, plain), headers=said)
    length = await s.reads.do(who, lambda: s.lengths.of(tag, make))
    ends = within(asked[1], asked[2], length)
    if ends is None:
        return problem_response(416, f"there are {length} bytes", headers={"Content-Range": f"bytes */{length}"})
    first, stop = ends
    said |= {"Content-Range": f"bytes {first}-{stop - 1}/{length}", "Content-Length": str(stop - first)}
    return await sending(cut(make(), first, stop), headers=said, status=206)


def whole(make: Make, headers: dict[str, str], plain: bool) -> Iterator[bytes]:
    """All of it, compressed or not; the headers say which."""
    if plain:
        return make()
    headers["Content-Encoding"] = "gzip"
    return zipped(make())


async def sent(reads: Reads, who: str, pieces: Iterator[bytes], media: str, headers: dict[str, str], status: int = 200) -> Response:
    """The pieces as they are made; the first one is there before the answer begins, so that what goes wrong with it can be said."""
    first = await reads.do(who, lambda: next(pieces, b""))
    return StreamingResponse(reads.pieces(who, first, pieces), status, headers, media)


def accepted(text: str) -> set[str]:
    """The encodings that a client takes."""
    found = set()
    for part in text.lower().split(","):
        name, *more = (p.strip() for p in part.split(";"))
        if not any(re.fullmatch(r"q=0(\.0*)?", p) for p in more):
            found.add(name)
    return found


def zipped(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """The pieces, compressed as they come."""
    packer = zlib.compressobj(1, wbits=31)
    for piece in pieces:
        if packed := packer.compress(piece):
            yield packed
    yield packer.flush()


def within(first: str, last: str, length: int) -> tuple[int, int] | None:
    """(first byte, end) of a range of so many bytes, as it is written; None when there is nothing in it."""
    if not first:
        start, stop = (max(0, length - int(last)), length) if last else (length, length)
    else:
        start, stop = int(first), min(length, int(last) + 1 if last else length)
    return (start, stop) if start < stop else None


def cut(pieces: Iterator[bytes], first: int, stop: int) -> Iterator[bytes]:
    """The bytes first … stop − 1 of the pieces."""
    at = 0
    for piece in pieces:
        if at >= stop:
            return
        if at + len(piece) > first:
            yield piece[max(0, first - at) : stop - at]
        at += len(piece)
