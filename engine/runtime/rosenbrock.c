/* The L-stable Rosenbrock method with the exact Jacobian, and the choice between it and the explicit methods.
 *
 * dF/dy = F_y − F_z R_z⁻¹ R_y: multipliers are eliminated inside the derivative just as inside the right-hand side. Works do not
 * act back on the motion and have no rows: they are integrated along its dense output (``works.c``). */
#include "modes.h"

#define KINKS_MAX 12      /* steps that end at a kink, beyond the number of those that do not: then the stiff method takes over */
#define STIFF_STEPS 15    /* steps limited by stability after which it does (Hairer, Wanner II, IV.2) */
#define FORGIVEN_STEPS 6  /* steps in a row that are not limited so: the count begins anew */
#define CALM 2.0          /* h |λ| up to which the stiff method's steps would be stable explicitly */
#define CALM_STEPS 8      /* so many of them in a row: back to the explicit method */
#define POWER_STEPS 8     /* iterations for |λ|: a factor of two is enough */

/* Right-hand sides of the rows of pairs held at rest (``tr_still_rows``): R is the derivative of their acceleration. */
static void tr_still_shift(tr_sim *s, const double *R, const double *lam, double *deta) {
  const tr_kernel *k = s->k;
  const int *row = tr_row_kinds(s);
  const double *Ql = map_Ql(k, TR_A(s, maps)), *Qe = TR_A(s, Q) + k->neta;
  for (int i = 0; i < k->neta; ++i) {
    if (row[i] == TR_ROW_LAW) continue;
    deta[i] = 0.0;
    if (row[i] != TR_ROW_STILL) continue;
    double a = R[i];
    for (int q = 0; q < k->active; ++q) a += Ql[i + q * k->neta] * lam[q];
    deta[i] = -a / Qe[i + i * k->neta];
  }
}

/* dz/d[y, t] (nz × (ny+1)) from the residual rows of the Jacobian: R_z dz = −R_y, with S factorised and dlaw/dN in place. choice: what
 * decides where redundant loops leave λ open, its rows behind R (0: the basic solution). */
static int tr_multiplier_derivatives(tr_sim *s, const double *J, int ld, const tr_choice *choice, double *dz) {
  tr_form_all(s);
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, n = k->nn, cols = s->ny + 1, top = s->ny, open = choice ? tr_open_count(s) : 0;
  const double *T = TR_A(s, T), *Nl = map_Nl(k, TR_A(s, maps)), *dn = TR_A(s, dn);
  double *lu = TR_A(s, lu), b[a + 1], lam[a + 1], shift[n + 1];
  int *perm = (int *)TR_A(s, perm) + a;
  if (e) {
    tr_law_jacobian(s);
    if (s->friction.still) tr_still_rows(s, TR_A(s, z) + a, TR_A(s, r), lu);
    if (!tr_lu(e, lu, perm)) return 0;
  }
  for (int j = 0; j < cols; ++j) {
    const double *R = J + (size_t)j * ld + top;
    double *out = dz + (size_t)j * (a + e), *deta = out + a;
    for (int i = 0; i < a; ++i) b[i] = -R[i];
    if (a) tr_solve_S(s, b, lam);
    if (choice && choice->r) tr_follow_choice(s, choice, j, R + a + e, lam);
    for (int i = 0; i < a; ++i) out[i] = lam[i];
    if (!e) continue;
    for (int i = 0; i < n; ++i) {
      shift[i] = 0.0;
      for (int q = 0; q < a; ++q) shift[i] += Nl[i + q * n] * lam[q];
    }
    for (int i = 0; i < e; ++i) deta[i] = -R[a + i];
    for (int m = 0; m < k->nelements; ++m) {
      const tr_element *el = k->element + m;
      const double *D = dn + el->dn0;
      for (int r = 0; r < el->neta; ++r)
        for (int i = 0; i < el->needs; ++i) deta[el->eta0 + r] += D[r + i * el->neta] * shift[el->n0 + i];
    }
    if (s->friction.still) tr_still_shift(s, R + a, lam, deta);
    tr_lu_solve(e, lu, perm, deta);
    for (int i = 0; i < a; ++i)
      for (int q = 0; q < e; ++q) out[i] -= T[i + q * a] * deta[q];
    for (int q = 0; q < e && open; ++q) { /* the open reactions follow friction too */
      double x[open];
      for (int p = 0; p < open; ++p) x[p] = TR_A(s, openY)[p + q * open] * deta[q];
      tr_add_columns(a, open, TR_A(s, openV), x, 1.0, out);
    }
  }
  return 1;
}

/* jac ← dF/d[y, t] at (t, y): ny × (ny+1), column-major in place (leading dimension ld). 0 when not available. */
static int tr_jacobian_at(tr_sim *s, double t, const double *y) {
  const tr_kernel *k = s->k;
  int nz = k->active + k->neta, top = s->ny, ld = tr_jacobian_rows(s), cols = s->ny + 1;
  double *J = TR_A(s, jac), *z = TR_A(s, z);
  if (!tr_rhs(s, t, y, TR_A(s, dy))) return 0;
  if (k->neta) tr_law(s, z + k->active);
  tr_jacobian_columns(s, y, z, cols + nz, J);
  s->stats.jacobians++;
  if (nz == 0) return 1;
  double *dz = TR_A(s, jw);
  tr_choice choice = tr_choice_of(s, y, J);
  if (!tr_multiplier_derivatives(s, J, ld, &choice, dz)) return 0;
  for (int q = 0; q < cols; ++q)
    for (int m = 0; m < nz; ++m) {
      double a = dz[m + (size_t)q * nz];
      const double *Fz = J + (size_t)(cols + m) * ld;
      double *col = J + (size_t)q * ld;
      if (a != 0.0)
        for (int i = 0; i < top; ++i) col[i] += Fz[i] * a;
    }
  return 1;
}

/* W ← E/(γh) − ∂F/∂y at (t, y), factorised. 0 when it cannot be. */
TR_INLINE int tr_stiff_matrix(tr_sim *s, double shift) {
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

/* out = y + Σ a[p] K[p + 1] over `count` stages; nv vectors a row. */
TR_INLINE void tr_stages_sum(int nv, int count, const double *a, const tr_vec *y, const tr_vec *K, tr_vec *out) {
  for (int i = 0; i < nv; ++i) {
    tr_vec sum = y[i];
    for (int p = 0; p < count; ++p) sum += a[p] * K[(p + 1) * nv + i];
    out[i] = sum;
  }
}

/* Stage `st` into its row of K. 0 when f cannot be evaluated. */
TR_INLINE int tr_stiff_stage(tr_sim *s, const tr_rosenbrock *m, int st, double h) {
  const int n = tr_width(s), nv = n / TR_LANES, ny = s->ny, ld = tr_jacobian_rows(s);
  const double *J = TR_A(s, jac), *ft = J + (size_t)ny * ld;
  double *K = TR_A(s, K), *tmp = TR_A(s, ytmp), *ki = K + (st + 1) * n, *f = TR_A(s, dy), c[TR_STAGES];
  if (st == 0) {
    memcpy(f, K, sizeof(double) * n);
  } else {
    tr_stages_sum(nv, st, m->A + st * m->stages, (tr_vec *)TR_A(s, y), (tr_vec *)K, (tr_vec *)tmp);
    if (!tr_rhs(s, s->clock.t + m->c[st] * h, tmp, f)) return 0;
  }
  for (int p = 0; p < st; ++p) c[p] = m->C[st * m->stages + p] / h;
  for (int i = 0; i < ny; ++i) ki[i] = f[i] + h * m->d[st] * ft[i];
  for (int i = ny; i < n; ++i) ki[i] = 0.0;
  tr_stages_sum(nv, st, c, (tr_vec *)ki, (tr_vec *)K, (tr_vec *)ki);
  tr_lu_solve(ny, TR_A(s, W), (int *)TR_A(s, wperm), ki);
  return 1;
}

/* One trial step: its error relative to the tolerance; not a number when a stage cannot be evaluated, or when the Jacobian unit is
 * missing (then the status says so). The derivative at the end is evaluated by the caller after projection. Rows of K: f(t, y), the
 * stages, the derivative at the end. */
static double tr_step_rosenbrock(tr_sim *s, const tr_rosenbrock *m, double h) {
  if (!s->j) {
    s->clock.status = TR_NEED_JACOBIAN;
    return NAN;
  }
  const int n = tr_width(s);
  double *K = TR_A(s, K), *y = TR_A(s, y), *ynew = TR_A(s, ynew);
  const double shift = 1.0 / (m->gamma * h);
  if (!tr_stiff_matrix(s, shift)) return NAN;
  for (int st = 0; st < m->stages; ++st)
    if (!tr_stiff_stage(s, m, st, h)) return NAN;
  tr_stages_sum(n / TR_LANES, m->stages, m->b, (tr_vec *)y, (tr_vec *)K, (tr_vec *)ynew);
  if (s->set.hfixed > 0.0) return 0.0;
  tr_note_strays(s, K + m->stages * n, 1.0);
  return sqrt(tr_norm2(s, K + m->stages * n, y, ynew));
}

/* Dense rows in the form of tr_dense_eval: (1−θ) y + θ (y₁ + (1−θ)(K₁ + θ (K₂ + θ K₃))) = y + θ (Δ + (1−θ)(K₁ + θ (K₂ + …))). */
static int tr_dense_rosenbrock(tr_sim *s, const tr_rosenbrock *m) {
  const int nv = tr_width(s) / TR_LANES;
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
    R[3 * nv + i] = -d[2]; /* θ (K₂ + θ K₃) = θ (K₂ + K₃ − (1−θ) K₃): the nested form alternates θ and 1−θ */
  }
  return 1;
}

#include "works.c"

/* Whether the dense output of the step just made is at hand: it is made when it is first asked for. */
static int tr_have_dense(tr_sim *s) {
  if (s->step.have_dense) return 1;
  const tr_method *m = tr_method_of(s);
  s->step.have_dense = m->kind == TR_IMPLICIT ? tr_dense_rosenbrock(s, m->rosenbrock) : tr_dense_explicit(s, m->explicit);
  if (m->kind == TR_IMPLICIT && s->naudit) tr_works_dense(s);
  return s->step.have_dense;
}

/* |λ|max h of the Jacobian by a few power iterations in the tolerance metric. */
static double tr_spectral(tr_sim *s, double h) {
  int ny = s->ny, ld = tr_jacobian_rows(s);
  const double *J = TR_A(s, jac), *unit = TR_A(s, scale);
  double v[ny], u[ny], size = 0.0; /* v begins with parts of all directions */
  for (int i = 0; i < ny; ++i) v[i] = unit[i] * (1.0 + 0.37 * (i % 3));
  for (int it = 0; it < POWER_STEPS; ++it) {
    memset(u, 0, sizeof u);
    for (int q = 0; q < ny; ++q)
      for (int i = 0; i < ny; ++i) u[i] += J[i + (size_t)q * ld] * v[q];
    double a = 0.0, b = 0.0;
    for (int i = 0; i < ny; ++i) a += u[i] * u[i] / (unit[i] * unit[i]), b += v[i] * v[i] / (unit[i] * unit[i]);
    if (!(b > 0.0) || !(a > 0.0)) return 0.0;
    size = sqrt(a / b);
    double inv = 1.0 / sqrt(a);
    for (int i = 0; i < ny; ++i) v[i] = u[i] * inv;
  }
  return size * h;
}

/* Automatic method, a step that ended at the kink of a law: where hardly a step gets by without one, an explicit method is thrown from
 * branch to branch by a velocity that creeps just below the kink. */
static void tr_kink_passed(tr_sim *s) {
  if (++s->step.kink_count < KINKS_MAX || s->step.method == TR_AUTO_STIFF) return;
  s->step.method = TR_AUTO_STIFF;
  s->step.kink_count = s->step.stiff_count = s->step.have_jac = 0;
}

/* Automatic method: leave the explicit one when stability, not accuracy, has limited it for a while; come back when the stiff one's
 * steps would be stable explicitly. */
static void tr_choose(tr_sim *s) {
  if (s->step.kink_count > 0) s->step.kink_count--;
  if (tr_method_of(s)->kind == TR_IMPLICIT) {
    int calm = tr_spectral(s, s->pending.h) < CALM;
    s->step.stiff_count = calm ? s->step.stiff_count + 1 : 0;
    if (s->step.stiff_count >= CALM_STEPS) {
      s->step.method = tr_first_choice(s);
      s->step.stiff_count = 0, s->step.nonstiff_count = 0;
    }
    return;
  }
  const tr_explicit *m = tr_method_of(s)->explicit;
  int stiff = tr_stiffness(s, m, s->pending.h) > m->stiff_at;
  if (stiff) {
    s->step.nonstiff_count = 0;
    if (++s->step.stiff_count >= STIFF_STEPS) {
      s->step.method = TR_AUTO_STIFF;
      s->step.stiff_count = 0, s->step.have_jac = 0;
    }
  } else if (++s->step.nonstiff_count >= FORGIVEN_STEPS) {
    s->step.stiff_count = 0;
  }
}
