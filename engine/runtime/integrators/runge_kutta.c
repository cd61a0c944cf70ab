/* Steps of explicit Runge–Kutta methods, defined by their tables. */
#include "integrators/integrators.h"

#define HERMITE_ROWS 3 /* rows of the cubic through values and slopes at both ends */
/* if steps near the limit of stability outnumber all others by more than this number, stability limits the steps */
#define LIMITED_STEPS 6
#define SLOPE_NOISE 1e-11 /* relative to the units of states × |λ|: a smaller error of slopes is round-off */

/* Squared error of the n works from index `first` of the state in the last explicit step. second: errors of the second estimator;
 * null pointer if there is no second estimator. */
static double tr_step_work_error(const tr_sim *s, double h, const double *e, const double *second, int first, int n) {
  const double *y = TR_A(s, y), *ynew = TR_A(s, ynew), unit = tr_work_unit(s, h, y, first, n);
  const double error = tr_squared_work_error(s, e, y, ynew, first, n, unit);
  return second ? tr_combine_estimators(error, tr_squared_work_error(s, second, y, ynew, first, n, unit)) : error;
}

TR_INLINE void tr_extrapolate_start(int e, double *x, const tr_explicit *m, int i, const double *old) {
  const double *weight = m->lead + i * m->stages;
  for (int j = 0; j < e; j += TR_LANES) {
    tr_vec sum = TR_NOUGHT;
    for (int k = 0; k < i; ++k) sum += *(const tr_vec *)(old + k * e + j) * weight[k];
    tr_copy(e - j < TR_LANES ? e - j : TR_LANES, (const double *)&sum, x + j);
  }
}

static void tr_keep_stage_multipliers(const tr_sim *s, int row) {
  const int nz = s->k->active + s->k->neta;
  if (s->step.stage_z) memcpy(s->step.stage_z + (size_t)row * nz, TR_A(s, z), sizeof(double) * nz);
}

static double tr_step_explicit(tr_sim *s, const tr_explicit *m, double h) {
  int n = tr_state_width(s), nv = n / TR_LANES;
  double *K = TR_A(s, K), *y = TR_A(s, y), *tmp = TR_A(s, ytmp), *ynew = TR_A(s, ynew);
  const int e = tr_z_length(s) - s->k->active;
  double *eta = TR_A(s, z) + s->k->active, old[e * m->stages + TR_LANES];
  const int made = tr_take_from_lane(s, TR_ASK_STEP, m->stages - 1 + m->ends_in_error);
  tr_keep_stage_multipliers(s, 0);
  for (int i = 1; i < m->stages && !made; ++i) {
    m->argument(i, nv, h, (tr_vec *)y, (tr_vec *)K, (tr_vec *)tmp);
    tr_copy(e, eta, old + (i - 1) * e);
    tr_extrapolate_start(e, eta, m, i, old);
    if (!tr_rhs(s, s->clock.t + m->c[i] * h, tmp, K + i * n)) return NAN;
    tr_keep_stage_multipliers(s, i);
  }
  if (!made) m->solution(nv, h, (tr_vec *)y, (tr_vec *)K, (tr_vec *)ynew);
  if (!made && m->ends_in_error && !tr_rhs(s, s->clock.t + h, ynew, K + m->stages * n)) return NAN;
  if (s->set.hfixed > 0.0) return 0.0;
  double *other = TR_A(s, yout);
  if (!made) m->error[0](nv, h, (tr_vec *)K, (tr_vec *)tmp);
  if (!made && m->errors > 1) m->error[1](nv, h, (tr_vec *)K, (tr_vec *)other);
  const double *second = m->errors > 1 ? other : 0;
  s->step.works = sqrt(tr_step_work_error(s, h, tmp, second, s->ny, s->nworks));
  const double works = tr_step_work_error(s, h, tmp, second, s->ny + s->nworks, TR_AUDIT_SUMS), first = tr_squared_error(s, tmp, y, ynew);
  const double motion = second ? tr_combine_estimators(first, tr_squared_error(s, second, y, ynew)) : first;
  tr_store_speed_errors(s, tmp, motion < first ? sqrt(motion / first) : 1.0);
  return sqrt(motion + works);
}

/* Estimate of h |λ| from the last stage and the end of an explicit step of length h (Hairer, Wanner II, IV.2). */
static double tr_estimate_stiffness(tr_sim *s, const tr_explicit *m, double h) {
  int n = tr_state_width(s), last = m->stages - 1;
  double *K = TR_A(s, K), *y = TR_A(s, y), *tmp = TR_A(s, ytmp), *ynew = TR_A(s, ynew);
  const double *unit = TR_A(s, scale);
  m->argument(last, n / TR_LANES, h, (tr_vec *)y, (tr_vec *)K, (tr_vec *)tmp);
  double num = 0.0, den = 0.0;
  for (int i = 0; i < s->ny; ++i) {
    double a = (K[m->stages * n + i] - K[last * n + i]) / unit[i], b = (ynew[i] - tmp[i]) / unit[i];
    num += a * a;
    den += b * b;
  }
  return den > 0.0 ? h * sqrt(num / den) : 0.0;
}

static double tr_error_of_slopes(tr_sim *s, const tr_method *m, double h) {
  if (m->kind != TR_EXPLICIT) return 0.0;
  const double size = s->step.stiffness = tr_estimate_stiffness(s, m->explicit, h);
  if (tr_is_auto(s) || s->set.hfixed > 0.0) return 0.0;
  const int near = size > NEAR_LIMIT * m->explicit->stiff_at, count = s->step.stiff_count + (near ? 1 : -1);
  s->step.stiff_count = count < 0 ? 0 : count > 2 * LIMITED_STEPS ? 2 * LIMITED_STEPS : count;
  if (!near || count <= LIMITED_STEPS) return 0.0;
  const double *last = TR_A(s, K) + (m->explicit->stages - 1) * tr_state_width(s), *end = TR_A(s, K) + m->end * tr_state_width(s);
  const double part = fmin(1.0 / s->set.rate, h / size * s->set.rtol / SLOPE_NOISE);
  double *e = TR_A(s, ytmp);
  for (int i = 0; i < s->ny; ++i) e[i] = part * (end[i] - last[i]);
  return sqrt(tr_squared_motion_error(s, e, TR_A(s, y), TR_A(s, ynew)));
}

/* State at θ of the pending explicit step. A new step from the same start computes this state; its length is θ times the length of
 * the pending step. Does not integrate works. Returns 0 on failure. */
static int tr_step_to_place(tr_sim *s, double theta, double *out) {
  const tr_explicit *m = tr_method_of(s)->explicit;
  const int n = tr_state_width(s), nv = n / TR_LANES, watch = s->step.watch;
  const double h = theta * s->step.size;
  double *K = TR_A(s, K), *yold = TR_A(s, yold), *tmp = TR_A(s, ytmp), kept[n * TR_STAGES];
  int made = 1;
  memcpy(kept, K, sizeof kept);
  s->step.watch = 0;
  for (int i = 1; i < m->stages && made; ++i) {
    m->argument(i, nv, h, (tr_vec *)yold, (tr_vec *)K, (tr_vec *)tmp);
    made = tr_rhs(s, s->step.t0 + m->c[i] * h, tmp, K + i * n);
  }
  if (made) m->solution(nv, h, (tr_vec *)yold, (tr_vec *)K, (tr_vec *)tmp);
  made = made && tr_project(s, s->step.t0 + h, tmp);
  if (made) memcpy(out, tmp, sizeof(double) * s->ny);
  memcpy(K, kept, sizeof kept);
  s->step.watch = watch;
  return made;
}

static int tr_form_dense_rows(const tr_explicit *m, int nv, double h, const tr_vec *K, const tr_vec *yold, const tr_vec *y1, tr_vec *rows) {
  const tr_vec *f0 = K, *f1 = f0 + m->stages * nv;
  for (int i = 0; i < nv; ++i) {
    tr_vec dy = y1[i] - yold[i];
    rows[i] = dy;
    rows[nv + i] = h * f0[i] - dy;
    rows[2 * nv + i] = 2.0 * dy - h * (f1[i] + f0[i]);
  }
  for (int i = 0; i < m->dense; ++i) m->dense_row[i](nv, h, K, rows + (HERMITE_ROWS + i) * nv);
  return HERMITE_ROWS + m->dense;
}

/* Form the rows of the dense output in kstep, from both ends of the step and K. Evaluates the extra stages. Returns 0 if a stage
 * fails. */
static int tr_form_dense_explicit(tr_sim *s, const tr_explicit *m) {
  int n = tr_state_width(s), nv = n / TR_LANES;
  double h = s->step.size, *K = TR_A(s, K), *yold = TR_A(s, yold), *y1 = TR_A(s, ynew), *R = TR_A(s, kstep), *tmp = TR_A(s, ytmp);
  int watch = s->step.watch;
  s->step.watch = 0;
  const int made = tr_take_from_lane(s, TR_ASK_DENSE, m->extra);
  for (int i = 0; i < m->extra && !made; ++i) {
    tr_interpolate_multipliers(s, m->c[m->stages + 1 + i]);
    m->argument(m->stages + 1 + i, nv, h, (tr_vec *)yold, (tr_vec *)K, (tr_vec *)tmp);
    if (!tr_rhs(s, s->step.t0 + m->c[m->stages + 1 + i] * h, tmp, K + (m->stages + 1 + i) * n)) return 0;
    tr_keep_stage_multipliers(s, m->stages + 1 + i);
  }
  s->step.watch = watch;
  s->step.dense_rows = tr_form_dense_rows(m, nv, h, (tr_vec *)K, (tr_vec *)yold, (tr_vec *)y1, (tr_vec *)R);
  TR_MADE(s, TR_HAS_DENSE);
  return 1;
}
