/* Mode changes of pairs at rest that violate the laws of their modes. The misfit of a pair states by how much the pair violates the
 * law of its mode. */
#include "modes/modes.h"

#define FAINT 1e-7     /* in units of length · rate²: the direction of a smaller acceleration is round-off */

/* In an impulse step, replace the direction in which pair i starts to slip by the direction in which it would slip from rest.
 * Condition: the pair's rates across this direction are below the rest speed. These rates are round-off; divided by the length of a
 * short step, they would turn the direction off its line. */
static void tr_straighten_direction(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double h = s->moreau.h, *rate = tr_pair_rates(s, i), *lever = TR_A(s, lever) + pair->eta0;
  double d[3], e[3], along = 0.0, across = 0.0;
  s->moreau.h = INFINITY;
  const int found = tr_solve_in_modes(s);
  s->moreau.h = h;
  for (int j = 0; j < pair->nrates; ++j) d[j] = TR_A(s, z)[s->k->active + pair->eta0 + j] / lever[j], e[j] = d[j] / lever[j];
  if (!found || !(tr_make_unit(pair->nrates, d) > 0.0)) return;
  for (int j = 0; j < pair->nrates; ++j) along += rate[j] * lever[j] * d[j];
  for (int j = 0; j < pair->nrates; ++j) across += pow(rate[j] * lever[j] - along * d[j], 2.0);
  if (sqrt(across) <= tr_rest_speed(tr_speed_unit(s))) memcpy(tr_mode_of(s, i)->direction, e, sizeof(double) * pair->nrates);
}

static void tr_let_slip(tr_sim *s, int i) {
  TR_NEED(s, TR_HAS_ROWS);
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active + pair->eta0, *lever = TR_A(s, lever) + pair->eta0;
  tr_mode *m = tr_mode_of(s, i);
  int prescribed = tr_row_kinds(s)[pair->eta0] == TR_ROW_FREE || tr_is_held_freedom_moving(s, pair->eta0, 0.0);
  if (tr_pair_classes(s)[i]) {
    double way = 0.0;
    for (int q = 0; q < s->k->nsliders; ++q)
      for (int e = tr_pair_of(s, q)->eta0; e < tr_pair_of(s, q)->eta0 + tr_pair_of(s, q)->neta && tr_are_coupled(s, q, i); ++e)
        way += TR_A(s, class_rates)[e] * (prescribed ? tr_freedom_acceleration(s, e) : TR_A(s, z)[s->k->active + e]);
    tr_let_class_slip(s, i, way, 1);
    return;
  }
  m->flag = TR_SLIPS;
  for (int j = 0; j < 3; ++j) m->direction[j] = 0.0;
  if (pair->nrates == 1)
    m->direction[0] = (prescribed ? tr_freedom_acceleration(s, pair->eta0) : eta[0]) < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < pair->nrates; ++j) m->direction[j] = prescribed ? tr_freedom_acceleration(s, pair->eta0 + j) : eta[j] / (lever[j] * lever[j]);
  if (pair->nrates > 1 && !prescribed && s->moreau.h > 0.0) tr_straighten_direction(s, i);
}

/* Let pair i stick, together with all pairs of its class in `rest`. */
static void tr_let_stick(tr_sim *s, const int *rest, int n, int i) {
  for (int q = 0; q < n; ++q)
    if (tr_are_coupled(s, rest[q], i)) tr_mode_of(s, rest[q])->flag = TR_STUCK;
}

/* Surface acceleration of pair i at the present solution, m/s² (nrates components). */
static void tr_pair_acceleration(tr_sim *s, int i, double *acc) {
  const tr_pair *pair = tr_pair_of(s, i);
  for (int j = 0; j < pair->nrates; ++j) acc[j] = tr_freedom_acceleration(s, pair->eta0 + j) * TR_A(s, lever)[pair->eta0 + j];
}

/* At the present solution: surface acceleration, m/s², below which the direction of pair i is round-off. */
static double tr_faint_acceleration(tr_sim *s, int i) {
  tr_form_all_maps(s);
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active, *Qe = TR_A(s, Q) + s->k->neta, *lever = TR_A(s, lever);
  double own = 0.0;
  for (int e = pair->eta0; e < pair->eta0 + pair->nrates; ++e) own = fmax(own, fabs(Qe[e + e * s->k->neta] * eta[e] * lever[e]));
  return fmax(FAINT * tr_speed_unit(s) * s->set.rate, FAINT_RATIO * own);
}

static double tr_mode_misfit(tr_sim *s, int i) {
  TR_NEED(s, TR_HAS_SOLUTION | TR_HAS_ROWS);
  const tr_pair *pair = tr_pair_of(s, i);
  const tr_mode *m = tr_mode_of(s, i);
  double acc[3], unit = tr_speed_unit(s) * s->set.rate, along = 0.0, worst = -1.0;
  if (tr_mode_flag(m) != TR_STUCK) {
    tr_pair_acceleration(s, i, acc);
    for (int j = 0; j < pair->nrates; ++j) along += acc[j] * m->direction[j] * TR_A(s, lever)[pair->eta0 + j];
    if (pair->nrates == 1) return -along / (unit * TR_A(s, lever)[pair->eta0]) - TOL_RESOLVE;
    for (int j = 0; j < pair->nrates; ++j) worst = fmax(worst, fabs(acc[j]));
    return worst <= tr_faint_acceleration(s, i) || along > 0.0 ? -1.0 : 1.0;
  }
  for (int j = 0; j < pair->neta; ++j)
    if (tr_is_held_freedom_moving(s, pair->eta0 + j, 0.0))
      worst = fmax(worst, fabs(tr_freedom_acceleration(s, pair->eta0 + j)) * TR_A(s, lever)[pair->eta0 + j] / unit - tr_acceleration_tolerance(s));
  return fmax(worst, tr_friction_ratio(s, i) - 1.0 - TOL_RESOLVE);
}

/* The pair in `rest` with the largest misfit in the modes in force; −1 if all modes fit. Requires tr_solve_in_modes. */
static int tr_find_worst_misfit(tr_sim *s, const int *rest, int n) {
  double most = 0.0;
  int worst = -1;
  for (int q = 0; q < n; ++q) {
    double v = tr_mode_misfit(s, rest[q]);
    if (!(v <= most)) most = v, worst = rest[q];
  }
  return worst;
}

/* Rank of the responses of all stuck pairs and of pair i (−1: none). Requires held maps. */
static int tr_rank_of_stuck(tr_sim *s, int i) {
  const int e = s->k->neta;
  int c[e], perm[e], n = 0;
  double A[e * e], L[e * e], d[e];
  for (int m = 0; m < s->k->nsliders; ++m)
    for (int q = 0; q < tr_pair_of(s, m)->neta; ++q)
      if (m == i || tr_is_stuck(s, m)) c[n++] = tr_pair_of(s, m)->eta0 + q;
  for (int p = 0; p < n; ++p) {
    for (int q = 0; q < n; ++q) A[p + q * n] = tr_freedom_response(s, c[p], c[q]);
    d[p] = tr_response_scale(s, c[p], A[p + p * n]);
  }
  return tr_cholesky(n, A, d, L, perm, 0, RANK_PIVOT, RANK_PIVOT);
}

/* Whether pair i carries no load, and no stuck pair holds its freedoms. If this pair stuck, the first load would release it
 * again. */
static int tr_is_unloaded_and_free(tr_sim *s, int i) {
  if (tr_hold_of(s, i)->capacity > s->friction.faint) return 0;
  tr_form_all_maps(s);
  return tr_rank_of_stuck(s, i) == tr_rank_of_stuck(s, -1) + tr_pair_of(s, i)->neta;
}

static int tr_is_slipping_in_place(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double acc[3], worst = 0.0;
  if (!tr_is_sliding(s, i) || tr_is_unloaded_and_free(s, i)) return 0;
  tr_pair_acceleration(s, i, acc);
  for (int j = 0; j < pair->nrates; ++j) worst = fmax(worst, fabs(acc[j]));
  return worst <= (pair->nrates > 1 ? tr_faint_acceleration(s, i) : TOL_RESOLVE * tr_speed_unit(s) * s->set.rate);
}

/* Let the pairs with idle[q] stick in addition to `modes`. Returns 1 if these modes have a solution that obeys the laws. Pairs that
 * would stick without a reserve are removed from idle. */
static int tr_stick_these(tr_sim *s, const int *rest, int n, const tr_mode *modes, int *idle) {
  int count = 0;
  tr_restore_modes(s, modes);
  for (int q = 0; q < n; ++q)
    if (idle[q]) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  if (!tr_solve_in_modes(s) || tr_find_worst_misfit(s, rest, n) >= 0 || !tr_is_valid_decision(s, rest, n)) return 0;
  for (int q = 0; q < n; ++q)
    if (idle[q] && tr_mode_misfit(s, rest[q]) > -KEPT_GAIN) idle[q] = 0, count++;
  return !count;
}

/* Let pairs that slip without acceleration stick, if these modes also have a solution. A stuck pair without a reserve would be
 * released again at once. Such a pair yields instead: it exerts its capacity, while other pairs hold its freedom. Requires a
 * solution for the n pairs `rest`. Returns 0 if afterwards the equations have no solution. */
static int tr_stick_idle_pairs(tr_sim *s, const int *rest, int n) {
  const int e = s->k->neta;
  double eta[e + 1], *now = TR_A(s, z) + s->k->active;
  tr_mode modes[s->k->nsliders + 1];
  int idle[n + 1], count = 0, left = 0;
  for (int q = 0; q < n; ++q) count += idle[q] = tr_is_slipping_in_place(s, rest[q]);
  if (!count || count == n) return 1;
  tr_save_modes(s, modes), memcpy(eta, now, sizeof(double) * e);
  if (tr_stick_these(s, rest, n, modes, idle)) return 1;
  for (int q = 0; q < n; ++q) left += idle[q];
  if (left && left < count) {
    memcpy(now, eta, sizeof(double) * e);
    if (tr_stick_these(s, rest, n, modes, idle)) return 1;
  }
  tr_restore_modes(s, modes), memcpy(now, eta, sizeof(double) * e);
  return tr_solve_in_modes(s);
}
