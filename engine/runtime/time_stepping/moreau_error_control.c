/* Moreau steps under error control, and their use by method auto (theory, "Error control").
 *
 * Each step is made as a whole and in two halves; the difference of the results is the error estimate. If no mode changes, the
 * results are extrapolated to second order. If a mode changes, the time of this change inside the step remains unknown. The
 * resulting uncertainty of a speed must then be below the tolerance, too. */
#include "time_stepping/time_stepping.h"

#define MOREAU_EVENTS 40   /* number n: events accumulate if n events occur within n times MOREAU_STEP */
#define MOREAU_PAIRS 8     /* number of pairs to which MOREAU_EVENTS refers; for more pairs the limit is proportionally larger */
#define MOREAU_STAY 400    /* number of impulse steps before event location is tried again */
/* in units of rtol / rate scale: in a shorter time, a speed changes by more than the tolerance only by an impact */
#define LEAST_IMPULSE 1e-3
/* relative to the change of a speed over a step: if the changes in both halves of the step differ by more, the speed jumps */
#define HALF_OF_IT 0.5
#define EVENT_SHARE 0.2    /* relative to the tolerance of speeds: allowed effect of the unknown time of an event */
#define SLIVER 1e-9        /* relative to a step: if less would remain before the limit, the step ends at the limit */

/* Whether all pairs have the modes `then`. A reversed direction counts as another mode. */
static int tr_has_same_modes(const tr_sim *s, const tr_mode *then) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_set_valued(s, i) && (tr_mode_flag(tr_mode_of(s, i)) != tr_mode_flag(then + i) || tr_mode_change(s, i, then + i))) return 0;
  return 1;
}

/* Surface speeds of all pairs at (t, y), m/s. */
static void tr_evaluate_speeds(tr_sim *s, double t, const double *y, double *speed) {
  tr_evaluate_maps_at(s, t, y);
  for (int i = 0; i < s->k->nsliders; ++i) speed[i] = tr_pair_speed(s, i);
}

/* Whether pair i moves against the direction in which it slides. Requires maps of the current state. */
static int tr_is_moving_backwards(const tr_sim *s, int i) {
  return tr_is_set_valued(s, i) && !tr_is_stuck(s, i) && tr_speed_along(s, i) < -tr_crawl_speed(tr_speed_unit(s));
}

/* Like tr_is_moving_backwards, for any pair at (t, y). */
static int tr_has_pair_moving_backwards(tr_sim *s, double t, const double *y) {
  int any = 0;
  if (!s->k->sets) return 0;
  tr_evaluate_maps_at(s, t, y);
  for (int i = 0; i < s->k->nsliders; ++i) any |= tr_is_moving_backwards(s, i);
  return any;
}

/* Largest speed that unknown times of mode changes leave uncertain, relative to its tolerance. For a pair that stops in the step,
 * the speed at the start is uncertain; for a pair that begins to slide, the speed at the end; for a pair that reverses, the sum of
 * both. Pairs that are stuck at the end but slip in the next step count, too. So do pairs whose rate reversed without a change of
 * mode. (The rates that decide modes have errors of h².) */
static double tr_uncertain_speed(tr_sim *s, double h, const tr_moreau_course *course) {
  const tr_kernel *k = s->k;
  const double t = s->clock.t;
  tr_mode end[k->nsliders + 1];
  double after[tr_state_width(s)], before[k->nsliders + 1], speed[k->nsliders + 1], most = 0.0;
  tr_save_modes(s, end);
  tr_evaluate_speeds(s, t, TR_A(s, y), before), tr_evaluate_speeds(s, t + h, TR_A(s, ynew), speed);
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_set_valued(s, i) && (tr_mode_change(s, i, course->start + i) || tr_mode_change(s, i, course->middle + i) || tr_is_moving_backwards(s, i)))
      most = fmax(most, before[i] + speed[i]);
  s->moreau.frozen = 0;
  if (tr_moreau_substep(s, t + h, TR_A(s, ynew), 0.5 * h, after) == TR_OK) {
    tr_evaluate_speeds(s, t + 1.5 * h, after, speed);
    for (int i = 0; i < k->nsliders; ++i)
      if (tr_is_set_valued(s, i) && !tr_is_stuck(s, i) && tr_mode_flag(end + i) == TR_STUCK) most = fmax(most, 2.0 * speed[i]);
  }
  tr_restore_modes(s, end);
  return most / (EVENT_SHARE * s->set.rtol * tr_speed_unit(s));
}

/* Extrapolate ynew, the result of two half steps, with `whole`, the result of one step. Do not extrapolate if this reverses the
 * motion of a pair, because friction would then drive the pair. half: state between the half steps. Forms the dense output. Returns
 * a status. */
static int tr_extrapolate_halves(tr_sim *s, double t, const double *whole, const double *half, double *ynew) {
  const tr_impulses *m = tr_method_of(s)->impulses;
  const int n = tr_state_width(s);
  const double *yold = TR_A(s, yold);
  double *R = TR_A(s, kstep), off[n], made[n];
  memcpy(made, ynew, sizeof made);
  for (int i = 0; i < n; ++i) off[i] = ynew[i] - whole[i], ynew[i] = m->halves * ynew[i] + m->whole * whole[i];
  tr_zero_held_rates(s, ynew);
  if (!tr_project(s, t, ynew)) return s->step.failure;
  if (tr_has_pair_moving_backwards(s, t, ynew)) memcpy(ynew, made, sizeof made), memset(off, 0, sizeof off);
  for (int i = 0; i < n; ++i) /* parabola through the middle state, corrected by half of the difference */
    R[i] = ynew[i] - yold[i], R[n + i] = 4.0 * (half[i] + 0.5 * off[i]) - 2.0 * (yold[i] + ynew[i]);
  s->step.dense_rows = 2;
  TR_MADE(s, TR_HAS_DENSE);
  return TR_OK;
}

static double tr_shortest_impulse_step(const tr_sim *s) { return LEAST_IMPULSE * s->set.rtol / s->set.rate + TIME_ROUND_OFF * fabs(s->clock.t); }

/* Largest surface acceleration of the pairs at the start of the step, in the modes in force, m/s². Returns 0 if these modes have no
 * solution at the start. */
static double tr_largest_start_acceleration(tr_sim *s) {
  double most = 0.0;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  tr_set_row_kinds(s);
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return 0.0;
  for (int i = 0; i < s->k->nsliders; ++i)
    for (int e = tr_pair_of(s, i)->eta0; e < tr_pair_of(s, i)->eta0 + tr_pair_of(s, i)->nrates; ++e)
      most = fmax(most, fabs(tr_acceleration_by_maps(s, e)) * TR_A(s, lever)[e]);
  return most;
}

/* Like tr_shortest_impulse_step, for accelerations above those of the rate scale. During the returned step, the accelerations at
 * the start of the step change speeds by at most LEAST_IMPULSE times the tolerance. A faster change is an impact. Accelerations
 * in the modes at the step's start and at its end both count, because a pair has no acceleration before its release. */
static double tr_shortest_impulse_step_from_start(tr_sim *s, const tr_moreau_course *course) {
  const int failure = s->step.failure;
  tr_mode end[s->k->nsliders + 1];
  double slope[tr_state_width(s)], z[tr_z_length(s) + 1], most = s->set.rate * tr_speed_unit(s);
  tr_save_modes(s, end), memcpy(slope, TR_A(s, dy), sizeof slope), memcpy(z, TR_A(s, z), sizeof(double) * tr_z_length(s));
  most = fmax(most, tr_largest_start_acceleration(s));
  tr_moreau_rewind(s, course);
  most = fmax(most, tr_largest_start_acceleration(s));
  tr_restore_modes(s, end), memcpy(TR_A(s, dy), slope, sizeof slope), memcpy(TR_A(s, z), z, sizeof(double) * tr_z_length(s));
  s->step.failure = failure;
  return LEAST_IMPULSE * s->set.rtol * tr_speed_unit(s) / most + TIME_ROUND_OFF * fabs(s->clock.t);
}

/* Whether a pair's speed jumps without a change of mode in the step of size h. half, ynew: states at the middle and at the end. A
 * jump lies in one half of the step, however short the step is. The error estimate does not show the jump, because the whole step
 * and the two half steps contain the same jump. */
static int tr_has_speed_jump(tr_sim *s, double h, const double *half, const double *ynew) {
  const int n = s->k->nsliders;
  double v[3][n + 1];
  int jumps = 0;
  if (!s->k->sets || h > tr_shortest_impulse_step(s)) return 0;
  tr_evaluate_speeds(s, s->clock.t, TR_A(s, y), v[0]), tr_evaluate_speeds(s, s->clock.t + 0.5 * h, half, v[1]), tr_evaluate_speeds(s, s->clock.t + h, ynew, v[2]);
  for (int i = 0; i < n; ++i)
    jumps |= fabs(v[2][i] - 2.0 * v[1][i] + v[0][i]) > fmax(s->set.rtol * tr_speed_unit(s), HALF_OF_IT * fabs(v[2][i] - v[0][i]));
  return jumps;
}

/* Store the powers of the last made part of a step. part: 0 for the whole step, 1 and 2 for its halves. */
static void tr_save_powers(const tr_sim *s, double *powers, int part) {
  const int n = s->k->npowers;
  tr_copy(n, TR_A(s, part_power), powers + part * n);
}

/* Squared error of the works over a step h with these powers, in tolerances. Every work is included, even if no column needs it;
 * otherwise errors of the motion would scale as rtol^(2/3). Until the step is accepted, impulse_work stores the sums that include
 * this step. */
static double tr_squared_impulse_work_error(tr_sim *s, double h, const double *powers) {
  const int n = s->k->npowers;
  double e[s->ny + n + 1], was[s->ny + n + 1], is[s->ny + n + 1], *done = TR_A(s, impulse_work), most = 0.0;
  for (int i = 0; i < n; ++i) {
    const double work = 0.5 * h * (powers[n + i] + powers[2 * n + i]);
    e[s->ny + i] = work - h * powers[i], was[s->ny + i] = done[i], is[s->ny + i] = done[n + i] = done[i] + work;
    most = fmax(most, fabs(done[i]) + fabs(work));
  }
  return tr_squared_work_error(s, e, was, is, s->ny, n, tr_smallest_work_unit(s, most));
}

/* Make a step h as a whole and in halves. ynew receives the result, extrapolated if no mode changed. Returns the error of ynew in
 * units of the tolerance. NaN means failure, with the reason in step.failure. */
static double tr_moreau_whole_and_halves(tr_sim *s, double h, tr_moreau_course *course) {
  const int n = tr_state_width(s);
  const double t = s->clock.t, *y = TR_A(s, y);
  double whole[n], half[n], off[n], *ynew = TR_A(s, ynew);
  double powers[3 * s->k->npowers + 1];
  if ((s->step.failure = tr_moreau_substep(s, t, y, h, whole)) != TR_OK) return NAN;
  tr_save_powers(s, powers, 0);
  const int same = tr_has_same_modes(s, course->start);
  tr_moreau_rewind(s, course);
  if ((s->step.failure = tr_moreau_substep(s, t, y, 0.5 * h, half)) != TR_OK) return NAN;
  tr_save_powers(s, powers, 1);
  course->steady = tr_has_same_modes(s, course->start);
  tr_save_modes(s, course->middle), memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * n);
  if ((s->step.failure = tr_moreau_substep(s, t + 0.5 * h, half, 0.5 * h, ynew)) != TR_OK) return NAN;
  tr_save_powers(s, powers, 2);
  course->steady &= tr_has_same_modes(s, course->start) && !tr_has_pair_moving_backwards(s, t + h, ynew), course->smooth = course->steady && same;
  for (int i = 0; i < n; ++i) off[i] = ynew[i] - whole[i];
  double err = sqrt(tr_squared_motion_error(s, off, y, ynew) + tr_squared_impulse_work_error(s, h, powers));
  if (!course->smooth) tr_form_dense_straight(s);
  if (!course->steady) err = fmax(err, tr_uncertain_speed(s, h, course));
  else if (err <= 1.0 && tr_has_speed_jump(s, h, half, ynew)) s->step.failure = TR_FAIL_MULTIPLIERS;
  if (s->step.failure == TR_OK && course->smooth && (s->step.failure = tr_extrapolate_halves(s, t + h, whole, half, ynew)) != TR_OK) return NAN;
  return err;
}

/* Make a trial step h to ynew. Fast sliding directions are frozen unless they turn too far. Returns the error of ynew, which is 0
 * for fixed steps. NaN means failure, with the reason in step.failure. */
static double tr_moreau_trial(tr_sim *s, double h, tr_moreau_course *course) {
  const int fixed = s->set.hfixed > 0.0;
  double err = 0.0;
  tr_moment_of(s)->inside = s->clock.t + 0.5 * h;
  tr_clear_extremes(s);
  s->moreau.frozen = !fixed, s->moreau.decides = fixed ? INFINITY : s->set.rtol / s->set.rate;
  if (fixed) s->step.failure = tr_moreau_substep(s, s->clock.t, TR_A(s, y), h, TR_A(s, ynew));
  else err = tr_moreau_whole_and_halves(s, h, course);
  if (s->step.failure == TR_MORE) {
    tr_moreau_rewind(s, course), s->moreau.frozen = 0;
    err = tr_moreau_whole_and_halves(s, h, course);
  }
  return s->step.failure == TR_OK ? err : NAN;
}

static int tr_log_mode_changes(tr_sim *s, double t, const tr_mode *then, int jolt) {
  int changed = 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const int kind = tr_is_set_valued(s, i) ? tr_mode_change(s, i, then + i) : 0;
    if (!kind) continue;
    tr_log_event(s, t, kind == TR_EV_STICK && jolt ? TR_EV_IMPACT : kind, i, 0, 0, 0);
    s->stats.events++, changed = 1;
  }
  return changed;
}

/* Log the separations of an accepted step to time `end`. smooth: whether all modes stay unchanged in the step; otherwise forces
 * jump, and the dense output does not show where a force passes through zero. */
static void tr_log_impulse_separations(tr_sim *s, double end, int smooth) {
  const double *y = TR_A(s, ynew);
  double kept[tr_solution_size(s)], *slope = TR_A(s, dy);
  if (!s->o || !s->o->ncontacts || !s->set.locate || s->set.hfixed > 0.0) return;
  tr_save_solution(s, kept);
  if (tr_rhs(s, end, y, slope)) {
    if (smooth) tr_log_step_separations(s, slope + s->k->nq);
    else tr_current_contacts(s, y, (tr_contact *)TR_A(s, contacts));
  }
  tr_restore_solution(s, kept);
}

/* Accept the step h to time `end`; it is then pending. err: error of the step. most: largest growth factor of the next step. */
static void tr_moreau_accept(tr_sim *s, double h, double end, double err, double most, const tr_moreau_course *course) {
  const int fixed = s->set.hfixed > 0.0;
  int changed = 0;
  if (!fixed && !course->steady) {
    tr_mode last[s->k->nsliders + 1];
    tr_save_modes(s, last), tr_restore_modes(s, course->middle);
    changed = tr_log_mode_changes(s, s->clock.t + course->let_go * h, course->start, err > 1.0);
    tr_restore_modes(s, last);
  }
  changed |= tr_log_mode_changes(s, end, fixed ? course->start : course->middle, err > 1.0);
  s->moreau.calm = changed ? 0 : s->moreau.calm + 1;
  if (fixed) tr_form_dense_straight(s);
  memcpy(TR_A(s, zstart), TR_A(s, z), sizeof(double) * tr_z_length(s)), tr_store_end_multipliers(s);
  s->step.t0 = s->clock.t, s->step.size = h, s->step.have_dense = 1;
  tr_log_impulse_separations(s, end, course->smooth);
  s->pending.t = end, s->pending.theta = 1.0, s->pending.h = h, s->pending.kind = TR_IMPULSE_STEP;
  s->pending.grow = fixed ? 1.0 : fmin(tr_next_step_factor(s, err, tr_method_of(s)->order, most), tr_position_growth(s));
  if (!fixed) tr_copy(s->k->npowers, TR_A(s, impulse_work) + s->k->npowers, TR_A(s, impulse_work));
  s->stats.steps++, s->stats.of_method[s->step.method]++;
}

/* Size of the next trial step towards `limit`. Sets pending.cut if the step ends at the limit. */
static double tr_moreau_length(tr_sim *s, double limit) {
  const double left = limit - s->clock.t, fixed = s->set.hfixed;
  if (s->step.h <= 0.0) s->step.h = tr_moreau_step_size(s);
  double h = fmin(fixed > 0.0 ? fixed : fmin(fmin(s->step.h, s->set.hmax), tr_longest_held_step(s)), left);
  if (left - h < SLIVER * h) h = left;
  else if (fixed <= 0.0 && h > 0.5 * left) h = 0.5 * left;
  s->pending.cut = h == left;
  return h;
}

/* Size of the next trial after a refused trial of size h. whole: fraction of h at which the next trial should end; 1:
 * unspecified. */
static double tr_moreau_shorter(const tr_sim *s, double h, double err, double whole) {
  if (whole < 1.0) return whole > STEP_START ? whole * h : SHRINK_MOST * h;
  return err == err ? h * tr_retry_factor(err, tr_method_of(s)->order) : SHRINK_MOST * h;
}

/* Status of a run whose last trial was refused. Where speeds jump, a solution exists, and other starts of Newton's method are not
 * tried. */
static int tr_moreau_fault(tr_sim *s) {
  if (s->step.failure == TR_FAIL_MULTIPLIERS) s->friction.searched = s->clock.t;
  return s->step.failure != TR_OK ? s->step.failure : TR_FAIL_MODES;
}

static int tr_make_moreau_step(tr_sim *s, double limit) {
  const int fixed = s->set.hfixed > 0.0;
  double least = tr_shortest_impulse_step(s);
  int known = 0; /* whether `least` accounts for the accelerations at the start */
  tr_mode start[s->k->nsliders + 1], middle[s->k->nsliders + 1];
  tr_moreau_course course = {.start = start, .middle = middle, .let_go = 0.5};
  s->step.watch = 0;
  tr_reverse_kink_directions(s);
  tr_clear_line_directions(s);
  if (!fixed) tr_moreau_update_stops(s, s->clock.t, TR_A(s, y));
  tr_save_modes(s, start);
  memcpy(TR_A(s, zold), TR_A(s, z), sizeof(double) * tr_z_length(s)), memcpy(TR_A(s, yold), TR_A(s, y), sizeof(double) * tr_state_width(s));
  for (double most = GROW_MOST;; most = 1.0) { /* no growth after a refused step */
    const double h = tr_moreau_length(s, limit);
    double err = tr_moreau_trial(s, h, &course);
    double whole = err <= 1.0 && !fixed ? tr_find_first_end(s, h, &course) : 1.0;
    if (whole == 1.0 && err <= 1.0 && !fixed) whole = tr_find_first_corner(s, 1.0);
    if (whole == 1.0 && err <= 1.0 && !fixed) whole = tr_find_first_release(s, h, &course);
    if (whole == 1.0 && err <= 1.0 && !fixed) whole = tr_find_release_beside_change(s, h, &course);
    if (err <= 1.0) err = fmax(err, tr_position_error(s, whole));
    /* Whether the error of a very short step may come from an impact. Without a change of mode, it comes from light bodies that
     * move fast. */
    const int jumps = !course.steady || err != err;
    if (!fixed && jumps && h <= least && !(err <= 1.0) && !known) known = 1, least = tr_shortest_impulse_step_from_start(s, &course);
    /* Accept a shortest step with a small error, or with an impact. */
    const int small = h <= least && (err <= 1.0 || (jumps && err == err && s->set.through_jams));
    if ((err <= 1.0 && whole > STEP_END) || small) {
      tr_moreau_accept(s, h, s->pending.cut ? limit : s->clock.t + h, err, most, &course);
      return TR_OK;
    }
    tr_moreau_rewind(s, &course);
    if (fixed || h <= (jumps ? least : TIME_ROUND_OFF * fmax(fabs(s->clock.t), 1.0 / s->set.rate))) return tr_moreau_fault(s);
    s->stats.rejected++;
    s->step.h = tr_moreau_shorter(s, h, err, whole);
  }
}

static void tr_choose_moreau(tr_sim *s) {
  if (!tr_is_auto(s) || !s->k->sets || s->k->nunilateral) return;
  for (int i = 0; i < s->k->nsliders; ++i) /* in mechanisms with laws that are stiff near rest, auto makes no impulse steps */
    if (!tr_is_set_valued(s, i) && tr_pair_of(s, i)->kind != TR_KIND_SMOOTH) return;
  if (tr_method_of(s)->kind == TR_IMPULSES) {
    if (++s->moreau.steps >= MOREAU_STAY && s->moreau.calm >= MOREAU_STAY / 4) s->step.method = TR_AUTO_TIGHT, s->step.have_k1 = s->step.have_jac = 0;
    return;
  }
  if (s->stats.events - s->moreau.burst_events < MOREAU_EVENTS * ((s->k->nsliders + MOREAU_PAIRS - 1) / MOREAU_PAIRS)) return;
  if (s->clock.t - s->moreau.burst_t < MOREAU_EVENTS * tr_moreau_step_size(s)) {
    s->step.method = TR_AUTO_ACCUMULATING, s->moreau.steps = s->moreau.calm = s->step.explicit_for_now = 0;
    s->step.h = tr_moreau_step_size(s), s->step.err_old = 0.0;
    if (s->moreau.first_t < 0.0) s->moreau.first_t = s->clock.t;
  }
  s->moreau.burst_events = s->stats.events, s->moreau.burst_t = s->clock.t;
}
