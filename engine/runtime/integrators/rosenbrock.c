/* Steps of an L-stable Rosenbrock method with the exact Jacobian. The integrated state contains no works; ``work_quadrature.c``
 * integrates works along the dense output. */
#include "integrators/integrators.h"

/* W ← E/(γh) − ∂F/∂y at (t, y), factorised. Returns 0 on failure. */
TR_INLINE int tr_factor_stiff_matrix(tr_sim *s, double shift) {
  const int ny = s->ny, ld = tr_jacobian_rows(s);
  double *W = TR_A(s, W), *J = TR_A(s, jac);
  if (s->step.jac_t != s->clock.t || !s->step.have_jac) {
    if (!tr_jacobian_at(s, s->clock.t, TR_A(s, y))) return 0;
    s->step.jac_t = s->clock.t, s->step.have_jac = 1;
  }
  for (int q = 0; q < ny; ++q) {
    for (int i = 0; i < ny; ++i) W[i + q * ny] = -J[i + (size_t)q * ld];
    W[q + q * ny] += shift;
  }
  return tr_lu(ny, W, (int *)TR_A(s, wperm));
}

/* out = y + Σ a[p] K[p + 1] over `count` stages. A row has nv SIMD vectors. */
TR_INLINE void tr_add_stages(int nv, int count, const double *a, const tr_vec *y, const tr_vec *K, tr_vec *out) {
  for (int i = 0; i < nv; ++i) {
    tr_vec sum = y[i];
    for (int p = 0; p < count; ++p) sum += a[p] * K[(p + 1) * nv + i];
    out[i] = sum;
  }
}

/* Solve stage `st` and store it in its row of K. Returns 0 if f cannot be evaluated. */
TR_INLINE int tr_solve_stiff_stage(tr_sim *s, const tr_rosenbrock *m, int st, double h) {
  const int n = tr_state_width(s), nv = n / TR_LANES, ny = s->ny, ld = tr_jacobian_rows(s);
  const double *J = TR_A(s, jac), *ft = J + (size_t)ny * ld;
  double *K = TR_A(s, K), *tmp = TR_A(s, ytmp), *ki = K + (st + 1) * n, *f = TR_A(s, dy), c[TR_STAGES];
  if (st == 0) {
    memcpy(f, K, sizeof(double) * n);
  } else {
    tr_add_stages(nv, st, m->A + st * m->stages, (tr_vec *)TR_A(s, y), (tr_vec *)K, (tr_vec *)tmp);
    if (!tr_rhs(s, s->clock.t + m->c[st] * h, tmp, f)) return 0;
  }
  for (int p = 0; p < st; ++p) c[p] = m->C[st * m->stages + p] / h;
  for (int i = 0; i < ny; ++i) ki[i] = f[i] + h * m->d[st] * ft[i];
  for (int i = ny; i < n; ++i) ki[i] = 0.0;
  tr_add_stages(nv, st, c, (tr_vec *)ki, (tr_vec *)K, (tr_vec *)ki);
  tr_lu_solve(ny, TR_A(s, W), (int *)TR_A(s, wperm), ki);
  return 1;
}

static double tr_step_rosenbrock(tr_sim *s, const tr_rosenbrock *m, double h) {
  if (!s->j) {
    s->clock.status = TR_NEED_JACOBIAN;
    return NAN;
  }
  const int n = tr_state_width(s);
  double *K = TR_A(s, K), *y = TR_A(s, y), *ynew = TR_A(s, ynew);
  const double shift = 1.0 / (m->gamma * h);
  if (!tr_factor_stiff_matrix(s, shift)) return NAN;
  for (int st = 0; st < m->stages; ++st)
    if (!tr_solve_stiff_stage(s, m, st, h)) return NAN;
  tr_add_stages(n / TR_LANES, m->stages, m->b, (tr_vec *)y, (tr_vec *)K, (tr_vec *)ynew);
  if (s->set.hfixed > 0.0) return 0.0;
  tr_store_speed_errors(s, K + m->stages * n, 1.0);
  return sqrt(tr_squared_error(s, K + m->stages * n, y, ynew));
}

/* Form the rows for tr_evaluate_dense, with Δ = y₁ − y: (1−θ) y + θ (y₁ + (1−θ)(K₁ + θ (K₂ + θ K₃))) = y + θ (Δ + (1−θ)(K₁ + θ (K₂
 * + …))). */
static int tr_form_dense_rosenbrock(tr_sim *s, const tr_rosenbrock *m) {
  const int nv = tr_state_width(s) / TR_LANES;
  const tr_vec *K = (tr_vec *)TR_A(s, K), *y0 = (tr_vec *)TR_A(s, yold), *y1 = (tr_vec *)TR_A(s, ynew);
  tr_vec *R = (tr_vec *)TR_A(s, kstep);
  s->step.dense_rows = 4;
  for (int i = 0; i < nv; ++i) {
    tr_vec d[3] = {TR_NOUGHT, TR_NOUGHT, TR_NOUGHT};
    for (int p = 0; p < m->stages; ++p) {
      TR_UNROLL
      for (int r = 0; r < 3; ++r) d[r] += m->H[r * m->stages + p] * K[(p + 1) * nv + i];
    }
    R[i] = y1[i] - y0[i];
    R[nv + i] = d[0] + 0.0;
    R[2 * nv + i] = d[1] + d[2];
    R[3 * nv + i] = -d[2]; /* the nested form alternates θ and 1−θ: θ (K₂ + θ K₃) = θ (K₂ + K₃ − (1−θ) K₃) */
  }
  TR_MADE(s, TR_HAS_DENSE);
  return 1;
}
