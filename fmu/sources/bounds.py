"""How long the runtime's arrays can become, where that is no number of the mechanism itself but a count of its parts.

Pairs at rest (``rest``, ``n``) are at most all pairs; multipliers of a group, or of what comes to rest, at most all; open reactions
at most all rows of the loops. ``tests/fmu/test_sources.py`` compiles the sources so that each length is held against its bound.
"""

from __future__ import annotations

CALLS = {
    "tr_width(s)": "TR_MAX_WIDTH", "tr_nz(s)": "TR_MAX_NZ", "tr_solution_size(s)": "(2 + TR_MAX_NZ + TR_MAX_ACTIVE)",
    "tr_open_count(s)": "TR_MAX_ACTIVE", "fmu_states()": "TR_MAX_WIDTH",
}  # fmt: skip
"""What functions give at most."""

FIELDS = {
    "s->ny": "TR_MAX_NY", "c->s->ny": "TR_MAX_NY", "c->s->k->nv": "TR_MAX_NV", "s->nworks": "TR_MAX_NWORKS",
    "s->naudit": "2", "w->count": "TR_LARGER(TR_MAX_NWORKS, 2)",
    "m->stages": "TR_STAGES", "s->o": "1", "s->o->nout": "TR_MAX_NOUT", "s->o->ncontacts": "TR_MAX_NCONTACTS",
    "s->o->nkappa": "TR_MAX_OPEN_NKAPPA",
    "l->nc": "TR_MAX_LINEAR_NC", "l->ninputs": "TR_MAX_NINPUTS", "s->loops.rank_now": "0", "q->r": "TR_MAX_ROWS",
    "c->m": "TR_MAX_NETA", "c->r": "TR_MAX_NETA", "c->e": "TR_MAX_NETA", "c->n": "TR_MAX_NSLIDERS",
    "MODEL->kernel->nq": "TR_MAX_NQ", "MODEL->kernel->nv": "TR_MAX_NV", "MODEL->inputs": "TR_MAX_NINPUTS",
    "MODEL->outputs": "TR_MAX_NOUT", "MODEL->columns->nout": "TR_MAX_NOUT",
}  # fmt: skip
"""What fields are at most: of problems about friction (``c``, ``q``) by what they count."""

PAIRS, MULTIPLIERS = {"n": "TR_MAX_NSLIDERS"}, {"n": "TR_MAX_NETA"}
BOUNDS: dict[str, dict[str, str]] = {
    **dict.fromkeys(("tr_spare", "tr_onsets_step", "tr_foresee", "tr_settle_at_once", "tr_are_many", "tr_enumerate"), PAIRS),
    **dict.fromkeys(("tr_least_share", "tr_share_loads", "tr_impending", "tr_share_line", "tr_share_by_lines"), MULTIPLIERS),
    **dict.fromkeys(("tr_keep_loads", "tr_group_of"), MULTIPLIERS),
    "tr_stopping_impulses": {"count": "TR_MAX_NETA"},
    "tr_cholesky_solve": {"rank": "TR_LARGER(TR_MAX_ROWS, TR_MAX_NETA)"},
    "tr_multiplier_derivatives": {"choice": "1"},
    "tr_moved_multipliers": {"ninputs": "TR_MAX_NINPUTS"},
    "tr_keep_shares": {"rows": "(TR_PAD(TR_MAX_NETA + 1) + TR_PAD(2 * TR_MAX_NETA + 1) + TR_MAX_NETA)"},
}  # fmt: skip
"""What a function's own counts are at most."""
