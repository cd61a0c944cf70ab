"""Jobs of a server as Python objects: ``connect(url, key).submit(scene, over=…).wait().to_pandas()``."""

from __future__ import annotations

import io
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.basics.extras import brought
from engine.basics.patterns import matcher
from engine.basics.problems import Problem, SceneError, SimulationError
from engine.batch.dims import dataset, units
from engine.batch.series import save_dataset
from engine.scene.given import Names, names_given
from engine.scene.overrides import Given, scene_given
from service.asking import ENDED, HERE, Server
from service.fit_asked import FIELDS, fit_asked
from service.looked import Looks, Silent

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray

POLL_SECONDS = 0.5
AT_ONCE = 4
"""Trajectories asked for at a time."""
ON_A_ROW = 1e-6
"""Of a spacing: a row so near to a multiple of it is one of its rows."""


def connect(url: str = HERE, key: str = "") -> Connection:
    """A server by its address, such as http://127.0.0.1:8765, with an API key where it wants one. Nothing is sent yet."""
    return Connection(Server(url, key))


class Connection:
    """A server whose jobs can be submitted and looked at. Its answers that are errors are raised: SceneError with the problems that
    it lists, SimulationError where there is none."""

    def __init__(self, server: Server):
        self.server = server

    def submit(
        self,
        scene: Given,
        over: Mapping[str, Any] | None = None,
        cases: Sequence[Mapping[str, Any]] | None = None,
        sample: Mapping[str, Any] | None = None,
        *,
        reductions: Names = (),
        overrides: Mapping[str, Any] | None = None,
        idempotency_key: str = "",
        **more: Any,
    ) -> Job:
        """Submit a batch, given as to ``engine.sweep``; sample: {"ranges": {path: (low, high)}, "count": N, "seed": S, "method":
        "latin"}. more: the other fields of ``POST /v1/jobs`` (optimise, refine, fit, until, every, rtol, method, patience, budget,
        label, tags, …)."""
        from engine.scene.dump import scene_to_dict

        body = {"scene": scene_to_dict(scene_given(scene, overrides)), "reductions": list(names_given(reductions)), **more}
        body |= {n: v for n, v in (("over", over), ("cases", cases), ("sample", sample)) if v is not None}
        headers = {"Idempotency-Key": idempotency_key} if idempotency_key else {}
        return Job(self.server, self.server.ask("POST", "/v1/jobs", json=body, headers=headers).json())

    def fit(self, scene: Given, parameters: Names, time: Any = None, measured: Mapping[str, Any] | None = None, **more: Any) -> Job:
        """Submit a fit, given as to ``engine.fit``, with ``candidates`` as to ``engine.compare`` and ``trials`` as to
        ``engine.propose``, whose answers its ``answer`` has. more: these, and what ``submit`` takes."""
        asked = {n: more.pop(n) for n in FIELDS if n in more}
        return self.submit(scene, fit=fit_asked(parameters, time, measured, **asked), **more)

    def job(self, job: str) -> Job:
        """A job by its id."""
        return Job(self.server, self.server.ask("GET", f"/v1/jobs/{job}").json())

    def jobs(self, **filters: Any) -> list[Job]:
        """The newest jobs; filters: state, scene, label, tag, search, limit."""
        found = self.server.ask("GET", "/v1/jobs", params=filters).json()["jobs"]
        return [Job(self.server, document) for document in found]


class Job(Looks):
    """A job of a server. document: what the server said of it last."""

    def __init__(self, server: Server, document: dict[str, Any]):
        self.server, self.document = server, document
        self._request: dict[str, Any] | None = None

    @property
    def id(self) -> str:
        """Its id."""
        return str(self.document["id"])

    @property
    def state(self) -> str:
        """queued, running, cancelling, done, failed or cancelled, as it was told last."""
        return str(self.document["state"])

    def __repr__(self) -> str:
        d = self.document
        return f"<job {d['id']} {d['state']}: {d['done']} of {d['cases']} cases of {d['scene']}>"

    @property
    def request(self) -> dict[str, Any]:
        """What was submitted; it can be submitted again."""
        if self._request is None:
            self._request = dict(self._ask("GET", "/request").json())
        return self._request

    def refresh(self) -> Job:
        """Ask how it goes."""
        self.document = self._ask("GET").json()
        return self

    def wait(self, progress: bool = False, timeout: float | None = None) -> Job:
        """Wait until it has ended, however that was (``state``, ``document["problems"]``). progress: with a bar on a terminal;
        timeout: s after which TimeoutError is raised. Ctrl-C leaves the job alone."""
        from engine.cli.progress import Watch

        end = None if timeout is None else time.monotonic() + timeout
        with Watch(f"job {self.id[:8]}") if progress else Silent() as bar:
            while self.refresh().state not in ENDED:
                bar.tell(self.document["done"] + self.document["lost"], self.document["cases"])
                if end is not None and time.monotonic() > end:
                    raise TimeoutError(f"job {self.id} has not ended within {timeout:g} s; it goes on")
                time.sleep(POLL_SECONDS)
        return self

    def cancel(self) -> Job:
        """Cancel it; rows computed so far are kept."""
        self.document = self._ask("DELETE").json()
        return self

    def rerun(self, outcomes: Sequence[str] | None = None, **others: Any) -> Job:
        """A new job of the cases that failed, or have these outcomes; others: settings that are to be others (patience, method,
        …)."""
        body = others | ({"outcomes": list(outcomes)} if outcomes is not None else {})
        return Job(self.server, self._ask("POST", "/rerun", json=body).json())

    def extend(self, over: Mapping[str, Any] | None = None, **others: Any) -> Job:
        """A new job of more cases of the same scene, without those that are there already."""
        body = others | ({"over": over} if over is not None else {})
        return Job(self.server, self._ask("POST", "/extend", json=body).json())

    def delete(self) -> None:
        """Delete it, which must have ended, with all its results."""
        self._ask("DELETE", params={"purge": "true"})

    def to_arrow(self, columns: Iterable[str] = ()) -> pyarrow.Table:
        """The rows there are so far; units in its fields' metadata, the job's id and request in the table's."""
        pa = brought("pyarrow", "tables", "a table of cases")
        asked = {"format": "arrow"} | ({"column": list(columns)} if columns else {})
        return pa.ipc.open_stream(io.BytesIO(self._ask("GET", "/results", params=asked).content)).read_all()

    def to_pandas(self, columns: Iterable[str] = ()) -> pandas.DataFrame:
        """A frame indexed by case; units in ``frame.attrs["units"]``."""
        brought("pandas", "pandas", "to_pandas()")
        table = self.to_arrow(columns)
        frame = table.to_pandas()
        frame.attrs["units"] = units(table)
        return frame.set_index("case") if "case" in frame else frame

    def to_xarray(self) -> xarray.Dataset:
        """A dataset with a dimension for each path of the grid, or of the case alone where it is none; units in ``attrs``. Of cases
        that are not there, nothing is there (NaN)."""
        return dataset(self.to_arrow(), tuple(self.request.get("over") or {}), self.document["cases"], {"job": self.id})

    def indices(self, of: Names = ()) -> list[dict[str, Any]]:
        """Which sampled numbers decide over results (default: all): Sobol indices with intervals, as ``GET …/indices`` tells
        them."""
        return list(self._ask("GET", "/indices", params={"of": list(names_given(of))}).json()["indices"])

    def spreads(
        self, of: Names = (), at: Sequence[float] = (), above: Mapping[str, Sequence[Any]] | None = None
    ) -> list[dict[str, Any]]:
        """Quantiles of results at probabilities, and how probably bounds ({result: bounds}) are exceeded, as ``GET …/spreads``."""
        bounds = [f"{name}={bound}" for name, given in (above or {}).items() for bound in given]
        asked = {"of": list(names_given(of)), "at": list(at), "above": bounds}
        return list(self._ask("GET", "/spreads", params=asked).json()["spreads"])

    @property
    def answer(self) -> dict[str, Any] | None:
        """What a study (``submit(scene, optimise={…})``, ``refine={…}``) or a ``fit`` has found so far, as ``GET …/answer``."""
        found = self._ask("GET", "/answer").json()["answer"]
        return dict(found) if found else None

    def trajectory(self, case: int, columns: Names = (), certify: bool = False) -> pyarrow.Table:
        """One case with all its rows, run again on the server; columns: patterns (default: the scene's outputs); certify: each
        with its global error beside it, ``<column>.error``."""
        pa = brought("pyarrow", "tables", "a table of rows")
        asked = {"format": "arrow"} | ({"outputs": list(names_given(columns))} if columns else {})
        asked |= {"certify": "true"} if certify else {}
        return pa.ipc.open_stream(io.BytesIO(self._ask("GET", f"/cases/{case}/trajectory", params=asked).content)).read_all()

    def trajectories(self, columns: Names = (), every: float | None = None, cases: Iterable[int] | None = None) -> pyarrow.Table:
        """The rows of many cases (default: all) as one table with a column ``case``. every: spacing of the rows that are kept, s, a
        multiple of the run's own. Where the job keeps these rows (``submit(…, trajectories=…)``) they are fetched; else each case
        is run again on the server."""
        pa = brought("pyarrow", "tables", "a table of rows")
        if cases is None and (kept := self._kept(names_given(columns))) is not None:
            return _thinned(kept, every)
        numbers = list(range(self.document["cases"])) if cases is None else list(cases)
        with ThreadPoolExecutor(AT_ONCE) as pool:
            tables = list(pool.map(lambda n: _thinned(self.trajectory(n, columns), every), numbers))
        return pa.concat_tables(
            t.add_column(0, pa.field("case", pa.int64()), pa.array([n] * len(t), pa.int64()))
            for n, t in zip(numbers, tables, strict=True)
        )

    def _kept(self, patterns: Sequence[str]) -> pyarrow.Table | None:
        """The rows that are kept; None where none are, or not those of these columns."""
        if not self.request.get("trajectories"):
            return None
        pa = brought("pyarrow", "tables", "a table of rows")
        table = pa.ipc.open_stream(io.BytesIO(self._ask("GET", "/trajectories", params={"format": "arrow"}).content)).read_all()
        if not patterns:
            return table
        names = [n for n in table.column_names if matcher(tuple(patterns))(n)]
        missed = [p for p in patterns if not any(matcher((p,))(n) for n in names)]
        return None if missed else table.select(["case", "time", *names])

    def save_trajectories(self, folder: str | os.PathLike[str], columns: Names = (), every: float | None = None) -> Path:
        """Write ``trajectories`` as a Parquet data set: ``case=0/part-0.parquet``, …"""
        return save_dataset(self.trajectories(columns, every), folder)

    def _ask(self, method: str, path: str = "", **more: Any) -> Any:
        return self.server.ask(method, f"/v1/jobs/{self.id}{path}", **more)


def _thinned(table: pyarrow.Table, every: float | None) -> pyarrow.Table:
    """The rows at multiples of a spacing."""
    import numpy as np

    if every is None:
        return table
    if not every > 0.0:
        raise SceneError([Problem("every", f"{every:g} s is no spacing", "a positive time, or None for all rows")])
    parts = table["time"].to_numpy() / every
    kept = table.filter(np.abs(parts - np.round(parts)) < ON_A_ROW)
    if len(kept) < 2 <= len(table):
        raise SimulationError(f"no rows but the first are {every:g} s apart: the run's own spacing does not divide that")
    return kept


__all__ = ["Connection", "Job", "connect"]
