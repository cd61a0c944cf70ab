/* Multipliers between stage 1 and stage 2: λ from S λ + Se η + g0 = 0 (90)–(92), η from the complement equations η = law(N(η)).
 *
 * S is factorised with pivoting and row scales taken from its own diagonal, so that rank does not depend on units. Rank is
 * remembered from accurate states: inside a step the loops are open by the step's own error, which makes redundant rows look
 * nearly independent; a pivot beyond the remembered rank counts only when it is large. Close to a singular configuration a kept
 * pivot p amplifies that error by 1/√p; below KEEP_PIVOT it is dropped, which costs an acceleration error of √p for a moment. */
#include "linalg.h"
#include "modes.h"
#include "tr.h"

#define KEEP_PIVOT 1e-9
#define GROW_PIVOT 1e-6
#define EXACT_PIVOT 1e-9
#define NEWTON_MAX 30

/* Offsets of the blocks of `maps`. */
static inline const double *map_Se(const tr_kernel *k, const double *m) { return m + k->active * k->active; }
static inline const double *map_g0(const tr_kernel *k, const double *m) { return map_Se(k, m) + k->active * k->neta; }
static inline const double *map_N0(const tr_kernel *k, const double *m) { return map_g0(k, m) + k->active; }
static inline const double *map_Nl(const tr_kernel *k, const double *m) { return map_N0(k, m) + k->nn; }
static inline const double *map_Ne(const tr_kernel *k, const double *m) { return map_Nl(k, m) + k->nn * k->active; }
static inline const double *map_rates(const tr_kernel *k, const double *m) { return map_Ne(k, m) + k->nn * k->neta; }

static int tr_factor(tr_sim *s) {
  const tr_kernel *k = s->k;
  s->loops.rank_now = tr_cholesky(k->active, TR_A(s, maps), TR_A(s, d), TR_A(s, S), (int *)TR_A(s, perm), s->loops.rank, KEEP_PIVOT, GROW_PIVOT);
  return s->loops.rank_now;
}

static void tr_solve_S(tr_sim *s, const double *b, double *x) {
  tr_cholesky_solve(s->k->active, s->loops.rank_now, TR_A(s, S), (int *)TR_A(s, perm), TR_A(s, d), b, x);
}

/* Row scales from the diagonal of S at an accurate state; a row without any takes the largest of its kind, and a kind that has
 * nothing but round-off (the turns of a planar loop, unless its axes are the world's) what the other amounts to over the length. */
static void tr_scale_rows(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *S = TR_A(s, maps);
  double *d = TR_A(s, d), big[2] = {0.0, 0.0};
  int n = k->active;
  for (int i = 0; i < n; ++i) {
    int kind = k->row_kind[k->active_rows[i]];
    if (S[i + i * n] > big[kind]) big[kind] = S[i + i * n];
  }
  double turn = big[0] / (s->set.length * s->set.length), travel = big[1] * s->set.length * s->set.length;
  if (big[1] < 1e-12 * turn) big[1] = turn;
  else if (big[0] < 1e-12 * travel) big[0] = travel;
  for (int i = 0; i < n; ++i) {
    double m = S[i + i * n], b = big[k->row_kind[k->active_rows[i]]];
    if (!(m > 1e-9 * b)) m = b;
    d[i] = m > 0.0 ? 1.0 / sqrt(m) : 1.0;
  }
}

/* Remember the rank found at an accurate (assembled or projected) state. */
static void tr_note_rank(tr_sim *s) {
  const tr_kernel *k = s->k;
  if (k->active == 0) return;
  int r = tr_cholesky(k->active, TR_A(s, maps), TR_A(s, d), TR_A(s, S), (int *)TR_A(s, perm), k->active, EXACT_PIVOT, EXACT_PIVOT);
  if (r > s->loops.rank) {
    double last = TR_A(s, S)[(r - 1) * (k->active + 1)];
    s->loops.rank = r, s->loops.least_pivot = last * last;
  }
}

static inline const double *map_Q0(const tr_kernel *k, const double *m) { return map_rates(k, m) + k->nrates; }
static inline const double *map_Ql(const tr_kernel *k, const double *m) { return map_Q0(k, m) + k->neta; }
static inline const double *map_Qe(const tr_kernel *k, const double *m) { return map_Ql(k, m) + k->neta * k->active; }
static inline const double *map_kappa(const tr_kernel *k, const double *m) {
  return map_Q0(k, m) + (k->sets ? k->neta * (1 + k->active + k->neta) : 0);
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

/* Redundant variant: choose, among the λ the motion leaves open, those of least scaled reactions; they stay affine in η.
 * lam0 and the columns of T are corrected in place. */
static void tr_choose_reactions(tr_sim *s, double *lam0) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, m = k->nkappa, r = a - s->loops.rank_now;
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
}

/* q̈ of the sliding freedoms = Q0' + Qe' η with λ eliminated. */
static void tr_held_maps(tr_sim *s, const double *lam0) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *Ql = map_Ql(k, maps), *T = TR_A(s, T);
  int a = k->active, e = k->neta;
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

static void tr_law(tr_sim *s, const double *eta) {
  const tr_kernel *k = s->k;
  int n = k->nn, e = k->neta;
  const double *N0 = TR_A(s, Np), *Ne = N0 + n;
  double *N = TR_A(s, NN);
  for (int i = 0; i < n; ++i) N[i] = N0[i];
  for (int j = 0; j < e; ++j)
    for (int i = 0; i < n; ++i) N[i] += Ne[i + j * n] * eta[j];
  k->laws(N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
}

/* J = E − dlaw/dN · Ne' (e×e). */
static void tr_law_jacobian(tr_sim *s, double *J) {
  const tr_kernel *k = s->k;
  int n = k->nn, e = k->neta;
  const double *Ne = TR_A(s, Np) + n, *dn = TR_A(s, dn);
  for (int m = 0; m < k->nelements; ++m) {
    const tr_element *el = k->element + m;
    int n0 = el->n0, nn = el->needs, e0 = el->eta0, ne = el->neta;
    const double *D = dn + el->dn0;
    for (int j = 0; j < e; ++j)
      for (int r = 0; r < ne; ++r) {
        double a = (e0 + r == j) ? 1.0 : 0.0;
        for (int i = 0; i < nn; ++i) a -= D[r + i * ne] * Ne[n0 + i + j * n];
        J[e0 + r + j * e] = a;
      }
  }
}

/* Residual and Jacobian rows of pairs held at rest replace those of their law: q̈ = 0 (scaled to the own multiplier), η = 0 where the
 * motion is prescribed, or a share of the group's load: friction ratio equal to the leader's. */
static void tr_still_rows(tr_sim *s, const double *eta, double *r, double *J) {
  const tr_kernel *k = s->k;
  int e = k->neta, n = k->nn;
  const int *row = tr_row_kinds(s);
  const tr_leader *lead = tr_leaders(s);
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e, *u = TR_A(s, share), *Ne = TR_A(s, Np) + n, *dhold = TR_A(s, dhold);
  if (s->friction.shares) k->held(TR_A(s, NN), u, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
  for (int m = 0, at = 0; m < k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    const tr_element *el = k->element + pair->element;
    const tr_hold *hold = tr_hold_of(s, m);
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) {
      if (row[i] == TR_ROW_STILL) {
        double acc = Q0[i], inv = 1.0 / Qe[i + i * e];
        for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j], J[i + j * e] = Qe[i + j * e] * inv;
        r[i] = -acc * inv;
      } else if (row[i] == TR_ROW_FREE) {
        for (int j = 0; j < e; ++j) J[i + j * e] = i == j;
        r[i] = -eta[i];
      } else if (row[i] == TR_ROW_SHARE) {
        int L = lead[i].multiplier, atl = lead[i].dhold;
        const tr_hold *holdl = tr_hold_of(s, lead[i].pair);
        const tr_element *ell = k->element + tr_pair_of(s, lead[i].pair)->element;
        double fit = hold->capacity / hold->size, fitl = holdl->capacity / holdl->size, ratio = u[i] / u[L], share = ratio * fit / fitl;
        for (int j = 0; j < e; ++j) {
          double d = 0.0, dl = 0.0;
          for (int q = 0; q < el->needs; ++q) d += dhold[at + q] * Ne[el->n0 + q + j * n];
          for (int q = 0; q < ell->needs; ++q) dl += dhold[atl + q] * Ne[ell->n0 + q + j * n];
          J[i + j * e] = (i == j) - eta[L] * share * (d / hold->capacity - dl / holdl->capacity) - (j == L ? share : 0.0);
        }
        r[i] = eta[L] * share - eta[i];
      }
    }
    at += el->needs;
  }
}

/* Newton on η − law(N(η)) = 0 from the given η; 1 on convergence. The last step is taken after its size shows quadratic
 * convergence has made the next one negligible (the Jacobian is exact). */
static int tr_newton(tr_sim *s, double *eta) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  double *r = TR_A(s, r), *J = TR_A(s, lu), last = INFINITY;
  for (int it = 1; it <= NEWTON_MAX; ++it) {
    tr_law(s, eta);
    tr_law_jacobian(s, J);
    const double *law = TR_A(s, law);
    double size = 0.0, step = 0.0;
    for (int i = 0; i < e; ++i) r[i] = law[i] - eta[i];
    if (s->friction.still) tr_still_rows(s, eta, r, J);
    if (e == 1) {
      if (!(fabs(J[0]) > 1e-300)) return 0;
      r[0] /= J[0];
    } else {
      if (!tr_lu(e, J, (int *)TR_A(s, perm) + k->active)) return 0;
      tr_lu_solve(e, J, (int *)TR_A(s, perm) + k->active, r);
    }
    for (int i = 0; i < e; ++i) {
      eta[i] += r[i];
      step = fmax(step, fabs(r[i]));
      size = fmax(size, fabs(eta[i]));
    }
    s->stats.newton_iterations++;
    if (!(step < INFINITY)) return 0;
    if (step <= 1e-15 * size || (step <= 1e-7 * size && step <= 0.1 * last) || size == 0.0) {
      if (it > s->stats.newton_most) s->stats.newton_most = it;
      return 1;
    }
    last = step;
  }
  return 0;
}

#include "tilt.c"

/* z = [λ active | η] at the state whose maps are in place; warm-started from the last z. 0 when there is no reachable root. */
static int tr_multipliers(tr_sim *s) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta;
  const double *maps = TR_A(s, maps);
  double *z = TR_A(s, z), *lam = z, *eta = z + a;
  if (a > 0) tr_factor(s);
  if (e == 0) {
    tr_solve_S(s, map_g0(k, maps), lam);
    for (int i = 0; i < a; ++i) lam[i] = -lam[i];
    return 1;
  }
  double lam0[a > 0 ? a : 1];
  tr_eliminate(s, lam0);
  if (s->friction.still) tr_held_maps(s, lam0);
  double warm[e];
  memcpy(warm, eta, sizeof warm);
  if (!tr_newton(s, eta)) {
    memset(eta, 0, sizeof(double) * e);
    if (!tr_newton(s, eta) && !tr_newton_by_tilt(s, warm)) {
      memset(eta, 0, sizeof(double) * e);
      return 0;
    }
  }
  const double *T = TR_A(s, T);
  for (int i = 0; i < a; ++i) {
    lam[i] = lam0[i];
    for (int j = 0; j < e; ++j) lam[i] -= T[i + j * a] * eta[j];
  }
  return 1;
}
