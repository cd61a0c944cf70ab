/* Equations and solution of the multipliers in the modes in force. */
#include "friction/friction.h"

static void tr_set_row_kinds(tr_sim *s) {
  TR_NEED(s, TR_HAS_MAPS), TR_MADE(s, TR_HAS_ROWS);
  const tr_kernel *k = s->k;
  int e = k->neta, *row = tr_row_kinds(s);
  s->friction.held = s->friction.shared = s->friction.impending_laws = 0;
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    int stuck = tr_is_stuck(s, i) || i == s->friction.freed;
    for (int j = 0; j < pair->neta; ++j) row[pair->eta0 + j] = i == s->friction.freed ? TR_ROW_FREE : stuck ? TR_ROW_REST : TR_ROW_LAW;
    s->friction.held += stuck;
  }
  if (!s->friction.held) return;
  if (tr_are_held_pairs_independent(s)) {
    memset(TR_A(s, share), 0, sizeof(double) * e), memset(TR_A(s, impending), 0, sizeof(double) * k->nrates);
    return;
  }
  tr_form_maps_without_loops(s, 1);
  for (int i = 0; i < e; ++i)
    if (row[i] == TR_ROW_REST && tr_is_prescribed(s, i)) row[i] = TR_ROW_FREE;
  tr_share_groups(s);
}

static int tr_solve_multipliers(tr_sim *s, int deciding) {
  TR_NEED(s, TR_HAS_MAPS);
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta;
  const double *maps = TR_A(s, maps);
  double *z = TR_A(s, z), *lam = z, *eta = z + a;
  if (a > 0) tr_factor_loops(s);
  if (e == 0) {
    tr_solve_loops(s, map_g0(k, maps), lam);
    for (int i = 0; i < a; ++i) lam[i] = -lam[i];
    TR_MADE(s, TR_HAS_SOLUTION);
    return 1;
  }
  double lam0[a > 0 ? a : 1];
  tr_eliminate_loops(s, lam0);
  if (s->friction.held) {
    tr_form_held_maps(s, lam0);
    if (tr_has_prescribed_changed(s)) tr_set_row_kinds(s);
  }
  double warm[TR_PAD(e)];
  tr_copy_vectors(e, eta, warm);
  if (!tr_newton_with_sense(s, eta) && (deciding || !tr_newton_by_near_tilt(s, warm))) {
    memset(eta, 0, sizeof(double) * e);
    if (!tr_newton_with_sense(s, eta) && !(deciding && tr_newton_with_axis_shares(s, warm)) && !tr_newton_with_other_leaders(s, warm) && !tr_newton_by_any_tilt(s, warm) &&
        !(s->friction.from_anywhere && tr_newton_from_anywhere(s, eta))) {
      memset(eta, 0, sizeof(double) * e);
      return 0;
    }
  } else if (a && tr_is_unstable_root(s)) tr_prefer_stable_root(s, eta);
  for (int i = 0; i < a; ++i) lam[i] = lam0[i];
  if (a) tr_add_columns(a, e, TR_A(s, T), eta, -1.0, lam);
  if (tr_open_count(s)) {
    tr_evaluate_laws(s, eta);
    tr_add_columns(a, tr_open_count(s), TR_A(s, openV), TR_A(s, open_amounts), 1.0, lam);
  }
  TR_MADE(s, TR_HAS_SOLUTION);
  return 1;
}

static void tr_prepare_equations(tr_sim *s) {
  s->step.recursive = 0;
  if (s->k->sets) tr_set_row_kinds(s);
  tr_form_maps_without_loops(s, s->friction.held);
}

/* Whether the present decision has used up its iterations. */
static inline int tr_is_work_spent(const tr_sim *s) { return s->friction.work > 0 && s->stats.newton_iterations + s->stats.creeps > s->friction.work; }

static int tr_solve_in_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  int a = k->active;
  if (tr_is_work_spent(s) || tr_is_cancelled(s, (double)(a + 1) * k->neta * (a + k->nn + k->neta))) return 0;
  s->stats.solutions++;
  TR_SPOILT(s, TR_HAS_SOLUTION);
  tr_set_row_kinds(s);
  if (tr_is_recursive(s) && tr_newton_recursive(s, 0)) {
    tr_evaluate_capacities(s);
    return 1;
  }
  tr_form_maps(s);
  if (!tr_solve_multipliers(s, 1)) return 0;
  if (!s->friction.held) {
    double lam0[a + 1];
    memcpy(lam0, TR_A(s, z), sizeof(double) * a);
    tr_add_columns(a, k->neta, TR_A(s, T), TR_A(s, z) + a, 1.0, lam0);
    tr_form_held_maps(s, lam0);
  }
  tr_store_solution_loads(s);
  tr_evaluate_laws(s, TR_A(s, z) + a);
  tr_evaluate_capacities(s);
  return 1;
}
