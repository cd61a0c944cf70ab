/* End of sliding of pairs of several components (theory, "End of sliding"). The speed of such a pair reaches zero without a change
 * of sign, so no root shows the stop. The last stretch of sliding is therefore a separate step (capture). At the end of this step,
 * the pair and all pairs that stop with it are at rest. A pair of one component is captured if steps shrink towards its stop. */
#include "events/events.h"

#define CAPTURE_JOLT 10.0   /* relative to the pair's own rates: largest change of any rate when the pair stops */
/* in units of tolerance · speed unit: largest speed at which a pair may be stopped, if no other pair stops with it */
#define CAPTURE_ALONE 1.0
/* relative to the deceleration: if the acceleration perpendicular to the sliding is larger, the pair passes its least speed without
 * a stop */
#define CAPTURE_ACROSS 0.2
/* relative to the tolerance: largest errors of a last stretch in a steady direction. These errors are: speed across the direction
 * (in speed units), time of the stop (in units of 1 / rate scale), and deviation of the path from the straight rows inside the
 * stretch (in lengths). */
#define CAPTURE_STEADY 0.1
/* relative to the deceleration: largest acceleration across a last stretch in a steady direction, below the speed CAPTURE_SPEED */
#define CAPTURE_TURNED 0.01
/* number of corrections of the length of a last stretch; the error that a correction leaves is proportional to the square of this
 * length */
#define CAPTURE_PASSES 2
/* in units of tolerance / rate scale: required accuracy of the stop's time; no requirement below the speed NEAR_MISS */
#define CAPTURE_TIME RUN_ERROR
/* in units of tolerance / rate scale: stops at a smaller distance in time are simultaneous; far below the error of event times */
#define STOPS_AS_ONE 0.01
/* relative to the length of the last stretch. A pair whose own stop is closer to the end of the stretch also stops at that end.
 * This distance is well above the error of stop times. */
#define STOPS_WITH 0.5

/* Surface speeds of all pairs, m/s, at the end of the step that is `back` steps before the last. */
static double *tr_past_speeds(const tr_sim *s, int back) { return TR_A(s, past_speeds) + back * s->k->nsliders; }

/* Store the speeds at the end of an accepted step. Speeds from before an event are discarded. Requires maps of the step's end. */
static void tr_save_speeds(tr_sim *s) {
  double *t = s->friction.past_t;
  if (t[0] != s->step.t0)
    for (int q = 0; q < TR_PAST_ENDS; ++q) t[q] = NAN;
  memmove(tr_past_speeds(s, 1), tr_past_speeds(s, 0), sizeof(double) * (TR_PAST_ENDS - 1) * s->k->nsliders);
  memmove(t + 1, t, sizeof(double) * (TR_PAST_ENDS - 1));
  t[0] = s->pending.t;
  for (int i = 0; i < s->k->nsliders; ++i) tr_past_speeds(s, 0)[i] = tr_pair_speed(s, i);
}

/* Time until pair i rests, s, extrapolated over two steps from its speed `back` steps ago. Over a single step, the result would
 * oscillate for explicit steps at their stability limit. NaN: unknown; negative: the pair does not stop. */
static double tr_time_to_rest(const tr_sim *s, int i, int back) {
  const double *t = s->friction.past_t + back, v = tr_past_speeds(s, back)[i], was = tr_past_speeds(s, back + 2)[i];
  return v * (t[0] - t[2]) / (was - v);
}

/* Whether pair m slides, and would come to rest at about the same time as a pair that comes to rest in `left` s. */
static int tr_is_resting_as_soon(const tr_sim *s, int m, double left) {
  return tr_is_set_valued(s, m) && tr_is_sliding(s, m) && fabs(tr_time_to_rest(s, m, 0) - left) <= STOPS_WITH * left;
}

/* Time, s, in which pair i comes to rest at its present acceleration; INFINITY if it does not brake. *across receives the ratio of
 * the acceleration across the sliding to the deceleration. Requires the solution. */
static double tr_braking_time(tr_sim *s, int i, double *across) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *rates = tr_pair_rates(s, i), *lever = TR_A(s, lever) + pair->eta0, v = tr_pair_speed(s, i);
  double along = 0.0, size = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    const double acc = tr_acceleration_by_maps(s, pair->eta0 + j) * lever[j];
    along += acc * rates[j] * lever[j] / v, size += acc * acc;
  }
  *across = sqrt(fmax(size - along * along, 0.0)) / fmax(fabs(along), NO_FORCE);
  return along < 0.0 ? v / -along : INFINITY;
}

static double tr_time_to_rest_by_braking(tr_sim *s, int i) {
  double across;
  const double left = tr_braking_time(s, i, &across);
  return across > CAPTURE_ACROSS ? INFINITY : left;
}

/* Largest speed, m/s, at which pair i may be stopped. This speed is smaller if other pairs are about to stop, too. left: time, s,
 * after which the pair would come to rest by itself. */
static double tr_capture_speed(tr_sim *s, int i, double left) {
  int alone = tr_time_to_rest_by_braking(s, i) < INFINITY;
  for (int m = 0; m < s->k->nsliders && alone; ++m) alone = m == i || !tr_is_resting_as_soon(s, m, left);
  return tr_speed_unit(s) * (alone ? fmax(CAPTURE_ALONE * s->set.rtol, CAPTURE_SPEED) : CAPTURE_SPEED);
}

/* Whether no pair m ≠ i would prevent the capture of pair i, which comes to rest in `left` s. Pairs of one component may stop with
 * a faster pair of one component. */
static int tr_stops_first(const tr_sim *s, int i, double left) {
  const int single = tr_pair_of(s, i)->nrates == 1;
  for (int m = 0; m < s->k->nsliders; ++m) {
    const int follows = single && tr_pair_of(s, m)->nrates == 1 && tr_pair_speed(s, m) <= tr_pair_speed(s, i);
    if (m != i && !follows && tr_is_resting_as_soon(s, m, left)) return 0;
  }
  return 1;
}

/* A pair that stops first in a steady direction, and whose stop lies on the present line of its sliding; −1: none. *left receives
 * the time until its rest, s. Ordinary steps would miss this stop: at rest the direction is undefined, so the errors of the steps
 * would determine the motion. Of a pair of one component, the next step does not reach the stop, although the way to the stop is
 * negligible. */
static int tr_find_steady_stop(tr_sim *s, double *left) {
  const double small = CAPTURE_STEADY * s->set.rtol, unit = tr_speed_unit(s), next = s->pending.h * s->pending.grow;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_is_set_valued(s, i) || !tr_is_sliding(s, i) || tr_pair_of(s, i)->cone) continue;
    const int single = tr_pair_of(s, i)->nrates == 1;
    const double v = tr_pair_speed(s, i);
    double across = 0.0;
    const double tried = TR_A(s, capture_tried)[i];
    if (!(v > tr_rest_speed(unit)) || (tried > 0.0 && v > 0.5 * tried)) continue;
    if (single ? v * next > small * s->set.length : v > sqrt(small) * unit) continue;
    *left = single ? tr_time_to_rest(s, i, 0) : tr_braking_time(s, i, &across);
    if (single && !(*left > next)) continue;
    const int slow = !single && v <= tr_last_speed(unit) && across <= CAPTURE_TURNED; /* its turn may be an error of steps */
    if (!slow && (v * across > small * unit || *left * fmax(across * across, v / unit) > small / s->set.rate)) continue;
    if (tr_stops_first(s, i, *left)) return i;
  }
  return -1;
}

static int tr_find_pair_to_capture(tr_sim *s) {
  /* Parts of fixed steps have unequal sizes, so speeds at the ends of past steps cannot be compared. */
  const int i = s->friction.cutting_pair, fixed = s->set.hfixed > 0.0;
  tr_save_speeds(s);
  const int stops = fixed ? -1 : tr_find_steady_stop(s, &s->friction.capture_h);
  s->friction.steady = stops >= 0 && tr_pair_of(s, stops)->nrates > 1;
  if (stops >= 0) return stops;
  if (i < 0 || i >= s->k->nsliders || !tr_is_set_valued(s, i) || tr_is_stuck(s, i) || tr_pair_of(s, i)->nrates == 1) return -1;
  const double v = tr_pair_speed(s, i), unit = tr_speed_unit(s), *t = s->friction.past_t;
  double *least = TR_A(s, capture_tried) + i;
  if (v > 2.0 * *least) *least = 0.0; /* the pair has been faster since the last attempt */
  if (!(v > tr_rest_speed(unit)) || (*least > 0.0 && v > 0.5 * *least)) return -1;
  const double left = fixed ? tr_time_to_rest_by_braking(s, i) : tr_time_to_rest(s, i, 0), before = tr_time_to_rest(s, i, 1);
  if (!(left > 0.0 && left <= cbrt(s->set.rtol) / s->set.rate) || v > tr_capture_speed(s, i, left)) return -1;
  const double moved = fabs(t[0] + left - (t[1] + before)), gone = before - left;
  const int known = fixed || (gone > 0.0 && moved * left <= CAPTURE_TIME * s->set.rtol / s->set.rate * gone);
  if (!known && v > tr_crawl_speed(unit)) return -1;
  s->friction.capture_h = left;
  return i;
}

static double tr_fastest_rate(int n, const double *v, const double *unit) {
  double most = 0.0;
  for (int q = 0; q < n; ++q) most = fmax(most, fabs(v[q]) / unit[q]);
  return most;
}

static int tr_has_answer_at_rest(tr_sim *s, double t, double *y, int i) {
  const int nv = s->k->nv, nq = s->k->nq, pair_rates = tr_pair_of(s, i)->nrates;
  /* The first rate of a cylindrical pair is a translation. */
  const double along = pair_rates == 2 ? s->set.length : 1.0, own_unit[3] = {along, 1.0, 1.0};
  tr_mode modes[s->k->nsliders + 1];
  double change[nv + 1], unit[nv + 1];
  const double margin = s->events.margin;
  const int unsure = s->events.unsure;
  int events = s->events.count;
  long refused = s->stats.refused;
  tr_save_modes(s, modes);
  int has = tr_rhs(s, t, y, TR_A(s, dy));
  if (has) {
    const double own = tr_fastest_rate(pair_rates, tr_pair_rates(s, i), own_unit);
    memcpy(change, y + nq, sizeof(double) * nv);
    has = tr_handle_event(s, t, y, i, 0) == TR_OK && tr_is_crawling(s, i) && (pair_rates > 1 || tr_is_stuck(s, i));
    for (int q = 0; q < nv; ++q) change[q] -= y[nq + q], unit[q] = tr_rate_unit(s, q);
    has = has && tr_fastest_rate(nv, change, unit) <= CAPTURE_JOLT * own;
  }
  tr_restore_modes(s, modes);
  s->events.count = events, s->events.margin = margin, s->events.unsure = unsure, s->stats.refused = refused;
  tr_set_row_kinds(s);
  return has;
}

/* Freeze the direction of pair i over its last stretch. Also freeze the directions of other pairs of several components with a
 * speed up to tr_last_speed. Directions of faster pairs may turn. */
static void tr_freeze_last_directions(tr_sim *s, int i) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    if (!tr_is_set_valued(s, m) || !tr_is_sliding(s, m) || tr_pair_of(s, m)->nrates == 1) continue;
    double r[3], v = tr_speed_of_state(s, m);
    tr_rates_of_state(s, m, r);
    if (m == i || (v > tr_rest_speed(tr_speed_unit(s)) && v <= tr_last_speed(tr_speed_unit(s)))) tr_freeze_line_direction(s, m, r, v);
  }
}

/* Mark the pairs that stop with pair i at the end of its last stretch. Requires maps of the end of the stretch. */
static void tr_mark_pairs_stopping_with(tr_sim *s, int i) {
  const double h = s->friction.capture_h;
  for (int m = 0; m < s->k->nsliders; ++m)
    tr_stopping_marks(s)[m] = m != i && tr_pair_speed(s, m) <= tr_last_speed(tr_speed_unit(s)) && tr_is_resting_as_soon(s, m, h);
}

static void tr_mark_pairs_stopping_at_once(tr_sim *s, int i) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    if (m == i || !tr_is_set_valued(s, m) || !tr_is_sliding(s, m) || tr_pair_of(s, m)->nrates > 1) continue;
    double change, v = tr_speed_on_line(s, m, &change);
    tr_stopping_marks(s)[m] = change < 0.0 && v <= tr_last_speed(tr_speed_unit(s)) && v <= -change * STOPS_AS_ONE * s->set.rtol / s->set.rate;
  }
}

/* mid ← state in the middle of a stretch of length h, from the slopes f. Positions follow from the rates at a quarter of the stretch;
 * the present rates would move the mechanism in half of the time to the place where it stops. */
static void tr_find_middle_of_stretch(tr_sim *s, double h, const double *f, double *mid) {
  const int n = tr_state_width(s), nq = s->k->nq;
  const double *y = TR_A(s, y);
  double dq[s->k->nq + 4];
  for (int q = 0; q < n; ++q) mid[q] = y[q] + 0.25 * h * f[q];
  s->k->qdot(y, mid + nq, TR_A(s, c), dq);
  for (int q = 0; q < n; ++q) mid[q] = y[q] + 0.5 * h * (q < nq ? dq[q] : f[q]);
}

static int tr_make_capture_step(tr_sim *s, double limit) {
  int n = tr_state_width(s), i = s->friction.capture;
  double h = s->friction.capture_h, *y = TR_A(s, y), *mid = TR_A(s, ytmp), *f = TR_A(s, dy), *R = TR_A(s, kstep), *ynew = TR_A(s, ynew);
  tr_mode modes[s->k->nsliders];
  memcpy(TR_A(s, yold), y, sizeof(double) * n);
  s->friction.capture = -1;
  tr_save_modes(s, modes);
  tr_freeze_last_directions(s, i);
  tr_find_middle_of_stretch(s, h, TR_A(s, K), mid);
  int ok = tr_rhs(s, s->clock.t + 0.5 * h, mid, f);
  for (int it = 0; it < CAPTURE_PASSES && ok && s->friction.steady; ++it) {
    double across;
    h = tr_past_speeds(s, 0)[i] / tr_pair_speed(s, i) * tr_braking_time(s, i, &across);
    tr_find_middle_of_stretch(s, h, f, mid);
    ok = h <= 2.0 * s->friction.capture_h && s->clock.t + h < limit - tr_time_tolerance(limit) && tr_rhs(s, s->clock.t + 0.5 * h, mid, f);
  }
  tr_store_end_multipliers(s);
  for (int q = 0; q < n; ++q) ynew[q] = y[q] + h * f[q];
  ok = ok && tr_project(s, s->clock.t + h, ynew);
  memcpy(TR_A(s, event_y), ynew, sizeof(double) * n);
  if (ok) tr_evaluate_maps_at(s, s->clock.t + h, ynew), tr_mark_pairs_stopping_with(s, i);
  ok = ok && (tr_pair_of(s, i)->nrates > 1 || tr_pair_speed(s, i) <= CAPTURE_TURNED * tr_past_speeds(s, 0)[i]);
  ok = ok && tr_has_answer_at_rest(s, s->clock.t + h, TR_A(s, event_y), i);
  if (!ok) {
    TR_A(s, capture_tried)[i] = tr_past_speeds(s, 0)[i];
    tr_clear_stopping_marks(s);
    tr_restore_modes(s, modes);
    return 0;
  }
  s->step.t0 = s->clock.t, s->step.size = h;
  for (int q = 0; q < n; ++q) R[q] = ynew[q] - y[q];
  s->step.dense_rows = 1, s->step.have_dense = 1;
  TR_MADE(s, TR_HAS_DENSE);
  s->pending.theta = 1.0, s->pending.which = i, s->pending.h = s->step.h, s->pending.t = s->clock.t + h, s->pending.grow = 1.0, s->pending.cut = 0;
  s->pending.captured = 1;
  return 1;
}
