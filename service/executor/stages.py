"""What a worker is at before the first rows of a job are there, kept beside its parts for whoever looks: its equations are derived,
they are compiled, they are stepped; and how far a fit has come."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache

from service.executor.parts import Parts

DERIVING, COMPILING, RUNNING, FITTING = STAGES = ("deriving", "compiling", "running", "fitting")
LOGS = ("trunnion.kernel", "trunnion.fits")
Tell = Callable[[str], None]
_TELL: ContextVar[Tell | None] = ContextVar("stage", default=None)


class _Hears(logging.Filter):
    """Hears that the compiler begins, on whatever thread of a build (they take over the context of who began it), and what a fit is
    at."""

    def __init__(self, level: int):
        super().__init__()
        self.level = level

    def filter(self, record: logging.LogRecord) -> bool:
        """Tell; what was not to be logged is not logged now either."""
        tell = _TELL.get()
        if tell is not None and record.name == LOGS[1]:
            tell(f"{FITTING}: {record.getMessage()}")
        elif tell is not None and str(record.msg).startswith("compile"):
            tell(COMPILING)
        return record.levelno >= self.level


@lru_cache(maxsize=1)
def _listen() -> None:
    """Hear what builds and fits log, from now on, in this process."""
    for logger in map(logging.getLogger, LOGS):
        logger.addFilter(_Hears(logger.getEffectiveLevel()))
        logger.setLevel(logging.DEBUG)


@contextmanager
def staged(parts: Parts, job: str, wanted: bool) -> Iterator[Tell]:
    """Within this block what is told is kept as the stage of the job (wanted: or else forgotten); that the compiler begins, and
    what a fit is at, is told by itself. A stage that cannot be kept is not worth failing for."""
    last = ""

    def tell(stage: str) -> None:
        nonlocal last
        if wanted and stage != last:
            last = stage
            with suppress(OSError):
                parts.write(parts.stage_file(job), stage.encode())

    _listen()
    token = _TELL.set(tell)
    try:
        yield tell
    finally:
        _TELL.reset(token)


def stage_kept(parts: Parts, job: str) -> str:
    """The stage that a worker told last; "" when none is known."""
    try:
        text = parts.read(parts.stage_file(job)).decode("utf-8", "replace")
    except OSError:
        return ""
    return text[:300] if text.partition(":")[0] in STAGES else ""
