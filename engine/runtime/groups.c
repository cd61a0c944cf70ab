/* Groups of pairs at rest that one freedom of the loops would move together: what holds them is not unique, and they share it.
 *
 * The members that carry the largest part of their capacity carry equal parts of it: all of those that one freedom moves alone do; where
 * several move the same, the loads of least largest part are sought (METHOD, "Shared loads"). */
#include "modes.h"

#define SHARE_MAX 30         /* iterations of loads and capacities, which follow from each other */
#define SHARE_SAME 1e-3      /* of the largest share: the loads only start Newton's iteration, which is exact */
#define SHARE_WEIGHT 1e-6    /* least weight of a member that carries nothing: it may come back */
#define SHARE_PASSES 300     /* of Lawson's algorithm, which converges linearly */
#define SHARE_PIVOT 1e-10    /* of a member's own response: below it the reweighted conditions depend on each other */
#define SHARE_NOTHING 1e-12  /* N or N m: least capacity, so that shares of it can be formed */
#define GROUP_PIVOT 1e-9     /* of a freedom's own response (as EXACT_PIVOT): below it a rest condition follows from the others */
#define BOUND_PART 1e-9      /* (sine)² between two freedoms' responses: below it they are one (as GROUP_PIVOT) */
#define GROUP_COUPLED 1e-16  /* of the product of two freedoms' own responses: the square of a coupling that is round-off */

/* Response of multiplier i's freedom to friction j, loops closed. */
static double tr_response(const tr_sim *s, int i, int j) {
  int e = s->k->neta;
  const double *Qe = TR_A(s, Q) + e;
  return -0.5 * (Qe[i + j * e] + Qe[j + i * e]);
}

/* Whether the freedoms of multipliers i and j are one. */
static int tr_are_one(const tr_sim *s, int i, int j) {
  double own = tr_response(s, i, i), other = tr_response(s, j, j), with = tr_response(s, i, j);
  double ui = tr_response_unit(s, i, own), uj = tr_response_unit(s, j, other);
  return (own * other - with * with) * ui * ui * uj * uj <= BOUND_PART;
}

/* The pair that owns multiplier e, and where its capacity's derivative starts. */
static int tr_owner(const tr_sim *s, int e, int *at) {
  int where = 0;
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    if (e >= pair->eta0 && e < pair->eta0 + pair->neta) {
      *at = where;
      return m;
    }
    where += s->k->element[pair->element].needs;
  }
  return -1;
}

/* Let `member` hold as large a part of its capacity as `leader`. */
static void tr_share_with(tr_sim *s, int member, int leader) {
  int *row = tr_row_kinds(s);
  tr_leader *lead = tr_leaders(s) + member;
  row[member] = TR_ROW_SHARE;
  lead->multiplier = leader, lead->pair = tr_owner(s, leader, &lead->dhold);
  s->friction.shares = 1;
}

/* Share of pair m: of its components (those i of n with owner[i] == m) of loads x together. */
static double tr_share_of(int n, const int *owner, const double *cap, const double *x, int m) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i)
    if (owner[i] == m) sum += x[i] * x[i] / (cap[i] * cap[i]);
  return sqrt(sum);
}

/* Loads x (n) of pairs (owner) of least largest share of capacity among those that leave no motion: A x = b (A: n×n response), by
 * reweighting (Lawson's algorithm: a share's weight in the sum of squares grows with its size). */
static void tr_least_share(int n, const double *A, const int *owner, const double *cap, const double *b, double *x) {
  double w[n], W[n * n], L[n * n], d[n], v[n];
  int perm[n];
  for (int i = 0; i < n; ++i) w[i] = 1.0;
  for (int it = 0; it < SHARE_PASSES; ++it) { /* x = D Aᵀ (A D Aᵀ)⁺ b with D = cap²/w: least Σ w x²/cap² */
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0.0;
        for (int q = 0; q < n; ++q) sum += A[i + q * n] * cap[q] * cap[q] / w[q] * A[j + q * n];
        W[i + j * n] = sum;
      }
    for (int i = 0; i < n; ++i) d[i] = W[i + i * n] > 0.0 ? 1.0 / sqrt(W[i + i * n]) : 1.0;
    int rank = tr_cholesky(n, W, d, L, perm, 0, SHARE_PIVOT, SHARE_PIVOT);
    tr_cholesky_solve(n, rank, L, perm, d, b, v);
    double total = 0.0;
    for (int q = 0; q < n; ++q) {
      double sum = 0.0;
      for (int i = 0; i < n; ++i) sum += A[i + q * n] * v[i];
      x[q] = cap[q] * cap[q] / w[q] * sum;
    }
    for (int q = 0; q < n; ++q) total += w[q] *= tr_share_of(n, owner, cap, x, owner[q]);
    if (!(total > 0.0)) return;
    for (int q = 0; q < n; ++q) w[q] = fmax(w[q] * n / total, SHARE_WEIGHT);
  }
}

/* Loads x of the multipliers c that leave no motion and ask for the least largest share of capacity. Capacities (cap) follow from the
 * loads, by iteration; the loads it ends with are where the multipliers' solution then starts (from none at all there may be no way:
 * without friction the pairs would carry quite other forces). */
static void tr_share_loads(tr_sim *s, int n, const int *c, const int *owner, const double *A, double *cap, double *x) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const double *Qe = TR_A(s, Q) + e;
  double unit[e + 1], mine[e + 1], b[n], *eta = TR_A(s, z) + k->active, moved = INFINITY;
  memset(mine, 0, sizeof mine);
  for (int i = 0; i < n; ++i) mine[c[i]] = 1.0, b[i] = TR_A(s, Q)[c[i]];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < e; ++j) b[i] += (1.0 - mine[j]) * Qe[c[i] + j * e] * eta[j];
  for (int it = 0; it < SHARE_MAX && moved > SHARE_SAME && !tr_gives_up(s, 2.0 * SHARE_PASSES * n * n * n); ++it) {
    double size = 0.0;
    moved = 0.0;
    tr_law(s, eta);
    for (int i = 0; i < n; ++i) {
      memset(unit, 0, sizeof unit);
      unit[c[i]] = 1.0;
      const int m = owner[i];
      k->held_alone(TR_A(s, NN), unit, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
      cap[i] = fmax(tr_hold_of(s, m)->capacity / tr_hold_of(s, m)->size, SHARE_NOTHING);
    }
    tr_least_share(n, A, owner, cap, b, x);
    for (int i = 0; i < n; ++i) {
      moved = fmax(moved, fabs(x[i] - eta[c[i]]) / cap[i]), size = fmax(size, fabs(x[i]) / cap[i]);
      eta[c[i]] = x[i];
    }
    moved /= size;
  }
}

/* Acceleration of multiplier c[i]'s freedom without friction of the n multipliers c. */
static double tr_unheld(tr_sim *s, int n, const int *c, int i) {
  tr_form_all(s);
  int e = s->k->neta;
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e, *eta = TR_A(s, z) + s->k->active;
  double acc = Q0[c[i]];
  for (int j = 0; j < e; ++j) acc += Qe[c[i] + j * e] * eta[j];
  for (int j = 0; j < n; ++j) acc -= Qe[c[i] + c[j] * e] * eta[c[j]];
  return acc;
}

/* One freedom would move the n multipliers c together, with rates v: the axes of the balls among them. Returns the one that leads: `leader`,
 * or where that is a ball's, which may have nothing to hold along it, one of another pair, or the largest of a ball. */
static int tr_impending(tr_sim *s, int n, const int *c, const double *v, int leader) {
  int owner[n], at, first = -1;
  double t[3], dt[9], most = 0.0;
  for (int i = 0; i < n; ++i) {
    const tr_pair *pair = tr_pair_of(s, owner[i] = tr_owner(s, c[i], &at));
    if (pair->cone) TR_A(s, impend)[pair->rate0 + c[i] - pair->eta0] = v[i];
    else if (first < 0) first = i;
  }
  for (int m = 0; m < s->k->nsliders; ++m) {
    double *w = TR_A(s, impend) + tr_pair_of(s, m)->rate0, size = 0.0;
    if (!tr_impends(s, m)) continue;
    for (int j = 0; j < 3; ++j) size += w[j] * w[j];
    for (int j = 0; j < 3; ++j) w[j] /= sqrt(size);
    s->friction.by_law = 1;
  }
  if (!tr_pair_of(s, owner[leader])->cone) return leader;
  if (first >= 0) return first;
  for (int i = 0; i < n; ++i) {
    tr_across(s, owner[i], t, dt);
    double mine = fabs(t[c[i] - tr_pair_of(s, owner[i])->eta0]);
    if (mine > most) most = mine, leader = i;
  }
  return leader;
}

/* Pairs that one freedom moves together, with multipliers c (n), the first of which moves most: all oppose its motion. */
static void tr_share_line(tr_sim *s, int n, const int *c) {
  const double *arm = TR_A(s, arm), way = tr_unheld(s, n, c, 0) < 0.0 ? -1.0 : 1.0;
  double v[n];
  for (int i = 0; i < n; ++i) v[i] = way * tr_response(s, c[i], c[0]);
  const int leader = tr_impending(s, n, c, v, 0);
  if (!(fabs(v[leader]) > 0.0)) return;
  for (int i = 0; i < n; ++i) TR_A(s, share)[c[i]] = v[i] * arm[c[i]] * arm[c[i]];
  for (int i = 0; i < n; ++i)
    if (i != leader) tr_share_with(s, c[i], c[leader]);
}

/* Where each of the freedoms that move the multipliers c (n) moves some of them alone, in a fixed ratio, with all that belongs to their
 * pairs: those of one freedom share what opposes that. first: numbers in c of one of each, `rank` of them. 1 when it is so. */
static int tr_share_by_lines(tr_sim *s, int n, const int *c, const int *first, int rank) {
  int line[n], at;
  for (int i = 0; i < n; ++i) {
    line[i] = rank == 1 ? 0 : -1;
    for (int q = 0; q < rank && line[i] < 0; ++q)
      if (i == first[q] || tr_are_one(s, c[first[q]], c[i])) line[i] = q;
    if (line[i] < 0) return 0;
    for (int j = 0; j < i; ++j)
      if (line[j] != line[i] && tr_owner(s, c[j], &at) == tr_owner(s, c[i], &at)) return 0;
  }
  for (int q = 0; q < rank; ++q) {
    int own[n], count = 1;
    own[0] = c[first[q]];
    for (int i = 0; i < n; ++i)
      if (line[i] == q && i != first[q]) own[count++] = c[i];
    if (count > 1) tr_share_line(s, count, own);
  }
  return 1;
}

static int tr_is_one_of(const int *rest, int n, int i);
#include "creep.c"
#include "kept.c"

/* One connected set `c` (n multipliers) of rest conditions: where they depend on each other, the members that carry the largest share
 * of their capacity do so equally. No rank at all: numbers of a trial state are not finite, which its step will see. */
static void tr_group_of(tr_sim *s, int n, const int *c) {
  int perm[n], owner[n], at;
  double A[n * n], L[n * n], d[n], cap[n], x[n], share[n];
  for (int i = 0; i < n; ++i) {
    owner[i] = tr_owner(s, c[i], &at);
    for (int j = 0; j < n; ++j) A[i + j * n] = tr_response(s, c[i], c[j]);
    d[i] = tr_response_unit(s, c[i], A[i + i * n]);
  }
  int rank = tr_cholesky(n, A, d, L, perm, 0, GROUP_PIVOT, GROUP_PIVOT), active = n - rank + 1;
  if (rank == 0 || rank == n || (s->friction.kept && tr_keep_loads(s, n, c, A, rank))) return;
  if (tr_share_by_lines(s, n, c, perm, rank) || tr_keep_loads(s, n, c, A, rank)) return;
  tr_share_loads(s, n, c, owner, A, cap, x);
  for (int i = 0; i < n; ++i) perm[i] = i, share[i] = tr_share_of(n, owner, cap, x, owner[i]);
  for (int i = 0; i < n; ++i) /* by share, largest first */
    for (int j = i + 1; j < n; ++j)
      if (share[perm[j]] > share[perm[i]]) {
        int t = perm[i];
        perm[i] = perm[j], perm[j] = t;
      }
  if (!(fabs(x[perm[0]]) > 0.0)) return;
  for (int i = 0; i < n; ++i) TR_A(s, share)[c[i]] = x[i];
  for (int i = 1; i < active; ++i) tr_share_with(s, c[perm[i]], c[perm[0]]);
}

/* Redundant rest conditions: several stuck pairs that one freedom would move together. */
static void tr_group(tr_sim *s) {
  tr_form_all(s);
  const tr_kernel *k = s->k;
  int e = k->neta, *row = tr_row_kinds(s), left[e + 1], c[e + 1];
  const double *Qe = TR_A(s, Q) + e;
  for (int i = 0; i < e; ++i) left[i] = row[i] == TR_ROW_STILL;
  memset(TR_A(s, share), 0, sizeof(double) * e);
  memset(TR_A(s, impend), 0, sizeof(double) * k->nrates);
  for (int i = 0; i < e; ++i) {
    if (!left[i]) continue;
    int n = 0;
    c[n++] = i, left[i] = 0;
    for (int p = 0; p < n; ++p)
      for (int j = 0; j < e; ++j)
        if (left[j] && Qe[c[p] + j * e] * Qe[c[p] + j * e] > GROUP_COUPLED * Qe[c[p] + c[p] * e] * Qe[j + j * e]) c[n++] = j, left[j] = 0;
    if (n > 1) tr_group_of(s, n, c);
  }
}
