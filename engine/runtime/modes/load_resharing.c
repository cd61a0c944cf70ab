/* Groups of stuck pairs share their load again before a pair is released: first by the sharing rule, then with stored loads. */
#include "modes/modes.h"

#define SHARE_GAIN 1e-10   /* × the capacity: smallest increase of the reserve by which resharing succeeds */

static int tr_has_stored_load(const tr_sim *s) {
  for (int i = 0; i < s->k->neta; ++i)
    if (tr_row_kinds(s)[i] == TR_ROW_STORED) return 1;
  return 0;
}

static int tr_hold_by_resharing(tr_sim *s, const int *rest, int n) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  s->friction.reserve = 1;
  /* The second solution computes shares from the loads of the first solution. */
  const int solved = tr_solve_in_modes(s) && tr_solve_in_modes(s);
  s->friction.reserve = 0;
  if (!solved) return 0;
  if (s->friction.stored == TR_STORES_PLACED) tr_minimise_stored_shares(s, rest, n);
  for (int q = 0; q < n; ++q)
    if (!(tr_mode_misfit(s, rest[q]) < -(tr_has_stored_load(s) ? KEPT_GAIN : SHARE_GAIN))) return 0;
  return tr_is_valid_decision(s, rest, n);
}

static int tr_stick_by_stored_loads(tr_sim *s, const int *rest, int n) {
  double eta[s->k->neta + 1], *now = TR_A(s, z) + s->k->active;
  if (!s->friction.shared || s->friction.stored) return 0;
  memcpy(eta, now, sizeof(double) * s->k->neta);
  for (s->friction.stored = TR_STORES_CREEP; s->friction.stored <= TR_STORES_PLACED; ++s->friction.stored) {
    int ok = tr_solve_in_modes(s) && tr_solve_in_modes(s); /* the second solution computes stored loads from the first */
    if (ok && s->friction.stored == TR_STORES_PLACED) tr_minimise_stored_shares(s, rest, n);
    for (int q = 0; q < n && ok; ++q) ok = tr_mode_misfit(s, rest[q]) <= (tr_is_stuck(s, rest[q]) ? -KEPT_GAIN : 0.0);
    if (ok && tr_is_valid_decision(s, rest, n)) return 1;
    memcpy(now, eta, sizeof(double) * s->k->neta);
  }
  s->friction.stored = TR_STORES_NONE;
  tr_solve_in_modes(s);
  return 0;
}

static int tr_continue_by_stored_loads(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  int rest[k->nsliders + 1];
  tr_mode modes[k->nsliders + 1];
  if (!k->sets || !s->friction.shared || s->friction.stored || s->friction.failed >= 0) return 0;
  s->step.watch = 0;
  tr_evaluate_maps_at(s, s->clock.t, y);
  tr_save_modes(s, modes);
  const int n = tr_collect_pairs_at_rest(s, -1, rest);
  for (s->friction.stored = TR_STORES_CREEP; n && s->friction.stored <= TR_STORES_PLACED; ++s->friction.stored) {
    memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_z_length(s));
    if (!tr_hold_by_resharing(s, rest, n) || !tr_rhs(s, s->clock.t, y, TR_A(s, dy))) continue;
    memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_state_width(s)); /* a new decision would use the rule */
    s->step.have_k1 = 1, s->step.have_jac = 0, s->step.margin = NAN, s->step.h = s->set.hfixed;
    return 1;
  }
  s->friction.stored = TR_STORES_NONE;
  tr_restore_modes(s, modes), tr_set_row_kinds(s);
  return 0;
}
