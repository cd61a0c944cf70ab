"""A thread that deletes what need not be kept: jobs older than the server keeps them, and folders of jobs that are no more."""

from __future__ import annotations

import logging
import re
import threading
from typing import Any

from service.executor.parts import Parts
from service.settings import Settings
from service.store.database import Unreachable
from service.store.keeping import KeepingStore
from service.store.rows import Job

log = logging.getLogger("trunnion.service")
PAUSE_SECONDS = 600.0
SERVER = "server"
"""Who did it, in the record."""
ID = re.compile(r"[0-9a-f]{24}")


class Keeper:
    """Deletes jobs and what they have kept."""

    def __init__(self, store: KeepingStore, parts: Parts, settings: Settings):
        self.store, self.parts, self.settings = store, parts, settings
        self.stopping = threading.Event()
        self.thread = threading.Thread(target=self._run, name="keeper", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self.thread.start()

    def stop(self) -> None:
        """Let it end; what it is at is taken up again by the next server."""
        self.stopping.set()

    def _run(self) -> None:
        while not self.stopping.is_set():
            try:
                self.tidy()
            except (Unreachable, OSError) as e:
                log.warning("housekeeping: %s", e)
            self.stopping.wait(PAUSE_SECONDS)

    def tidy(self) -> int:
        """Delete what is too old, and what a deletion that was cut short has left; how many jobs were deleted."""
        count = 0
        if self.settings.keep > 0.0:
            while old := self.store.older(self.settings.keep):
                for job in old:
                    count += self.delete(job, SERVER, why="older than the server keeps jobs")
        for folder in self.parts.folders():
            name = folder.rpartition("/")[2]
            if ID.fullmatch(name) and self.store.deleted(name):  # what is nobody's may be another database's
                self.parts.remove(name)
        return count

    def delete(self, job: Job, who: str, **data: Any) -> bool:
        """Delete a job that has ended, and all it has kept: first from the database, so that nothing reads what is half gone."""
        if not self.store.delete(job.id, who, owner=job.owner, cases=job.cases, label=job.label, created=job.created, **data):
            return False
        self.parts.remove(job.id)
        return True
