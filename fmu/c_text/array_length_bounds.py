"""Upper bounds of the array lengths in the runtime, as C constants of the mechanism.

The number of friction pairs at rest (``rest``, ``n``) is at most the number of all pairs. The numbers of multipliers in a group,
and of multipliers that come to rest, are at most the number of all multipliers. The number of internal forces is at most the number
of constraint rows. ``tests/fmu/sources/test_c_library.py`` checks each length against its bound."""

from __future__ import annotations

CALLS = {
    "tr_path_vectors(s)": "(1 + (TR_MAX_NV + TR_MAX_NSLIDERS + TR_MAX_ACTIVE + TR_MAX_NETA) / TR_LANES)",
    "tr_state_width(s)": "TR_MAX_WIDTH", "tr_z_length(s)": "TR_MAX_NZ", "tr_solution_size(s)": "(2 + TR_MAX_NZ + TR_MAX_ACTIVE)",
    "tr_open_count(s)": "TR_MAX_ACTIVE", "tr_loop_rows(s)": "TR_MAX_ACTIVE", "tr_dependent_rows(s)": "TR_MAX_ACTIVE",
    "fmu_states()": "TR_MAX_WIDTH", "tr_watched_count(s)": "(TR_MAX_NSLIDERS + TR_MAX_NSTOPS)",
    "tr_sample_width(s)": "(2 * TR_MAX_NSLIDERS + TR_MAX_NSTOPS)",
}  # fmt: skip
"""Upper bounds of the results of functions."""

FIELDS = {
    "s->ny": "TR_MAX_NY", "c->s->ny": "TR_MAX_NY", "c->s->k->nv": "TR_MAX_NV", "s->nworks": "TR_MAX_NWORKS",
    "w->count": "TR_LARGER(TR_MAX_NWORKS, 2)",
    "m->stages": "TR_STAGES", "s->o": "1", "s->o->nout": "TR_MAX_NOUT", "s->o->ncontacts": "TR_MAX_NCONTACTS",
    "s->o->nkappa": "TR_MAX_OPEN_NKAPPA",
    "l->nc": "TR_MAX_LINEAR_NC", "l->ninputs": "TR_MAX_NINPUTS", "s->loops.rank_now": "0", "q->r": "TR_MAX_ROWS",
    "c->m": "TR_MAX_NETA", "c->r": "TR_MAX_NETA", "c->e": "TR_MAX_NETA", "c->n": "TR_MAX_NSLIDERS",
    "MODEL->kernel->nq": "TR_MAX_NQ", "MODEL->kernel->nv": "TR_MAX_NV", "MODEL->inputs": "TR_MAX_NINPUTS",
    "MODEL->outputs": "TR_MAX_NOUT", "MODEL->columns->nout": "TR_MAX_NOUT",
}  # fmt: skip
"""Upper bounds of struct fields. In a friction problem (``c``, ``q``), a field has the bound of the quantity that the field
counts."""

PAIRS, MULTIPLIERS = {"n": "TR_MAX_NSLIDERS"}, {"n": "TR_MAX_NETA"}
OF_PAIRS = ("tr_minimise_stored_shares", "tr_onsets_newton_step", "tr_predict_modes", "tr_decide_by_cones", "tr_are_many_pairs",
            "tr_try_all_combinations", "tr_release_class", "tr_stick_idle_pairs")  # fmt: skip
OF_MULTIPLIERS = ("tr_minimise_largest_share", "tr_share_loads", "tr_set_impending_axes", "tr_share_along_line",
                  "tr_share_by_lines", "tr_store_loads", "tr_share_group", "tr_set_aside_unloaded")  # fmt: skip
"""OF_PAIRS: functions in which `n` is a number of pairs. OF_MULTIPLIERS: functions in which `n` is a number of multipliers."""
BOUNDS: dict[str, dict[str, str]] = {
    **dict.fromkeys(OF_PAIRS, PAIRS),
    **dict.fromkeys(OF_MULTIPLIERS, MULTIPLIERS),
    "tr_find_stopping_impulses": {"count": "TR_MAX_NETA"},
    "tr_cholesky_solve": {"rank": "TR_LARGER(TR_MAX_ROWS, TR_MAX_NETA)"},
    "tr_multiplier_derivatives": {"choice": "1"},
    "tr_newton_of_size": {"e": "TR_MAX_NETA"},
    "tr_multipliers_moved": {"ninputs": "TR_MAX_NINPUTS"},
    "tr_restore_shares_before": {"rows": "(TR_PAD(TR_MAX_NETA + 1) + TR_PAD(2 * TR_MAX_NETA + 1) + TR_MAX_NETA)"},
}  # fmt: skip
"""Upper bounds of local variables, by function."""
