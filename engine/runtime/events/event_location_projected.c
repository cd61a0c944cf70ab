/* Refined event times. On the dense output, loops are open by the error of the step. The functions of this file refine event times
 * with closed loops, so that decisions and rows belong to the exact event (theory, "Events"). */
#include "events/events.h"

#define CLOSE_STEP 1e-3 /* relative to θ: distance between the two points of the first secant */
#define CLOSE_TIMES 8   /* largest number of secant iterations */
/* relative to the step: largest shift of an event by the step's error; a root at a larger distance is another event */
#define CLOSE_FAR 0.25
/* relative to TOL_STOP: depth beyond a stop at which the stop's event is placed, and tolerance of this depth */
#define STOP_PASSED (0.5 * EVENT_CLOSE)
/* in units of tolerance / rate scale: releases at a smaller distance in time count as simultaneous; far below the error of event
 * times */
#define LET_GO_AS_ONE 1.0
#define LET_GO_FIRST 1e-4 /* relative to LET_GO_AS_ONE: first distance in time at which the program looks for later releases */
#define LET_GO_GROWS 10.0 /* ratio of successive distances */
#define LET_GO_NEAR 1e-4 /* relative to the friction ratio: a pair farther from release is not considered */

/* Surface speed of pair i along its frozen direction, m/s, at the present solution. *change receives its time derivative, m/s². */
static double tr_speed_on_line(tr_sim *s, int i, double *change) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *dir = tr_mode_of(s, i)->direction, *r = tr_pair_rates(s, i), *lever = TR_A(s, lever) + pair->eta0;
  double v = 0.0, size = 0.0;
  *change = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    double along = dir[j] * lever[j];
    v += r[j] * lever[j] * along, *change += tr_acceleration_by_maps(s, pair->eta0 + j) * lever[j] * along, size += along * along;
  }
  *change /= sqrt(size);
  return v / sqrt(size);
}

static void tr_refine_event_time(tr_sim *s, int i, double *t, double *y) {
  int n = tr_state_width(s);
  double moved[n], te = *t, change;
  if (tr_pair_of(s, i)->nrates > 1 && !tr_is_stopping_on_line(s, i, *t, y)) return;
  memcpy(moved, y, sizeof moved);
  for (int it = 0; it < 4; ++it) {
    double v = tr_speed_on_line(s, i, &change);
    if (fabs(v) <= tr_stick_tolerance(tr_speed_unit(s))) break;
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

static int tr_is_refinement_needed(const tr_sim *s, int i) {
  return s->k->active && i < s->k->nsliders && tr_is_set_valued(s, i) && tr_mode_flag(tr_mode_of(s, i)) == TR_SLIPS;
}

/* Violation of the mode of pair or stop i, minus one, in tolerances, at θ of the last step with closed loops. For a stuck pair i:
 * the largest violation of all stuck pairs. For a stop: the violation minus STOP_PASSED, so that the state at the root is beyond
 * the stop. Returns NaN if there is no solution. */
static double tr_projected_violation(tr_sim *s, int i, double theta) {
  double *y = TR_A(s, event_y), t = s->step.t0 + theta * s->step.size, depth[s->k->nstops + 1];
  tr_dense_state(s, theta, y);
  if (!tr_project(s, t, y) || !tr_rhs(s, t, y, TR_A(s, dy))) return NAN;
  if (i >= s->k->nsliders) {
    tr_stop_depths(s, y, depth);
    return tr_mode_violation(s, i, depth) - STOP_PASSED;
  }
  tr_evaluate_laws(s, TR_A(s, z) + s->k->active); /* Newton's method leaves the laws' values of an earlier iterate */
  if (s->friction.held) tr_evaluate_capacities(s);
  double most = tr_mode_violation(s, i, 0);
  for (int j = 0; tr_is_stuck(s, i) && j < s->k->nsliders; ++j)
    if (tr_is_stuck(s, j)) most = fmax(most, tr_mode_violation(s, j, 0));
  return most - 1.0;
}

/* Refine the pending event of a stuck pair, a ball or a stop with closed loops, by secants on θ. If the secants do not converge,
 * the time stays unchanged. */
static void tr_refine_projected_event(tr_sim *s, int i) {
  const double close = i < s->k->nsliders ? EVENT_CLOSE : STOP_PASSED;
  double was = s->pending.theta, g0 = tr_projected_violation(s, i, was), theta = was * (1.0 - CLOSE_STEP);
  for (int it = 0; it < CLOSE_TIMES && fabs(g0) > close; ++it) {
    double g = tr_projected_violation(s, i, theta), next = theta - g * (theta - was) / (g - g0);
    was = theta, g0 = g, theta = next;
    if (!(theta > 0.0 && theta <= 1.0) || fabs(theta - s->pending.theta) > CLOSE_FAR) return;
  }
  if (!(fabs(g0) <= close)) return;
  s->pending.theta = was, s->pending.t = s->step.t0 + was * s->step.size;
}

/* Number of stuck pairs beyond their capacity at θ with closed loops; −1 if there is no solution. */
static int tr_count_released_at(tr_sim *s, int i, double theta) {
  int count = 0;
  const double worst = tr_projected_violation(s, i, theta);
  if (worst != worst) return -1;
  for (int j = 0; j < s->k->nsliders; ++j) count += tr_is_set_valued(s, j) && tr_is_stuck(s, j) && tr_mode_violation(s, j, 0) > 0.0;
  return count;
}

/* Delay the pending release of pair i to the last release that follows within the error of event times. In symmetric mechanisms
 * these releases are simultaneous; only the error of the step separates the releases in time. */
static void tr_release_together(tr_sim *s, int i) {
  int near = 0;
  const int nz = tr_z_length(s);
  double z[nz + 1];
  if (s->friction.shared) return; /* with shared loads, another solution may divide the loads differently */
  tr_copy(nz, TR_A(s, z), z);
  const double most = LET_GO_AS_ONE * s->set.rtol / s->set.rate / s->step.size;
  const int now = tr_count_released_at(s, i, s->pending.theta);
  for (int j = 0; j < s->k->nsliders; ++j)
    near += j != i && tr_is_set_valued(s, j) && tr_is_stuck(s, j) && tr_mode_violation(s, j, 0) > -LET_GO_NEAR / TOL_RELEASE && tr_mode_violation(s, j, 0) <= 0.0;
  for (double part = LET_GO_FIRST; near && now >= 0 && part <= 1.0; part *= LET_GO_GROWS) {
    const double theta = s->pending.theta + part * most;
    if (theta > 1.0 || tr_count_released_at(s, i, theta) <= now) continue;
    s->pending.theta = theta, s->pending.t = s->step.t0 + theta * s->step.size;
    return;
  }
  tr_copy(nz, z, TR_A(s, z));
}

static void tr_refine_pending_event(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, event_y);
  const int i = s->pending.which, lands = i < s->k->nsliders ? -1 : tr_contact_of_stop(s, i - s->k->nsliders);
  if (lands >= 0 && tr_is_contact_open(s, lands) && !tr_is_contact_unloaded(s, lands)) {
    tr_refine_landing(s, lands);
    return;
  }
  const int pair = i < s->k->nsliders, projected = !pair || (tr_is_set_valued(s, i) && (tr_is_stuck(s, i) || tr_is_moving_ball(s, i)));
  if (s->k->active && projected) tr_refine_projected_event(s, i);
  if (i < s->k->nsliders && tr_is_set_valued(s, i) && tr_is_stuck(s, i)) tr_release_together(s, i);
  if (!tr_is_refinement_needed(s, s->pending.which)) return;
  tr_dense_state(s, s->pending.theta, ye);
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, TR_A(s, dy))) return;
  tr_refine_event_time(s, s->pending.which, &te, ye);
  s->pending.t = te, s->pending.theta = (te - s->step.t0) / s->step.size;
}
