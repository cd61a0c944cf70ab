/* Steps of Moreau's time stepping (``moreau.c``) under error control, and when method auto takes to them.
 *
 * A step is made whole and in two halves, whose difference is its error; where no mode changes both are extrapolated to the second order.
 * Where one does, the difference says nothing of when it did; so the speed that this leaves open is held below the tolerance too. */
#include "modes.h"

#define MOREAU_EVENTS 40   /* events in as many first steps (``tr_moreau_step``): they accumulate */
#define MOREAU_PAIRS 8     /* pairs of which so many events are: of more of them there are as many more in any case */
#define MOREAU_STAY 400    /* steps before locating events is tried again */
#define LEAST_IMPULSE 1e-3 /* of rtol / rate: in so short a time nothing but an impact changes a speed by more than the tolerance */
#define HALF_OF_IT 0.5     /* of the change over a step: by so much its halves do not differ where speeds change with time */
#define EVENT_SHARE 0.2    /* of the tolerance of speeds: what the unknown time of an event may amount to */

/* Whether all pairs are in the modes `then` as they are now; one that slides the other way is not. */
static int tr_as_before(const tr_sim *s, const tr_mode *then) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_set(s, i) && (tr_flag(tr_mode_of(s, i)) != tr_flag(then + i) || tr_change(s, i, then + i))) return 0;
  return 1;
}

/* Surface speed of every pair at (t, y), m/s. */
static void tr_speeds(tr_sim *s, double t, const double *y, double *speed) {
  tr_maps_at(s, t, y);
  for (int i = 0; i < s->k->nsliders; ++i) speed[i] = tr_pair_speed(s, i);
}

/* The largest speed that pairs have while a change of their modes is somewhere inside a step, over the tolerance of that: before a stop,
 * behind a start, both where one turns round, and that of one that is held at the step's end and slips in the next. */
static double tr_uncertain_speed(tr_sim *s, double h, const tr_course *course) {
  const tr_kernel *k = s->k;
  const double t = s->clock.t;
  tr_mode end[k->nsliders + 1];
  double after[tr_width(s)], before[k->nsliders + 1], speed[k->nsliders + 1], most = 0.0;
  tr_keep_modes(s, end);
  tr_speeds(s, t, TR_A(s, y), before), tr_speeds(s, t + h, TR_A(s, ynew), speed);
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_set(s, i) && (tr_change(s, i, course->start + i) || tr_change(s, i, course->middle + i)))
      most = fmax(most, before[i] + speed[i]);
  s->moreau.frozen = 0;
  if (tr_moreau_part(s, t + h, TR_A(s, ynew), 0.5 * h, after) == TR_OK) {
    tr_speeds(s, t + 1.5 * h, after, speed);
    for (int i = 0; i < k->nsliders; ++i)
      if (tr_is_set(s, i) && !tr_is_stuck(s, i) && tr_flag(end + i) == TR_STUCK) most = fmax(most, 2.0 * speed[i]);
  }
  tr_put_modes(s, end);
  return most / (EVENT_SHARE * s->set.rtol * tr_speed_unit(s));
}

/* ynew, the state two halves of a step lead to, extrapolated with the one `whole` that it leads to at once; `half`: between the halves.
 * TR_OK, or why there is none. */
static int tr_extrapolate(tr_sim *s, double t, const double *whole, const double *half, double *ynew) {
  const tr_impulses *m = tr_method_of(s)->impulses;
  const int n = tr_width(s);
  const double *yold = TR_A(s, yold);
  double *R = TR_A(s, kstep), off[n];
  for (int i = 0; i < n; ++i) off[i] = ynew[i] - whole[i], ynew[i] = m->halves * ynew[i] + m->whole * whole[i];
  tr_keep_still(s, ynew);
  if (!tr_project(s, t, ynew)) return s->step.trouble;
  for (int i = 0; i < n; ++i) /* a parabola, through the middle with half the error of two halves */
    R[i] = ynew[i] - yold[i], R[n + i] = 4.0 * (half[i] + 0.5 * off[i]) - 2.0 * (yold[i] + ynew[i]);
  s->step.dense_rows = 2;
  return TR_OK;
}

/* A step so short that nothing but an impact changes a speed by more than the tolerance in it, s. */
static double tr_least_impulse(const tr_sim *s) { return LEAST_IMPULSE * s->set.rtol / s->set.rate + TIME_ROUND_OFF * fabs(s->clock.t); }

/* Whether one half of a step over h by `half` to ynew changes the speed of a pair and the other does not, though its modes are the same
 * throughout: it jumps then however short the step is, and whole and halves agree about it. */
static int tr_jumps(tr_sim *s, double h, const double *half, const double *ynew) {
  const int n = s->k->nsliders;
  double v[3][n + 1];
  int jumps = 0;
  if (!s->k->sets || h > tr_least_impulse(s)) return 0;
  tr_speeds(s, s->clock.t, TR_A(s, y), v[0]), tr_speeds(s, s->clock.t + 0.5 * h, half, v[1]), tr_speeds(s, s->clock.t + h, ynew, v[2]);
  for (int i = 0; i < n; ++i)
    jumps |= fabs(v[2][i] - 2.0 * v[1][i] + v[0][i]) > fmax(s->set.rtol * tr_speed_unit(s), HALF_OF_IT * fabs(v[2][i] - v[0][i]));
  return jumps;
}

/* Powers of the part just made: the whole step (0) or a half of it (1, 2). */
static void tr_take_powers(const tr_sim *s, double *powers, int part) {
  const int n = s->k->npowers;
  tr_copy(n, TR_A(s, parted), powers + part * n);
}

/* Squared error of the works of a step over h, made whole and in halves with these powers, 1 at the tolerance. They are asked for always, each
 * by itself: without them errors of the motion go as rtol^(2/3). What they have come to with this step is kept until it is accepted. */
static double tr_impulse_works2(tr_sim *s, double h, const double *powers) {
  const int n = s->k->npowers;
  double e[s->ny + n + 1], was[s->ny + n + 1], is[s->ny + n + 1], *done = TR_A(s, impulsed), most = 0.0;
  for (int i = 0; i < n; ++i) {
    const double work = 0.5 * h * (powers[n + i] + powers[2 * n + i]);
    e[s->ny + i] = work - h * powers[i], was[s->ny + i] = done[i], is[s->ny + i] = done[n + i] = done[i] + work;
    most = fmax(most, fabs(done[i]) + fabs(work));
  }
  return tr_works2(s, e, was, is, s->ny, n, tr_least_work(s, most));
}

/* A step over h, made whole and in two halves: ynew, extrapolated where no mode changes, else what the halves lead to. Its error relative to
 * the tolerance; NaN: it could not be made (trouble says why). */
static double tr_moreau_twice(tr_sim *s, double h, tr_course *course) {
  const int n = tr_width(s);
  const double t = s->clock.t, *y = TR_A(s, y);
  double whole[n], half[n], off[n], *ynew = TR_A(s, ynew);
  double powers[3 * s->k->npowers + 1];
  if ((s->step.trouble = tr_moreau_part(s, t, y, h, whole)) != TR_OK) return NAN;
  tr_take_powers(s, powers, 0);
  const int same = tr_as_before(s, course->start);
  tr_moreau_back(s, course);
  if ((s->step.trouble = tr_moreau_part(s, t, y, 0.5 * h, half)) != TR_OK) return NAN;
  tr_take_powers(s, powers, 1);
  course->steady = tr_as_before(s, course->start);
  tr_keep_modes(s, course->middle), memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * n);
  if ((s->step.trouble = tr_moreau_part(s, t + 0.5 * h, half, 0.5 * h, ynew)) != TR_OK) return NAN;
  tr_take_powers(s, powers, 2);
  course->steady &= tr_as_before(s, course->start), course->smooth = course->steady && same;
  for (int i = 0; i < n; ++i) off[i] = ynew[i] - whole[i];
  double err = sqrt(tr_size2(s, off, y, ynew) + tr_impulse_works2(s, h, powers));
  if (!course->smooth) tr_straight(s);
  if (!course->steady) err = fmax(err, tr_uncertain_speed(s, h, course));
  else if (err <= 1.0 && tr_jumps(s, h, half, ynew)) s->step.trouble = TR_FAIL_MULTIPLIERS;
  if (s->step.trouble == TR_OK && course->smooth && (s->step.trouble = tr_extrapolate(s, t + h, whole, half, ynew)) != TR_OK) return NAN;
  return err;
}

/* A trial step over h: ynew, and its error (0 where the size is fixed, NaN where it could not be made: trouble says why). Directions of
 * fast sliding are frozen, unless they turn too far. */
static double tr_moreau_try(tr_sim *s, double h, tr_course *course) {
  const int fixed = s->set.hfixed > 0.0;
  double err = 0.0;
  tr_moment_of(s)->inside = s->clock.t + 0.5 * h;
  tr_forget_extremes(s);
  s->moreau.frozen = !fixed, s->moreau.decides = fixed ? INFINITY : s->set.rtol / s->set.rate;
  if (fixed) s->step.trouble = tr_moreau_part(s, s->clock.t, TR_A(s, y), h, TR_A(s, ynew));
  else err = tr_moreau_twice(s, h, course);
  if (s->step.trouble == TR_MORE) {
    tr_moreau_back(s, course), s->moreau.frozen = 0;
    err = tr_moreau_twice(s, h, course);
  }
  return s->step.trouble == TR_OK ? err : NAN;
}

/* Record at time t what pairs do otherwise than in the modes `then`. jolt: one that stopped did so by an impact. Whether any does. */
static int tr_log_switches(tr_sim *s, double t, const tr_mode *then, int jolt) {
  int changed = 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const int kind = tr_is_set(s, i) ? tr_change(s, i, then + i) : 0;
    if (!kind) continue;
    tr_log(s, t, kind == TR_EV_STOP && jolt ? TR_EV_IMPACT : kind, i, 0, 0, 0);
    s->stats.events++, changed = 1;
  }
  return changed;
}

/* The step over h that has been made waits. err: its error; at a fixed step none is known, 0. */
static void tr_moreau_accept(tr_sim *s, double h, double end, double err, double most, const tr_course *course) {
  const int fixed = s->set.hfixed > 0.0;
  int changed = 0;
  if (!fixed && !course->steady) {
    tr_mode last[s->k->nsliders + 1];
    tr_keep_modes(s, last), tr_put_modes(s, course->middle);
    changed = tr_log_switches(s, s->clock.t + course->let_go * h, course->start, err > 1.0);
    tr_put_modes(s, last);
  }
  changed |= tr_log_switches(s, end, fixed ? course->start : course->middle, err > 1.0);
  s->moreau.calm = changed ? 0 : s->moreau.calm + 1;
  if (fixed) tr_straight(s);
  memcpy(TR_A(s, zstart), TR_A(s, z), sizeof(double) * tr_nz(s)), tr_note_end(s);
  s->step.t0 = s->clock.t, s->step.size = h, s->step.have_dense = 1;
  s->pending.t = end, s->pending.theta = 1.0, s->pending.h = h, s->pending.kind = TR_IMPULSE_STEP;
  s->pending.grow = fixed ? 1.0 : tr_grow(s, err, tr_method_of(s)->order, most);
  if (!fixed) tr_copy(s->k->npowers, TR_A(s, impulsed) + s->k->npowers, TR_A(s, impulsed));
  s->stats.steps++, s->stats.of_method[s->step.method]++;
}

/* Length of the next trial step of time stepping towards `limit`; whether it ends there is what pending says of its cut. */
static double tr_moreau_length(tr_sim *s, double limit) {
  const double left = limit - s->clock.t, fixed = s->set.hfixed;
  if (s->step.h <= 0.0) s->step.h = tr_moreau_step(s);
  double h = fmin(fixed > 0.0 ? fixed : fmin(fmin(s->step.h, s->set.hmax), tr_held_step(s)), left);
  if (left - h < SLIVER * h) h = left;
  else if (fixed <= 0.0 && h > 0.5 * left) h = 0.5 * left;
  s->pending.cut = h == left;
  return h;
}

/* The size of the next trial after one over h that was refused. whole: where it is to end instead, of h. */
static double tr_moreau_shorter(const tr_sim *s, double h, double err, double whole) {
  if (whole < 1.0) return whole > AT_START ? whole * h : SHRINK_MOST * h;
  return err == err ? h * tr_factor_of(err, tr_method_of(s)->order, RETRY_MOST) : SHRINK_MOST * h;
}

/* Why no step can be made, the last trial of which was refused. Where speeds jump there are answers, and no others are to be sought. */
static int tr_moreau_fault(tr_sim *s) {
  if (s->step.trouble == TR_FAIL_MULTIPLIERS) s->friction.searched = s->clock.t;
  return s->step.trouble != TR_OK ? s->step.trouble : TR_FAIL_MODES;
}

/* One acceptable step to at most `limit`; waits as pending. */
static int tr_attempt_moreau(tr_sim *s, double limit) {
  const int fixed = s->set.hfixed > 0.0;
  const double least = tr_least_impulse(s);
  tr_mode start[s->k->nsliders + 1], middle[s->k->nsliders + 1];
  tr_course course = {.start = start, .middle = middle, .let_go = 0.5};
  s->step.watch = 0;
  tr_turn_directions(s);
  tr_leave_lines(s);
  if (!fixed) tr_moreau_stops(s, s->clock.t, TR_A(s, y));
  tr_keep_modes(s, start);
  memcpy(TR_A(s, zold), TR_A(s, z), sizeof(double) * tr_nz(s)), memcpy(TR_A(s, yold), TR_A(s, y), sizeof(double) * tr_width(s));
  for (double most = GROW_MOST;; most = 1.0) { /* a step after a refused one does not grow */
    const double h = tr_moreau_length(s, limit), err = tr_moreau_try(s, h, &course);
    double whole = err <= 1.0 && !fixed ? tr_first_end(s, h, &course) : 1.0;
    if (whole == 1.0 && err <= 1.0 && !fixed) whole = tr_first_release(s, h, &course);
    const int jumps = !course.steady || err != err; /* in so short a time; where nothing changes its mode it is what is light that is fast */
    const int small = h <= least && (err <= 1.0 || (jumps && err == err && s->set.through_jams)); /* an impact */
    if ((err <= 1.0 && whole > AT_END) || small) {
      tr_moreau_accept(s, h, s->pending.cut ? limit : s->clock.t + h, err, most, &course);
      return TR_OK;
    }
    tr_moreau_back(s, &course);
    if (fixed || h <= (jumps ? least : TIME_ROUND_OFF * fmax(fabs(s->clock.t), 1.0 / s->set.rate))) return tr_moreau_fault(s);
    s->stats.rejected++;
    s->step.h = tr_moreau_shorter(s, h, err, whole);
  }
}

/* Hand over to time stepping when events accumulate, and back when nothing has changed for a while. Only with method auto. */
static void tr_hand_over(tr_sim *s) {
  if (!tr_chooses(s) || !s->k->sets) return;
  for (int i = 0; i < s->k->nsliders; ++i) /* laws that are stiff near rest are not for impulses */
    if (!tr_is_set(s, i) && tr_pair_of(s, i)->kind != TR_KIND_SMOOTH) return;
  if (tr_method_of(s)->kind == TR_IMPULSES) {
    if (++s->moreau.steps >= MOREAU_STAY && s->moreau.calm >= MOREAU_STAY / 4) s->step.method = TR_AUTO_TIGHT, s->step.have_k1 = s->step.have_jac = 0;
    return;
  }
  if (s->stats.events - s->moreau.burst_events < MOREAU_EVENTS * ((s->k->nsliders + MOREAU_PAIRS - 1) / MOREAU_PAIRS)) return;
  if (s->clock.t - s->moreau.burst_t < MOREAU_EVENTS * tr_moreau_step(s)) {
    s->step.method = TR_AUTO_ACCUMULATING, s->moreau.steps = s->moreau.calm = s->step.aside = 0;
    s->step.h = tr_moreau_step(s), s->step.err_old = 0.0;
    if (s->moreau.first_t < 0.0) s->moreau.first_t = s->clock.t;
  }
  s->moreau.burst_events = s->stats.events, s->moreau.burst_t = s->clock.t;
}
