/* The stepping loop: step sizes, error control, events, output rows, outcomes. */
#include "modes.h"

#define SAFETY 0.9
#define PI_NOW 0.8 /* weights of this and the last error in the step size: a third fewer rejections than 1, 0 at the same accuracy */
#define PI_OLD 0.3
#define CHATTER_MAX 12

static int tr_prepare_dense(tr_sim *s) {
  const tr_method *m = tr_method_of(s);
  return m->kind == TR_IMPLICIT ? tr_dense_rosenbrock(s, m->rosenbrock) : tr_dense_explicit(s, m->explicit);
}

static double tr_limit_time(const tr_sim *s, double target) {
  if (s->clock.next_break < s->clock.nbreaks) {
    double b = TR_A(s, breaks)[s->clock.next_break];
    if (b < target) return b;
  }
  return target;
}

/* First step size (Hairer, II.4): from the size of y, ẏ and ÿ in the tolerance norm. K[0] must be in place. */
static double tr_first_step(tr_sim *s, double span, int order) {
  int n = tr_width(s);
  double *K = TR_A(s, K), *y = TR_A(s, y), *tmp = TR_A(s, ytmp);
  const double *unit = TR_A(s, scale);
  double d0 = 0.0, d1 = 0.0, d2 = 0.0;
  for (int i = 0; i < s->ny; ++i) {
    double w = s->set.rtol * (unit[i] + fabs(y[i]));
    d0 += y[i] * y[i] / (w * w);
    d1 += K[i] * K[i] / (w * w);
  }
  d0 = sqrt(d0 / s->ny), d1 = sqrt(d1 / s->ny);
  double h0 = d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1;
  h0 = fmin(h0, span);
  for (int i = 0; i < n; ++i) tmp[i] = y[i] + h0 * K[i];
  double *f1 = TR_A(s, dy);
  if (!tr_rhs(s, s->clock.t + h0, tmp, f1)) return h0 * 1e-2;
  for (int i = 0; i < s->ny; ++i) {
    double w = s->set.rtol * (unit[i] + fabs(y[i])), d = (f1[i] - K[i]) / w;
    d2 += d * d;
  }
  d2 = sqrt(d2 / s->ny) / h0;
  double big = fmax(d1, d2), h1 = big <= 1e-15 ? fmax(1e-6, h0 * 1e-3) : pow(0.01 / big, 1.0 / order);
  return fmin(fmin(100.0 * h0, h1), span);
}

/* Rows whose time lies in (…, t_end] of the step whose dense output is available, and the step's end itself when `every` is 0: the
 * end of the whole step, or where an event cuts it short (as it was up to there). */
static int tr_rows(tr_sim *s, double t_end, int final, double *rows, long capacity, long *count) {
  if (s->clock.width == 0) return TR_OK;
  int width = s->clock.width;
  if (s->clock.every <= 0.0) {
    if (*count >= capacity) return TR_ROWS_FULL;
    double *y = TR_A(s, yout);
    if (final) memcpy(y, TR_A(s, ynew), sizeof(double) * tr_width(s));
    else tr_dense_eval(s, s->pending.theta, y);
    int code = tr_output(s, t_end, y, rows + width * *count);
    if (code != TR_OK) return code;
    ++*count;
    return TR_OK;
  }
  while (s->clock.row_next <= t_end + (final ? 1e-12 * fmax(1.0, fabs(t_end)) : 0.0)) {
    if (*count >= capacity) return TR_ROWS_FULL;
    double *y = TR_A(s, yout), theta = (s->clock.row_next - s->step.t0) / s->step.size, t = s->clock.row_next;
    if (final && fabs(t - (s->step.t0 + s->step.size)) <= 1e-12 * fmax(1.0, fabs(t))) {
      memcpy(y, TR_A(s, ynew), sizeof(double) * tr_width(s));
    } else {
      if (!s->step.have_dense) {
        if (!tr_prepare_dense(s)) return TR_FAIL_MULTIPLIERS;
        s->step.have_dense = 1;
      }
      tr_dense_eval(s, theta, y);
    }
    int code = tr_output(s, t, y, rows + width * *count);
    if (code != TR_OK) return code;
    ++*count;
    s->clock.row_index++;
    s->clock.row_next = s->clock.start + s->clock.row_index * s->clock.every;
  }
  return TR_OK;
}

/* While a slider passes through its proportional zone, note when its velocity along the old direction vanishes. */
static void tr_note_reversals(tr_sim *s, double theta_end) {
  const tr_kernel *k = s->k;
  for (int i = 0; i < k->nsliders; ++i) {
    tr_zone *zone = tr_zone_of(s, i);
    if (!zone->inside || zone->reversal == zone->reversal) continue;
    if (tr_along(s, i) >= 0.0) continue;
    if (!s->step.have_dense) {
      if (!tr_prepare_dense(s)) return;
      s->step.have_dense = 1;
    }
    double a = 0.0, b = theta_end, *y = TR_A(s, yout);
    for (int it = 0; it < 60 && b - a > 1e-15; ++it) {
      double m = 0.5 * (a + b), t = s->step.t0 + m * s->step.size;
      tr_dense_eval(s, m, y);
      tr_set_time(s, t);
      k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
      if (tr_along(s, i) < 0.0) b = m; else a = m;
    }
    zone->reversal = s->step.t0 + b * s->step.size;
  }
}

static void tr_forget_extremes(tr_sim *s);

static void tr_shift(tr_sim *s, double t, const double *y) {
  int n = tr_width(s);
  memmove(TR_A(s, y), y, sizeof(double) * n);
  s->clock.t = t;
  while (s->clock.next_break < s->clock.nbreaks && TR_A(s, breaks)[s->clock.next_break] <= t + 1e-13 * fmax(1.0, fabs(t))) {
    s->clock.next_break++;
    s->step.have_k1 = 0;
  }
  tr_forget_extremes(s);
}

/* Step size factor for an error (1 = at the tolerance). */
static double tr_factor_of(double err, int order, double most) {
  return fmin(most, fmax(0.2, SAFETY * pow(fmax(err, 1e-12), -1.0 / order)));
}

/* The same after an accepted step, with the previous error taken into account (proportional–integral control: fewer rejections where
 * the difficulty of the motion comes and goes). */
static double tr_grow(tr_sim *s, double err, int order, double most) {
  double e = fmax(err, 1e-4), old = s->step.err_old > 0.0 ? s->step.err_old : e;
  s->step.err_old = e;
  return fmin(most, fmax(0.2, SAFETY * pow(e, -PI_NOW / order) * pow(old, PI_OLD / order)));
}

static void tr_forget_extremes(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i) TR_A(s, smin)[i] = INFINITY, TR_A(s, smax)[i] = -INFINITY;
}

/* Derivative and first step size at the start of a step; directions of sliding are frozen here. */
static int tr_begin_step(tr_sim *s, double limit, int order) {
  const tr_kernel *k = s->k;
  if (!s->step.have_k1) {
    tr_moment_of(s)->inside = s->clock.t + 0.5 * fmin(limit - s->clock.t, s->step.h > 0.0 ? s->step.h : limit - s->clock.t);
    s->step.watch = 0;
    if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, K))) return TR_FAIL_MULTIPLIERS;
    if (s->friction.still) { /* loads may have jumped here */
      int code = tr_settle(s, s->clock.t, TR_A(s, y), -1);
      if (code != TR_OK) return code;
      memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s));
    }
    s->step.have_k1 = 1;
  }
  if (s->step.h <= 0.0) s->step.h = tr_first_step(s, limit - s->clock.t, order);
  if (!s->set.locate || s->events.chatter > CHATTER_MAX) tr_turn_directions(s);
  for (int i = 0; i < k->nsliders; ++i) {
    if (!tr_slides(s, i) || tr_pair_of(s, i)->nrates == 1) continue;
    if (!tr_is_set(s, i)) tr_freeze(s, i);
    else if (!tr_keeps_direction(s, i, tr_speed_of_state(s, i))) tr_rates_of_state(s, i, tr_mode_of(s, i)->direction);
  }
  if (k->sets && s->set.hfixed <= 0.0) s->step.h = fmin(s->step.h, tr_onset_step(s, TR_A(s, K) + k->nq));
  memcpy(TR_A(s, zold), TR_A(s, z), sizeof(double) * (k->active + k->neta));
  return TR_OK;
}

/* The Rosenbrock method's Jacobian is of no use where friction of several components starts from rest (its direction turns infinitely
 * fast) or groups share their load: such steps are made explicitly. */
static void tr_step_aside(tr_sim *s) {
  const tr_kernel *k = s->k;
  if (!k->sets || (tr_method_of(s)->kind != TR_IMPLICIT && !s->step.aside)) return;
  int slow = s->friction.shares;
  for (int i = 0; i < k->nsliders && !slow; ++i)
    slow = tr_is_set(s, i) && !tr_is_stuck(s, i) && tr_pair_of(s, i)->nrates > 1 && tr_keeps_direction(s, i, tr_speed_of_state(s, i));
  if (slow != s->step.aside) s->step.have_jac = 0;
  s->step.aside = slow;
  s->step.method = slow ? TR_AUTO_TIGHT : tr_chooses(s) ? TR_AUTO_STIFF : s->set.method;
}

/* Why the last trial step towards ynew was refused. */
static int tr_fault(const tr_sim *s, double err, const double *ynew) {
  if (err == err) return TR_FAIL_STEP;
  if (s->step.trouble != TR_OK) return s->step.trouble;
  return s->k->neta && tr_finite(s->ny + s->k->nquad, ynew) ? TR_FAIL_MULTIPLIERS : TR_FAIL_NOT_FINITE;
}

/* A fixed step in which friction cannot be followed (sliding of several components that ends inside it) is made in parts, not smaller than
 * this. */
#define LEAST_PART 1e-4

/* Make one acceptable trial step towards `limit`; the result waits as `pending`. */
static int tr_attempt(tr_sim *s, double limit) {
  const tr_kernel *k = s->k;
  if (tr_method_of(s)->kind == TR_IMPULSES) return tr_attempt_moreau(s, limit);
  tr_step_aside(s);
  const tr_method *m = tr_method_of(s);
  const int order = m->order, end = m->end, n = tr_width(s), nz = k->active + k->neta, live = s->ny + k->nquad;
  int code = tr_begin_step(s, limit, order), rejected = 0;
  if (code != TR_OK) return code;
  if (s->friction.capture >= 0 && s->clock.t + s->friction.capture_h < limit && tr_step_capture(s)) {
    s->stats.steps++;
    s->pending.kind = TR_STEP_TO_EVENT;
    return TR_OK;
  }
  for (;;) {
    double h = s->set.hfixed > 0.0 && !k->sets ? s->set.hfixed : fmin(s->step.h, s->set.hfixed > 0.0 ? s->set.hfixed : s->set.hmax), left = limit - s->clock.t;
    int last = h >= left * (1.0 - 1e-10);
    if (last) h = left;
    else if (h > 0.5 * left && s->set.hfixed <= 0.0) h = 0.5 * left;
    tr_moment_of(s)->inside = s->clock.t + 0.5 * h;
    s->step.watch = s->set.locate && k->nsliders > 0;
    s->step.trouble = TR_OK;
    double err = m->kind == TR_IMPLICIT ? tr_step_rosenbrock(s, m->rosenbrock, h) : tr_step_explicit(s, m->explicit, h), theta = 1.0, t1 = last ? limit : s->clock.t + h;
    int which = -1, found = TR_NO_EVENT;
    if (s->clock.status == TR_NEED_JACOBIAN) return TR_NEED_JACOBIAN;
    if (err <= 1.0) {
      s->step.t0 = s->clock.t, s->step.size = t1 - s->clock.t, s->step.have_dense = 0;
      memcpy(TR_A(s, yold), TR_A(s, y), sizeof(double) * n);
      if (!tr_finite(live, TR_A(s, ynew)) || !tr_project(s, t1, TR_A(s, ynew)) || !tr_rhs(s, t1, TR_A(s, ynew), TR_A(s, K) + end * n) ||
          !tr_finite(live, TR_A(s, K) + end * n))
        err = NAN;
      else if (s->events.chatter <= CHATTER_MAX) found = tr_find_event(s, &which, &theta);
      if (found == TR_TOO_LARGE || (k->sets && s->set.hfixed <= 0.0 && tr_onset_too_fast(s, TR_A(s, ynew), h))) err = NAN;
    }
    s->step.watch = 0;
    if (err <= 1.0) {
      s->stats.steps++;
      s->pending.kind = found == TR_FOUND ? TR_STEP_TO_EVENT : TR_WHOLE_STEP;
      s->pending.theta = theta, s->pending.which = which, s->pending.h = h, s->pending.t = found == TR_FOUND ? s->step.t0 + theta * s->step.size : t1;
      s->pending.grow = s->set.hfixed > 0.0 ? 2.0 : tr_grow(s, err, order, rejected ? 1.0 : 6.0);
      s->pending.cut = last;
      if (s->pending.kind == TR_STEP_TO_EVENT) tr_sharpen_pending(s);
      if (s->pending.kind == TR_WHOLE_STEP) memcpy(TR_A(s, zold), TR_A(s, z), sizeof(double) * nz);
      if (s->pending.kind == TR_WHOLE_STEP && k->sets) s->friction.capture = tr_ends_sliding(s);
      if (s->pending.kind == TR_WHOLE_STEP && k->nsliders) tr_watch_contacts(s, TR_A(s, K) + end * n + k->nq);
      return TR_OK;
    }
    s->stats.rejected++;
    rejected = 1;
    memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * nz);
    tr_forget_extremes(s);
    s->step.h = err == err ? h * tr_factor_of(err, order, 0.9) : 0.2 * h;
    if (s->set.hfixed > 0.0 && (!k->sets || s->step.h < LEAST_PART * s->set.hfixed)) return tr_fault(s, err, TR_A(s, ynew));
    if (s->step.h <= s->set.hmin + 8e-16 * fabs(s->clock.t)) return tr_fault(s, err, TR_A(s, ynew));
  }
}

/* Complete a whole step: it becomes the start of the next. */
static void tr_finish_whole(tr_sim *s) {
  const tr_kernel *k = s->k;
  const int n = tr_width(s), end = tr_method_of(s)->end;
  s->events.chatter = 0;
  s->stats.of_method[s->step.method]++;
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * (k->active + k->neta));
  if (tr_chooses(s) && !s->step.aside) tr_choose(s);
  memcpy(TR_A(s, K), TR_A(s, K) + end * n, sizeof(double) * n);
  if (s->friction.still) tr_keep_still(s, TR_A(s, ynew));
  tr_shift(s, s->pending.t, TR_A(s, ynew));
  double next = s->pending.h * s->pending.grow;
  s->step.h = s->pending.cut && next < s->step.h ? (s->pending.grow < 1.0 ? next : s->step.h) : next;
}

/* Complete a step that ends where a pair with a set-valued law changes its mode. */
static int tr_finish_set(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, cand);
  tr_mode modes[s->k->nsliders];
  s->friction.capture = s->friction.missed = -1;
  tr_dense_eval(s, s->pending.theta, ye);
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  if (tr_needs_sharpening(s, s->pending.which)) tr_sharpen(s, s->pending.which, &te, ye);
  tr_keep_modes(s, modes);
  int code = tr_settle(s, te, ye, s->pending.which);
  if (code != TR_OK) { /* this is where it ends, or goes on by an impact */
    tr_put_modes(s, modes);
    tr_shift(s, te, ye);
    return code;
  }
  s->stats.events++;
  s->events.chatter = te - s->events.chatter_t < 1e-12 * fmax(1.0, fabs(te)) ? s->events.chatter + 1 : 0;
  s->events.chatter_t = te;
  tr_shift(s, te, ye);
  memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s));
  s->step.have_k1 = 1, s->step.have_jac = 0;
  s->step.h = s->set.hfixed > 0.0 ? s->set.hfixed : s->pending.h * fmin(s->pending.grow, 1.0);
  return TR_OK;
}

/* Complete a step that ends at an event: the state there, the new mode, and a fitting next step. */
static int tr_finish_event(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, cand), *yo = TR_A(s, yout), *dy = TR_A(s, dy);
  int i = s->pending.which, pair = i < s->k->nsliders;
  if (pair && tr_is_set(s, i)) return tr_finish_set(s);
  tr_dense_eval(s, s->pending.theta, ye);
  double rate = 0.0, kink = 1.0, dt = fmin(s->pending.theta, 1e-3) * s->step.size;
  if (pair && tr_slides(s, i) && dt > 0.0) { /* how fast the proportional zone will be crossed */
    tr_dense_eval(s, s->pending.theta - dt / s->step.size, yo);
    if (!tr_rhs(s, te - dt, yo, dy)) return TR_FAIL_MULTIPLIERS;
    rate = tr_sliding_of(s, i)->speed;
  }
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, dy)) return TR_FAIL_MULTIPLIERS;
  if (pair) kink = tr_sliding_of(s, i)->border, rate = fabs(tr_sliding_of(s, i)->speed - rate) / dt;
  s->events.chatter = te - s->events.chatter_t < 1e-12 * fmax(1.0, fabs(te)) ? s->events.chatter + 1 : 0;
  s->events.chatter_t = te;
  int entering = pair && tr_slides(s, i);
  if (pair && tr_chooses(s)) tr_kink_passed(s);
  tr_switch(s, i, te, ye);
  tr_shift(s, te, ye);
  s->step.have_k1 = s->step.have_jac = 0;
  double h = s->pending.h * fmin(s->pending.grow, 1.0);
  if (entering) {
    s->step.h_slip = fmax(h, s->step.h_slip);
    s->step.h = rate > 0.0 ? fmin(h, 2.2 * kink / rate) : h;
  } else {
    s->step.h = s->step.h_slip > 0.0 ? s->step.h_slip : h;
    s->step.h_slip = 0.0;
  }
  return TR_OK;
}

/* Rows, then completion, of what is pending. May return TR_ROWS_FULL and be called again. */
static int tr_finish(tr_sim *s, double *rows, long capacity, long *count) {
  int pending = s->pending.kind, code;
  if (s->k->nsliders && !s->pending.noted && pending != TR_IMPULSE_STEP) tr_note_reversals(s, pending == TR_WHOLE_STEP ? 1.0 : s->pending.theta);
  s->pending.noted = 1;
  code = tr_rows(s, s->pending.t, pending != TR_STEP_TO_EVENT, rows, capacity, count);
  if (code != TR_OK) return code;
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  if (pending == TR_IMPULSE_STEP) tr_shift(s, s->pending.t, TR_A(s, ynew)), s->step.have_k1 = 0;
  if (pending == TR_WHOLE_STEP) tr_finish_whole(s);
  code = pending == TR_STEP_TO_EVENT ? tr_finish_event(s) : TR_OK;
  tr_hand_over(s);
  return code;
}

/* After a failure of friction: whether the run goes on from the state in place, a ball spinning or a jammed pair stopped. */
static int tr_goes_on(tr_sim *s, int code) {
  if (code != TR_FAIL_MULTIPLIERS && code != TR_FAIL_MODES) return 0;
  if (!tr_lets_spin(s) && !tr_through_jam(s)) return 0;
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  return 1;
}

/* Go on to `target`, at most max_steps steps. Rows are appended to rows[capacity][want]. */
int tr_advance(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count) {
  *count = 0;
  if (s->clock.status >= TR_DONE && s->clock.status != TR_DONE) return s->clock.status;
  s->clock.status = TR_OK;
  for (long step = 0;;) {
    int code = TR_OK;
    if (s->pending.kind != TR_NOTHING) {
      code = tr_finish(s, rows, capacity, count);
      if (tr_goes_on(s, code)) continue;
      if (code != TR_OK) return tr_end(s, code);
      if (s->events.count > s->events.capacity - 2 * tr_watched(s) - 2) return TR_EVENTS_FULL;
    }
    if (s->clock.t >= target - 1e-13 * fmax(1.0, fabs(target))) return s->clock.status = TR_DONE;
    if (step++ >= max_steps) return TR_MORE;
    if (s->set.max_steps > 0 && s->stats.steps >= s->set.max_steps) return s->clock.status = TR_FAIL_MAX_STEPS;
    code = tr_attempt(s, tr_limit_time(s, target));
    if (code == TR_NEED_JACOBIAN) {
      s->clock.status = TR_OK;
      return code;
    }
    if (tr_goes_on(s, code)) continue;
    if (code != TR_OK) return tr_end(s, code);
  }
}
