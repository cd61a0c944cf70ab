/* S of many loops of which few share bodies: its factor where it is not zero by structure (METHOD, "Loops by structure"). The pivots come in
 * the order of structure, not of size. So only a factor counts whose every pivot is far above what may be taken for a row that depends on
 * others; else rank is decided as of few loops (``loops.c``). */
#include "linalg.h"
#include "tr.h"

#define CLEAR_PIVOT 1e-3 /* of a row's scale: a thousand times GROW_PIVOT, for pivots in another order are smaller */

/* The factor of S at the state whose maps are in place, in the lower triangle of S in that order; 0: left to the dense one. */
TR_APART int tr_factor_sparse(tr_sim *s) {
  const tr_kernel *k = s->k;
  const int n = k->active, *order = k->fill_order, *start = k->fill_start, *below = k->fill_below;
  const double *S = TR_A(s, maps), *d = TR_A(s, d);
  double *L = TR_A(s, S);
  for (int j = 0; j < n; ++j) {
    const double *from = S + (size_t)order[j] * n, dj = d[order[j]];
    double *column = L + (size_t)j * n;
    column[j] = dj * dj * from[order[j]];
    for (int p = start[j]; p < start[j + 1]; ++p) column[below[p]] = d[order[below[p]]] * dj * from[order[below[p]]];
  }
  for (int j = 0; j < n; ++j) {
    double *column = L + (size_t)j * n;
    if (!(column[j] > CLEAR_PIVOT)) return 0;
    const double root = sqrt(column[j]), inv = 1.0 / root;
    const int *first = below + start[j], *end = below + start[j + 1];
    column[j] = inv; /* by which solutions are multiplied */
    for (const int *i = first; i < end; ++i) column[*i] *= inv;
    for (const int *c = first; c < end; ++c) {
      const double a = column[*c];
      double *other = L + (size_t)*c * n;
      for (const int *i = c; i < end; ++i) other[*i] -= column[*i] * a;
    }
  }
  memcpy(TR_A(s, perm), order, sizeof(int) * n);
  return 1;
}

/* x ← S⁻¹ b with that factor. */
TR_APART void tr_solve_sparse(const tr_sim *s, const double *b, double *x) {
  const tr_kernel *k = s->k;
  const int n = k->active, *order = k->fill_order, *start = k->fill_start, *below = k->fill_below;
  const double *L = TR_A(s, S), *d = TR_A(s, d);
  double y[n];
  for (int j = 0; j < n; ++j) y[j] = d[order[j]] * b[order[j]];
  for (int j = 0; j < n; ++j) {
    const double *column = L + (size_t)j * n, a = y[j] *= column[j];
    for (int p = start[j]; p < start[j + 1]; ++p) y[below[p]] -= column[below[p]] * a;
  }
  for (int j = n - 1; j >= 0; --j) {
    const double *column = L + (size_t)j * n;
    double a = y[j];
    for (int p = start[j]; p < start[j + 1]; ++p) a -= column[below[p]] * y[below[p]];
    y[j] = a * column[j];
    x[order[j]] = d[order[j]] * y[j];
  }
}
