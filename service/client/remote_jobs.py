"""Python objects for the jobs of a server: ``connect(url, key).submit(scene, vary=…).wait().to_pandas()``."""

from __future__ import annotations

import io
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.basics.name_patterns import matcher
from trunnion.basics.optional_packages import brought
from trunnion.batch.tables.trajectories import save_dataset
from trunnion.batch.tables.xarray_dataset import dataset, units
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.units.python_arguments import Names, names_given
from trunnion.service.client.fit_request_body import FIELDS, fit_body
from trunnion.service.client.http_requests import DEFAULT_URL, ENDED, Server

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray

POLL_SECONDS = 0.5
Ends = tuple[float | None, float | None]
AT_ONCE = 4
"""Largest number of concurrent requests for trajectories."""
ON_A_ROW = 1e-6
"""A row counts as a multiple of a spacing if its time differs by less than this, relative to the spacing."""


def connect(url: str = DEFAULT_URL, key: str = "") -> Connection:
    """A connection to a server. url: address, such as http://127.0.0.1:8765. key: API key, if the server requires one. This
    function sends no request."""
    return Connection(Server(url, key))


class Connection:
    """A connection to a server. An error response raises SceneError with the listed problems, or SimulationError if the response
    lists none."""

    def __init__(self, server: Server):
        self.server = server

    def submit(
        self,
        scene: Given,
        vary: Mapping[str, Any] | None = None,
        cases: Sequence[Mapping[str, Any]] | None = None,
        sample: Mapping[str, Any] | None = None,
        *,
        reductions: Names = (),
        overrides: Mapping[str, Any] | None = None,
        idempotency_key: str = "",
        **more: Any,
    ) -> Job:
        """Submit a batch. The arguments are the arguments of ``trunnion.sweep``. sample: {"ranges": {path: (low, high)},
        "count": N, "seed": S, "method": "latin"}. more: other fields of ``POST /v1/jobs`` (optimise, refine, fit, until, every,
        rtol, method, cpu_limit, budget, label, tags, …)."""
        from trunnion.scene.file_format.yaml_writer import scene_to_dict

        body = {"scene": scene_to_dict(scene_given(scene, overrides)), "reductions": list(names_given(reductions)), **more}
        body |= {n: v for n, v in (("vary", vary), ("cases", cases), ("sample", sample)) if v is not None}
        headers = {"Idempotency-Key": idempotency_key} if idempotency_key else {}
        return Job(self.server, self.server.request("POST", "/v1/jobs", json=body, headers=headers).json())

    def fit(self, scene: Given, parameters: Names, time: Any = None, measured: Mapping[str, Any] | None = None, **more: Any) -> Job:
        """Submit a fit. The arguments are the arguments of ``trunnion.fit``. more: other arguments of ``trunnion.fit``,
        ``candidates`` as in ``trunnion.compare``, ``trials`` as in ``trunnion.propose``, and arguments of ``submit``."""
        asked = {n: more.pop(n) for n in FIELDS if n in more}
        return self.submit(scene, fit=fit_body(parameters, time, measured, **asked), **more)

    def job(self, job: str) -> Job:
        return Job(self.server, self.server.request("GET", f"/v1/jobs/{job}").json())

    def jobs(self, **filters: Any) -> list[Job]:
        """The newest jobs. filters: state, scene, label, tag, search, limit."""
        found = self.server.request("GET", "/v1/jobs", params=filters).json()["jobs"]
        return [Job(self.server, document) for document in found]


class Job:
    """A job of a server. document: the job's document at the last query."""

    def __init__(self, server: Server, document: dict[str, Any]):
        self.server, self.document = server, document
        self._request: dict[str, Any] | None = None

    @property
    def id(self) -> str:
        return str(self.document["id"])

    @property
    def state(self) -> str:
        """State at the last query: queued, running, cancelling, done, failed or cancelled."""
        return str(self.document["state"])

    def __repr__(self) -> str:
        d = self.document
        return f"<job {d['id']} {d['state']}: {d['done']} of {d['cases']} cases of {d['scene']}>"

    @property
    def request(self) -> dict[str, Any]:
        """The submitted request, which can be submitted again."""
        if self._request is None:
            self._request = dict(self._ask("GET", "/request").json())
        return self._request

    def refresh(self) -> Job:
        """Fetch the present state."""
        self.document = self._ask("GET").json()
        return self

    def wait(self, progress: bool = False, timeout: float | None = None) -> Job:
        """Wait until the job has ended. Afterwards, see ``state`` and ``document["problems"]``. progress: whether to show a
        progress bar on a terminal. timeout: time after which TimeoutError is raised, s. Ctrl-C does not cancel the job."""
        from trunnion.cli.output.progress_bars import ProgressBar

        end = None if timeout is None else time.monotonic() + timeout
        with ProgressBar(f"job {self.id[:8]}", progress) as bar:
            while self.refresh().state not in ENDED:
                bar.show_count(self.document["done"] + self.document["lost"], self.document["cases"])
                if end is not None and time.monotonic() > end:
                    raise TimeoutError(f"job {self.id} has not ended within {timeout:g} s; the job continues")
                time.sleep(POLL_SECONDS)
        return self

    def cancel(self) -> Job:
        """Cancel the job. The server keeps the computed rows."""
        self.document = self._ask("DELETE").json()
        return self

    def rerun(self, outcomes: Sequence[str] | None = None, **others: Any) -> Job:
        """Submit a new job that runs failed cases again. outcomes: outcomes of the cases to run, in place of the failed cases.
        others: changed settings (cpu_limit, method, …)."""
        body = others | ({"outcomes": list(outcomes)} if outcomes is not None else {})
        return Job(self.server, self._ask("POST", "/rerun", json=body).json())

    def extend(self, vary: Mapping[str, Any] | None = None, **others: Any) -> Job:
        """Submit a new job with more cases of the same scene. Cases of this job are skipped."""
        body = others | ({"vary": vary} if vary is not None else {})
        return Job(self.server, self._ask("POST", "/extend", json=body).json())

    def delete(self) -> None:
        """Delete the ended job with its results."""
        self._ask("DELETE", params={"purge": "true"})

    def to_arrow(self, columns: Iterable[str] = ()) -> pyarrow.Table:
        """The rows of the finished cases. The field metadata contain the units; the table metadata contain the job's id and
        request."""
        return self._table("/results", {"column": list(columns)} if columns else {})

    def to_pandas(self, columns: Iterable[str] = ()) -> pandas.DataFrame:
        """The rows of the finished cases as a frame whose index is the case. ``frame.attrs["units"]`` contains the units."""
        brought("pandas", "pandas", "to_pandas()")
        table = self.to_arrow(columns)
        frame = table.to_pandas()
        frame.attrs["units"] = units(table)
        return frame.set_index("case") if "case" in frame else frame

    def to_xarray(self) -> xarray.Dataset:
        """The results as a dataset with a dimension for each path of a grid. Without a grid, the dimension is the case. ``attrs``
        contain the units. Values of missing cases are NaN."""
        return dataset(self.to_arrow(), tuple(self.request.get("vary") or {}), self.document["cases"], {"job": self.id})

    def indices(self, of: Names = ()) -> list[dict[str, Any]]:
        """Sobol indices of results (default: all results) with confidence intervals, as from ``GET …/indices``."""
        return list(self._ask("GET", "/indices", params={"of": list(names_given(of))}).json()["indices"])

    def spreads(
        self, of: Names = (), at: Sequence[float] = (), above: Mapping[str, Sequence[Any]] | None = None
    ) -> list[dict[str, Any]]:
        """Quantiles of results, and probabilities that results exceed bounds, as from ``GET …/spreads``. at: probabilities of the
        quantiles. above: {result: bounds}."""
        bounds = [f"{name}={bound}" for name, given in (above or {}).items() for bound in given]
        asked = {"of": list(names_given(of)), "at": list(at), "above": bounds}
        return list(self._ask("GET", "/spreads", params=asked).json()["spreads"])

    @property
    def answer(self) -> dict[str, Any] | None:
        """The present result of a study (``optimise``, ``refine``) or a ``fit``, as from ``GET …/answer``."""
        found = self._ask("GET", "/answer").json()["answer"]
        return dict(found) if found else None

    def bins(
        self,
        x: str,
        y: str = "",
        of: str = "",
        *,
        nx: int = 60,
        ny: int = 60,
        within: Mapping[str, Ends | Sequence[str]] | None = None,
    ) -> dict[str, Any]:
        """Count the cases in bins over one or two columns, as ``GET …/bins`` does. of: a third column. Each bin then has the least,
        mean and largest value of this column. within: conditions on cases, as {column: (low, high)} with None for no limit, or
        {column: words}."""
        asked = {"x": x, "y": y, "of": of, "nx": nx, "ny": ny, "within": [_condition(n, c) for n, c in (within or {}).items()]}
        return dict(self._ask("GET", "/bins", params=asked).json())

    def events(self, case: int) -> dict[str, Any]:
        """The events of a case, which runs again on the server. The result is ``{"events": [{"time", "kind", "joint", "text"}],
        "count", "outcome"}``."""
        return dict(self._ask("GET", f"/cases/{case}/events").json())

    @property
    def scene_text(self) -> str:
        """The scene as YAML. A new job can be submitted with a changed copy of this text."""
        return str(self._ask("GET", "/scene").text)

    def trajectory(self, case: int, columns: Names = (), certify: bool = False) -> pyarrow.Table:
        """All rows of one case, which runs again on the server. columns: patterns of columns (default: the scene's outputs).
        certify: whether to add a column ``<column>.error`` with the global error of each column."""
        asked = {"outputs": list(names_given(columns))} if columns else {}
        return self._table(f"/cases/{case}/trajectory", asked | ({"certify": "true"} if certify else {}))

    def trajectories(self, columns: Names = (), every: float | None = None, cases: Iterable[int] | None = None) -> pyarrow.Table:
        """Rows of many cases (default: all cases) as one table with a column ``case``. every: spacing of the rows, s, a multiple of
        the run's spacing. If the job stores rows (``submit(…, trajectories=…)``), the stored rows are fetched. Otherwise, each case
        runs again on the server."""
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
        """The stored rows. None if the job stores no rows, or stores only some of these columns."""
        if not self.request.get("trajectories"):
            return None
        table = self._table("/trajectories", {})
        if not patterns:
            return table
        names = [n for n in table.column_names if matcher(tuple(patterns))(n)]
        missed = [p for p in patterns if not any(matcher((p,))(n) for n in names)]
        return None if missed else table.select(["case", "time", *names])

    def save_trajectories(self, folder: str | os.PathLike[str], columns: Names = (), every: float | None = None) -> Path:
        """Write the result of ``trajectories`` as a Parquet data set: ``case=0/part-0.parquet``, …"""
        return save_dataset(self.trajectories(columns, every), folder)

    def _table(self, path: str, asked: Mapping[str, Any]) -> pyarrow.Table:
        """A table that the server returns as an Arrow stream."""
        pa = brought("pyarrow", "tables", "a table of a job")
        content = self._ask("GET", path, params={"format": "arrow", **asked}).content
        return pa.ipc.open_stream(io.BytesIO(content)).read_all()

    def _ask(self, method: str, path: str = "", **more: Any) -> Any:
        return self.server.request(method, f"/v1/jobs/{self.id}{path}", **more)


def _condition(name: str, given: Ends | Sequence[str]) -> str:
    if all(isinstance(word, str) for word in given):
        return f"{name}={','.join(map(str, given))}"
    if len(given) != 2:
        raise SceneError([Problem("within", f"{name}: {given!r} are not two limits", "(low, high), None for no limit")])
    return f"{name}=" + ":".join("" if end is None else f"{end!r}" for end in given)


def _thinned(table: pyarrow.Table, every: float | None) -> pyarrow.Table:
    """The rows whose times are multiples of the spacing ``every``; None means all rows."""
    import numpy as np

    if every is None:
        return table
    if not every > 0.0:
        raise SceneError([Problem("every", f"{every:g} s is not a spacing", "give a positive time, or None for all rows")])
    parts = table["time"].to_numpy() / every
    kept = table.filter(np.abs(parts - np.round(parts)) < ON_A_ROW)
    if len(kept) < 2 <= len(table):
        raise SimulationError(f"{every:g} s is not a multiple of the spacing of the run: give a multiple")
    return kept
