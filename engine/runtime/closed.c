/* Events found inside a step on its dense output, where the loops are open by the step's error: their times are found again with the loops
 * closed, so that what is decided, and the row written there, is at the event and not beside it. */
#include "modes.h"

#define CLOSE_STEP 1e-3 /* of θ: the first step of the secants that find an event again, */
#define CLOSE_TIMES 8   /* which are so many at most, */
#define CLOSE_FAR 0.25  /* of the step: what the step's error can move it by; farther on it is another event */
#define LET_GO_AS_ONE 1.0 /* × the tolerance, of 1/rate: pairs that are let go within that are let go at once; far below what times may be off by */
#define LET_GO_FIRST 1e-4 /* of that: so soon it is looked first, */
#define LET_GO_GROWS 10.0 /* then so many times later */
#define LET_GO_NEAR 1e-4 /* of the friction ratio: what is farther from that is not looked at */
#define CLOSE_ENOUGH 10.0 /* down to so many tolerances of the event */

/* Sliding speed of a pair that moves on a line, m/s, along the direction it had (`change`: its rate of change), at the state just solved. */
static double tr_speed_on_line(tr_sim *s, int i, double *change) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *dir = tr_mode_of(s, i)->direction, *r = tr_slider_rates(s, i), *arm = TR_A(s, arm) + pair->eta0;
  double v = 0.0, size = 0.0;
  *change = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    double along = dir[j] * arm[j];
    v += r[j] * arm[j] * along, *change += tr_acceleration_now(s, pair->eta0 + j) * arm[j] * along, size += along * along;
  }
  *change /= sqrt(size);
  return v / sqrt(size);
}

/* The end of sliding of pair i, found inside a step at (t, y) and evaluated there, was found with the loops open by the step's error;
 * closing them leaves a speed. Where the pair is at its dead centre (whatever moves, its rate is near zero) that speed cannot be taken by
 * an impulse of its friction: that would stop the whole mechanism; and others that the loops bind to it are then not yet at rest. Its time
 * is therefore found anew with the loops closed. */
static void tr_sharpen(tr_sim *s, int i, double *t, double *y) {
  int n = tr_width(s);
  double moved[n], te = *t, change;
  if (tr_pair_of(s, i)->nrates > 1 && !tr_stops_on_line(s, i, *t, y)) return;
  memcpy(moved, y, sizeof moved);
  for (int it = 0; it < 4; ++it) {
    double v = tr_speed_on_line(s, i, &change);
    if (fabs(v) <= TOL_SPEED * tr_speed_unit(s)) break;
    double dt = -v / change, next;
    te += dt;
    if (!(change < 0.0) || !(te > s->clock.t) || te > s->step.t0 + s->step.size) break;
    for (int q = 0; q < n; ++q) moved[q] += dt * TR_A(s, dy)[q];
    if (!tr_project(s, te, moved) || !tr_rhs(s, te, moved, TR_A(s, dy))) break;
    next = tr_speed_on_line(s, i, &change);
    if (!(fabs(next) < 0.5 * fabs(v))) break;
    memcpy(y, moved, sizeof moved), *t = te;
  }
  tr_rhs(s, *t, y, TR_A(s, dy));
}

/* Whether the end of a pair's sliding, found inside a step, is to be found anew with the loops closed. */
static int tr_needs_sharpening(const tr_sim *s, int i) {
  return s->k->active && i < s->k->nsliders && tr_is_set(s, i) && tr_flag(tr_mode_of(s, i)) == TR_SLIPS;
}

/* How far pair i (one that is held: the worst of those) is beyond its mode (``tr_violation``, less what is tolerated) at θ of the step just
 * made, with the loops closed. NaN: no answer there. */
static double tr_closed_violation(tr_sim *s, int i, double theta) {
  double *y = TR_A(s, cand), t = s->step.t0 + theta * s->step.size;
  tr_dense_state(s, theta, y);
  if (!tr_project(s, t, y) || !tr_rhs(s, t, y, TR_A(s, dy))) return NAN;
  tr_law(s, TR_A(s, z) + s->k->active); /* what Newton's method leaves in place is that of its last iterate but one */
  if (s->friction.still) tr_holding(s);
  double most = tr_violation(s, i, 0);
  for (int j = 0; tr_is_stuck(s, i) && j < s->k->nsliders; ++j)
    if (tr_is_stuck(s, j)) most = fmax(most, tr_violation(s, j, 0));
  return most - 1.0;
}

/* The event of a pair that holds or of a ball, found with the loops open by the step's error, is found again with the loops closed: by
 * secants on θ, which is left as it was where they lead nowhere. */
static void tr_close_event(tr_sim *s, int i) {
  double was = s->pending.theta, g0 = tr_closed_violation(s, i, was), theta = was * (1.0 - CLOSE_STEP);
  for (int it = 0; it < CLOSE_TIMES && fabs(g0) > CLOSE_ENOUGH; ++it) {
    double g = tr_closed_violation(s, i, theta), next = theta - g * (theta - was) / (g - g0);
    was = theta, g0 = g, theta = next;
    if (!(theta > 0.0 && theta <= 1.0) || fabs(theta - s->pending.theta) > CLOSE_FAR) return;
  }
  if (!(fabs(g0) <= CLOSE_ENOUGH)) return;
  s->pending.theta = was, s->pending.t = s->step.t0 + was * s->step.size;
}

/* Stuck pairs that are asked for more than they can hold at θ, a tolerance or more; loops closed. −1: no answer there. */
static int tr_let_go_at(tr_sim *s, int i, double theta) {
  int count = 0;
  const double worst = tr_closed_violation(s, i, theta);
  if (worst != worst) return -1;
  for (int j = 0; j < s->k->nsliders; ++j) count += tr_is_set(s, j) && tr_is_stuck(s, j) && tr_violation(s, j, 0) > 0.0;
  return count;
}

/* Pairs that would be let go so soon after pair i that no times are told from each other are let go with it, at the time of the last: in what is
 * symmetric they are let go at once, and the step's error parts them. */
static void tr_let_go_as_one(tr_sim *s, int i) {
  int near = 0;
  const int nz = tr_nz(s);
  double z[nz + 1];
  if (s->friction.shares) return; /* followed to and fro they may be shared otherwise */
  tr_copy(nz, TR_A(s, z), z);
  const double most = LET_GO_AS_ONE * s->set.rtol / s->set.rate / s->step.size;
  const int now = tr_let_go_at(s, i, s->pending.theta);
  for (int j = 0; j < s->k->nsliders; ++j)
    near += j != i && tr_is_set(s, j) && tr_is_stuck(s, j) && tr_violation(s, j, 0) > -LET_GO_NEAR / TOL_RELEASE && tr_violation(s, j, 0) <= 0.0;
  for (double part = LET_GO_FIRST; near && now >= 0 && part <= 1.0; part *= LET_GO_GROWS) {
    const double theta = s->pending.theta + part * most;
    if (theta > 1.0 || tr_let_go_at(s, i, theta) <= now) continue;
    s->pending.theta = theta, s->pending.t = s->step.t0 + theta * s->step.size;
    return;
  }
  tr_copy(nz, z, TR_A(s, z));
}

/* The pending step's event moved to its sharpened time, so that rows up to it are its own. */
static void tr_sharpen_pending(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, cand);
  const int i = s->pending.which;
  if (s->k->active && i < s->k->nsliders && tr_is_set(s, i) && (tr_is_stuck(s, i) || tr_moving_ball(s, i))) tr_close_event(s, i);
  if (i < s->k->nsliders && tr_is_set(s, i) && tr_is_stuck(s, i)) tr_let_go_as_one(s, i);
  if (!tr_needs_sharpening(s, s->pending.which)) return;
  tr_dense_state(s, s->pending.theta, ye);
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, TR_A(s, dy))) return;
  tr_sharpen(s, s->pending.which, &te, ye);
  s->pending.t = te, s->pending.theta = (te - s->step.t0) / s->step.size;
}
