/* Why friction has no answer, and what may be done: which pair is to blame, and whether it jams (its sliding stops at once, and from
 * rest there is an answer) or is inconsistent (not even then). */
#include "modes.h"

#define BLAME_MORE 1.01    /* times the share of the one before: where pairs that move together share the blame the first has it */

/* The pair whose equation is nearest to having no root where the equations still have one: the largest component of the direction the
 * Jacobian nearly annihilates. */
static int tr_weakest_pair(tr_sim *s) {
  const tr_kernel *k = s->k;
  int e = k->neta, *perm = (int *)TR_A(s, perm) + k->active, best = -1;
  double *J = TR_A(s, lu), x[e + 1], most = 0.0;
  tr_law(s, TR_A(s, z) + k->active);
  tr_law_jacobian(s);
  if (s->friction.still) tr_still_rows(s, TR_A(s, z) + k->active, TR_A(s, r), J);
  if (!tr_lu(e, J, perm)) return -1;
  for (int i = 0; i < e; ++i) x[i] = 1.0 / TR_A(s, arm)[i];
  for (int it = 0; it < 4; ++it) {
    double size = 0.0;
    tr_lu_solve(e, J, perm, x);
    for (int i = 0; i < e; ++i) size = fmax(size, fabs(x[i]));
    for (int i = 0; i < e; ++i) x[i] /= size;
  }
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double size = 0.0;
    for (int j = 0; j < pair->neta; ++j) size += x[pair->eta0 + j] * x[pair->eta0 + j] / (TR_A(s, arm)[pair->eta0 + j] * TR_A(s, arm)[pair->eta0 + j]);
    if (!tr_is_stuck(s, i) && size > BLAME_MORE * most) most = size, best = i;
  }
  return best;
}

/* A moving pair without whose friction the equations of the state in place have an answer; −1 when there is none. */
static int tr_stumbling_pair(tr_sim *s) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], n = tr_at_rest(s, -1, rest), found = -1;
  for (int i = 0; i < k->nsliders && found < 0; ++i) {
    if (!tr_is_set(s, i) || tr_pair_speed(s, i) <= REST_SPEED * tr_speed_unit(s)) continue;
    s->friction.freed = i;
    memset(TR_A(s, z) + k->active, 0, sizeof(double) * k->neta);
    if (n ? tr_decide(s, rest, n, -1) : tr_solve_modes(s)) found = i;
  }
  s->friction.freed = -1;
  return found;
}

/* The pair to blame at the state in place. Of pairs that the loops move as one freedom it is the weakest, also where the root that was followed has
 * gone: at its friction, the last there was. Without whose friction there is an answer is a matter of how loads are split there. */
static int tr_pair_to_blame(tr_sim *s) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  tr_keep_modes(s, modes);
  if (tr_solve_modes(s)) return tr_weakest_pair(s);
  const int stumbles = tr_stumbling_pair(s);
  if (stumbles < 0 || !k->active) return stumbles;
  tr_put_modes(s, modes);
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_nz(s));
  tr_note_modes(s);
  tr_without_loops(s, 1);
  const int weakest = tr_weakest_pair(s), line = tr_line_of(s, stumbles), other = weakest < 0 ? -1 : tr_line_of(s, weakest);
  return line >= 0 && other >= 0 && tr_are_one(s, line, other) ? weakest : stumbles;
}

/* Stop the pair at once by an impulse of its own friction (the tangential impact of a jam: no other impulse but those of the joints'
 * reactions) and decide anew. y: the state, replaced. 1 when there is an answer then: it sticks, or slips anew from rest. */
static int tr_impact(tr_sim *s, double *y, int pair) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], n = tr_all_to_rest(s, y, pair, rest, tr_at_rest(s, pair, rest));
  for (int i = 0; i < k->nsliders; ++i) /* what slides on may have been turned round */
    if (tr_is_set(s, i) && !tr_is_one_of(rest, n, i)) tr_freeze(s, i);
  memset(TR_A(s, z) + k->active, 0, sizeof(double) * k->neta);
  return tr_decide(s, rest, n, -1);
}

/* Whether the loops and their drives prescribe all of the motion of a pair: no friction stops it. Maps in place. */
static int tr_is_driven(tr_sim *s, int pair) {
  const tr_pair *p = tr_pair_of(s, pair);
  int driven = s->k->active > 0;
  if (driven) tr_without_loops(s, 1);
  for (int i = p->eta0; i < p->eta0 + p->neta && driven; ++i) driven = tr_is_prescribed(s, i);
  return driven;
}

/* At the state in place (maps of y): the pair to blame and the reason. Modes are kept. */
static int tr_blame(tr_sim *s, const double *y, int *pair) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  double copy[tr_width(s)];
  tr_keep_modes(s, modes);
  memcpy(copy, y, sizeof copy);
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_nz(s)); /* the root that was followed, not what was tried since */
  *pair = tr_pair_to_blame(s);
  int why = TR_WHY_UNKNOWN;
  if (*pair >= 0) why = tr_is_driven(s, *pair) || tr_impact(s, copy, *pair) ? TR_WHY_JAM : TR_WHY_INCONSISTENT;
  tr_put_modes(s, modes);
  return why;
}

/* After a failure: why (TR_WHY_…) and which pair. Only for scenes with a set-valued law. */
int tr_why(tr_sim *s, int *pair) {
  *pair = -1;
  if (!s->k->sets) return TR_WHY_UNKNOWN;
  if (s->friction.undecided) return TR_WHY_UNDECIDED;
  s->step.watch = 0;
  tr_maps_at(s, s->clock.t, TR_A(s, y));
  return tr_blame(s, TR_A(s, y), pair);
}

/* A ball that cannot slide on (its sliding branch has turned back) while it could turn without sliding does that from here. 1 when one
 * does. */
static int tr_lets_spin(tr_sim *s) {
  double *y = TR_A(s, y);
  if (!s->k->sets) return 0;
  s->step.watch = 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_slides_on_cone(s, i) || tr_pair_speed(s, i) <= NEAR_MISS * tr_speed_unit(s)) continue;
    const tr_branch was = tr_branch_at(s, i, s->clock.t, y);
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

/* The speed that does not count, m/s: the tolerance of velocities, or what may stop at once at any, once the run has made a step. At the start
 * they are as given. */
static double tr_no_speed(const tr_sim *s) { return s->stats.steps ? fmax(s->set.rtol, CAPTURE_SPEED) * tr_speed_unit(s) : 0.0; }

/* The slowest of the pairs whose speed does not count, of those that slide; −1: there is none. Maps in place. */
static int tr_slowest(const tr_sim *s) {
  double least = tr_no_speed(s);
  int slow = -1;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_is_set(s, i) || tr_is_stuck(s, i)) continue;
    double v = tr_pair_speed(s, i);
    if (v <= least) least = v, slow = i;
  }
  return slow;
}

/* Where friction has no answer beside a pair that is all but at rest, that pair stops here, and all at rest are decided: the direction of
 * so slow a sliding turns faster than any step. 1 when the run can go on. */
static int tr_slow_pair_stops(tr_sim *s) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  if (!k->sets) return 0;
  s->step.watch = 0;
  tr_maps_at(s, s->clock.t, TR_A(s, y));
  int slow = tr_slowest(s);
  if (slow < 0) return 0;
  tr_keep_modes(s, modes);
  memset(TR_A(s, z) + k->active, 0, sizeof(double) * k->neta);
  if (!tr_settles_anew(s, slow, modes, 0)) return 0;
  s->stats.events++;
  return 1;
}

/* Continue through a jam at (t, y): the pair to blame stops at once. Where what is left of its speed is below the tolerance of velocities,
 * that is how it comes to rest; else it is an impact, if the user wants those. 1 when the run can go on. */
static int tr_through_jam(tr_sim *s) {
  const tr_kernel *k = s->k;
  int pair, nc = s->o ? s->o->ncontacts : 0;
  double *y = TR_A(s, y);
  tr_contact before[nc + 1], after[nc + 1];
  if (!k->sets) return 0;
  s->step.watch = 0;
  tr_maps_at(s, s->clock.t, y);
  if (tr_blame(s, y, &pair) != TR_WHY_JAM) return 0;
  tr_maps_at(s, s->clock.t, y);
  int slow = tr_pair_speed(s, pair) <= tr_no_speed(s);
  if (!slow && !s->set.through_jams) return 0;
  int contacts = tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_all_contacts(s, y, before);
  const double energy = tr_audit_now(s);
  tr_maps_at(s, s->clock.t, y);
  if (!tr_impact(s, y, pair) || !tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return 0;
  tr_audit_excuse(s, energy);
  if (contacts) tr_all_contacts(s, y, after);
  tr_log(s, s->clock.t, slow ? TR_EV_STOP : TR_EV_IMPACT, pair, before + tr_pair_of(s, pair)->contact0, after + tr_pair_of(s, pair)->contact0,
         contacts ? tr_pair_of(s, pair)->ncontacts : 0);
  s->stats.events++;
  s->step.have_k1 = s->step.have_jac = 0;
  s->step.h = s->set.hfixed;
  return 1;
}
