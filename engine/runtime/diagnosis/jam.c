/* Diagnosis of friction equations without a solution (theory, "Jams"). A pair jams if a solution exists after a sudden stop of this
 * pair. If no solution exists even then, the pair is inconsistent. */
#include "diagnosis/diagnosis.h"

/* ratio of squared components above which a later pair replaces an earlier pair; of pairs with equal components, the first is
 * returned */
#define BLAME_MORE 1.01

/* The sliding pair whose equation is closest to losing its root: it has the largest component in the near-null vector of the
 * Jacobian. Returns −1 if the Jacobian is singular. Requires a solution. */
static int tr_find_weakest_pair(tr_sim *s) {
  const tr_kernel *k = s->k;
  int e = k->neta, *perm = (int *)TR_A(s, perm) + k->active, best = -1;
  double *J = TR_A(s, lu), x[e + 1], most = 0.0;
  tr_evaluate_laws(s, TR_A(s, z) + k->active);
  tr_form_law_jacobian(s);
  if (s->friction.held) tr_form_rest_rows(s, TR_A(s, z) + k->active, TR_A(s, r), J);
  if (!tr_lu(e, J, perm)) return -1;
  for (int i = 0; i < e; ++i) x[i] = 1.0 / TR_A(s, lever)[i];
  for (int it = 0; it < 4; ++it) {
    double size = 0.0;
    tr_lu_solve(e, J, perm, x);
    for (int i = 0; i < e; ++i) size = fmax(size, fabs(x[i]));
    for (int i = 0; i < e; ++i) x[i] /= size;
  }
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double size = 0.0;
    for (int j = 0; j < pair->neta; ++j) size += x[pair->eta0 + j] * x[pair->eta0 + j] / (TR_A(s, lever)[pair->eta0 + j] * TR_A(s, lever)[pair->eta0 + j]);
    if (!tr_is_stuck(s, i) && size > BLAME_MORE * most) most = size, best = i;
  }
  return best;
}

/* Index of a moving pair that prevents a solution at the current state: without the friction of this pair, the equations have a
 * solution. −1: none. */
static int tr_find_obstructing_pair(tr_sim *s) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], n = tr_collect_pairs_at_rest(s, -1, rest), found = -1;
  for (int i = 0; i < k->nsliders && found < 0; ++i) {
    if (!tr_is_set_valued(s, i) || tr_is_at_rest(s, i)) continue;
    s->friction.freed = i;
    memset(TR_A(s, z) + k->active, 0, sizeof(double) * k->neta);
    if (n ? tr_decide_modes(s, rest, n, -1) : tr_solve_in_modes(s)) found = i;
  }
  s->friction.freed = -1;
  return found;
}

/* The pair that causes the failure at the current state. If loops move several pairs as one freedom, the split of loads between
 * these pairs is arbitrary. The function then returns the weakest of them (tr_find_weakest_pair, at the last friction found). */
static int tr_find_jamming_pair(tr_sim *s) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  tr_save_modes(s, modes);
  if (tr_solve_in_modes(s)) return tr_find_weakest_pair(s);
  const int stumbles = tr_find_obstructing_pair(s);
  if (stumbles < 0 || !k->active) return stumbles;
  tr_restore_modes(s, modes);
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_z_length(s));
  tr_set_row_kinds(s);
  tr_form_maps_without_loops(s, 1);
  const int weakest = tr_find_weakest_pair(s), line = tr_line_multiplier(s, stumbles), other = weakest < 0 ? -1 : tr_line_multiplier(s, weakest);
  return line >= 0 && other >= 0 && tr_are_one_freedom(s, line, other) ? weakest : stumbles;
}

/* Stop the pair by an impulse of its own friction and of joint reactions, and decide the modes again. Replaces y, which must be the
 * current state. Returns 1 if a solution exists; the pair then sticks, or slips from rest. */
static int tr_stop_by_impact(tr_sim *s, double *y, int pair) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], n = tr_bring_all_to_rest(s, y, pair, rest, tr_collect_pairs_at_rest(s, pair, rest));
  /* directions are frozen again, because the impulse may have reversed the sliding of other pairs */
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_set_valued(s, i) && !tr_contains(rest, n, i)) tr_freeze_direction(s, i);
  memset(TR_A(s, z) + k->active, 0, sizeof(double) * k->neta);
  return tr_decide_modes(s, rest, n, -1);
}

/* Whether a pair at rest holds freedom i: a multiplier of this pair acts on the same freedom. Requires held maps. */
static int tr_follows_pair_at_rest(const tr_sim *s, int i) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    for (int j = pair->eta0; j < pair->eta0 + pair->neta && tr_is_stuck(s, m); ++j)
      if (tr_are_one_freedom(s, i, j)) return 1;
  }
  return 0;
}

/* Whether loops, drives and pairs at rest prescribe all motion of a pair. Friction then cannot stop the pair. Requires maps of the
 * current state. */
static int tr_is_fully_driven(tr_sim *s, int pair) {
  const tr_pair *p = tr_pair_of(s, pair);
  int driven = s->k->active > 0;
  if (driven) tr_form_maps_without_loops(s, 1);
  for (int i = p->eta0; i < p->eta0 + p->neta && driven; ++i) driven = tr_is_prescribed(s, i) || tr_follows_pair_at_rest(s, i);
  return driven;
}

/* The first moving pair whose sudden stop at y makes a solution possible; −1 if there is none. Used for failures that several pairs
 * cause together, or that a pair at rest causes. (tr_find_obstructing_pair finds single moving pairs.) (Example: when a nut
 * reverses, its self-locking thread stops the link that drives the nut.) */
static int tr_find_stopping_pair(tr_sim *s, const double *y, const tr_mode *modes) {
  double copy[tr_state_width(s)];
  for (int i = 0; i < s->k->nsliders; ++i) {
    tr_restore_modes(s, modes);
    memcpy(copy, y, sizeof copy);
    tr_evaluate_maps_at(s, s->clock.t, copy);
    if (tr_is_set_valued(s, i) && !tr_is_at_rest(s, i) && tr_stop_by_impact(s, copy, i)) return i;
  }
  return -1;
}

/* Find the pair that causes the failure at y. Returns the reason TR_WHY_…. Requires maps of y. Restores the modes. */
static int tr_find_jam(tr_sim *s, const double *y, int *pair) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  double copy[tr_state_width(s)];
  tr_save_modes(s, modes);
  memcpy(copy, y, sizeof copy);
  /* the last accepted root; z may hold the result of a later attempt */
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_z_length(s));
  *pair = tr_find_jamming_pair(s);
  tr_evaluate_maps_at(s, s->clock.t, y);
  const int found = *pair, moves = found >= 0 && !tr_is_at_rest(s, found), driven = found >= 0 && tr_is_fully_driven(s, found);
  int why = (moves && driven) || (found >= 0 && tr_stop_by_impact(s, copy, found)) ? TR_WHY_JAM : TR_WHY_UNKNOWN;
  if (why == TR_WHY_UNKNOWN && !moves && (*pair = tr_find_stopping_pair(s, y, modes)) >= 0) why = TR_WHY_JAM;
  else if (why == TR_WHY_UNKNOWN && found >= 0) *pair = found, why = driven ? TR_WHY_JAM : TR_WHY_INCONSISTENT;
  tr_restore_modes(s, modes);
  return why;
}

int tr_diagnose_friction(tr_sim *s, int *pair) {
  *pair = -1;
  if (!s->k->sets) return TR_WHY_UNKNOWN;
  if (s->friction.undecided) return TR_WHY_UNDECIDED;
  s->step.watch = 0;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  return tr_find_jam(s, TR_A(s, y), pair);
}

static int tr_let_ball_spin(tr_sim *s) {
  double *y = TR_A(s, y);
  if (!s->k->sets) return 0;
  s->step.watch = 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_is_sliding_ball(s, i) || tr_is_crawling(s, i)) continue;
    const tr_branch was = tr_evaluate_branch(s, i, s->clock.t, y);
    tr_mode_of(s, i)->flag = TR_CONE;
    if (tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_sliding_of(s, i)->cone < 0.0) {
      tr_log_fold(s, i, s->clock.t, y, &was);
      s->step.have_k1 = s->step.have_jac = 0;
      s->step.h = s->set.hfixed;
      s->stats.events++;
      return 1;
    }
    tr_mode_of(s, i)->flag = TR_SLIPS;
  }
  return 0;
}

/* Largest negligible speed, m/s: the tolerance of velocities or CAPTURE_SPEED, whichever is larger. Before the first step it is
 * zero, because initial speeds are exact. */
static double tr_negligible_speed(const tr_sim *s) { return s->stats.steps ? fmax(s->set.rtol, CAPTURE_SPEED) * tr_speed_unit(s) : 0.0; }

/* The slowest sliding pair with a negligible speed; −1 if there is none. Requires maps of the current state. */
static int tr_find_slowest(const tr_sim *s) {
  double least = tr_negligible_speed(s);
  int slow = -1;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_is_set_valued(s, i) || tr_is_stuck(s, i)) continue;
    double v = tr_pair_speed(s, i);
    if (v <= least) least = v, slow = i;
  }
  return slow;
}

static int tr_stop_slow_pair(tr_sim *s) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  if (!k->sets) return 0;
  s->step.watch = 0;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  int slow = tr_find_slowest(s);
  if (slow < 0) return 0;
  tr_save_modes(s, modes);
  memset(TR_A(s, z) + k->active, 0, sizeof(double) * k->neta);
  if (!tr_decide_again(s, slow, modes, 0)) return 0;
  s->stats.events++;
  return 1;
}

static int tr_continue_through_jam(tr_sim *s) {
  const tr_kernel *k = s->k;
  int pair, nc = s->o ? s->o->ncontacts : 0;
  double *y = TR_A(s, y);
  tr_contact before[nc + 1], after[nc + 1];
  if (!k->sets) return 0;
  s->step.watch = 0;
  tr_evaluate_maps_at(s, s->clock.t, y);
  if (tr_find_jam(s, y, &pair) != TR_WHY_JAM) return 0;
  tr_evaluate_maps_at(s, s->clock.t, y);
  int slow = tr_pair_speed(s, pair) <= tr_negligible_speed(s);
  if (!slow && !s->set.through_jams) return 0;
  int contacts = tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_current_contacts(s, y, before);
  const double energy = tr_audit_energy(s);
  tr_evaluate_maps_at(s, s->clock.t, y);
  if (!tr_stop_by_impact(s, y, pair) || !tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return 0;
  tr_audit_allow_change(s, energy);
  if (contacts) tr_current_contacts(s, y, after);
  tr_log_event(s, s->clock.t, slow ? TR_EV_STICK : TR_EV_IMPACT, pair, before + tr_pair_of(s, pair)->contact0, after + tr_pair_of(s, pair)->contact0,
         contacts ? tr_pair_of(s, pair)->ncontacts : 0);
  s->stats.events++;
  s->step.have_k1 = s->step.have_jac = 0;
  s->step.h = s->set.hfixed;
  return 1;
}
