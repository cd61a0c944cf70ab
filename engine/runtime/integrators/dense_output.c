/* Dense output: the state at any fraction θ of the last step. Its rows are formed when such a state is first requested. */
#include "integrators/integrators.h"

static void tr_evaluate_dense_rows(int n, int rows, const double *R, const double *yold, double theta, double *out) {
  const double factor[2] = {theta, 1.0 - theta};
  for (int i = 0; i < n; i += TR_LANES) {
    tr_vec a = TR_NOUGHT;
    for (int r = rows - 1; r >= 0; --r) a = (a + *(const tr_vec *)(R + r * n + i)) * factor[r & 1];
    *(tr_vec *)(out + i) = *(const tr_vec *)(yold + i) + a;
  }
}

static void tr_evaluate_dense(const tr_sim *s, double theta, double *out) {
  TR_NEED(s, TR_HAS_DENSE);
  tr_evaluate_dense_rows(tr_state_width(s), s->step.dense_rows, TR_A(s, kstep), TR_A(s, yold), theta, out);
}

static int tr_evaluate_middle_powers(tr_sim *s, const tr_rosenbrock *m) {
  const int watch = s->step.watch, trouble = s->step.failure;
  double kept[tr_solution_size(s)], *y = TR_A(s, ytmp), *f = TR_A(s, dy), *middle = TR_A(s, K) + TR_MIDDLE_ROW * tr_state_width(s);
  tr_save_solution(s, kept);
  tr_form_dense_rosenbrock(s, m);
  tr_evaluate_dense(s, 0.5, y);
  if (s->k->nquat) tr_normalise_quaternions(s, y);
  s->step.watch = 0;
  const int known = tr_rhs(s, s->step.t0 + 0.5 * s->step.size, y, f);
  s->step.watch = watch, s->step.failure = trouble;
  for (int i = s->ny; i < s->ny + s->nworks + TR_AUDIT_SUMS; ++i) middle[i] = known ? f[i] : NAN;
  tr_restore_solution(s, kept);
  return known;
}

/* Add the rows of works to the dense output (tr_form_dense_rosenbrock). The step's end must be evaluated. Also sets the works in
 * ynew. */
static void tr_form_dense_works(tr_sim *s) {
  const int n = tr_state_width(s);
  const double h = s->step.size, *K = TR_A(s, K), *start = K, *middle = K + TR_MIDDLE_ROW * n, *end = K + tr_method_of(s)->end * n;
  double *R = TR_A(s, kstep);
  for (int i = s->ny; i < s->ny + s->nworks + TR_AUDIT_SUMS; ++i) { /* the power is start + a θ + b θ² */
    const double b = 2.0 * (start[i] - 2.0 * middle[i] + end[i]), a = end[i] - start[i] - b;
    R[i] = h * (start[i] + a / 2.0 + b / 3.0);
    R[n + i] = -h * (a / 2.0 + b / 3.0);
    R[2 * n + i] = -h * b / 3.0;
    R[3 * n + i] = 0.0;
    TR_A(s, ynew)[i] = TR_A(s, yold)[i] + R[i];
  }
}

static int tr_ensure_dense(tr_sim *s) {
  if (s->step.have_dense) return 1;
  const tr_method *m = tr_method_of(s);
  s->step.have_dense = m->kind == TR_IMPLICIT ? tr_form_dense_rosenbrock(s, m->rosenbrock) : tr_form_dense_explicit(s, m->explicit);
  if (m->kind == TR_IMPLICIT) tr_form_dense_works(s);
  return s->step.have_dense;
}

static void tr_dense_state(tr_sim *s, double theta, double *out) {
  tr_evaluate_dense(s, theta, out);
  tr_interpolate_multipliers(s, theta);
}

/* Whether the dense output in the middle of the pending step is as accurate as the step. */
static int tr_is_dense_accurate(tr_sim *s) {
  double stepped[s->ny + 1], dense[tr_state_width(s)];
  const double middle = 0.5 * s->pending.theta;
  const int failure = s->step.failure;
  const int known = tr_ensure_dense(s) && tr_step_to_place(s, middle, stepped);
  s->step.failure = failure;
  if (!known) return 0;
  tr_dense_state(s, middle, dense);
  for (int i = 0; i < s->ny; ++i) dense[i] -= stepped[i];
  return tr_squared_motion_error(s, dense, TR_A(s, yold), TR_A(s, ynew)) <= 1.0;
}

static int tr_is_limited_by_stability(tr_sim *s) {
  const tr_method *m = tr_method_of(s);
  if (m->kind != TR_EXPLICIT || s->set.hfixed > 0.0 || s->pending.captured) return 0;
  const double most = NEAR_LIMIT * m->explicit->stiff_at;
  if (!s->step.judged && s->step.stiffness > most) s->step.rough = !tr_is_dense_accurate(s), s->step.judged = 1;
  return s->step.judged && s->step.rough;
}
