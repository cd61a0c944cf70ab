"""The fits of a request as cases of a batch, with one row for each fit. The service, which runs batches, can therefore also run
fits."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.analysis.fits.request_and_answer import FitRequest, answer_fit, combine_answers
from trunnion.basics.arrow_columns import field
from trunnion.basics.errors import SceneError, SimulationError
from trunnion.basics.json_values import finite
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.batch.cases.grids_and_samples import Cases
from trunnion.batch.plan_and_runner import Plan, Stopped
from trunnion.batch.tables.case_table import schema
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.settings.run_settings import Run

if TYPE_CHECKING:
    import pyarrow

UNSETTLED, NO_FIT = "not_converged", "no_fit"
"""Outcomes in addition to ``done``. UNSETTLED: the search did not converge; NO_FIT: there is no fit, and ``outcome.advice`` gives
the reason."""
FIT_COLUMNS = {"candidate": "name of the candidate model", "answer": "the fit and the experiments ranked at its estimate, as JSON"}
"""Text columns of a fit's row with their descriptions. These columns come before the column ``steps``."""


@dataclass(frozen=True, kw_only=True)
class FitPlan(Plan):
    """Fits of a scene: one case for each candidate model, or one fit of the unchanged scene."""

    request: FitRequest

    @property
    def kernel(self) -> str:  # type: ignore[override]
        """The kind of kernel for the runs of the fits."""
        return "parts"

    @property
    def schema(self) -> pyarrow.Schema:
        """The Arrow schema of the table of fits."""
        import pyarrow as pa

        made = schema((), (), (), dict(self.about))
        for name, text in FIT_COLUMNS.items():
            made = made.insert(made.get_field_index("steps"), field(name, pa.string(), "", text))
        return made


def make_fit_plan(scene: Scene, q: FitRequest) -> FitPlan:
    """The plan of a request, which must have no problems (``request_problems``)."""
    cases = Cases((), (), len(q.names), lambda start, stop: np.zeros((stop - start, 0)))
    return FitPlan(scene, cases, (), Run(), request=q)


class FitRunner:
    """Makes the fits of a plan, in the same way as ``Runner`` runs cases. It stores no state between fits, so that each fit is
    reproducible."""

    def __init__(self, plan: FitPlan):
        self.plan = plan
        self.seconds = self.build_seconds = 0.0
        self.rows: pyarrow.Table | None = None

    def chunk(self, start: int, stop: int, tick: Callable[[int], bool] | None = None) -> pyarrow.Table:
        """Table of the fits from start to stop − 1. ``tick`` receives the number of finished fits. If ``tick`` returns False,
        Stopped is raised."""
        rows: list[dict[str, Any]] = []
        for case in range(start, stop):
            if tick is not None and not tick(len(rows)):
                raise Stopped(self._table(rows))
            rows.append(self._row(case))
        return self._table(rows)

    def _row(self, case: int) -> dict[str, Any]:
        name = self.plan.request.names[case]
        row: dict[str, Any] = dict.fromkeys(self.plan.schema.names, "")
        row |= {"case": case, "candidate": name, "outcome.time": None, "audit.energy": None, "steps": 0}
        try:
            told = answer_fit(self.plan.scene, self.plan.request, name)
        except (SceneError, SimulationError) as e:
            return row | {"outcome": NO_FIT, "outcome.advice": str(e)}
        except (ValueError, np.linalg.LinAlgError) as e:  # the search tried a value outside the range of floats
            return row | {"outcome": NO_FIT, "outcome.advice": f"the search broke off: {e}"}
        outcome = "done" if told["fit"]["converged"] else UNSETTLED
        return row | {"outcome": outcome, "steps": told["fit"]["rounds"], "answer": json.dumps(finite(told), allow_nan=False)}

    def _table(self, rows: list[dict[str, Any]]) -> pyarrow.Table:
        import pyarrow as pa

        return pa.Table.from_pylist(rows, self.plan.schema)


def combine_rows(plan: FitPlan, rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The answer of the request from the rows so far."""
    kept = list(rows)
    made = {r["candidate"]: json.loads(r["answer"]) for r in kept if r["answer"]}
    return combine_answers(plan.request, made, {r["candidate"]: r["outcome.advice"] for r in kept if not r["answer"]})
