"""The fits of a question as the cases of a batch, a row each: whatever runs batches and keeps their rows does so of fits."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.basics.problems import SceneError, SimulationError
from engine.batch.cases import Cases
from engine.batch.plan import Plan, Stopped
from engine.batch.table import schema
from engine.fits.asked import Question, answered, together
from engine.scene.model import Scene
from engine.simulation.settings import Run
from engine.simulation.tables import finite

if TYPE_CHECKING:
    import pyarrow

UNSETTLED, NONE = "unsettled", "no_fit"
"""Outcomes beside ``done``: the search did not come to its end; there is no fit, and the advice says why."""
OWN = {"candidate": "which law, by its name", "answer": "the fit and the experiments ranked by it, as JSON"}
"""Columns of words that a fit's row has, before ``steps``."""


@dataclass(frozen=True, kw_only=True)
class FitPlan(Plan):
    """Fits of a scene: a case for each candidate law, or one."""

    question: Question

    @property
    def kernel(self) -> str:  # type: ignore[override]
        """What evaluates its runs."""
        return "parts"

    @property
    def schema(self) -> pyarrow.Schema:
        """The Arrow schema of its table."""
        import pyarrow as pa

        made = schema((), (), (), dict(self.about))
        for name, text in OWN.items():
            made = made.insert(made.get_field_index("steps"), pa.field(name, pa.string(), False, {"unit": "", "description": text}))
        return made


def fit_plan(scene: Scene, q: Question) -> FitPlan:
    """The plan of a question with which nothing is wrong (``problems_of``)."""
    cases = Cases((), (), len(q.names), lambda start, stop: np.zeros((stop - start, 0)))
    return FitPlan(scene, cases, (), Run(), question=q)


class FitRunner:
    """Makes the fits of a plan, as ``Runner`` runs cases. It keeps nothing between fits, so that each is the same whenever made."""

    def __init__(self, plan: FitPlan):
        self.plan = plan
        self.seconds = self.build_seconds = 0.0
        self.rows: pyarrow.Table | None = None

    def chunk(self, start: int, stop: int, tick: Callable[[int], bool] | None = None) -> pyarrow.Table:
        """Table of the fits start … stop − 1; ``tick`` is told how many of them are done; when it says no, Stopped is raised."""
        rows: list[dict[str, Any]] = []
        for case in range(start, stop):
            if tick is not None and not tick(len(rows)):
                raise Stopped(self._table(rows))
            rows.append(self._row(case))
        return self._table(rows)

    def _row(self, case: int) -> dict[str, Any]:
        name = self.plan.question.names[case]
        row: dict[str, Any] = dict.fromkeys(self.plan.schema.names, "")
        row |= {"case": case, "candidate": name, "outcome.time": None, "audit.energy": None, "steps": 0}
        try:
            told = answered(self.plan.scene, self.plan.question, name)
        except (SceneError, SimulationError) as e:
            return row | {"outcome": NONE, "outcome.advice": str(e)}
        except (ValueError, np.linalg.LinAlgError) as e:  # numbers so large or small that nothing can be said of them
            return row | {"outcome": NONE, "outcome.advice": f"the search broke off: {e}"}
        outcome = "done" if told["fit"]["converged"] else UNSETTLED
        return row | {"outcome": outcome, "steps": told["fit"]["rounds"], "answer": json.dumps(finite(told), allow_nan=False)}

    def _table(self, rows: list[dict[str, Any]]) -> pyarrow.Table:
        import pyarrow as pa

        return pa.Table.from_pylist(rows, self.plan.schema)


def answer_of(plan: FitPlan, rows: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """What the question comes to, from the rows there are."""
    kept = list(rows)
    made = {r["candidate"]: json.loads(r["answer"]) for r in kept if r["answer"]}
    return together(plan.question, made, {r["candidate"]: r["outcome.advice"] for r in kept if not r["answer"]})
