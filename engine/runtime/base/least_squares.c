/* Least squares for reactions that redundant loops leave open: minimise |κ + N x|. N (m×r) contains the scaled reactions of the
 * open directions.
 *
 * The columns are normalised before the Gram matrix is factorised, so that units have no effect. The Gram matrix squares the
 * condition number; two iterative refinements restore the lost digits. Each direction involves few joints, so most entries of a
 * column are zero. The code skips the zeros at the start and at the end of each column. The coefficients of dependent directions
 * are zero. */
#include "base/base.h"

/* a unit direction with a smaller squared remainder is dependent; sums of about 1000 products are accurate to 1e-14 */
#define DEPENDENT 1e-12
#define CORRECTIONS 2 /* number of iterative refinements */

/* Number of doubles of work space: Gram matrix, scales, right-hand side, pivot order and spans (ints). */
static int tr_least_squares_doubles(int r) { return r * (r + 4); }

static tr_least_squares tr_least_squares_factor(int m, int r, const double *N, double *work) {
  tr_least_squares q = {m, r, 0, N, work, work + r * r, work + r * (r + 1), (int *)(work + r * (r + 2)), 0, 0};
  q.lo = q.perm + r, q.hi = q.lo + r;
  for (int j = 0; j < r; ++j) {
    const double *n = N + (size_t)m * j;
    int lo = 0, hi = m;
    while (lo < hi && n[lo] == 0.0) ++lo;
    while (hi > lo && n[hi - 1] == 0.0) --hi;
    q.lo[j] = lo, q.hi[j] = hi;
    double len = tr_dot(n + lo, n + lo, hi - lo);
    q.d[j] = len > 0.0 ? 1.0 / sqrt(len) : 0.0;
    for (int i = 0; i <= j; ++i) {
      int a = lo > q.lo[i] ? lo : q.lo[i], b = hi < q.hi[i] ? hi : q.hi[i];
      q.L[i + j * r] = q.L[j + i * r] = a < b ? tr_dot(n + a, N + (size_t)m * i + a, b - a) : 0.0;
    }
  }
  q.rank = tr_cholesky(r, q.L, q.d, q.L, q.perm, 0, DEPENDENT, DEPENDENT);
  return q;
}

static void tr_least_squares_solve(const tr_least_squares *q, double *kappa, const double *more, double *x) {
  int m = q->m, r = q->r;
  double dx[r];
  for (int j = 0; j < r; ++j) x[j] = 0.0;
  for (int pass = 0; pass <= CORRECTIONS; ++pass) {
    for (int j = 0; j < r; ++j) q->g[j] = -tr_dot(q->N + (size_t)m * j + q->lo[j], kappa + q->lo[j], q->hi[j] - q->lo[j]) - (more ? more[j] : 0.0);
    tr_cholesky_solve(r, q->rank, q->L, q->perm, q->d, q->g, dx);
    for (int j = 0; j < r; ++j) {
      const double *n = q->N + (size_t)m * j;
      x[j] += dx[j];
      if (dx[j] != 0.0)
        for (int i = q->lo[j]; i < q->hi[j]; ++i) kappa[i] += n[i] * dx[j];
    }
  }
}
