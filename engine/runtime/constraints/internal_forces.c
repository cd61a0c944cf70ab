/* Internal forces: open reactions of redundant loops whose joints have friction (theory, "Redundant loops"). The internal forces
 * are the limit of those of elastic contacts with growing stiffness.
 *
 * Rigid parts require that the deformations of the contacts along their normals are compatible: Qᵀ(κ + Q y + δ(N)) = 0. The
 * unknowns y are the amounts of the open directions V. Column j of Q contains the loads of the contact springs that a unit of open
 * direction j causes. κ are the loads of the springs without open reactions; κ is affine in η, because friction acts as an applied
 * force. ``loop_solve.c`` has already made Qᵀκ = 0, the condition of least elastic energy.
 *
 * Friction turns the forces away from the normals; δ is the change of the spring loads that results. δ uses the friction of the law
 * for a sliding pair, and the friction η for a pair at rest. Loads therefore do not jump when a pair begins to slip. Friction has
 * no potential, so y minimises an energy only without friction. Newton's method finds y from η. If δ is linear, one step
 * suffices. */
#include "constraints/constraints.h"

#define PRESS_MAX 40 /* largest number of iterations; if only balls make δ nonlinear, two or three suffice */
/* relative to the largest load that friction changes, or to the largest joint load: a smaller step is round-off */
#define PRESS_EXACT 1e-15
/* relative to the largest load: a smaller step is the last one, because the next step would be quadratically smaller, and so
 * round-off */
#define PRESS_LAST 1e-9
#define PRESS_NONE 1e-250 /* N: a smaller load has no significant digits */

/* Store the independent open directions V (a×r) and their loads Q (m×r), scaled so that each column of Q has the norm 1. */
static void tr_store_open_directions(tr_sim *s, const double *V, const double *Q, const tr_least_squares *least) {
  const tr_kernel *k = s->k;
  int a = k->active, m = k->nkappa, n = k->nn, kept = 0;
  double *Vo = TR_A(s, openV), *Qo = TR_A(s, openQ), *No = TR_A(s, openN);
  const double *Nl = map_Nl(k, TR_A(s, maps));
  for (int i = 0; i < least->rank; ++i) {
    int q = least->perm[i];
    double unit = least->d[q];
    for (int j = 0; j < a; ++j) Vo[j + kept * a] = unit * V[j + q * a];
    for (int j = 0; j < m; ++j) Qo[j + kept * m] = unit * Q[j + q * m];
    memset(No + kept * n, 0, sizeof(double) * n);
    tr_add_columns(n, a, Nl, Vo + kept * a, 1.0, No + kept * n);
    ++kept;
  }
  for (int q = 0; q < kept; ++q)
    for (int p = 0; p < kept; ++p) TR_A(s, openG)[q + p * kept] = tr_dot(Qo + (size_t)q * m, Qo + (size_t)p * m, m);
  if (kept != s->loops.open) memset(TR_A(s, open_amounts), 0, sizeof(double) * kept);
  s->loops.open = kept;
}

/* B (r×n) = Qᵀ ∂δ/∂N and C (r×e) = Qᵀ ∂δ/∂η, from the derivatives of δ in `dmore`. */
static void tr_internal_force_derivatives(tr_sim *s, int r, double *B, double *C) {
  const tr_kernel *k = s->k;
  const double *Qo = TR_A(s, openQ), *dmore = TR_A(s, dmore);
  memset(B, 0, sizeof(double) * r * k->nn), memset(C, 0, sizeof(double) * r * k->neta);
  for (int e = 0; e < k->nelements; ++e) {
    const tr_element *el = k->element + e;
    const double *D = dmore + el->dmore0;
    for (int i = 0; i < el->needs + el->neta; ++i, D += el->nmore) {
      double *out = i < el->needs ? B + (el->n0 + i) * r : C + (el->eta0 + i - el->needs) * r;
      for (int q = 0; q < r; ++q) out[q] += tr_dot(Qo + el->kappa0 + q * k->nkappa, D, el->nmore);
    }
  }
}

/* Residual f (r) = Qᵀ(Q y + δ(N, η)) at the loads NN. Returns the largest absolute component of δ. */
static double tr_internal_force_residual(tr_sim *s, int r, const double *eta, const double *y, double *f) {
  const tr_kernel *k = s->k;
  int m = k->nkappa;
  const double *Qo = TR_A(s, openQ), *more = TR_A(s, more);
  double load[m], size = 0.0;
  k->pressed(TR_A(s, NN), map_rates(k, TR_A(s, maps)), eta, TR_A(s, x), TR_A(s, c) + k->c_pressed, TR_A(s, more), TR_A(s, dmore));
  memset(load, 0, sizeof load);
  for (int e = 0; e < k->nelements; ++e)
    for (int i = 0; i < k->element[e].nmore; ++i) load[k->element[e].kappa0 + i] = more[k->element[e].more0 + i];
  for (int i = 0; i < m; ++i) size = fmax(size, fabs(load[i]));
  tr_add_columns(m, r, Qo, y, 1.0, load);
  for (int q = 0; q < r; ++q) f[q] = tr_dot(Qo + (size_t)q * m, load, m);
  return size;
}

/* Whether a step f of the amounts y changes the joint loads N only by round-off. If friction changes no spring load, δ is zero and
 * gives no scale of convergence; only this test then ends the iteration. */
static int tr_is_internal_step_settled(const tr_sim *s, int r, const double *f, const double *N) {
  const int n = s->k->nn;
  double change = 0.0, most = 0.0;
  for (int i = 0; i < n; ++i) {
    double sum = 0.0;
    for (int q = 0; q < r; ++q) sum += fabs(TR_A(s, openN)[i + q * n] * f[q]);
    change = fmax(change, sum), most = fmax(most, fabs(N[i]));
  }
  return change <= PRESS_EXACT * most;
}

static int tr_solve_internal_forces(tr_sim *s, const double *eta, double *N) {
  TR_NEED(s, TR_HAS_LOADS);
  const tr_kernel *k = s->k;
  int r = tr_open_count(s), n = k->nn, e = k->neta, *perm = (int *)TR_A(s, openP);
  const double *No = TR_A(s, openN), *G = TR_A(s, openG);
  double *y = TR_A(s, open_amounts), *F = TR_A(s, openF), *B = TR_A(s, openB), C[r * e], base[n], f[r], last = INFINITY;
  memcpy(base, N, sizeof base);
  for (int it = 0; it < PRESS_MAX; ++it) {
    double step = 0.0, size;
    memcpy(N, base, sizeof base);
    tr_add_columns(n, r, No, y, 1.0, N);
    size = tr_internal_force_residual(s, r, eta, y, f);
    tr_internal_force_derivatives(s, r, B, C);
    for (int q = 0; q < r; ++q)
      for (int p = 0; p < r; ++p) {
        double sum = G[q + p * r];
        for (int i = 0; i < n; ++i) sum += B[q + i * r] * No[i + p * n];
        F[q + p * r] = sum;
      }
    if (!tr_lu(r, F, perm)) break;
    tr_lu_solve(r, F, perm, f);
    if (!tr_is_finite(r, f)) break;
    for (int q = 0; q < r; ++q) y[q] -= f[q], step = fmax(step, fabs(f[q])), size = fmax(size, fabs(y[q]));
    if (step <= PRESS_EXACT * size || size < PRESS_NONE || (step <= PRESS_LAST * size && step < last) ||
        tr_is_internal_step_settled(s, r, f, N)) {
      memcpy(N, base, sizeof base);
      tr_add_columns(n, r, No, y, 1.0, N);
      memcpy(TR_A(s, openE), TR_A(s, Np) + n, sizeof(double) * n * e);
      for (int j = 0; j < e; ++j) {
        for (int q = 0; q < r; ++q) f[q] = -C[q + j * r];
        tr_add_columns(r, n, B, TR_A(s, Np) + n + j * n, -1.0, f);
        tr_lu_solve(r, F, perm, f);
        memcpy(TR_A(s, openY) + j * r, f, sizeof f);
        tr_add_columns(n, r, No, f, 1.0, TR_A(s, openE) + j * n);
      }
      return 1;
    }
    last = step;
  }
  memset(y, 0, sizeof(double) * r);
  for (int i = 0; i < n; ++i) N[i] = NAN;
  return 0;
}
