/* Sums and products of short arrays. */
#ifndef TR_VECTORS_H
#define TR_VECTORS_H
#include <math.h>
#include <string.h>
#include "base/compiler.h"

/* Copy n numbers between arrays of the block. Most copies are so short that a call of memcpy would take longer. */
static inline void tr_copy(int n, const double *from, double *to) {
  int i = 0;
  for (; i + TR_LANES <= n; i += TR_LANES) *(tr_vec *)(to + i) = *(const tr_vec *)(from + i);
  for (; i < n; ++i) to[i] = from[i];
}

/* Copy n numbers as whole vectors. May overwrite three doubles after the end of `to`; arrays of the block have room for these. */
static inline void tr_copy_vectors(int n, const double *from, double *to) {
  for (int i = 0; i < n; i += TR_LANES) *(tr_vec *)(to + i) = *(const tr_vec *)(from + i);
}

/* a · b, with four independent sums for speed. */
static double tr_dot(const double *a, const double *b, int n) {
  double sum[4] = {0.0, 0.0, 0.0, 0.0};
  int i = 0;
  for (; i + 4 <= n; i += 4)
    for (int k = 0; k < 4; ++k) sum[k] += a[i + k] * b[i + k];
  for (; i < n; ++i) sum[0] += a[i] * b[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* y (m) += sign · A x, where A is m×n. Skips the columns j with x[j] = 0. */
static void tr_add_columns(int m, int n, const double *A, const double *x, double sign, double *y) {
  for (int j = 0; j < n; ++j) {
    const double *col = A + (size_t)j * m;
    double f = sign * x[j];
    if (f != 0.0)
      for (int i = 0; i < m; ++i) y[i] += col[i] * f;
  }
}

/* The larger argument; NaN if an argument is NaN. (fmax would ignore a NaN.) */
static inline double tr_max_or_nan(double a, double b) { return b <= a || a != a ? a : b; }

/* Whether all n numbers are finite. */
static int tr_is_finite(int n, const double *a) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += 0.0 * a[i];
  return sum == 0.0;
}

/* y = b + A x, where A is m×n, four rows at a time. May overwrite three doubles after the end of y; arrays of the block have room
 * for these. */
static inline void tr_affine_map(int m, int n, const double *b, const double *A, const double *x, double *y) {
  for (int i = 0; i < m; i += TR_LANES) {
    tr_vec sum = *(const tr_vec *)(b + i);
    for (int j = 0; j < n; ++j) sum += *(const tr_vec *)(A + i + (size_t)j * m) * x[j];
    *(tr_vec *)(y + i) = sum;
  }
}

/* Largest absolute value of n numbers. */
static double tr_largest_size(int n, const double *v) {
  double most = 0.0;
  for (int i = 0; i < n; ++i) most = fmax(most, fabs(v[i]));
  return most;
}

/* Surface speed: the norm of n rates, each multiplied by its lever. */
static double tr_surface_speed(int n, const double *rate, const double *lever) {
  double sum = 0.0;
  for (int j = 0; j < n; ++j) sum += rate[j] * rate[j] * lever[j] * lever[j];
  return sqrt(sum);
}

/* Normalise v (n) to Euclidean norm 1; a zero vector stays zero. Returns the norm of the given v. */
static double tr_make_unit(int n, double *v) {
  double len = 0.0;
  for (int j = 0; j < n; ++j) len += v[j] * v[j];
  len = sqrt(len);
  for (int j = 0; j < n && len > 0.0; ++j) v[j] /= len;
  return len;
}

/* c = a × b. */
static void tr_cross(const double *a, const double *b, double *c) {
  c[0] = a[1] * b[2] - a[2] * b[1], c[1] = a[2] * b[0] - a[0] * b[2], c[2] = a[0] * b[1] - a[1] * b[0];
}
#endif
