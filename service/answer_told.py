"""What a job with a fit has found, in the words of ``trunnion fit``."""

from __future__ import annotations

from service.remote import Job


def answer_lines(job: Job) -> list[str]:
    """Lines that tell it."""
    from engine.cli.fitted import lines, proposal_lines
    from engine.fits.told import evidence_of, fit_of, proposals_of

    found = job.answer
    if found is None or found["fit"] is None:
        return [found["why"] if found and found["why"] else f"nothing is found yet: the job is {job.refresh().document['stage']}"]
    fit = fit_of(found["fit"])
    evidence = evidence_of(found["compared"]) if found["compared"] else None
    return [*lines(job.document["scene"], fit, evidence), *proposal_lines(proposals_of(found["experiments"]), fit)]
