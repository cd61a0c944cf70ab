"""Outcomes and audits of cases from the records of the C loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from trunnion.runtime.abi import Verdict
from trunnion.simulation.results.audit import WORDS, Audit, audit_of, judged
from trunnion.simulation.results.outcome import DONE, Outcome


def audits_of(cases: np.ndarray, joints: Sequence[str]) -> list[Audit]:
    """The audit of each case (n records of ``CASE``). An audit within the tolerance contains only the numbers that tables show,
    because such an audit is created 50 times faster."""
    said = cases["audit"]
    plain = ((said["verdict"] == Verdict.WITHIN) & (cases["rows"] != 0.0)).tolist()
    known = said["judged"].astype(bool).tolist()
    figures = zip(*(said[n].tolist() for n in ("tolerance", "lost", "turned", "share")), strict=True)
    out = []
    for i, (tolerance, lost, turned, share) in enumerate(figures):
        if not plain[i]:
            out.append(audit_of(said[i].tobytes(), joints) if cases["rows"][i] else Audit())
        elif known[i]:
            out.append(Audit(WORDS[Verdict.WITHIN], tolerance, lost, turned_over=turned, share=share))
        else:
            out.append(Audit(WORDS[Verdict.WITHIN], tolerance))
    return out


def ends_of(cases: np.ndarray, failed: Mapping[int, Outcome], joints: Sequence[str]) -> tuple[list[Outcome], list[Audit]]:
    """(outcomes, audits) of the cases (n records). failed: {index: outcome} of failed cases."""
    audits = audits_of(cases, joints)
    ends = [failed.get(i) or Outcome(DONE, t) for i, t in enumerate(cases["time"].tolist())]
    return [judged(o, a) for o, a in zip(ends, audits, strict=True)], audits
