/* Laws of friction at given frictions, and the derivative of their equations. */
#include "modes.h"

static void tr_form_all(tr_sim *s);

/* y = b + A x, A m×n, four rows at a time: up to three numbers behind y are overwritten, which arrays of the block have room for. */
static inline void tr_affine(int m, int n, const double *b, const double *A, const double *x, double *y) {
  for (int i = 0; i < m; i += TR_LANES) {
    tr_vec sum = *(const tr_vec *)(b + i);
    for (int j = 0; j < n; ++j) sum += *(const tr_vec *)(A + i + (size_t)j * m) * x[j];
    *(tr_vec *)(y + i) = sum;
  }
}

/* N at these frictions, without what is open. */
static inline void tr_loads_now(tr_sim *s, const double *eta) {
  const double *N0 = TR_A(s, Np);
  tr_affine(s->k->nn, s->k->neta, N0, N0 + s->k->nn, eta, TR_A(s, NN));
}

/* The law at these frictions: N, law(N), its derivative and the sliding speeds, with λ eliminated (after tr_eliminate). */
static void tr_law(tr_sim *s, const double *eta) {
  const tr_kernel *k = s->k;
  tr_form_all(s);
  double *N = TR_A(s, NN);
  tr_loads_now(s, eta);
  if (tr_open_count(s)) tr_press(s, N);
  k->laws(N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
}

/* `count` rows (at most 3) of an element, of ne multipliers and so many needs, from its first-th of e multipliers on, in J = E − D Ne'. */
TR_SIZED void tr_rows_of(int e, int n, int ne, const int needs, const int count, int first, const double *D, const double *Ne, double *J) {
  static const double unit[8] = {0.0, 0.0, 1.0};
  for (int j = 0, own = -first; j < e; ++j, ++own, Ne += n, J += e) {
    const double *begin = unit + (own >= 0 && own < count ? 2 - own : 5);
    double row[3];
    TR_UNROLL
    for (int q = 0; q < count; ++q) row[q] = begin[q];
    TR_UNROLL
    for (int i = 0; i < needs; ++i) {
      TR_UNROLL
      for (int q = 0; q < count; ++q) row[q] = tr_less(row[q], D[q + i * ne], Ne[i]);
    }
    TR_UNROLL
    for (int q = 0; q < count; ++q) J[q] = row[q];
  }
}

/* J = E − dlaw/dN · Ne' (e×e) into `lu`. The sizes of journals and balls are compiled by themselves. */
static void tr_law_jacobian(tr_sim *s) {
  const int e = s->k->neta, n = s->k->nn;
  const double *by_friction = tr_by_friction(s);
  for (int m = 0; m < s->k->nelements; ++m) {
    const tr_element *el = s->k->element + m;
    const int ne = el->neta, needs = el->needs;
    const double *D = TR_A(s, dn) + el->dn0, *Ne = by_friction + el->n0;
    double *J = TR_A(s, lu) + el->eta0;
    if (ne == 1 && needs == 4) tr_rows_of(e, n, 1, 4, 1, el->eta0, D, Ne, J);
    else if (ne == 3 && needs == 3) tr_rows_of(e, n, 3, 3, 3, el->eta0, D, Ne, J);
    else
      for (int r = 0, count; r < ne; r += count) {
        count = ne - r > 1 ? 2 : 1;
        if (count == 2) tr_rows_of(e, n, ne, needs, 2, el->eta0 + r, D + r, Ne, J + r);
        else tr_rows_of(e, n, ne, needs, 1, el->eta0 + r, D + r, Ne, J + r);
      }
  }
}
