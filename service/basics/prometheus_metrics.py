"""The metrics of a server for Prometheus."""

from __future__ import annotations

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)


class Metrics:
    """Counters and gauges of one server."""

    def __init__(self) -> None:
        self.registry = r = CollectorRegistry()
        self.requests = Counter("trunnion_requests_total", "Requests answered.", ("method", "route", "status"), registry=r)
        self.latency = Histogram("trunnion_request_seconds", "Time to answer.", ("route",), registry=r, buckets=SECONDS)
        self.jobs = Gauge("trunnion_jobs", "Jobs by state.", ("state",), registry=r)
        self.workers = Gauge("trunnion_worker_threads", "Chunks that can run at once.", registry=r)
        self.cases = Counter("trunnion_cases_total", "Cases run.", registry=r)
        self.stepping = Counter("trunnion_stepping_seconds_total", "Time spent stepping.", registry=r)
        self.chunks = Counter("trunnion_chunks_total", "Number of chunks by result.", ("result",), registry=r)

    def chunk(self, cases: int, seconds: float) -> None:
        """Count a finished chunk."""
        self.cases.inc(cases)
        self.stepping.inc(seconds)
        self.chunks.labels("done").inc()

    def text(self, states: dict[str, int], workers: int) -> bytes:
        """The metrics in Prometheus's text format."""
        for state, n in states.items():
            self.jobs.labels(state).set(n)
        self.workers.set(workers)
        return generate_latest(self.registry)
