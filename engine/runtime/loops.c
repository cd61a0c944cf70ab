/* The loops' equations at one state: λ from S λ + Se η + g0 = 0 (90)–(92), and everything that follows from λ as a function of η alone.
 *
 * S is factorised with pivoting and row scales taken from its own diagonal, so that rank does not depend on units. Rank is
 * remembered from accurate states: inside a step the loops are open by the step's own error, which makes redundant rows look
 * nearly independent; a pivot beyond the remembered rank counts only when it is large. Close to a singular configuration a kept
 * pivot p amplifies that error by 1/√p; below KEEP_PIVOT it is dropped, which costs an acceleration error of √p for a moment. */
#include "linalg.h"
#include "maps.h"
#include "modes.h"
#include "sparse.c"

#define KEEP_PIVOT 1e-9   /* of a row's scale: pivots within the remembered rank; 1e-9 crosses bifurcations at every tolerance (METHOD.md) */
#define GROW_PIVOT 1e-6   /* beyond it: above what a step's own error makes of a redundant row */
#define EXACT_PIVOT 1e-9  /* at accurate states, where only round-off and the linear dependence itself are left */
#define NOTHING_OF_KIND 1e-12 /* of the other kind of rows: what is less is round-off of a kind that holds nothing */
#define NOTHING_OF_ROW 1e-9   /* of the largest row of its kind: what is less takes that row's scale */

/* The maps of the state that was evaluated last, where that went without them (``recursive.c``). */
static void tr_form_maps(tr_sim *s) {
  if (s->step.mapped || !s->k->begin) return;
  s->step.mapped = TR_MAPS_RAW;
  s->k->stage1(TR_A(s, x), TR_A(s, yeval), TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dyeval), TR_A(s, power));
}

/* Factor of S at the state that was evaluated last; returns its rank. */
static int tr_factor(tr_sim *s) {
  const tr_kernel *k = s->k;
  tr_form_maps(s);
  s->loops.apart = 0.0;
  s->loops.sparse = k->nfill && !k->neta && s->loops.rank == k->active && tr_factor_sparse(s);
  if (s->loops.sparse) return s->loops.rank_now = k->active;
  s->loops.rank_now = tr_cholesky(k->active, TR_A(s, maps), TR_A(s, d), TR_A(s, S), (int *)TR_A(s, perm), s->loops.rank, KEEP_PIVOT, GROW_PIVOT);
  return s->loops.rank_now;
}

/* x ← S⁺ b with that factor. */
static void tr_solve_S(tr_sim *s, const double *b, double *x) {
  if (s->loops.sparse) tr_solve_sparse(s, b, x);
  else tr_cholesky_solve(s->k->active, s->loops.rank_now, TR_A(s, S), (int *)TR_A(s, perm), TR_A(s, d), b, x);
}

/* Row scales from the diagonal of S at an accurate state; a row without any takes the largest of its kind, and a kind that has
 * nothing but round-off (the turns of a planar loop, unless its axes are the world's) what the other amounts to over the length. Where no row
 * holds anything (`nothing`) none is scaled up: all pivots stay round-off. */
static void tr_scale_rows(tr_sim *s, int nothing) {
  const tr_kernel *k = s->k;
  tr_form_maps(s);
  const double *S = TR_A(s, maps);
  double *d = TR_A(s, d), big[2] = {0.0, 0.0};
  int n = k->active;
  for (int i = 0; i < n; ++i) {
    int kind = k->row_kind[k->active_rows[i]];
    if (S[i + i * n] > big[kind]) big[kind] = S[i + i * n];
  }
  double turn = big[0] / (s->set.length * s->set.length), travel = big[1] * s->set.length * s->set.length;
  if (big[1] < NOTHING_OF_KIND * turn) big[1] = turn;
  else if (big[0] < NOTHING_OF_KIND * travel) big[0] = travel;
  for (int i = 0; i < n; ++i) {
    double m = S[i + i * n], b = big[k->row_kind[k->active_rows[i]]];
    if (!(m > NOTHING_OF_ROW * b)) m = b;
    d[i] = m > 0.0 && !nothing ? 1.0 / sqrt(m) : 1.0;
  }
}

/* Remember the rank found at an accurate (assembled or projected) state. */
static void tr_note_rank(tr_sim *s) {
  const tr_kernel *k = s->k;
  if (k->active == 0) return;
  tr_form_maps(s);
  s->loops.sparse = 0;
  int r = tr_cholesky(k->active, TR_A(s, maps), TR_A(s, d), TR_A(s, S), (int *)TR_A(s, perm), k->active, EXACT_PIVOT, EXACT_PIVOT);
  if (r > s->loops.rank) {
    double last = TR_A(s, S)[(r - 1) * (k->active + 1)];
    s->loops.rank = r, s->loops.least_pivot = last * last;
  }
}

/* λ that the motion leaves open: columns V (a×r) with S V = 0, one for each pivot beyond the rank. */
static int tr_null_space(tr_sim *s, double *V) {
  const tr_kernel *k = s->k;
  int a = k->active, r = a - s->loops.rank_now;
  const int *perm = (const int *)TR_A(s, perm);
  const double *S = TR_A(s, maps);
  double b[a + 1];
  for (int q = 0; q < r; ++q) {
    int out = perm[s->loops.rank_now + q], empty = 1;
    for (int i = 0; i < a; ++i) b[i] = -S[i + out * a], empty &= b[i] == 0.0;
    if (empty) memset(V + q * a, 0, sizeof(double) * a);
    else tr_solve_S(s, b, V + q * a);
    V[out + q * a] = 1.0;
  }
  return r;
}

/* y (m) += sign · A x, A m×n; absent columns are skipped. */
static void tr_add_columns(int m, int n, const double *A, const double *x, double sign, double *y) {
  for (int j = 0; j < n; ++j) {
    const double *col = A + (size_t)j * m;
    double f = sign * x[j];
    if (f != 0.0)
      for (int i = 0; i < m; ++i) y[i] += col[i] * f;
  }
}

#include "pressed.c"

/* Redundant variant: choose, among the λ the motion leaves open, those of least scaled reactions; they stay affine in η.
 * lam0 and the columns of T are corrected in place. Where joints on loops rub this is the middle from which ``pressed.c`` starts. */
static void tr_choose_reactions(tr_sim *s, double *lam0) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, m = k->nkappa, r = a - s->loops.rank_now;
  s->loops.open = m && r > 0 ? s->loops.open : 0;
  if (m == 0 || r <= 0) return;
  double *V = TR_A(s, nul), *Q = V + a * a, *T = TR_A(s, T), kap[m], x[r];
  const double *k0 = map_kappa(k, TR_A(s, maps)), *kl = k0 + m, *ke = kl + m * a;
  tr_null_space(s, V);
  memset(Q, 0, sizeof(double) * m * r);
  for (int q = 0; q < r; ++q) tr_add_columns(m, a, kl, V + q * a, 1.0, Q + q * m);
  tr_least least = tr_least_of(m, r, Q, TR_A(s, gram));
  for (int col = 0; col <= e; ++col) { /* column 0: lam0 with κ0; column j: −T_j with κe_j */
    double *lam = col == 0 ? lam0 : T + (col - 1) * a, sign = col == 0 ? 1.0 : -1.0;
    memcpy(kap, col == 0 ? k0 : ke + (col - 1) * m, sizeof kap);
    tr_add_columns(m, a, kl, lam, sign, kap);
    tr_least_solve(&least, kap, 0, x);
    tr_add_columns(a, r, V, x, sign, lam);
  }
  if (k->nmore) tr_keep_open(s, V, Q, &least);
}

/* q̈ of the sliding freedoms = Q0' + Qe' η with λ eliminated. */
static void tr_held_maps(tr_sim *s, const double *lam0) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *Ql = map_Ql(k, maps), *T = TR_A(s, T);
  int a = k->active, e = k->neta;
  s->step.mapped = TR_MAPS_HELD;
  double *Q0 = TR_A(s, Q), *Qe = Q0 + e;
  memcpy(Q0, map_Q0(k, maps), sizeof(double) * e);
  memcpy(Qe, map_Qe(k, maps), sizeof(double) * e * e);
  for (int j = 0; j < a; ++j) {
    const double *col = Ql + j * e;
    for (int i = 0; i < e; ++i) Q0[i] += col[i] * lam0[j];
    for (int q = 0; q < e; ++q) {
      double t = T[j + q * a];
      if (t != 0.0)
        for (int i = 0; i < e; ++i) Qe[i + q * e] -= col[i] * t;
    }
  }
  if (s->moreau.h > 0.0) /* rates at the end of a step of impulses instead (``moreau.c``) */
    for (int m = 0; m < k->nsliders; ++m)
      for (int j = 0; j < tr_pair_of(s, m)->nrates; ++j)
        Q0[tr_pair_of(s, m)->eta0 + j] += map_rates(k, maps)[tr_pair_of(s, m)->rate0 + j] / s->moreau.h;
}

/* N' = N0' + Ne' η with λ eliminated; T = S⁺ Se. */
static void tr_eliminate(tr_sim *s, double *lam0) {
  const tr_kernel *k = s->k;
  tr_form_maps(s);
  s->step.mapped = TR_MAPS_OF_LOADS, s->step.along = 0;
  const double *maps = TR_A(s, maps);
  int a = k->active, e = k->neta, n = k->nn;
  double *T = TR_A(s, T), *N0 = TR_A(s, Np), *Ne = N0 + n;
  memcpy(N0, map_N0(k, maps), sizeof(double) * n);
  memcpy(Ne, map_Ne(k, maps), sizeof(double) * n * e);
  if (a == 0) return;
  const double *Nl = map_Nl(k, maps);
  tr_solve_S(s, map_g0(k, maps), lam0);
  for (int i = 0; i < a; ++i) lam0[i] = -lam0[i];
  for (int j = 0; j < e; ++j) tr_solve_S(s, map_Se(k, maps) + j * a, T + j * a);
  tr_choose_reactions(s, lam0);
  for (int j = 0; j < a; ++j) {
    const double *col = Nl + j * n;
    for (int i = 0; i < n; ++i) N0[i] += col[i] * lam0[j];
    for (int q = 0; q < e; ++q) {
      double t = T[j + q * a];
      if (t != 0.0)
        for (int i = 0; i < n; ++i) Ne[i + q * n] -= col[i] * t;
    }
  }
}

/* Eliminate λ from the maps in place: from the loads of friction, and (`held`) from the accelerations of what may be at rest. */
static void tr_without_loops(tr_sim *s, int held) {
  double lam0[s->k->active + 1];
  if (s->k->active) tr_factor(s);
  tr_eliminate(s, lam0);
  if (held) tr_held_maps(s, lam0);
}
