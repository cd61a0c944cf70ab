/* The right-hand side ẏ(t, y), in this order: signals, stage 1 of the kernel (affine maps of the multipliers), multipliers, stage
 * 2. */
#include "evaluate/evaluate.h"

/* Record the present reserves of pairs at rest. Requires capacities. */
static void tr_record_reserves(tr_sim *s) {
  const int n = s->k->nsliders;
  if (s->step.recorded >= TR_RECORDS) return;
  double *to = TR_A(s, reserves) + s->step.recorded++ * (1 + n);
  to[0] = tr_moment_of(s)->t;
  for (int i = 0; i < n; ++i) to[1 + i] = tr_is_stuck(s, i) ? tr_reserve(s, i) : NAN;
}

static void tr_update_extremes(tr_sim *s) {
  double *lo = TR_A(s, smin), *hi = TR_A(s, smax);
  if (s->friction.held) tr_evaluate_capacities_at_solution(s), tr_record_reserves(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (tr_is_set_valued(s, i)) {
      double v = tr_set_valued_violation(s, i);
      hi[i] = fmax(hi[i], v), lo[i] = fmin(lo[i], v);
      continue;
    }
    if (tr_has_kink_at_rest(s, i)) {
      hi[i] = fmax(hi[i], tr_direction_violation(s, i));
      continue;
    }
    const tr_sliding *v = tr_sliding_of(s, i);
    double g = v->speed - v->border, b = -v->speed - v->border;
    if (g < lo[i]) lo[i] = g;
    if (fmax(g, b) > hi[i]) hi[i] = fmax(g, b);
  }
}

static void tr_clear_extremes(tr_sim *s) {
  s->loops.least = INFINITY, s->step.recorded = 0;
  for (int i = 0; i < s->k->nsliders; ++i) TR_A(s, smin)[i] = INFINITY, TR_A(s, smax)[i] = -INFINITY;
}

static int tr_rhs(tr_sim *s, double t, const double *y, double *dy) {
  const tr_kernel *k = s->k;
  if (tr_is_at_bound(s)) {
    s->step.failure = TR_FAIL_MULTIPLIERS;
    return 0;
  }
  s->stats.rhs_evaluations++;
  TR_SPOILT(s, TR_HAS_SOLUTION);
  tr_set_time(s, t);
  if (k->begin && tr_is_recursive(s) && tr_rhs_recursive(s, y, dy)) {
    tr_append_powers(s, dy);
    if (s->step.watch) tr_update_extremes(s);
    if (s->step.watch && k->active) tr_update_independence(s);
    if (s->friction.held) tr_zero_held_rates(s, dy);
    return 1;
  }
  k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), dy, TR_A(s, power));
  if (k->nunilateral) tr_apply_contacts(s);
  s->step.mapped = TR_MAPS_RAW, s->step.recursive = 0;
  TR_NEW_STATE(s);
  if (k->begin) tr_store_current_state(s, y);
  if (k->active + k->neta == 0) {
    tr_append_powers(s, dy);
    TR_MADE(s, TR_HAS_SOLUTION);
    return 1;
  }
  if (!tr_solve_multipliers(s, 0)) {
    s->step.failure = tr_is_finite(k->nmaps, TR_A(s, maps)) ? TR_FAIL_MULTIPLIERS : TR_FAIL_NOT_FINITE;
    return 0;
  }
  tr_store_solution_loads(s);
  if (s->step.watch) tr_update_extremes(s);
  if (s->step.watch && k->active) tr_update_independence(s);
  tr_evaluate_stage2(s, y, TR_A(s, z), dy);
  if (s->friction.held) tr_zero_held_rates(s, dy);
  return 1;
}

static void tr_interpolate_multipliers(tr_sim *s, double theta) {
  TR_SPOILT(s, TR_HAS_SOLUTION);
  const double *start = TR_A(s, zstart) + s->k->active, *end = TR_A(s, zend) + s->k->active;
  double *eta = TR_A(s, z) + s->k->active;
  for (int i = 0; i < tr_z_length(s) - s->k->active; ++i) eta[i] = (1.0 - theta) * start[i] + theta * end[i];
}

static void tr_save_solution(const tr_sim *s, double *kept) {
  const int nz = tr_z_length(s);
  kept[0] = s->loops.open, kept[1] = s->step.loads_known;
  tr_copy(nz, TR_A(s, z), kept + 2), tr_copy(tr_open_count(s), TR_A(s, open_amounts), kept + 2 + nz);
}

static void tr_restore_solution(tr_sim *s, const double *kept) {
  const int nz = tr_z_length(s);
  s->loops.open = (int)kept[0], s->step.loads_known = (int)kept[1], s->step.recursive = 0;
  tr_copy(nz, kept + 2, TR_A(s, z)), tr_copy(tr_open_count(s), kept + 2 + nz, TR_A(s, open_amounts));
}

