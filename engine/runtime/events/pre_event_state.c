/* State just before an event that cuts a step short: branches of balls, directions of stopping pairs, shared loads, contacts. */
#include "events/events.h"

#define NO_MOTION 1e-9        /* relative to the speed unit: the direction of a slower pair is round-off */
#define JUST_BEFORE 1e-3      /* relative to the step: first distance before the event at which a direction is computed */
#define BEFORE_GROWS 10.0     /* factor from one distance before the event to the next */
#define BRANCH_BACK 1e-12 /* relative to the step: first distance before the event at which the program looks for a lost branch */
#define BRANCH_GROWS 10.0     /* factor from one distance of the branch search to the next */
#define BRANCH_FAR 1e-2 /* relative to the step: largest distance before the event at which the program looks for a lost branch */

static void tr_event_state(tr_sim *s, double t, double *out) {
  tr_dense_state(s, s->pending.theta, out);
  if (!tr_project(s, t, out)) tr_dense_state(s, s->pending.theta, out);
}

/* Whether the friction branch of ball i exists at the fraction `part` before the event. y receives the evaluated state at this
 * fraction. found: θ of the event. */
static int tr_has_branch_before(tr_sim *s, int i, double found, double part, double *y) {
  s->pending.theta = found * (1.0 - part);
  const double t = s->step.t0 + s->pending.theta * s->step.size;
  tr_event_state(s, t, y);
  return tr_rhs(s, t, y, TR_A(s, dy)) && tr_mode_violation(s, i, 0) <= EVENT_CLOSE;
}

static int tr_step_back_to_branch(tr_sim *s, double *y) {
  const double found = s->pending.theta;
  const int i = s->pending.which;
  if (i >= s->k->nsliders || !tr_is_set_valued(s, i) || !tr_is_moving_ball(s, i)) return 0;
  int there = tr_has_branch_before(s, i, found, 0.0, y);
  for (double part = BRANCH_BACK; !there && part < BRANCH_FAR; part *= BRANCH_GROWS) there = tr_has_branch_before(s, i, found, part, y);
  s->pending.theta = found;
  return there;
}

/* Whether all pairs at rest hold at (t, y) under loads that continue the loads at the step's start. If so, these loads become the
 * solution. */
static int tr_hold_until_event(tr_sim *s, double t, const double *y, int which) {
  int rest[s->k->nsliders + 1];
  tr_evaluate_maps_at(s, t, y);
  const int n = tr_collect_pairs_at_rest(s, which, rest);
  memcpy(TR_A(s, z) + s->k->active, TR_A(s, zold) + s->k->active, sizeof(double) * s->k->neta);
  return tr_hold_by_resharing(s, rest, n);
}

static void tr_restore_shares_before(tr_sim *s, double t, double *y) {
  const tr_kernel *k = s->k;
  const int which = s->pending.which, a = k->active, e = k->neta;
  /* One copy restores row_kind, leaders and share, which are contiguous in the block. */
  int rows = TR_A(s, share) + e - TR_A(s, row_kind), width = tr_state_width(s);
  double eta[e + 1], found[rows + 1], impend[k->nrates + 1], there[width];
  const double theta = s->pending.theta;
  if (!s->friction.shared || s->friction.stored || which >= k->nsliders || !tr_is_set_valued(s, which) || !tr_is_stuck(s, which)) return;
  tr_mode modes[k->nsliders + 1];
  tr_save_modes(s, modes), memcpy(eta, TR_A(s, z) + a, sizeof(double) * e), tr_copy(width, y, there);
  memcpy(found, TR_A(s, row_kind), sizeof(double) * rows), memcpy(impend, TR_A(s, impending), sizeof(double) * k->nrates);
  const int still = s->friction.held, by_law = s->friction.impending_laws;
  int holds = tr_hold_until_event(s, t, y, which);
  for (double part = BRANCH_BACK; part < BRANCH_FAR && !holds; part *= BRANCH_GROWS) {
    s->pending.theta = theta * (1.0 - part);
    tr_event_state(s, s->step.t0 + s->pending.theta * s->step.size, y);
    holds = tr_hold_until_event(s, t, y, which);
  }
  s->pending.theta = theta;
  if (holds) return;
  tr_copy(width, there, y), tr_evaluate_maps_at(s, t, y);
  tr_restore_modes(s, modes), memcpy(TR_A(s, z) + a, eta, sizeof(double) * e);
  memcpy(TR_A(s, row_kind), found, sizeof(double) * rows), memcpy(TR_A(s, impending), impend, sizeof(double) * k->nrates);
  /* Each value is restored separately, because tr_set_row_kinds would change the shares. */
  s->friction.held = still, s->friction.shared = 1, s->friction.impending_laws = by_law;
}

/* Freeze the direction in which pair i slid when it last moved by more than round-off. Its mode keeps this direction. */
static void tr_freeze_last_direction(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double last[3] = {0.0, 0.0, 0.0}, size = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    last[j] = tr_mode_of(s, i)->direction[j];
    size += last[j] * last[j] * TR_A(s, lever)[pair->eta0 + j] * TR_A(s, lever)[pair->eta0 + j];
  }
  if (size > 0.0) tr_freeze_line_direction(s, i, last, sqrt(size));
}

static int tr_restore_directions_before(tr_sim *s, double t, const double *y) {
  const tr_kernel *k = s->k;
  double before[tr_state_width(s)];
  int stops[k->nsliders + 1], any = 0, kept;
  for (int i = 0; i < k->nsliders; ++i) any |= tr_is_set_valued(s, i) && tr_is_sliding(s, i) && tr_pair_of(s, i)->nrates > 1;
  if (!any) return any;
  tr_evaluate_maps_at(s, t, y), any = 0;
  for (int i = 0; i < k->nsliders; ++i) {
    stops[i] = tr_is_set_valued(s, i) && tr_is_sliding(s, i) && tr_pair_of(s, i)->nrates > 1 && tr_frozen_length(s, i) < TR_LINE &&
               tr_pair_speed(s, i) <= NO_MOTION * tr_speed_unit(s);
    any |= stops[i];
  }
  kept = any;
  for (double part = JUST_BEFORE; any && part <= 1.0; part *= BEFORE_GROWS) {
    const double theta = s->pending.theta * (1.0 - part);
    tr_evaluate_dense(s, theta, before);
    tr_evaluate_maps_at(s, s->step.t0 + theta * s->step.size, before);
    any = 0;
    for (int i = 0; i < k->nsliders; ++i) {
      if (!stops[i]) continue;
      stops[i] = tr_pair_speed(s, i) <= NO_MOTION * tr_speed_unit(s);
      if (!stops[i]) tr_freeze_line_direction(s, i, tr_pair_rates(s, i), tr_pair_speed(s, i));
      any |= stops[i];
    }
  }
  for (int i = 0; i < k->nsliders && any; ++i)
    if (stops[i]) tr_freeze_last_direction(s, i);
  return kept;
}

static int tr_evaluate_before_event(tr_sim *s, double t, double *y) {
  if (!tr_project(s, t, y)) return 0;
  if (tr_rhs(s, t, y, TR_A(s, dy))) return 1;
  return !s->pending.captured && tr_restore_directions_before(s, t, y) && tr_rhs(s, t, y, TR_A(s, dy));
}

static int tr_contacts_before_event(tr_sim *s, double t, const double *y, tr_contact *out) {
  tr_mode modes[s->k->nsliders + 1];
  if (!s->o || !s->o->contacts) return 0;
  tr_save_modes(s, modes);
  const int kept = !s->pending.captured && tr_restore_directions_before(s, t, y);
  if (kept) tr_rhs(s, t, y, TR_A(s, dy));
  const int any = tr_current_contacts(s, y, out);
  tr_restore_modes(s, modes);
  if (kept) tr_rhs(s, t, y, TR_A(s, dy));
  return any;
}
