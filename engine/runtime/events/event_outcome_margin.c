/* Margin of an event: the change of its deciding quantity that would change its outcome (theory, "Marginal events"). At a crossing
 * of a threshold, the margin is the overshoot that would follow without the event. For a decision, the margin is the distance of
 * stuck pairs from release and of slipping pairs from rest. Events with a margin below the run's error are marked as unsure. */
#include "events/events.h"

/* rate of a crossing, relative to the unit of the crossing quantity divided by the duration of the run. At a slower crossing, a
 * shift of the threshold by one tolerance shifts the event by more than the error of event times. */
#define SLOW 0.01
#define STRAYS_LEAST 1e-3 /* relative to the run's error: smallest assumed error of a speed */
/* relative to the friction ratio: a pair whose ratio is this close to the ratio of the released pair is also released */
#define LET_GO_WITH 1e-6
#define ENOUGH 0.01      /* relative to the friction ratio: if an estimated margin is larger, it is not computed exactly */
#define LEAST_STRETCH 1e-3 /* relative to the step: shortest interval over which a slope is measured */
/* distance s²/|ω|²: in model exchange, shift of a ball's indicator from the cone. The law of a ball loses half of its digits at the
 * cone; the error of the distance is then 5e-10. */
#define SHIFT_CONE 2e-9

/* Possible error of the run's states, relative to the units of the states. */
static double tr_run_error(const tr_sim *s) { return RUN_ERROR * tr_audit_tolerance(s); }

static void tr_add_speed_errors(tr_sim *s) {
  double *trial = TR_A(s, speed_errors), *sum = trial + s->k->nsliders;
  for (int i = 0; i < s->k->nsliders && s->k->sets; ++i) sum[i] = hypot(sum[i], trial[i]);
}

static double *tr_violations_at(const tr_sim *s, int when) { return TR_A(s, violations) + when * (tr_watched_count(s) + s->k->nsliders); }

/* Reserves of the pairs at rest; NaN for other pairs. */
static double *tr_reserves_at(const tr_sim *s, int when) { return tr_violations_at(s, when) + tr_watched_count(s); }

static void tr_copy_violations(tr_sim *s, int from, int when) {
  tr_copy(tr_watched_count(s) + s->k->nsliders, tr_violations_at(s, from), tr_violations_at(s, when));
  if (when == TR_AT_START) s->step.far_known = 1;
}

/* Fraction of the run's error that applies to the event of pair or stop `which`. At the end of a pair's sliding, this fraction
 * follows from the accumulated error of the pair's speed. */
static double tr_error_part(const tr_sim *s, int which) {
  if (which >= s->k->nsliders || !tr_is_set_valued(s, which) || tr_is_stuck(s, which) || tr_is_moving_ball(s, which)) return 1.0;
  if (tr_pair_of(s, which)->v0 < 0) return 1.0;
  const double off = RUN_ERROR * TR_A(s, speed_errors)[s->k->nsliders + which] / tr_pair_speed_unit(s, which);
  return fmin(1.0, fmax(off / tr_run_error(s), STRAYS_LEAST));
}

/* Factor that converts a violation of pair or stop `which`, in tolerances, to a margin. The unit of the margin is friction ratio,
 * relative speed, relative length, or sine². */
static double tr_margin_unit(const tr_sim *s, int which) {
  if (which >= s->k->nsliders) return TOL_STOP / s->set.length;
  if (!tr_is_set_valued(s, which)) return TOL_KINK * tr_sliding_of(s, which)->border / tr_pair_speed_unit(s, which);
  if (tr_is_stuck(s, which)) return TOL_RELEASE;
  return tr_is_moving_ball(s, which) ? TOL_CONE : tr_stick_tolerance(tr_speed_unit(s)) / tr_pair_speed_unit(s, which);
}

static void tr_set_crossing_margin(tr_sim *s, int which) {
  const double at = s->pending.theta, left = 1.0 - at, unit = tr_margin_unit(s, which);
  const double start = tr_violations_at(s, TR_AT_START)[which] * unit, end = tr_violations_at(s, TR_AT_END)[which] * unit;
  const int before = s->step.far_known && at > LEAST_STRETCH && start < 0.0, beyond = left > LEAST_STRETCH && end == end;
  s->events.margin = CLEAR_MARGIN, s->events.unsure = 0;
  if (s->pending.captured || !(before || beyond)) return;
  const double first = before ? -start / at : end / left, second = beyond ? end / left : first;
  const double slope = first + (second - first) * at, bend = 2.0 * (second - first);
  if (bend < -unit) s->events.margin = fmin(CLEAR_MARGIN, fmax(0.5 * slope * slope / -bend, end));
  const double part = tr_error_part(s, which), gone = fabs(slope) / s->step.size * fmax(s->clock.t_end - s->clock.t_start, 1.0 / s->set.rate);
  /* start values have no error: a stop that begins at its limit, at rest, engages at a certain time */
  const double grown = fmin(1.0, (s->pending.t - s->clock.t_start) * s->set.rate);
  s->events.unsure = s->events.margin < part * tr_run_error(s) || gone < SLOW * part * grown;
}

/* Estimated margin of slipping pair i, which could also rest: the friction needed for rest divided by the capacity, minus 1.
 * Requires the capacities of the present solution. */
static double tr_slip_margin(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const tr_hold *hold = tr_hold_of(s, i);
  const int along = s->step.recursive && !s->k->active;
  double size = 0.0, most = 0.0;
  if (!along) tr_form_maps_without_loops(s, 1);
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) {
    const double lever = TR_A(s, lever)[j], acc = tr_acceleration_by_maps(s, j) * lever;
    if (!along && tr_is_prescribed(s, j)) continue;
    size += acc * acc, most = fmax(most, (along ? tr_response_by_recursion(s, j) : tr_freedom_response(s, j, j)) * lever * lever);
  }
  if (!(most > 0.0) || tr_mode_flag(tr_mode_of(s, i)) == TR_CONE) return CLEAR_MARGIN;
  return (hold->size + sqrt(size) / most) / fmax(hold->capacity, NO_FORCE) - 1.0;
}

/* Margin of slipping pair i: the relative distance of its friction from its capacity, in a solution in which the pair is stuck.
 * Restores modes and multipliers. */
static double tr_margin_if_stuck(tr_sim *s, int i) {
  const int nz = tr_z_length(s);
  tr_mode modes[s->k->nsliders + 1];
  double z[nz + 1];
  tr_save_modes(s, modes), tr_copy(nz, TR_A(s, z), z);
  tr_mode_of(s, i)->flag = TR_STUCK;
  const double margin = tr_solve_in_modes(s) ? fabs(tr_friction_ratio(s, i) - 1.0) : CLEAR_MARGIN;
  tr_restore_modes(s, modes), tr_copy(nz, z, TR_A(s, z));
  tr_solve_in_modes(s);
  tr_copy(nz, z, TR_A(s, z));
  return margin;
}

/* Ratio of friction to capacity of each stuck pair at the present solution; 0 for every other pair. */
static void tr_save_held_shares(tr_sim *s, double *was) {
  memset(was, 0, sizeof(double) * s->k->nsliders);
  if (!s->friction.held) return;
  tr_evaluate_capacities(s);
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_stuck(s, i)) was[i] = tr_friction_ratio(s, i);
}

/* Margin of the decision about the n pairs `rest`, after its evaluation. was: result of tr_save_held_shares before the decision. */
static double tr_decision_margin(tr_sim *s, const int *rest, int n, int released, const double *was) {
  double least = CLEAR_MARGIN;
  tr_evaluate_capacities(s);
  for (int q = 0; q < n; ++q) {
    const int i = rest[q];
    if (tr_is_stuck(s, i)) least = fmin(least, 1.0 - tr_friction_ratio(s, i));
    else if (i != released && was[i] < 1.0 - LET_GO_WITH) {
      /* the estimate equals the margin if no other pair rests; otherwise the estimate is smaller */
      const double estimate = tr_slip_margin(s, i);
      least = fmin(least, estimate < ENOUGH ? tr_margin_if_stuck(s, i) : estimate);
    }
  }
  return fmax(least, 0.0);
}

/* Lower the margin of the next event to `margin`, if `margin` is smaller. */
static void tr_record_margin(tr_sim *s, double margin) {
  s->events.margin = fmin(s->events.margin, margin), s->events.unsure |= margin < tr_run_error(s);
}

static double tr_distance_to_cone(const tr_sim *s, int i) {
  const double cone = tr_sliding_of(s, i)->cone;
  if (!tr_is_set_valued(s, i) || tr_is_stuck(s, i) || !tr_pair_of(s, i)->cone || !tr_is_moving_ball(s, i)) return 1.0;
  return SHIFT_CONE + (tr_mode_flag(tr_mode_of(s, i)) == TR_CONE ? -cone : cone);
}
