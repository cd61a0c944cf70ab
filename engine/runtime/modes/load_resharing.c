/* Before a pair is released, its group of stuck pairs shares the load again: first by the sharing rule, then with stored loads. */
#include "modes/modes.h"

#define SHARE_GAIN 1e-10   /* relative to the capacity: resharing succeeds if the reserve increases by at least this much */

static int tr_has_stored_load(const tr_sim *s) {
  for (int i = 0; i < s->k->neta; ++i)
    if (tr_row_kinds(s)[i] == TR_ROW_STORED) return 1;
  return 0;
}

/* Let all n pairs `rest` stick; none of them yields. */
static void tr_stick_all(tr_sim *s, const int *rest, int n) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK, tr_mode_of(s, rest[q])->tilt = 0.0;
}

static int tr_hold_by_resharing(tr_sim *s, const int *rest, int n) {
  tr_stick_all(s, rest, n);
  s->friction.reserve = 1;
  /* The second call computes shares from the loads that the first call finds. */
  const int solved = tr_solve_in_modes(s) && tr_solve_in_modes(s);
  s->friction.reserve = 0;
  if (!solved) return 0;
  if (s->friction.stored == TR_STORES_PLACED) tr_minimise_stored_shares(s, rest, n);
  for (int q = 0; q < n; ++q)
    if (!(tr_mode_misfit(s, rest[q]) < -(tr_has_stored_load(s) ? KEPT_GAIN : SHARE_GAIN))) return 0;
  return tr_is_valid_decision(s, rest, n);
}

/* Whether the capacity of pair i is given, not a function of loads. A given capacity does not grow when internal forces press the
 * pairs of a group together. Requires a solution. */
static int tr_has_given_capacity(tr_sim *s, int i) {
  const tr_kernel *k = s->k;
  const tr_pair *pair = tr_pair_of(s, i);
  int at = 0, given = !pair->cone && pair->neta == 1;
  tr_pair_of_multiplier(s, pair->eta0, &at);
  k->held(TR_A(s, NN), TR_A(s, z) + k->active, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
  for (int q = 0; q < k->element[pair->element].needs && given; ++q) given = TR_A(s, dhold)[at + q] == 0.0;
  return given;
}

/* Whether pair i yielded in the modes `start`. */
static inline int tr_yielded(const tr_mode *start, int i) { return tr_mode_flag(start + i) == TR_STUCK && start[i].tilt != 0.0; }

/* Change the pairs that yielded in the modes `start`, and the pair `released` (−1: none). flag = TR_STUCK: these pairs yield;
 * TR_SLIPS: they slip with their classes. All other pairs stick. Returns the number of pairs that yield or slip. */
static int tr_set_yielding_modes(tr_sim *s, const int *rest, int n, const tr_mode *start, int released, int flag) {
  int count = 0;
  tr_stick_all(s, rest, n);
  for (int q = 0; q < n; ++q) {
    const int i = rest[q];
    if (!tr_yielded(start, i) && i != released && !(flag == TR_SLIPS && released >= 0 && tr_are_coupled(s, i, released))) continue;
    *tr_mode_of(s, i) = start[i];
    tr_mode_of(s, i)->flag = flag, tr_mode_of(s, i)->tilt = flag == TR_STUCK;
    ++count;
  }
  return count;
}

/* Whether the n pairs `rest` hold if the pair `released` yields, together with the pairs that have already yielded. A pair that
 * yields exerts its capacity, while other pairs hold its freedom. Only pairs of given capacity yield. start: modes before the
 * decision. On success, the modes are in force. */
static int tr_hold_by_yielding(tr_sim *s, const int *rest, int n, int released, const tr_mode *start) {
  const int was = s->friction.stored, given = tr_has_given_capacity(s, released);
  double eta[s->k->neta + 1], *now = TR_A(s, z) + s->k->active;
  memcpy(eta, now, sizeof(double) * s->k->neta);
  for (s->friction.stored = TR_STORES_NONE; s->friction.stored <= TR_STORES_CREEP; ++s->friction.stored) {
    if (!tr_set_yielding_modes(s, rest, n, start, given ? released : -1, TR_STUCK)) break;
    s->friction.reserve = 1;
    int ok = tr_solve_in_modes(s) && tr_solve_in_modes(s);
    s->friction.reserve = 0;
    for (int q = 0; q < n && ok; ++q) ok = tr_mode_misfit(s, rest[q]) <= (tr_yields(s, rest[q]) ? 0.0 : -KEPT_GAIN);
    if (ok && tr_is_valid_decision(s, rest, n)) return 1;
    memcpy(now, eta, sizeof(double) * s->k->neta);
  }
  s->friction.stored = was;
  return 0;
}

/* Let overloaded pairs slip one after another, until all modes fit and the pairs that stick no longer hold the freedom of the pair
 * `released`. Returns 1 on success, 0 also if an overloaded pair has several components. */
static int tr_slide_one_by_one(tr_sim *s, const int *rest, int n, int released) {
  for (int it = 0; it <= n && tr_solve_in_modes(s); ++it) {
    const int worst = tr_find_worst_misfit(s, rest, n);
    if (worst < 0) return tr_rank_of_stuck(s, released) > tr_rank_of_stuck(s, -1) && tr_is_valid_decision(s, rest, n);
    if (tr_is_sliding(s, worst) || tr_pair_of(s, worst)->nrates > 1) return 0;
    tr_let_slip(s, worst);
  }
  return 0;
}

/* Whether sliding starts if the pair `released` slips, together with the pairs that have already yielded. Pairs that become
 * overloaded slip, too. first: 1 requires a pair that already yielded; 0 also accepts a pair `released` of given capacity. start:
 * modes before the decision. On success, the modes are in force. */
static int tr_slide_by_yielding(tr_sim *s, const int *rest, int n, int released, const tr_mode *start, int first) {
  const int was = s->friction.stored;
  double eta[s->k->neta + 1], *now = TR_A(s, z) + s->k->active;
  int yielded = !first && tr_has_given_capacity(s, released);
  for (int q = 0; q < n; ++q) yielded |= tr_yielded(start, rest[q]);
  if (!yielded || tr_pair_of(s, released)->nrates > 1) return 0;
  memcpy(eta, now, sizeof(double) * s->k->neta);
  for (s->friction.stored = TR_STORES_NONE; s->friction.stored <= TR_STORES_CREEP; ++s->friction.stored) {
    tr_set_yielding_modes(s, rest, n, start, released, TR_SLIPS);
    if (tr_slide_one_by_one(s, rest, n, released)) return 1;
    memcpy(now, eta, sizeof(double) * s->k->neta);
  }
  s->friction.stored = was;
  return 0;
}

static int tr_stick_by_stored_loads(tr_sim *s, const int *rest, int n) {
  double eta[s->k->neta + 1], *now = TR_A(s, z) + s->k->active;
  if (!s->friction.shared || s->friction.stored) return 0;
  memcpy(eta, now, sizeof(double) * s->k->neta);
  for (s->friction.stored = TR_STORES_CREEP; s->friction.stored <= TR_STORES_PLACED; ++s->friction.stored) {
    int ok = tr_solve_in_modes(s) && tr_solve_in_modes(s); /* the second call uses the loads that the first finds */
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
    /* stored as the start of the next step, because a new decision would share loads by the rule */
    memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_state_width(s));
    s->step.have_k1 = 1, s->step.have_jac = 0, s->step.margin = NAN, s->step.h = s->set.hfixed;
    return 1;
  }
  s->friction.stored = TR_STORES_NONE;
  tr_restore_modes(s, modes), tr_set_row_kinds(s);
  return 0;
}
