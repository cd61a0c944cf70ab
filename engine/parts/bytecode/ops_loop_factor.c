/* Builtin ops for many loops with friction (theory, "Friction along the recursion"). One op eliminates the friction of a cut joint
 * from the equations of its loop. Two other ops factorise and solve the unsymmetric equations of all loops by sparse LU. */
#include <math.h>

#include "interpreter.h"

void tr_op_transposed_product(double *const *a, const int *how) {
  for (int j = 0; j < how[2]; ++j)
    for (int i = 0; i < how[1]; ++i) {
      double *out = a[2] + i + (size_t)j * how[5];
      *out = (how[6] ? 0.0 : *out) + dot(how[0], a[0] + (size_t)i * how[3], a[1] + (size_t)j * how[4]);
    }
}

/* B (n×m) ← A⁻¹ B by elimination with row exchange, n ≤ 3. Overwrites A. Returns the determinant of A. */
static double eliminate(int n, int m, double *A, double *B) {
  double det = 1.0;
  for (int k = 0; k < n; ++k) {
    int p = k;
    for (int i = k + 1; i < n; ++i)
      if (fabs(A[i + k * n]) > fabs(A[p + k * n])) p = i;
    if (p != k) det = -det;
    for (int j = 0; j < n + m && p != k; ++j) {
      double *column = j < n ? A + j * n : B + (j - n) * n, t = column[k];
      column[k] = column[p], column[p] = t;
    }
    const double pivot = A[k + k * n];
    det *= pivot;
    for (int j = 0; j < n + m; ++j) {
      double *column = j < n ? A + j * n : B + (j - n) * n;
      if (j < n && j <= k) continue;
      column[k] /= pivot;
      for (int i = 0; i < n; ++i)
        if (i != k) column[i] -= A[i + k * n] * column[k];
    }
  }
  return det;
}

/* Eliminate the friction of a cut joint. The linearised law is η = e + D f, and the reactions are f = p0 + P λ − Pw η. Together: (E
 * + D Pw) η = e + D p0 + D P λ. */
void tr_op_cut_joint_friction(double *const *a, const int *how) {
  const int nv = how[0], needs = how[1], rows = how[2];
  double A[9], B[3 * (3 + 6 + 1)];
  for (int j = 0; j < nv + rows + 1; ++j) {
    const double *f = j < nv ? a[1] + j * needs : j < nv + rows ? a[2] + (j - nv) * needs : a[3];
    for (int i = 0; i < nv; ++i) {
      double sum = 0.0;
      for (int q = 0; q < needs; ++q) sum += a[0][i + q * nv] * f[q];
      if (j < nv) A[i + j * nv] = (i == j) + sum, B[i + j * nv] = i == j;
      else B[i + j * nv] = -sum;
    }
  }
  *a[7] = eliminate(nv, nv + rows + 1, A, B);
  memcpy(a[4], B, sizeof(double) * nv * nv);
  memcpy(a[5], B + nv * nv, sizeof(double) * nv * rows);
  memcpy(a[6], B + nv * (nv + rows), sizeof(double) * nv);
}

/* Factorise S = L U in the order of elimination, column by column. L holds the inverse pivots of all columns, then the entries
 * below the pivots. U holds the entries to the right of the pivots. Only structural nonzeros are stored. a[3] receives the pivots
 * and the diagonal of S, indexed by row of S. */
void tr_op_factor_loops(double *const *a, const int *how) {
  const int n = how[0], *order = how + 1, *start = order + n, *below = start + n + 1, count = start[n];
  const int *own = below + count, *lower = own + n, *upper = lower + count, *meets = upper + count, *with = meets + n + 1, *at = with + count;
  const double *S = a[0];
  double *L = a[1], *U = a[2], l[n + 1], u[n + 1];
  for (int c = 0; c < n; ++c) {
    double pivot = a[3][n + order[c]] = S[own[c]];
    for (int p = start[c]; p < start[c + 1]; ++p) {
      l[below[p]] = lower[p] >= 0 ? S[lower[p]] : 0.0;
      u[below[p]] = upper[p] >= 0 ? S[upper[p]] : 0.0;
    }
    for (int m = meets[c]; m < meets[c + 1]; ++m) { /* earlier columns with an entry in row c */
      const int first = at[m] + 1, size = start[with[m] + 1] - first, *row = below + first;
      const double *lj = L + n + first, *uj = U + first, lc = lj[-1], uc = uj[-1];
      pivot -= lc * uc;
      if (size && row[size - 1] - row[0] == size - 1) { /* the rows are contiguous */
        double *to = l + row[0], *right = u + row[0];
        for (int i = 0; i < size; ++i) to[i] -= lj[i] * uc, right[i] -= uj[i] * lc;
      } else
        for (int i = 0; i < size; ++i) l[row[i]] -= lj[i] * uc, u[row[i]] -= uj[i] * lc;
    }
    const double inv = L[c] = 1.0 / pivot;
    a[3][order[c]] = pivot;
    for (int p = start[c]; p < start[c + 1]; ++p) L[n + p] = l[below[p]] * inv, U[p] = u[below[p]];
  }
}

void tr_op_solve_loops(double *const *a, const int *how) {
  const int n = how[0], *order = how + 1, *start = order + n, *below = start + n + 1;
  const double *inverse = a[0], *L = inverse + n, *U = a[1];
  double y[n + 1];
  for (int j = 0; j < n; ++j) y[j] = -a[2][order[j]];
  for (int j = 0; j < n; ++j) {
    const double f = y[j];
    for (int p = start[j]; p < start[j + 1]; ++p) y[below[p]] -= L[p] * f;
  }
  for (int j = n - 1; j >= 0; --j) {
    double f = y[j];
    for (int p = start[j]; p < start[j + 1]; ++p) f -= U[p] * y[below[p]];
    a[3][order[j]] = y[j] = f * inverse[j];
  }
}
