/* The stepping loop: step sizes, error control, events, output rows, outcomes. */
#include "tr.h"

#define SAFETY 0.9
#define PI_NOW 0.8 /* weights of this and the last error in the step size: a third fewer rejections than 1, 0 at the same accuracy */
#define PI_OLD 0.3
#define CHATTER_MAX 12

static int tr_prepare_dense(tr_sim *s) {
  int ok;
  if (s->method_now == TR_ROSENBROCK) {
    ok = tr_dense_rosenbrock(s);
  } else {
    const tr_erk *m = tr_erk_of(s->method_now);
    s->method_dense = 3 + m->dense;
    ok = tr_dense_explicit(s, m);
  }
  return ok;
}

static double tr_limit_time(const tr_sim *s, double target) {
  if (s->next_break < s->nbreaks) {
    double b = TR_A(s, breaks)[s->next_break];
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
    double w = s->rtol * (unit[i] + fabs(y[i]));
    d0 += y[i] * y[i] / (w * w);
    d1 += K[i] * K[i] / (w * w);
  }
  d0 = sqrt(d0 / s->ny), d1 = sqrt(d1 / s->ny);
  double h0 = d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1;
  h0 = fmin(h0, span);
  for (int i = 0; i < n; ++i) tmp[i] = y[i] + h0 * K[i];
  double *f1 = TR_A(s, dy);
  if (!tr_rhs(s, s->t + h0, tmp, f1)) return h0 * 1e-2;
  for (int i = 0; i < s->ny; ++i) {
    double w = s->rtol * (unit[i] + fabs(y[i])), d = (f1[i] - K[i]) / w;
    d2 += d * d;
  }
  d2 = sqrt(d2 / s->ny) / h0;
  double big = fmax(d1, d2), h1 = big <= 1e-15 ? fmax(1e-6, h0 * 1e-3) : pow(0.01 / big, 1.0 / order);
  return fmin(fmin(100.0 * h0, h1), span);
}

/* Rows whose time lies in (…, t_end] of the step whose dense output is available, and the step's end itself when `every` is 0: the
 * end of the whole step, or where an event cuts it short (as it was up to there). */
static int tr_rows(tr_sim *s, double t_end, int final, double *rows, long capacity, long *count) {
  if (s->want == 0) return TR_OK;
  int width = s->want;
  if (s->every <= 0.0) {
    if (*count >= capacity) return TR_ROWS_FULL;
    double *y = TR_A(s, yout);
    if (final) memcpy(y, TR_A(s, ynew), sizeof(double) * tr_width(s));
    else tr_dense_eval(s, s->p_theta, y);
    if (!tr_output(s, t_end, y, rows + width * *count)) return TR_FAIL_MULTIPLIERS;
    ++*count;
    return TR_OK;
  }
  while (s->row_next <= t_end + (final ? 1e-12 * fmax(1.0, fabs(t_end)) : 0.0)) {
    if (*count >= capacity) return TR_ROWS_FULL;
    double *y = TR_A(s, yout), theta = (s->row_next - s->step_t0) / s->step_h, t = s->row_next;
    if (final && fabs(t - (s->step_t0 + s->step_h)) <= 1e-12 * fmax(1.0, fabs(t))) {
      memcpy(y, TR_A(s, ynew), sizeof(double) * tr_width(s));
    } else {
      if (!s->have_dense) {
        if (!tr_prepare_dense(s)) return TR_FAIL_MULTIPLIERS;
        s->have_dense = 1;
      }
      tr_dense_eval(s, theta, y);
    }
    if (!tr_output(s, t, y, rows + width * *count)) return TR_FAIL_MULTIPLIERS;
    ++*count;
    s->row_index++;
    s->row_next = s->t_start + s->row_index * s->every;
  }
  return TR_OK;
}

/* While a slider passes through its proportional zone, note when its velocity along the old direction vanishes. */
static void tr_note_reversals(tr_sim *s, double theta_end) {
  const tr_kernel *k = s->k;
  for (int i = 0; i < k->nsliders; ++i) {
    double *z = tr_zone(s, i);
    if (z[0] < 0.5 || z[5] == z[5]) continue;
    if (tr_along(s, i) >= 0.0) continue;
    if (!s->have_dense) {
      if (!tr_prepare_dense(s)) return;
      s->have_dense = 1;
    }
    double a = 0.0, b = theta_end, *y = TR_A(s, yout);
    for (int it = 0; it < 60 && b - a > 1e-15; ++it) {
      double m = 0.5 * (a + b), t = s->step_t0 + m * s->step_h;
      tr_dense_eval(s, m, y);
      tr_set_time(s, t);
      k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
      if (tr_along(s, i) < 0.0) b = m; else a = m;
    }
    z[5] = s->step_t0 + b * s->step_h;
  }
}

static void tr_forget_extremes(tr_sim *s);

static void tr_shift(tr_sim *s, double t, const double *y) {
  int n = tr_width(s);
  memmove(TR_A(s, y), y, sizeof(double) * n);
  s->t = t;
  while (s->next_break < s->nbreaks && TR_A(s, breaks)[s->next_break] <= t + 1e-13 * fmax(1.0, fabs(t))) {
    s->next_break++;
    s->have_k1 = 0;
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
  double e = fmax(err, 1e-4), old = s->err_old > 0.0 ? s->err_old : e;
  s->err_old = e;
  return fmin(most, fmax(0.2, SAFETY * pow(e, -PI_NOW / order) * pow(old, PI_OLD / order)));
}

static void tr_forget_extremes(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i) TR_A(s, smin)[i] = INFINITY, TR_A(s, smax)[i] = -INFINITY;
}

/* Derivative and first step size at the start of a step; directions of sliding are frozen here. */
static int tr_begin_step(tr_sim *s, double limit, int order) {
  const tr_kernel *k = s->k;
  if (!s->have_k1) {
    TR_A(s, x)[1] = s->t + 0.5 * fmin(limit - s->t, s->h > 0.0 ? s->h : limit - s->t);
    s->watch = 0;
    if (!tr_rhs(s, s->t, TR_A(s, y), TR_A(s, K))) return TR_FAIL_MULTIPLIERS;
    if (s->still) { /* loads may have jumped here */
      int code = tr_settle(s, s->t, TR_A(s, y), -1);
      if (code != TR_OK) return code;
      memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s));
    }
    s->have_k1 = 1;
  }
  if (s->h <= 0.0) s->h = tr_first_step(s, limit - s->t, order);
  if (!s->locate || s->chatter > CHATTER_MAX) tr_turn_directions(s);
  for (int i = 0; i < k->nsliders; ++i) {
    if (tr_mode(s, i)[0] < 0.5 || tr_slider(s, i)[4] == 1) continue;
    if (!tr_is_set(s, i)) tr_freeze(s, i);
    else if (!tr_keeps_direction(s, i, tr_speed_of_state(s, i))) tr_rates_of_state(s, i, tr_mode(s, i) + 1);
  }
  if (k->sets && s->hfixed <= 0.0) s->h = fmin(s->h, tr_onset_step(s, TR_A(s, K) + k->nq));
  memcpy(TR_A(s, zold), TR_A(s, z), sizeof(double) * (k->active + k->neta));
  return TR_OK;
}

/* The Rosenbrock method's Jacobian is of no use where friction of several components starts from rest (its direction turns infinitely
 * fast) or groups share their load: such steps are made explicitly. */
static void tr_step_aside(tr_sim *s) {
  const tr_kernel *k = s->k;
  if (!k->sets || (s->method_now != TR_ROSENBROCK && !s->aside)) return;
  int slow = s->shares;
  for (int i = 0; i < k->nsliders && !slow; ++i)
    slow = tr_is_set(s, i) && !tr_is_stuck(s, i) && tr_slider(s, i)[4] > 1 && tr_keeps_direction(s, i, tr_speed_of_state(s, i));
  if (slow != s->aside) s->have_jac = 0;
  s->aside = slow;
  s->method_now = slow ? TR_RK8 : TR_ROSENBROCK;
}

/* Why the last trial step towards ynew was refused. */
static int tr_fault(const tr_sim *s, double err, const double *ynew) {
  if (err == err) return TR_FAIL_STEP;
  if (s->trouble != TR_OK) return s->trouble;
  return s->k->neta && tr_finite(s->ny + s->k->nquad, ynew) ? TR_FAIL_MULTIPLIERS : TR_FAIL_NOT_FINITE;
}

/* A fixed step in which friction cannot be followed (sliding of several components that ends inside it) is made in parts, not smaller than
 * this. */
#define LEAST_PART 1e-4

/* Make one acceptable trial step towards `limit`; the result waits as `pending` (1 whole step, 2 up to an event). */
static int tr_attempt(tr_sim *s, double limit) {
  const tr_kernel *k = s->k;
  if (s->method_now == TR_MOREAU) return tr_attempt_moreau(s, limit);
  tr_step_aside(s);
  const int ros = s->method_now == TR_ROSENBROCK, n = tr_width(s), nz = k->active + k->neta, live = s->ny + k->nquad;
  const tr_erk *m = tr_erk_of(s->method_now);
  const int order = ros ? TR_ROS_ORDER : m->order, end = ros ? TR_ROS_END : m->stages;
  int code = tr_begin_step(s, limit, order), rejected = 0;
  if (code != TR_OK) return code;
  if (s->capture >= 0 && s->t + s->capture_h < limit && tr_step_capture(s)) {
    s->stats.steps++;
    s->pending = 2;
    return TR_OK;
  }
  for (;;) {
    double h = s->hfixed > 0.0 && !k->sets ? s->hfixed : fmin(s->h, s->hfixed > 0.0 ? s->hfixed : s->hmax), left = limit - s->t;
    int last = h >= left * (1.0 - 1e-10);
    if (last) h = left;
    else if (h > 0.5 * left && s->hfixed <= 0.0) h = 0.5 * left;
    TR_A(s, x)[1] = s->t + 0.5 * h;
    s->watch = s->locate && k->nsliders > 0;
    s->trouble = TR_OK;
    double err = ros ? tr_step_rosenbrock(s, h) : tr_step_explicit(s, m, h), theta = 2.0, t1 = last ? limit : s->t + h;
    int which = -1;
    if (s->status == TR_NEED_JACOBIAN) return TR_NEED_JACOBIAN;
    if (err <= 1.0) {
      s->step_t0 = s->t, s->step_h = t1 - s->t, s->have_dense = 0;
      memcpy(TR_A(s, yold), TR_A(s, y), sizeof(double) * n);
      if (!tr_finite(live, TR_A(s, ynew)) || !tr_project(s, t1, TR_A(s, ynew)) || !tr_rhs(s, t1, TR_A(s, ynew), TR_A(s, K) + end * n) ||
          !tr_finite(live, TR_A(s, K) + end * n))
        err = NAN;
      else if (s->chatter <= CHATTER_MAX) theta = tr_find_event(s, &which);
      if (theta == 3.0 || (k->sets && s->hfixed <= 0.0 && tr_onset_too_fast(s, TR_A(s, ynew), h))) err = NAN;
    }
    s->watch = 0;
    if (err <= 1.0) {
      s->stats.steps++;
      s->pending = theta <= 1.0 ? 2 : 1;
      s->p_theta = theta, s->p_which = which, s->p_h = h, s->p_t = theta <= 1.0 ? s->step_t0 + theta * s->step_h : t1;
      s->p_grow = s->hfixed > 0.0 ? 2.0 : tr_grow(s, err, order, rejected ? 1.0 : 6.0);
      s->p_cut = last;
      if (s->pending == 2) tr_sharpen_pending(s);
      if (s->pending == 1) memcpy(TR_A(s, zold), TR_A(s, z), sizeof(double) * nz);
      if (s->pending == 1 && k->sets) s->capture = tr_ends_sliding(s);
      if (s->pending == 1 && k->nsliders) tr_watch_contacts(s, TR_A(s, K) + end * n + k->nq);
      return TR_OK;
    }
    s->stats.rejected++;
    rejected = 1;
    memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * nz);
    tr_forget_extremes(s);
    s->h = err == err ? h * tr_factor_of(err, order, 0.9) : 0.2 * h;
    if (s->hfixed > 0.0 && (!k->sets || s->h < LEAST_PART * s->hfixed)) return tr_fault(s, err, TR_A(s, ynew));
    if (s->h <= s->hmin + 8e-16 * fabs(s->t)) return tr_fault(s, err, TR_A(s, ynew));
  }
}

/* Complete a whole step: it becomes the start of the next. */
static void tr_finish_whole(tr_sim *s) {
  const tr_kernel *k = s->k;
  const int ros = s->method_now == TR_ROSENBROCK, n = tr_width(s), end = ros ? TR_ROS_END : tr_erk_of(s->method_now)->stages;
  s->chatter = 0;
  *(ros ? &s->stats.stiff : s->method_now == TR_RK5 ? &s->stats.rk5 : &s->stats.rk8) += 1;
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * (k->active + k->neta));
  if (s->method == TR_AUTO && !s->aside) tr_choose(s);
  memcpy(TR_A(s, K), TR_A(s, K) + end * n, sizeof(double) * n);
  if (s->still) tr_keep_still(s, TR_A(s, ynew));
  tr_shift(s, s->p_t, TR_A(s, ynew));
  double next = s->p_h * s->p_grow;
  s->h = s->p_cut && next < s->h ? (s->p_grow < 1.0 ? next : s->h) : next;
}

/* Complete a step that ends where a pair with a set-valued law changes its mode. */
static int tr_finish_set(tr_sim *s) {
  double te = s->p_t, *ye = TR_A(s, cand), modes[TR_MODE * s->k->nsliders];
  s->capture = s->missed = -1;
  tr_dense_eval(s, s->p_theta, ye);
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  if (tr_needs_sharpening(s, s->p_which)) tr_sharpen(s, s->p_which, &te, ye);
  memcpy(modes, tr_mode(s, 0), sizeof modes);
  int code = tr_settle(s, te, ye, s->p_which);
  if (code != TR_OK) { /* this is where it ends, or goes on by an impact */
    memcpy(tr_mode(s, 0), modes, sizeof modes);
    tr_shift(s, te, ye);
    return code;
  }
  s->stats.events++;
  s->chatter = te - s->chatter_t < 1e-12 * fmax(1.0, fabs(te)) ? s->chatter + 1 : 0;
  s->chatter_t = te;
  tr_shift(s, te, ye);
  memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s));
  s->have_k1 = 1, s->have_jac = 0;
  s->h = s->hfixed > 0.0 ? s->hfixed : s->p_h * fmin(s->p_grow, 1.0);
  return TR_OK;
}

/* Complete a step that ends at an event: the state there, the new mode, and a fitting next step. */
static int tr_finish_event(tr_sim *s) {
  double te = s->p_t, *ye = TR_A(s, cand), *yo = TR_A(s, yout), *dy = TR_A(s, dy);
  int i = s->p_which, pair = i < s->k->nsliders;
  if (pair && tr_is_set(s, i)) return tr_finish_set(s);
  tr_dense_eval(s, s->p_theta, ye);
  double rate = 0.0, kink = 1.0, dt = fmin(s->p_theta, 1e-3) * s->step_h;
  if (pair && tr_mode(s, i)[0] > 0.5 && dt > 0.0) { /* how fast the proportional zone will be crossed */
    tr_dense_eval(s, s->p_theta - dt / s->step_h, yo);
    if (!tr_rhs(s, te - dt, yo, dy)) return TR_FAIL_MULTIPLIERS;
    rate = TR_A(s, speed)[2 * i];
  }
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, dy)) return TR_FAIL_MULTIPLIERS;
  if (pair) kink = TR_A(s, speed)[2 * i + 1], rate = fabs(TR_A(s, speed)[2 * i] - rate) / dt;
  s->chatter = te - s->chatter_t < 1e-12 * fmax(1.0, fabs(te)) ? s->chatter + 1 : 0;
  s->chatter_t = te;
  int entering = pair && tr_mode(s, i)[0] > 0.5;
  if (pair && s->method == TR_AUTO) tr_kink_passed(s);
  tr_switch(s, i, te, ye);
  tr_shift(s, te, ye);
  s->have_k1 = s->have_jac = 0;
  double h = s->p_h * fmin(s->p_grow, 1.0);
  if (entering) {
    s->h_slip = fmax(h, s->h_slip);
    s->h = rate > 0.0 ? fmin(h, 2.2 * kink / rate) : h;
  } else {
    s->h = s->h_slip > 0.0 ? s->h_slip : h;
    s->h_slip = 0.0;
  }
  return TR_OK;
}

/* Rows, then completion, of what is pending. May return TR_ROWS_FULL and be called again. */
static int tr_finish(tr_sim *s, double *rows, long capacity, long *count) {
  int pending = s->pending, code;
  if (s->k->nsliders && !s->p_noted && pending != 4) tr_note_reversals(s, pending == 1 ? 1.0 : s->p_theta);
  s->p_noted = 1;
  code = tr_rows(s, s->p_t, pending != 2, rows, capacity, count);
  if (code != TR_OK) return code;
  s->pending = s->p_noted = 0;
  if (pending == 4) tr_shift(s, s->p_t, TR_A(s, ynew)), s->have_k1 = 0;
  if (pending == 1) tr_finish_whole(s);
  code = pending == 2 ? tr_finish_event(s) : TR_OK;
  tr_hand_over(s);
  return code;
}

/* After a failure of friction: whether the run goes on from the state in place, a ball spinning or a jammed pair stopped. */
static int tr_goes_on(tr_sim *s, int code) {
  if (code != TR_FAIL_MULTIPLIERS && code != TR_FAIL_MODES) return 0;
  if (!tr_lets_spin(s) && !tr_through_jam(s)) return 0;
  s->pending = s->p_noted = 0;
  return 1;
}

/* Go on to `target`, at most max_steps steps. Rows are appended to rows[capacity][want]. */
int tr_advance(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count) {
  *count = 0;
  if (s->status >= TR_DONE && s->status != TR_DONE) return s->status;
  s->status = TR_OK;
  for (long step = 0;;) {
    int code = TR_OK;
    if (s->pending) {
      code = tr_finish(s, rows, capacity, count);
      if (tr_goes_on(s, code)) continue;
      if (code != TR_OK) return tr_end(s, code);
      if (s->nev > s->ev_capacity - 2 * tr_watched(s) - 2) return TR_EVENTS_FULL;
    }
    if (s->t >= target - 1e-13 * fmax(1.0, fabs(target))) return s->status = TR_DONE;
    if (step++ >= max_steps) return TR_MORE;
    if (s->max_steps_total > 0 && s->stats.steps >= s->max_steps_total) return s->status = TR_FAIL_MAX_STEPS;
    code = tr_attempt(s, tr_limit_time(s, target));
    if (code == TR_NEED_JACOBIAN) {
      s->status = TR_OK;
      return code;
    }
    if (tr_goes_on(s, code)) continue;
    if (code != TR_OK) return tr_end(s, code);
  }
}
