/* How it was up to an event that cuts a step short: branches of balls, the directions of what comes to rest there, loads shared at rest, contacts. */
#include "modes.h"

#define NO_MOTION 1e-9        /* of the speed unit: the direction of what is slower is that of round-off */
#define JUST_BEFORE 1e-3      /* of the step: so much before an event it was not, or if it was, */
#define BEFORE_GROWS 10.0     /* so many times that, back to the step's start */
#define BRANCH_BACK 1e-12     /* of the step: so far before its event what ends there is looked for first, */
#define BRANCH_GROWS 10.0     /* then so many times that, */
#define BRANCH_FAR 1e-2       /* and no farther */
#define BRANCH_ENDS 10.0      /* tolerances of its end: it is still there (as CLOSE_ENOUGH) */

/* The state where an event cuts the step short, on the manifold; where loops stay open, as it is. */
static void tr_event_state(tr_sim *s, double t, double *out) {
  tr_dense_state(s, s->pending.theta, out);
  if (!tr_project(s, t, out)) tr_dense_state(s, s->pending.theta, out);
}

/* Whether the branch of ball i's friction that ends at the event is still there at a part of the step before it; y is that state, evaluated. */
static int tr_still_there(tr_sim *s, int i, double found, double part, double *y) {
  s->pending.theta = found * (1.0 - part);
  const double t = s->step.t0 + s->pending.theta * s->step.size;
  tr_event_state(s, t, y);
  return tr_rhs(s, t, y, TR_A(s, dy)) && tr_violation(s, i, 0) <= BRANCH_ENDS;
}

/* The branch of a ball's friction that ends at the event that cuts the step short may have ended already at the state y there: it ends as a root
 * does, and the time at which is known less well than its friction has to be. Then y is made the state at the last instant found at which it was
 * still there, with its friction in place: at its very end a root is not found twice. Whether it was. */
static int tr_back_on_branch(tr_sim *s, double *y) {
  const double found = s->pending.theta;
  const int i = s->pending.which;
  if (i >= s->k->nsliders || !tr_is_set(s, i) || !tr_moving_ball(s, i)) return 0;
  int there = tr_still_there(s, i, found, 0.0, y);
  for (double part = BRANCH_BACK; !there && part < BRANCH_FAR; part *= BRANCH_GROWS) there = tr_still_there(s, i, found, part, y);
  s->pending.theta = found;
  return there;
}

/* Whether all that rest hold on by the loads followed up to the state y, which are then in place, with `which` among them. */
static int tr_held_up_to(tr_sim *s, double t, const double *y, int which) {
  int rest[s->k->nsliders + 1];
  tr_maps_at(s, t, y);
  const int n = tr_at_rest(s, which, rest);
  memcpy(TR_A(s, z) + s->k->active, TR_A(s, zold) + s->k->active, sizeof(double) * s->k->neta);
  return tr_hold_anew(s, rest, n);
}

/* At the event of a pair that shares a load at rest, at the state y: the loads followed up to there, by which all that rest hold on, if they do;
 * Newton's method may have come to others, by which none does. Their multipliers are then in place. Where their root ends at the event y is made
 * the state at the last instant found at which it was still there. */
static void tr_keep_shares(tr_sim *s, double t, double *y) {
  const tr_kernel *k = s->k;
  const int which = s->pending.which, a = k->active, e = k->neta;
  int rows = TR_A(s, share) + e - TR_A(s, rowk), width = tr_width(s); /* kinds, leaders and shares lie behind each other */
  double eta[e + 1], found[rows + 1], impend[k->nrates + 1], there[width];
  const double theta = s->pending.theta;
  if (!s->friction.shares || s->friction.kept || which >= k->nsliders || !tr_is_set(s, which) || !tr_is_stuck(s, which)) return;
  tr_mode modes[k->nsliders + 1];
  tr_keep_modes(s, modes), memcpy(eta, TR_A(s, z) + a, sizeof(double) * e), tr_copy(width, y, there);
  memcpy(found, TR_A(s, rowk), sizeof(double) * rows), memcpy(impend, TR_A(s, impend), sizeof(double) * k->nrates);
  const int still = s->friction.still, by_law = s->friction.by_law;
  int holds = tr_held_up_to(s, t, y, which);
  for (double part = BRANCH_BACK; part < BRANCH_FAR && !holds; part *= BRANCH_GROWS) {
    s->pending.theta = theta * (1.0 - part);
    tr_event_state(s, s->step.t0 + s->pending.theta * s->step.size, y);
    holds = tr_held_up_to(s, t, y, which);
  }
  s->pending.theta = theta;
  if (holds) return;
  tr_copy(width, there, y), tr_maps_at(s, t, y);
  tr_put_modes(s, modes), memcpy(TR_A(s, z) + a, eta, sizeof(double) * e);
  memcpy(TR_A(s, rowk), found, sizeof(double) * rows), memcpy(TR_A(s, impend), impend, sizeof(double) * k->nrates);
  s->friction.still = still, s->friction.shares = 1, s->friction.by_law = by_law; /* noted anew they would share otherwise */
}

/* Pairs of several components that come to rest at the event that cuts the step short have no direction at the state y there: as it was up to
 * there they keep the one they had just before, whichever way round-off points. Whether there are any. */
static int tr_keep_directions(tr_sim *s, double t, const double *y) {
  const tr_kernel *k = s->k;
  double before[tr_width(s)];
  int stops[k->nsliders + 1], any = 0, kept;
  tr_maps_at(s, t, y);
  for (int i = 0; i < k->nsliders; ++i) {
    stops[i] = tr_is_set(s, i) && tr_slides(s, i) && tr_pair_of(s, i)->nrates > 1 && tr_frozen_length(s, i) < TR_LINE &&
               tr_pair_speed(s, i) <= NO_MOTION * tr_speed_unit(s);
    any |= stops[i];
  }
  kept = any;
  for (double part = JUST_BEFORE; any && part <= 1.0; part *= BEFORE_GROWS) {
    const double theta = s->pending.theta * (1.0 - part);
    tr_dense_eval(s, theta, before);
    tr_maps_at(s, s->step.t0 + theta * s->step.size, before);
    any = 0;
    for (int i = 0; i < k->nsliders; ++i) {
      if (!stops[i]) continue;
      stops[i] = tr_pair_speed(s, i) <= NO_MOTION * tr_speed_unit(s);
      if (!stops[i]) tr_freeze_along(s, i, ON_LINE, tr_slider_rates(s, i), tr_pair_speed(s, i));
      any |= stops[i];
    }
  }
  return kept;
}

/* The state y where an event cuts the step short is brought onto the loops and evaluated as it was up to there: what comes to rest may have
 * friction along no direction that round-off has, but along the one it had. 0: neither. */
static int tr_evaluate_before(tr_sim *s, double t, double *y) {
  if (!tr_project(s, t, y)) return 0;
  if (tr_rhs(s, t, y, TR_A(s, dy))) return 1;
  return !s->pending.captured && tr_keep_directions(s, t, y) && tr_rhs(s, t, y, TR_A(s, dy));
}

/* Contact forces up to the event that cuts the step short, at the state y just evaluated. 0 when there are none. */
static int tr_contacts_before(tr_sim *s, double t, const double *y, tr_contact *out) {
  tr_mode modes[s->k->nsliders + 1];
  if (!s->o || !s->o->contacts) return 0;
  tr_keep_modes(s, modes);
  const int kept = !s->pending.captured && tr_keep_directions(s, t, y);
  if (kept) tr_rhs(s, t, y, TR_A(s, dy));
  const int any = tr_all_contacts(s, y, out);
  tr_put_modes(s, modes);
  if (kept) tr_rhs(s, t, y, TR_A(s, dy));
  return any;
}
