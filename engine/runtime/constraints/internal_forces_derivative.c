/* Derivatives of the choice of the open reactions (tr_choose_reactions), for friction that depends on this choice.
 *
 * The choice of λ satisfies Vᵀ κlᵀ κ = 0, where S V = 0 and κ = κ0 + κl λ + κe η are the scaled reactions. Let w = κ be the
 * residual of the least squares, with κlᵀ w = S p. For a change of state d, it follows that Vᵀ κlᵀ dκ + cᵈ = 0. The vector cᵈ_q =
 * wᵀ (dκl) V_q − pᵀ (dS) V_q accounts for the change of V with the state. The rows of the Jacobian unit contain derivatives of κ
 * and of S λ, and are affine in λ. Both products are therefore differences: the rows at λ + V_q minus the rows at λ. In loops whose
 * joints have friction, w contains the spring loads with friction (``internal_forces.c``), and δ changes with the state, too. */
#include "constraints/constraints.h"

static void tr_jacobian_columns(tr_sim *s, const double *y, const double *z, int cols, double *J) {
  const tr_jacobian *j = s->j;
  const double *x = TR_A(s, x), *c = TR_A(s, cj);
  int n = s->ny + 1 + s->k->active + s->k->neta, ld = tr_jacobian_rows(s);
  if (j->eval) {
    j->eval(x, y, c, z, TR_A(s, jp), J);
    return;
  }
  double *w = TR_A(s, jp), seed[n];
  j->point(x, y, c, z, w);
  memset(seed, 0, sizeof seed);
  for (int i = 0; i < cols; ++i) {
    seed[i] = 1.0;
    j->along(x, y, c, z, w, seed, J + (size_t)i * ld);
    seed[i] = 0.0;
  }
}

static tr_reaction_choice tr_linearise_choice(tr_sim *s, const double *y, const double *J) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, m = k->nkappa, r = tr_dependent_rows(s), cols = s->ny + 1, ld = tr_jacobian_rows(s);
  int top = s->ny;
  tr_reaction_choice q;
  memset(&q, 0, sizeof q);
  if (m == 0 || r <= 0) return q;
  const double *z = TR_A(s, z), *k0 = map_kappa(k, TR_A(s, maps)), *kl = k0 + m, *ke = kl + m * a;
  double *N = TR_A(s, open_lambda) + a * a, *other = TR_A(s, choice_jac), w[m], p[a], b[a], moved[a + e], size = 1.0;
  q.r = r, q.V = TR_A(s, open_lambda), q.turn = other + (size_t)ld * (cols + a + e);
  tr_null_space(s, q.V);
  memset(N, 0, sizeof(double) * m * r);
  for (int i = 0; i < r; ++i) tr_add_columns(m, a, kl, q.V + i * a, 1.0, N + i * m);
  q.least = tr_least_squares_factor(m, r, N, TR_A(s, gram));
  memcpy(w, k0, sizeof w);
  tr_add_columns(m, a, kl, z, 1.0, w);
  tr_add_columns(m, e, ke, z + a, 1.0, w);
  for (int i = 0; i < k->nelements && k->nmore; ++i)
    for (int j = 0; j < k->element[i].nmore; ++j) w[k->element[i].kappa0 + j] += TR_A(s, more)[k->element[i].more0 + j];
  for (int i = 0; i < a; ++i) b[i] = tr_dot(kl + i * m, w, m), size = fmax(size, fabs(z[i]));
  tr_solve_loops(s, b, p);
  for (int i = 0; i < r; ++i) {
    memcpy(moved, z, sizeof moved);
    tr_add_columns(a, 1, q.V + i * a, &size, 1.0, moved);
    tr_jacobian_columns(s, y, moved, cols, other);
    for (int j = 0; j < cols; ++j) {
      const double *now = J + (size_t)j * ld + top, *then = other + (size_t)j * ld + top;
      double c = 0.0;
      for (int row = 0; row < m; ++row) c += w[row] * (then[a + e + row] - now[a + e + row]);
      for (int row = 0; row < a; ++row) c -= p[row] * (then[row] - now[row]);
      q.turn[i + j * r] = c / size;
    }
  }
  return q;
}

/* Like tr_follow_choice, for loops whose joints have friction. kap, more: derivatives of κ and of δ along the column. */
static void tr_follow_internal_forces(tr_sim *s, const tr_reaction_choice *q, int j, double *kap, const double *more, double *lam) {
  const tr_kernel *k = s->k;
  int m = k->nkappa, n = k->nn, r = tr_open_count(s), a = k->active;
  double f[r], shift[n];
  memset(shift, 0, sizeof shift), memset(f, 0, sizeof f);
  tr_add_columns(n, a, map_Nl(k, TR_A(s, maps)), lam, 1.0, shift);
  tr_add_columns(r, n, TR_A(s, openB), shift, 1.0, f);
  for (int i = 0; i < k->nelements; ++i)
    for (int row = 0; row < k->element[i].nmore; ++row) kap[k->element[i].kappa0 + row] += more[k->element[i].more0 + row];
  for (int p = 0; p < r; ++p) {
    int from = q->least.perm[p];
    f[p] += tr_dot(TR_A(s, openQ) + (size_t)p * m, kap, m) + q->least.d[from] * q->turn[from + j * q->r];
    f[p] = -f[p];
  }
  tr_lu_solve(r, TR_A(s, openF), (const int *)TR_A(s, openP), f);
  tr_add_columns(a, r, TR_A(s, openV), f, 1.0, lam);
}

static void tr_follow_choice(tr_sim *s, const tr_reaction_choice *q, int j, const double *K, double *lam) {
  const tr_kernel *k = s->k;
  int m = k->nkappa;
  double kap[m], x[q->r];
  memcpy(kap, K, sizeof kap);
  tr_add_columns(m, k->active, map_kappa(k, TR_A(s, maps)) + m, lam, 1.0, kap);
  if (tr_open_count(s)) {
    tr_follow_internal_forces(s, q, j, kap, K + m, lam);
    return;
  }
  tr_least_squares_solve(&q->least, kap, q->turn + j * q->r, x);
  tr_add_columns(k->active, q->r, q->V, x, 1.0, lam);
}
