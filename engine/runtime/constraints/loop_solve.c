/* The loop equations S λ + Se η + g0 = 0 (90)–(92) in the current state: λ, loads and accelerations as functions of η.
 *
 * S is factorised with pivoting and with row scales from its diagonal, so that the rank does not depend on units. Inside a step,
 * loops are open by the error of the step, so that redundant rows seem independent. The rank is therefore determined at accurate
 * states and stored. Beyond the stored rank, only large pivots count. Near a singular position, a pivot p amplifies the error of
 * the step by 1/√p. A pivot below KEEP_PIVOT is dropped; for a short time, accelerations then have an error of √p.
 *
 * If many loops share few bodies, S has a sparse factor (theory, "Loops by structure"). The order of its pivots depends on the
 * structure, not on the values. At the start, the sparse factor proves full rank if every pivot is far above the pivot of a
 * dependent row. Otherwise the dense factor determines the rank. If the stored rank is full, the sparse factor is used in every
 * position. Near a singular position, the sparse factor drops each row that depends on earlier rows. */
#include "constraints/constraints.h"

/* relative to the largest diagonal of the other kind: if all diagonals of rotations, or of translations, are smaller, they are
 * round-off */
#define NOTHING_OF_KIND 1e-12
/* relative to the largest diagonal of the same kind: a row with a smaller diagonal takes the scale of the largest diagonal */
#define NOTHING_OF_ROW 1e-9
/* relative to a row's scale: smallest pivot of a clearly independent row; 1000 × GROW_PIVOT, because the structural pivot order
 * gives smaller pivots */
#define CLEAR_PIVOT 1e-3

/* Sparse factor of S in the structural pivot order, column by column. A row whose pivot is at most `keep` depends on the rows
 * before it, and is dropped. `perm`: the rows in use, then the dropped rows. Returns the number of rows in use. Requires raw
 * maps. */
TR_APART int tr_factor_sparse(tr_sim *s, double keep) {
  const tr_kernel *k = s->k;
  const int n = k->active, *order = k->fill_order, *start = k->fill_start, *below = k->fill_below, *at = k->fill_at, *row = k->fill_row;
  const double *S = TR_A(s, maps), *d = TR_A(s, d);
  double *inverse = TR_A(s, sparse), *L = inverse + n, column[n];
  int *perm = (int *)TR_A(s, perm), rank = 0, dropped = 0;
  for (int c = 0; c < n; ++c) {
    const double dc = d[order[c]];
    double pivot = dc * dc * S[at[c]];
    for (int p = start[c]; p < start[c + 1]; ++p) column[below[p]] = at[n + p] < 0 ? 0.0 : d[order[below[p]]] * dc * S[at[n + p]];
    for (int m = row[c]; m < row[c + 1]; ++m) {
      const int entry = k->fill_entry[m], end = start[k->fill_pivot[m] + 1];
      const double a = L[entry];
      pivot -= a * a;
      for (int p = entry + 1; p < end; ++p) column[below[p]] -= L[p] * a;
    }
    if (pivot > keep) perm[rank++] = order[c];
    else perm[n - ++dropped] = order[c];
    /* A dropped row gets zeros: its multiplier is then zero, and other rows do not change. tr_solve_sparse needs no divisions,
     * because the inverses are stored. */
    const double inv = inverse[c] = pivot > keep ? 1.0 / sqrt(pivot) : 0.0;
    for (int p = start[c]; p < start[c + 1]; ++p) L[p] = pivot > keep ? column[below[p]] * inv : 0.0;
  }
  return rank;
}

static const double *tr_whole_loop_matrix(tr_sim *s) {
  const tr_kernel *k = s->k;
  const size_t n = k->active;
  const int *order = k->fill_order, *at = k->fill_at;
  const double *S = TR_A(s, maps);
  double *whole = TR_A(s, whole_S);
  if (k->nS == k->active * k->active) return S;
  memset(whole, 0, sizeof(double) * n * n);
  for (int j = 0; j < k->active; ++j) {
    whole[order[j] + n * order[j]] = S[at[j]];
    for (int p = k->fill_start[j]; p < k->fill_start[j + 1]; ++p) {
      const int i = k->fill_below[p];
      if (at[n + p] >= 0) whole[order[i] + n * order[j]] = whole[order[j] + n * order[i]] = S[at[n + p]];
    }
  }
  return whole;
}

static const double *tr_loop_matrix(tr_sim *s) {
  const int a = s->k->active, n = tr_loop_rows(s);
  const double *S = TR_A(s, maps);
  double *own = TR_A(s, light_S);
  if (!s->k->nlight) return tr_whole_loop_matrix(s);
  for (int i = 0; i < n; ++i) memcpy(own + i * n, S + i * a, sizeof(double) * n);
  return own;
}

/* With S = [S' C; Cᵀ D], where S' belongs to the loops, form Z = S'⁻¹ C and D − Cᵀ Z, which is negative definite. A factor of the
 * whole S would lose the digits of S' beside the large responses of light freedoms (theory, "Light bodies"). */
static void tr_factor_light_rows(tr_sim *s) {
  const int a = s->k->active, n = tr_loop_rows(s), l = s->k->nlight;
  double *Z = TR_A(s, light_Z), *D = TR_A(s, light_D);
  for (int q = 0; q < l; ++q) {
    const double *C = TR_A(s, maps) + (size_t)(n + q) * a;
    tr_cholesky_solve(n, s->loops.rank_now, TR_A(s, S), (int *)TR_A(s, perm), TR_A(s, d), C, Z + q * n);
    for (int p = 0; p < l; ++p) D[p + q * l] = C[n + p];
  }
  for (int q = 0; q < l; ++q)
    for (int p = 0; p < l; ++p) D[p + q * l] -= tr_dot(TR_A(s, maps) + (size_t)(n + p) * a, Z + q * n, n);
  tr_lu(l, D, (int *)TR_A(s, light_P));
}

static int tr_factor_loops(tr_sim *s) {
  const tr_kernel *k = s->k;
  tr_form_maps(s);
  TR_MADE(s, TR_HAS_FACTOR);
  s->loops.recursive_pivot = 0.0;
  s->loops.sparse = k->nfill && !k->neta && s->loops.rank == k->active;
  if (s->loops.sparse) return s->loops.rank_now = tr_factor_sparse(s, KEEP_PIVOT);
  s->loops.rank_now = tr_cholesky(tr_loop_rows(s), tr_loop_matrix(s), TR_A(s, d), TR_A(s, S), (int *)TR_A(s, perm), s->loops.rank, KEEP_PIVOT, GROW_PIVOT);
  if (k->nlight) tr_factor_light_rows(s);
  return s->loops.rank_now;
}

/* x ← S⁻¹ b with the sparse factor. */
TR_APART void tr_solve_sparse(const tr_sim *s, const double *b, double *x) {
  const tr_kernel *k = s->k;
  const int n = k->active, *order = k->fill_order, *start = k->fill_start, *below = k->fill_below;
  const double *inverse = TR_A(s, sparse), *L = inverse + n, *d = TR_A(s, d);
  double y[n];
  for (int j = 0; j < n; ++j) y[j] = d[order[j]] * b[order[j]];
  for (int j = 0; j < n; ++j) {
    const double a = y[j] *= inverse[j];
    for (int p = start[j]; p < start[j + 1]; ++p) y[below[p]] -= L[p] * a;
  }
  for (int j = n - 1; j >= 0; --j) {
    double a = y[j];
    for (int p = start[j]; p < start[j + 1]; ++p) a -= L[p] * y[below[p]];
    y[j] = a * inverse[j];
    x[order[j]] = d[order[j]] * y[j];
  }
}

static void tr_add_loop_product(const tr_sim *s, const double *z, double *r) {
  const tr_kernel *k = s->k;
  const int n = k->active, *order = k->fill_order, *at = k->fill_at;
  const double *S = TR_A(s, maps);
  if (!k->nfill) {
    tr_add_columns(n, n, S, z, 1.0, r);
    return;
  }
  for (int j = 0; j < n; ++j) {
    r[order[j]] += S[at[j]] * z[order[j]];
    for (int p = k->fill_start[j]; p < k->fill_start[j + 1]; ++p) {
      const int i = order[k->fill_below[p]];
      if (at[n + p] >= 0) r[i] += S[at[n + p]] * z[order[j]], r[order[j]] += S[at[n + p]] * z[i];
    }
  }
}

/* Complete the solution of S x = b by the unknowns of light freedoms. On entry, x (n) solves the rows of loops alone. */
static void tr_solve_light_rows(tr_sim *s, const double *b, double *x) {
  const int a = s->k->active, n = tr_loop_rows(s), l = s->k->nlight;
  for (int q = 0; q < l; ++q) x[n + q] = b[n + q] - tr_dot(TR_A(s, maps) + (size_t)(n + q) * a, x, n);
  tr_lu_solve(l, TR_A(s, light_D), (int *)TR_A(s, light_P), x + n);
  tr_add_columns(n, l, TR_A(s, light_Z), x + n, -1.0, x);
}

static void tr_solve_loops(tr_sim *s, const double *b, double *x) {
  TR_NEED(s, TR_HAS_FACTOR);
  if (s->loops.sparse) tr_solve_sparse(s, b, x);
  else tr_cholesky_solve(tr_loop_rows(s), s->loops.rank_now, TR_A(s, S), (int *)TR_A(s, perm), TR_A(s, d), b, x);
  if (s->k->nlight) tr_solve_light_rows(s, b, x);
}

/* Set the row scales d from the diagonal of S. */
static void tr_set_row_scales(tr_sim *s, const double *diagonal, int nothing) {
  const tr_kernel *k = s->k;
  double *d = TR_A(s, d), big[2] = {0.0, 0.0};
  const int n = tr_loop_rows(s);
  for (int i = 0; i < n; ++i) {
    int kind = k->row_kind[k->active_rows[i]];
    if (diagonal[i] > big[kind]) big[kind] = diagonal[i];
  }
  double turn = big[0] / (s->set.length * s->set.length), travel = big[1] * s->set.length * s->set.length;
  if (big[1] < NOTHING_OF_KIND * turn) big[1] = turn;
  else if (big[0] < NOTHING_OF_KIND * travel) big[0] = travel;
  for (int i = 0; i < n; ++i) {
    double m = diagonal[i], b = big[k->row_kind[k->active_rows[i]]];
    if (!(m > NOTHING_OF_ROW * b)) m = b;
    d[i] = m > 0.0 && !nothing ? 1.0 / sqrt(m) : 1.0;
  }
}

/* Determine the rank of S from its factor. Makes the factor invalid. Requires raw maps and row scales. */
static void tr_update_rank(tr_sim *s) {
  const tr_kernel *k = s->k;
  TR_SPOILT(s, TR_HAS_FACTOR);
  s->step.mapped = TR_MAPS_RAW;
  s->loops.sparse = 0;
  const int n = tr_loop_rows(s);
  if (k->nfill && !k->neta && tr_factor_sparse(s, CLEAR_PIVOT) == n) {
    double most = 0.0; /* largest inverse square root of a pivot */
    for (int j = 0; j < n; ++j) most = fmax(most, TR_A(s, sparse)[j]);
    s->loops.rank = n, s->loops.least_pivot = 1.0 / (most * most);
    return;
  }
  int r = tr_cholesky(n, tr_loop_matrix(s), TR_A(s, d), TR_A(s, S), (int *)TR_A(s, perm), n, RANK_PIVOT, RANK_PIVOT);
  if (r > s->loops.rank) {
    double last = TR_A(s, S)[(r - 1) * (n + 1)];
    s->loops.rank = r, s->loops.least_pivot = last * last;
  }
}

static void tr_narrow_without_friction(tr_sim *s) {
  memset(TR_A(s, dlaw), 0, sizeof(double) * s->k->ndn);
  for (int i = 0; i < s->k->neta; ++i) TR_A(s, moves)[i] = 1.0;
  s->k->narrow(TR_A(s, c), TR_A(s, w), TR_A(s, moves), TR_A(s, dlaw), TR_A(s, pivots));
}

/* Scale the rows and prove full rank from the factor of the recursion without friction. Returns 0 if a pivot is not clear. */
static int tr_prove_rank_by_recursion(tr_sim *s, int nothing) {
  const tr_kernel *k = s->k;
  const double *own = TR_A(s, pivots) + k->nbodies + k->nelements, *d = TR_A(s, d);
  double least = INFINITY;
  if (!k->shift || !k->nfill) return 0;
  tr_narrow_without_friction(s);
  tr_set_row_scales(s, own + k->active, nothing);
  for (int i = 0; i < k->active; ++i) {
    const double pivot = own[i] * d[i] * d[i];
    if (!(pivot > CLEAR_PIVOT)) return 0;
    least = fmin(least, pivot);
  }
  s->loops.rank = k->active, s->loops.least_pivot = least;
  return 1;
}

static void tr_find_rank(tr_sim *s, int nothing) {
  const tr_kernel *k = s->k;
  const int n = k->active;
  const double *S = TR_A(s, maps);
  double diagonal[n + 1];
  if (tr_prove_rank_by_recursion(s, nothing)) return;
  tr_form_maps(s);
  for (int i = 0; i < n; ++i)
    if (k->nfill) diagonal[k->fill_order[i]] = S[k->fill_at[i]];
    else diagonal[i] = S[i + (size_t)i * n];
  tr_set_row_scales(s, diagonal, nothing);
  tr_update_rank(s);
}

static int tr_null_space(tr_sim *s, double *V) {
  TR_NEED(s, TR_HAS_FACTOR);
  const tr_kernel *k = s->k;
  int a = k->active, r = tr_dependent_rows(s);
  const int *perm = (const int *)TR_A(s, perm);
  const double *S = r > 0 ? tr_whole_loop_matrix(s) : 0;
  double b[a + 1];
  for (int q = 0; q < r; ++q) {
    int out = perm[s->loops.rank_now + q], empty = 1;
    for (int i = 0; i < a; ++i) b[i] = -S[i + out * a], empty &= b[i] == 0.0;
    if (empty) memset(V + q * a, 0, sizeof(double) * a);
    else tr_solve_loops(s, b, V + q * a);
    V[out + q * a] = 1.0;
  }
  return r;
}

/* Redundant variant: choose λ so that the norm of the scaled reactions is smallest. This choice is affine in η. Corrects lam0 and
 * the columns of T. In loops whose joints have friction, ``internal_forces.c`` starts from this choice. */
static void tr_choose_reactions(tr_sim *s, double *lam0) {
  TR_NEED(s, TR_HAS_FACTOR);
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, m = k->nkappa, r = tr_dependent_rows(s);
  s->loops.open = m && r > 0 ? s->loops.open : 0;
  if (m == 0 || r <= 0) return;
  double *V = TR_A(s, open_lambda), *Q = V + a * a, *T = TR_A(s, T), kap[m], x[r];
  const double *k0 = map_kappa(k, TR_A(s, maps)), *kl = k0 + m, *ke = kl + m * a;
  tr_null_space(s, V);
  memset(Q, 0, sizeof(double) * m * r);
  for (int q = 0; q < r; ++q) tr_add_columns(m, a, kl, V + q * a, 1.0, Q + q * m);
  tr_least_squares least = tr_least_squares_factor(m, r, Q, TR_A(s, gram));
  for (int col = 0; col <= e; ++col) { /* column 0: κ from lam0 and κ0; column j: κ from −T_j and κe_j */
    double *lam = col == 0 ? lam0 : T + (col - 1) * a, sign = col == 0 ? 1.0 : -1.0;
    memcpy(kap, col == 0 ? k0 : ke + (col - 1) * m, sizeof kap);
    tr_add_columns(m, a, kl, lam, sign, kap);
    tr_least_squares_solve(&least, kap, 0, x);
    tr_add_columns(a, r, V, x, sign, lam);
  }
  if (k->nmore) tr_store_open_directions(s, V, Q, &least);
}

/* Substitute λ = lam0 − T η into a map with n rows: X0 += L lam0 and Xe −= L T. L (n×a) are the map's columns of λ, and Xe (n×e)
 * its columns of η. */
TR_INLINE void tr_substitute_multipliers(int n, int a, int e, const double *L, const double *lam0, const double *T, double *X0, double *Xe) {
  for (int j = 0; j < a; ++j) {
    const double *col = L + j * n;
    for (int i = 0; i < n; ++i) X0[i] += col[i] * lam0[j];
    for (int q = 0; q < e; ++q) {
      double t = T[j + q * a];
      if (t != 0.0)
        for (int i = 0; i < n; ++i) Xe[i + q * n] -= col[i] * t;
    }
  }
}

static inline int tr_is_prescribed(const tr_sim *s, int i) {
  TR_NEED(s, TR_HAS_HELD);
  const int at = i + i * s->k->neta;
  return !(fabs((TR_A(s, Q) + s->k->neta)[at]) > RANK_PIVOT * fabs(map_Qe(s->k, TR_A(s, maps))[at]));
}

static void tr_add_start_rates(const tr_sim *s, double *acc, double *size) {
  for (int m = 0; m < s->k->nsliders; ++m)
    for (int j = 0, i = tr_pair_of(s, m)->eta0; j < tr_pair_of(s, m)->nrates; ++j, ++i) {
      const double rate = (tr_is_prescribed(s, i) ? 2.0 : 1.0) * tr_pair_rates(s, m)[j] / s->moreau.h;
      acc[i] += rate;
      if (size) size[i] += fabs(rate);
    }
}

static void tr_form_held_maps(tr_sim *s, const double *lam0) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps);
  int a = k->active, e = k->neta;
  s->step.mapped = s->moreau.h > 0.0 ? TR_MAPS_OF_IMPULSES : TR_MAPS_HELD;
  TR_NEED(s, TR_HAS_LOADS), TR_MADE(s, TR_HAS_HELD);
  double *Q0 = TR_A(s, Q), *Qe = Q0 + e;
  memcpy(Q0, map_Q0(k, maps), sizeof(double) * e);
  memcpy(Qe, map_Qe(k, maps), sizeof(double) * e * e);
  tr_substitute_multipliers(e, a, e, map_Ql(k, maps), lam0, TR_A(s, T), Q0, Qe);
  if (s->moreau.h > 0.0) tr_add_start_rates(s, Q0, 0);
}

static void tr_eliminate_loops(tr_sim *s, double *lam0) {
  const tr_kernel *k = s->k;
  tr_form_maps(s);
  s->step.mapped = TR_MAPS_OF_LOADS, s->step.recursive = 0;
  TR_SPOILT(s, TR_HAS_HELD | TR_HAS_LAW), TR_MADE(s, TR_HAS_LOADS);
  const double *maps = TR_A(s, maps);
  int a = k->active, e = k->neta, n = k->nn;
  double *T = TR_A(s, T), *N0 = TR_A(s, Np), *Ne = N0 + n;
  tr_copy_vectors(n, map_N0(k, maps), N0);
  tr_copy_vectors(n * e, map_Ne(k, maps), Ne);
  if (a == 0) return;
  tr_solve_loops(s, map_g0(k, maps), lam0);
  for (int i = 0; i < a; ++i) lam0[i] = -lam0[i];
  for (int j = 0; j < e; ++j) tr_solve_loops(s, map_Se(k, maps) + j * a, T + j * a);
  tr_choose_reactions(s, lam0);
  tr_substitute_multipliers(n, a, e, map_Nl(k, maps), lam0, T, N0, Ne);
}

static void tr_form_maps_without_loops(tr_sim *s, int held) {
  double lam0[s->k->active + 1];
  if (s->k->begin && !(s->moreau.h > 0.0) && (s->step.mapped == TR_MAPS_HELD || (!held && s->step.mapped == TR_MAPS_OF_LOADS))) {
    s->step.recursive = 0; /* from here on, the solution comes from maps */
    return;
  }
  if (s->k->active) tr_factor_loops(s);
  tr_eliminate_loops(s, lam0);
  if (held) tr_form_held_maps(s, lam0);
}

static void tr_form_all_maps(tr_sim *s) {
  if (s->step.mapped >= (s->k->sets ? TR_MAPS_HELD : TR_MAPS_OF_LOADS) || !s->k->begin) return;
  if (s->k->active) {
    tr_form_maps_without_loops(s, s->k->sets);
    return;
  }
  double lam0[1];
  if (s->step.mapped < TR_MAPS_OF_LOADS) tr_eliminate_loops(s, lam0);
  if (s->k->sets) tr_form_held_maps(s, lam0);
}

static double tr_loop_independence(const tr_sim *s) {
  const int r = s->loops.rank;
  if (s->loops.recursive_pivot > 0.0) return s->loops.recursive_pivot;
  if (s->loops.sparse) return INFINITY;
  if (r) TR_NEED(s, TR_HAS_FACTOR);
  return r && s->loops.rank_now >= r ? TR_A(s, S)[(r - 1) * (tr_loop_rows(s) + 1)] : 0.0;
}

