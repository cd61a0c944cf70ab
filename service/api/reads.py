"""Reading what jobs have kept, in turns: rows become text and numbers in this process, a few at a time, so that whoever asks for
many holds up nobody who asks for little."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from typing import TypeVar

from fastapi.concurrency import run_in_threadpool

from service.api.problems import Refusal
from service.desk.row import Crowded, Row

PLACES = 3
"""How many read at a time; no caller more than one less."""
T = TypeVar("T")


class Reads(Row[int]):
    """Places to read at. For the event loop."""

    def __init__(self) -> None:
        super().__init__(range(PLACES))

    async def do(self, who: str, work: Callable[[], T], begun: bool = False) -> T:
        """What some work comes to, on a thread, when it is the caller's turn. Refusal (429, 503) where too many wait."""
        try:
            place = await self.take(who, begun)
        except Crowded as e:
            raise Refusal(429 if e.own else 503, str(e), headers={"Retry-After": "5"}) from None
        except asyncio.CancelledError:
            if begun:
                raise
            raise Refusal(503, "the server ends; ask again", headers={"Retry-After": "10"}) from None
        try:
            return await run_in_threadpool(work)
        finally:
            self.give(who, place)

    async def pieces(self, who: str, first: bytes, others: Iterator[bytes]) -> AsyncIterator[bytes]:
        """An answer piece by piece, each in a turn of its own: who takes long to receive one keeps no place."""
        piece: bytes | None = first
        while piece is not None:
            yield piece
            piece = await self.do(who, lambda: next(others, None), begun=True)
