/* Small dense linear algebra with column-major matrices. The Cholesky factorisation is rank-revealing. */
#ifndef TR_LINALG_H
#define TR_LINALG_H
#include <math.h>
#include <string.h>
#include "base/compiler.h"
#include "base/tolerances.h"


/* Exchange row and column k with row and column m > k of a symmetric matrix (n×n), stored as its lower triangle. */
static inline void tr_exchange_symmetric(int n, int k, int m, double *L) {
  double *ck = L + (size_t)k * n, *cm = L + (size_t)m * n, t;
  for (int i = 0; i < k; ++i) t = L[k + (size_t)i * n], L[k + (size_t)i * n] = L[m + (size_t)i * n], L[m + (size_t)i * n] = t;
  t = ck[k], ck[k] = cm[m], cm[m] = t;
  for (int i = k + 1; i < m; ++i) t = ck[i], ck[i] = L[m + (size_t)i * n], L[m + (size_t)i * n] = t;
  for (int i = m + 1; i < n; ++i) t = ck[i], ck[i] = cm[i], cm[i] = t;
}

/* Pivoted Cholesky factor of d S d (n×n, S in full storage). The lower triangle of L receives the factor, and `perm` the pivot
 * order. The first `base` pivots must exceed `keep`; later pivots must exceed `grow`. Returns the rank: the number of pivots before
 * the first pivot that is too small. */
static int tr_cholesky(int n, const double *S, const double *d, double *L, int *perm, int base, double keep, double grow) {
  for (int j = 0; j < n; ++j) {
    const double *from = S + (size_t)j * n, dj = d[j];
    double *column = L + (size_t)j * n;
    perm[j] = j;
    for (int i = j; i < n; ++i) column[i] = d[i] * dj * from[i];
  }
  for (int k = 0; k < n; ++k) {
    double *column = L + (size_t)k * n, pivot = column[k];
    int m = k;
    for (int i = k + 1; i < n; ++i)
      if (L[i + (size_t)i * n] > pivot) pivot = L[i + (size_t)i * n], m = i;
    if (!(pivot > (k < base ? keep : grow))) return k;
    if (m != k) {
      int t = perm[k];
      perm[k] = perm[m];
      perm[m] = t;
      tr_exchange_symmetric(n, k, m, L);
    }
    double root = sqrt(pivot), inv = 1.0 / root;
    column[k] = root;
    for (int i = k + 1; i < n; ++i) column[i] *= inv;
    for (int j = k + 1; j < n; ++j) {
      const double a = column[j];
      double *other = L + (size_t)j * n;
      for (int i = j; i < n; ++i) other[i] -= column[i] * a;
    }
  }
  return n;
}

/* Solve S x = b on the first `rank` pivots: x = d L⁻ᵀ L⁻¹ d b. The other unknowns are zero. */
static void tr_cholesky_solve(int n, int rank, const double *L, const int *perm, const double *d, const double *b, double *x) {
  double y[rank > 0 ? rank : 1];
  for (int i = 0; i < rank; ++i) {
    const double *row = L + i;
    double a = d[perm[i]] * b[perm[i]];
    for (int k = 0; k < i; ++k, row += n) a -= *row * y[k];
    y[i] = a / *row;
  }
  for (int i = 0; i < n; ++i) x[i] = 0.0;
  for (int i = rank - 1; i >= 0; --i) {
    const double *column = L + (size_t)i * n;
    double a = y[i];
    for (int k = i + 1; k < rank; ++k) a -= column[k] * y[k];
    y[i] = a / column[i];
    x[perm[i]] = d[perm[i]] * y[i];
  }
}

/* Replace A by its LU factors with partial pivoting. Returns 0 if A is singular to working precision. */
TR_SIZED int tr_lu_sized(const int n, double *A, int *perm) {
  TR_UNROLL
  for (int k = 0; k < n; ++k) {
    int m = k;
    TR_UNROLL
    for (int i = k + 1; i < n; ++i)
      if (fabs(A[i + k * n]) > fabs(A[m + k * n])) m = i;
    perm[k] = m;
    double pivot = A[m + k * n];
    if (!(fabs(pivot) > NO_PIVOT)) return 0;
    if (m != k)
      TR_UNROLL
      for (int j = 0; j < n; ++j) {
        double a = A[k + j * n];
        A[k + j * n] = A[m + j * n];
        A[m + j * n] = a;
      }
    double inv = 1.0 / pivot;
    TR_UNROLL
    for (int i = k + 1; i < n; ++i) A[i + k * n] *= inv;
    TR_UNROLL
    for (int j = k + 1; j < n; ++j) {
      double a = A[k + j * n];
      if (a != 0.0)
        TR_UNROLL
        for (int i = k + 1; i < n; ++i) A[i + j * n] -= A[i + k * n] * a;
    }
  }
  return 1;
}

/* number of columns that are eliminated from another column in one pass; this reduces memory access to a quarter */
#define TR_LU_WIDE 4
#define TR_LU_LARGE 16 /* smallest matrix size at which elimination by four columns is faster */

/* Factorise the columns k ≤ c < end of A, from which all earlier columns are already eliminated. Exchanges rows only within these
 * columns. */
static inline int tr_lu_panel(int n, int k, int end, double *A, int *perm) {
  for (int c = k; c < end; ++c) {
    double *column = A + (size_t)c * n;
    int m = c;
    for (int i = c + 1; i < n; ++i)
      if (fabs(column[i]) > fabs(column[m])) m = i;
    perm[c] = m;
    if (!(fabs(column[m]) > NO_PIVOT)) return 0;
    for (int j = k; j < end && m != c; ++j) {
      double *other = A + (size_t)j * n, a = other[c];
      other[c] = other[m], other[m] = a;
    }
    const double inv = 1.0 / column[c];
    for (int i = c + 1; i < n; ++i) column[i] *= inv;
    for (int j = c + 1; j < end; ++j) {
      double *other = A + (size_t)j * n;
      const double a = other[c];
      for (int i = c + 1; i < n; ++i) other[i] = tr_multiply_subtract(other[i], column[i], a);
    }
  }
  return 1;
}

/* Eliminate the columns k to k + 3 from the column `to`, one after another. */
static inline void tr_lu_subtract_panel(int n, int k, const double *A, double *to) {
  const double *L0 = A + (size_t)k * n, *L1 = L0 + n, *L2 = L1 + n, *L3 = L2 + n, a = to[k], b = to[k + 1] = tr_multiply_subtract(to[k + 1], L0[k + 1], a);
  const double c = to[k + 2] = tr_multiply_subtract(tr_multiply_subtract(to[k + 2], L0[k + 2], a), L1[k + 2], b);
  const double d = to[k + 3] = tr_multiply_subtract(tr_multiply_subtract(tr_multiply_subtract(to[k + 3], L0[k + 3], a), L1[k + 3], b), L2[k + 3], c);
  int i = k + TR_LU_WIDE;
  for (; i + TR_LANES <= n; i += TR_LANES) {
    tr_vec sum = *(tr_vec *)(to + i);
    sum -= *(const tr_vec *)(L0 + i) * a;
    sum -= *(const tr_vec *)(L1 + i) * b;
    sum -= *(const tr_vec *)(L2 + i) * c;
    *(tr_vec *)(to + i) = sum - *(const tr_vec *)(L3 + i) * d;
  }
  for (; i < n; ++i) to[i] = tr_multiply_subtract(tr_multiply_subtract(tr_multiply_subtract(tr_multiply_subtract(to[i], L0[i], a), L1[i], b), L2[i], c), L3[i], d);
}

/* Like tr_lu_sized, for large matrices: eliminates four columns at a time. */
static int tr_lu_large(int n, double *A, int *perm) {
  for (int k = 0; k < n; k += TR_LU_WIDE) {
    const int end = k + TR_LU_WIDE < n ? k + TR_LU_WIDE : n;
    if (!tr_lu_panel(n, k, end, A, perm)) return 0;
    for (int j = 0; j < n; ++j) {
      double *to = A + (size_t)j * n;
      if (j >= k && j < end) continue;
      for (int c = k; c < end; ++c) {
        const double a = to[c];
        to[c] = to[perm[c]], to[perm[c]] = a;
      }
      if (j >= end) tr_lu_subtract_panel(n, k, A, to);
    }
  }
  return 1;
}

/* Like tr_lu_sized. The matrix sizes of small mechanisms are compiled separately. */
static int tr_lu(int n, double *A, int *perm) {
  switch (n) {
    case 2: return tr_lu_sized(2, A, perm);
    case 3: return tr_lu_sized(3, A, perm);
    case 4: return tr_lu_sized(4, A, perm);
    case 6: return tr_lu_sized(6, A, perm);
    case 8: return tr_lu_sized(8, A, perm);
    default: return n < TR_LU_LARGE ? tr_lu_sized(n, A, perm) : tr_lu_large(n, A, perm);
  }
}

/* b ← A⁻¹ b for three unknowns, by Cramer's rule with one division. Returns 0 if A is singular to working precision. */
static inline int tr_solve_three(const double *A, double *b) {
  const double *x = A, *y = A + 3, *z = A + 6, r[3] = {b[0], b[1], b[2]};
  const double yz[3] = {y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]};
  const double rx[3] = {r[1] * x[2] - r[2] * x[1], r[2] * x[0] - r[0] * x[2], r[0] * x[1] - r[1] * x[0]};
  const double det = x[0] * yz[0] + x[1] * yz[1] + x[2] * yz[2];
  if (!(fabs(det) > NO_PIVOT)) return 0;
  const double inv = 1.0 / det;
  b[0] = (r[0] * yz[0] + r[1] * yz[1] + r[2] * yz[2]) * inv;
  b[1] = -(z[0] * rx[0] + z[1] * rx[1] + z[2] * rx[2]) * inv;
  b[2] = (y[0] * rx[0] + y[1] * rx[1] + y[2] * rx[2]) * inv;
  return 1;
}

/* Sign (±1) of the determinant, from the factors A and the exchanges perm of tr_lu. */
static int tr_lu_determinant_sign(int n, const double *A, const int *perm) {
  int sense = 1;
  for (int i = 0; i < n; ++i) sense *= (A[i + i * n] < 0.0) != (perm[i] != i) ? -1 : 1;
  return sense;
}

/* b ← A⁻¹ b with the factors A and the exchanges perm of tr_lu. */
TR_SIZED void tr_lu_solve_sized(const int n, const double *A, const int *perm, double *b) {
  TR_UNROLL
  for (int k = 0; k < n; ++k) { /* tr_lu exchanges whole rows, so all exchanges precede the substitution */
    double a = b[perm[k]];
    b[perm[k]] = b[k];
    b[k] = a;
  }
  TR_UNROLL
  for (int k = 0; k < n; ++k) {
    const double *column = A + (size_t)k * n, a = b[k];
    TR_UNROLL
    for (int i = k + 1; i < n; ++i) b[i] -= column[i] * a;
  }
  TR_UNROLL
  for (int k = n - 1; k >= 0; --k) {
    const double *column = A + (size_t)k * n, a = b[k] /= column[k];
    TR_UNROLL
    for (int i = 0; i < k; ++i) b[i] -= column[i] * a;
  }
}

/* Like tr_lu_solve_sized. The matrix sizes of small mechanisms are compiled separately. */
static void tr_lu_solve(int n, const double *A, const int *perm, double *b) {
  switch (n) {
    case 2: tr_lu_solve_sized(2, A, perm, b); break;
    case 3: tr_lu_solve_sized(3, A, perm, b); break;
    case 4: tr_lu_solve_sized(4, A, perm, b); break;
    case 6: tr_lu_solve_sized(6, A, perm, b); break;
    case 8: tr_lu_solve_sized(8, A, perm, b); break;
    default: tr_lu_solve_sized(n, A, perm, b);
  }
}
#endif
