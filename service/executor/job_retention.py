"""A thread that deletes expired jobs, and the folders of deleted jobs."""

from __future__ import annotations

import logging
import re
import threading
from typing import Any

from trunnion.service.basics.server_settings import KEEP_PERIOD, Settings
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.store.database_connection import Unreachable
from trunnion.service.store.job_store import Store
from trunnion.service.store.store_records import Job

log = logging.getLogger("trunnion.service")
SERVER = "server"
"""Actor in the audit log."""
ID = re.compile(r"[0-9a-f]{24}")


class JobRetention:
    """Deletes jobs and their files."""

    def __init__(self, store: Store, parts: Parts, settings: Settings):
        self.store, self.parts, self.settings = store, parts, settings
        self.stopping = threading.Event()
        self.thread = threading.Thread(target=self._run, name="keeper", daemon=True)

    def start(self) -> None:
        self.thread.start()

    def stop(self) -> None:
        """Stop the thread. The next server completes interrupted deletions."""
        self.stopping.set()

    def _run(self) -> None:
        while not self.stopping.is_set():
            try:
                self.delete_expired()
            except (Unreachable, OSError) as e:
                log.warning("housekeeping: %s", e)
            self.stopping.wait(KEEP_PERIOD)

    def delete_expired(self) -> int:
        """Delete expired jobs, and complete interrupted deletions. Returns the number of deleted jobs."""
        count = 0
        if self.settings.keep > 0.0:
            while old := self.store.older(self.settings.keep):
                for job in old:
                    count += self.delete(job, SERVER, why="the job has ended longer ago than the server keeps jobs")
        for folder in self.parts.folders():
            name = folder.rpartition("/")[2]
            if ID.fullmatch(name) and self.store.deleted(name):  # other folders can belong to another database
                self.parts.remove(name)
        return count

    def delete(self, job: Job, who: str, **data: Any) -> bool:
        """Delete an ended job from the database, then delete its files. In this order, nothing can read a partly deleted job.
        Returns False if the job has not ended."""
        if not self.store.delete(job.id, who, owner=job.owner, cases=job.cases, label=job.label, created=job.created, **data):
            return False
        self.parts.remove(job.id)
        return True
