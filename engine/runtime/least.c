/* Least squares over the reactions that redundant loops leave open: x with |κ + N x| smallest, N (m×r) the scaled reactions of the
 * open directions.
 *
 * Through the Gram matrix of the columns brought to unit length (so that neither units nor the size of a direction matter), with two
 * passes of correction on the residual itself, which give back the digits that squaring the condition costs. A direction belongs to
 * a few joints only: the rows outside the span of a column are skipped. Directions that depend on others get no share. */
#include "linalg.h"
#include "tr.h"

#define DEPENDENT 1e-12 /* what is left of a unit direction, squared; sums of m ≈ 1e3 products are good to 1e-14 */
#define CORRECTIONS 2
#define VANISHED 1e-20 /* of a direction's length, squared: what orthogonalising leaves of one that depends on others */

/* Doubles of work space: Gram matrix, scales, one right-hand side, order and spans (ints). */
static int tr_least_size(int r) { return r * (r + 4); }

typedef struct tr_least {
  int m, r, rank;
  const double *N;
  double *L, *d, *g;
  int *perm, *lo, *hi;
} tr_least;

/* a · b, in four sums that do not wait for each other. */
static double tr_dot(const double *a, const double *b, int n) {
  double sum[4] = {0.0, 0.0, 0.0, 0.0};
  int i = 0;
  for (; i + 4 <= n; i += 4)
    for (int k = 0; k < 4; ++k) sum[k] += a[i + k] * b[i + k];
  for (; i < n; ++i) sum[0] += a[i] * b[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* Factorise for the directions N (m×r); work: tr_least_size(r). */
static tr_least tr_least_of(int m, int r, const double *N, double *work) {
  tr_least q = {m, r, 0, N, work, work + r * r, work + r * (r + 1), (int *)(work + r * (r + 2)), 0, 0};
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

/* x ← the best amounts; kappa becomes the residual κ + N x. `more` (r, or 0): Nᵀ(κ + N x) + more = 0 instead. */
static void tr_least_solve(const tr_least *q, double *kappa, const double *more, double *x) {
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

/* Orthonormalise the directions N (m×r) by Gram and Schmidt, twice; dependent ones become zero. */
static void tr_orthonormal(int m, int r, double *N) {
  for (int q = 0; q < r; ++q) {
    double *n = N + (size_t)m * q, was = tr_dot(n, n, m);
    for (int pass = 0; pass < 2; ++pass)
      for (int p = 0; p < q; ++p) {
        const double *np = N + (size_t)m * p;
        double dot = tr_dot(n, np, m);
        for (int i = 0; i < m; ++i) n[i] -= dot * np[i];
      }
    double len = tr_dot(n, n, m), inv = len > VANISHED * was && len > 0.0 ? 1.0 / sqrt(len) : 0.0;
    for (int i = 0; i < m; ++i) n[i] *= inv;
  }
}
