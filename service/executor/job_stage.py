"""The stage of a job before its first rows (deriving, compiling, running), or the progress of a fit. A file in the folder of the
parts holds the stage."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache

from trunnion.service.executor.parquet_parts import Parts

DERIVING, COMPILING, RUNNING, FITTING = STAGES = ("deriving", "compiling", "running", "fitting")
LOGS = ("trunnion.kernel", "trunnion.analysis.fits")
Tell = Callable[[str], None]
_TELL: ContextVar[Tell | None] = ContextVar("stage", default=None)


class _Hears(logging.Filter):
    """A logging filter that reports the start of the compiler and the progress of a fit. The compiler may start on any thread of a
    build."""

    def __init__(self, level: int):
        super().__init__()
        self.level = level

    def filter(self, record: logging.LogRecord) -> bool:
        """Report the stage that a record announces. The record is logged only if it has the original level of the logger."""
        tell = _TELL.get()
        if tell is not None and record.name == LOGS[1]:
            tell(f"{FITTING}: {record.getMessage()}")
        elif tell is not None and str(record.msg).startswith("compile"):
            tell(COMPILING)
        return record.levelno >= self.level


@lru_cache(maxsize=1)
def _listen() -> None:
    """Attach the filters to the loggers of builds and fits in this process."""
    for logger in map(logging.getLogger, LOGS):
        logger.addFilter(_Hears(logger.getEffectiveLevel()))
        logger.setLevel(logging.DEBUG)


@contextmanager
def report_stages(parts: Parts, job: str, wanted: bool) -> Iterator[Tell]:
    """A context in which the reported stages of a job are stored, if ``wanted``. Yields the function that reports a stage.
    Compilation and fits are reported automatically. Failed writes are ignored."""
    last = ""

    def tell(stage: str) -> None:
        nonlocal last
        if wanted and stage != last:
            last = stage
            with suppress(OSError):
                parts.write(parts.stage_file(job), stage.encode(), lasting=False)

    _listen()
    token = _TELL.set(tell)
    try:
        yield tell
    finally:
        _TELL.reset(token)


def read_stage(parts: Parts, job: str) -> str:
    """The last reported stage of a job; "" if no stage is known."""
    try:
        text = parts.read(parts.stage_file(job)).decode("utf-8", "replace")
    except OSError:
        return ""
    return text[:300] if text.partition(":")[0] in STAGES else ""
