/* Load sharing (theory, "Shared loads"). If one freedom of the loops moves several pairs together, the motion at rest does not
 * determine how these pairs share the load. Such pairs form a group.
 *
 * The share of a member is its load divided by its capacity. In a group with one freedom, all members have equal shares. In a group
 * with several freedoms, the loads minimise the largest share, and the members with the largest share have equal shares. Large
 * groups store the loads of a creep minimisation (theory, "Many pairs"), within the capacities if possible. While the group rests,
 * its pairs keep these loads. Only as many pairs as the group has freedoms take the changes of load. */
#include "friction/friction.h"

#define SHARE_MAX 30 /* largest number of iterations on loads and capacities */
/* relative to the largest share: tolerance of the loads, which is loose because Newton's method only starts from them */
#define SHARE_SAME 1e-3
#define SHARE_WEIGHT 1e-6 /* smallest weight of a member, so that a member without load can get load again */
#define SHARE_PASSES 300 /* number of iterations of Lawson's algorithm, which converges linearly */
/* relative to a member's own response: if its pivot is smaller, a row of the weighted conditions is dependent */
#define SHARE_PIVOT 1e-10
#define GROUP_COUPLED 1e-16 /* relative to the product of two freedoms' own responses: a smaller squared coupling is round-off */
#define SPARE_LEAST 1e-3 /* relative to the capacity: smallest reserve that is tried */
#define LEADS_NOTHING 1e-6 /* relative to the largest capacity of a group: a leader with a smaller capacity carries no load */
#define KEPT_MORE_THAN 8 /* largest number of pairs in a group that minimises its largest share; a larger group stores loads */

/* Let the multiplier `member` have the same share as the multiplier `leader`. */
static void tr_follow_leader(tr_sim *s, int member, int leader) {
  int *row = tr_row_kinds(s);
  tr_leader *lead = tr_leaders(s) + member;
  row[member] = TR_ROW_SHARE;
  lead->multiplier = leader, lead->pair = tr_pair_of_multiplier(s, leader, &lead->dhold);
  s->friction.shared = 1;
}

/* Share of pair m under the loads x (n): the norm of the shares of its components. owner[i]: pair of component i. */
static double tr_pair_share(int n, const int *owner, const double *cap, const double *x, int m) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i)
    if (owner[i] == m) sum += x[i] * x[i] / (cap[i] * cap[i]);
  return sqrt(sum);
}

/* Find loads x (n) with A x = b that minimise the largest share. A: n×n response. Lawson's algorithm of iteratively reweighted
 * least squares increases the weight of large shares. */
static void tr_minimise_largest_share(int n, const double *A, const int *owner, const double *cap, const double *b, double *x) {
  double w[n], W[n * n], L[n * n], d[n], v[n];
  int perm[n];
  for (int i = 0; i < n; ++i) w[i] = 1.0;
  for (int it = 0; it < SHARE_PASSES; ++it) { /* the minimum of Σ w x²/cap² is x = D Aᵀ (A D Aᵀ)⁺ b with D = cap²/w */
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
    for (int q = 0; q < n; ++q) total += w[q] *= tr_pair_share(n, owner, cap, x, owner[q]);
    if (!(total > 0.0)) return;
    for (int q = 0; q < n; ++q) w[q] = fmax(w[q] * n / total, SHARE_WEIGHT);
  }
}

/* Order the n multipliers c of a group with responses A: first the loaded multipliers, which have a significant capacity, then the
 * others. `cap` is in the unit of the multiplier; capacities are compared by the accelerations that they cause. Pairs without
 * capacity carry nothing; they store the load 0, because a share of zero capacity is undefined. Returns the number of loaded
 * multipliers, or n if the loaded multipliers alone could not hold the group's freedoms. */
static int tr_set_aside_unloaded(tr_sim *s, int n, const int *c, const double *A, const double *cap, int rank, int *order) {
  double most = 0.0, B[n * n], L[n * n], d[n];
  int perm[n], count = 0, last = n;
  for (int i = 0; i < n; ++i) most = fmax(most, cap[i] * sqrt(A[i + i * n]));
  for (int i = 0; i < n; ++i)
    if (cap[i] * sqrt(A[i + i * n]) >= LEADS_NOTHING * most) order[count++] = i; else order[--last] = i;
  for (int i = 0; i < count && count < n; ++i) {
    for (int j = 0; j < count; ++j) B[i + j * count] = A[order[i] + order[j] * n];
    d[i] = tr_response_scale(s, c[order[i]], B[i + i * count]);
  }
  if (count < n && tr_cholesky(count, B, d, L, perm, 0, RANK_PIVOT, RANK_PIVOT) < rank) {
    for (int i = 0; i < n; ++i) order[i] = i;
    return n;
  }
  for (int i = count; i < n; ++i) tr_row_kinds(s)[c[order[i]]] = TR_ROW_STORED, TR_A(s, share)[c[order[i]]] = 0.0, s->friction.shared = 1;
  return count;
}

/* Find loads x of the multipliers c (n) that prevent motion and minimise the largest share. The iteration updates the capacities
 * with the loads and their signs. Newton's method must start from these loads, because capacities under loads without friction differ too much. */
static void tr_share_loads(tr_sim *s, int n, const int *c, const int *owner, const double *A, double *cap, double *x) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const double *Qe = TR_A(s, Q) + e;
  double unit[e + 1], mine[e + 1], b[n], *eta = TR_A(s, z) + k->active, moved = INFINITY;
  memset(mine, 0, sizeof mine);
  for (int i = 0; i < n; ++i) mine[c[i]] = 1.0, b[i] = TR_A(s, Q)[c[i]];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < e; ++j) b[i] += (1.0 - mine[j]) * Qe[c[i] + j * e] * eta[j];
  for (int it = 0; it < SHARE_MAX && moved > SHARE_SAME && !tr_is_cancelled(s, 2.0 * SHARE_PASSES * n * n * n); ++it) {
    double size = 0.0;
    moved = 0.0;
    tr_evaluate_laws(s, eta);
    for (int i = 0; i < n; ++i) {
      memset(unit, 0, sizeof unit);
      unit[c[i]] = eta[c[i]] < 0.0 ? -1.0 : 1.0;
      const int m = owner[i];
      k->held_alone(TR_A(s, NN), unit, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
      cap[i] = fmax(tr_hold_of(s, m)->capacity / tr_hold_of(s, m)->size, NO_CAPACITY);
    }
    tr_minimise_largest_share(n, A, owner, cap, b, x);
    for (int i = 0; i < n; ++i) {
      moved = fmax(moved, fabs(x[i] - eta[c[i]]) / cap[i]), size = fmax(size, fabs(x[i]) / cap[i]);
      eta[c[i]] = x[i];
    }
    moved /= size;
  }
}

/* Acceleration of the freedom of multiplier c[0] without the friction of the n multipliers c. */
static double tr_unheld_acceleration(tr_sim *s, int n, const int *c) {
  tr_form_all_maps(s);
  int e = s->k->neta;
  const double *Qe = TR_A(s, Q) + e, *eta = TR_A(s, z) + s->k->active;
  double acc = tr_held_acceleration(s, c[0], eta);
  for (int j = 0; j < n; ++j) acc -= Qe[c[0] + c[j] * e] * eta[c[j]];
  return acc;
}

/* Set the impending axes of the balls among the n multipliers c of a group with one freedom. This freedom would move the
 * multipliers with the rates v. Returns the index of the leader in c. The leader is the first multiplier, unless this multiplier
 * belongs to a ball, because a ball may carry no load along its axis. In this case, the leader is the first pair that is not a
 * ball. If all pairs are balls, the leader is the component with the largest part perpendicular to the force of its ball. */
static int tr_set_impending_axes(tr_sim *s, int n, const int *c, const double *v) {
  int owner[n], at, first = -1, leader = 0;
  double t[3], dt[9], most = 0.0;
  for (int i = 0; i < n; ++i) {
    const tr_pair *pair = tr_pair_of(s, owner[i] = tr_pair_of_multiplier(s, c[i], &at));
    if (pair->cone) TR_A(s, impending)[pair->rate0 + c[i] - pair->eta0] = v[i];
    else if (first < 0) first = i;
  }
  for (int m = 0; m < s->k->nsliders; ++m) {
    if (!tr_has_impending_axis(s, m)) continue;
    tr_make_unit(3, TR_A(s, impending) + tr_pair_of(s, m)->rate0);
    s->friction.impending_laws = 1;
  }
  if (!tr_pair_of(s, owner[0])->cone) return 0;
  if (first >= 0) return first;
  for (int i = 0; i < n; ++i) {
    tr_axis_across_force(s, owner[i], t, dt);
    double mine = fabs(t[c[i] - tr_pair_of(s, owner[i])->eta0]);
    if (mine > most) most = mine, leader = i;
  }
  return leader;
}

/* Index of a leader that carries load: `leader`, or the member with the largest capacity if `leader` carries no load at the last
 * solution. (Shares cannot be proportional to zero.) */
static int tr_find_loaded_leader(const tr_sim *s, int n, const int *c, int leader) {
  int at, loaded = leader;
  const double leads = tr_hold_of(s, tr_pair_of_multiplier(s, c[leader], &at))->capacity;
  double most = leads;
  for (int i = 0; i < n; ++i) {
    const int owner = tr_pair_of_multiplier(s, c[i], &at);
    if (tr_pair_of(s, owner)->cone) return leader;
    if (tr_hold_of(s, owner)->capacity > most) most = tr_hold_of(s, owner)->capacity, loaded = i;
  }
  return leads < LEADS_NOTHING * most ? loaded : leader;
}

/* Share a load among the multipliers c (n) of pairs that one freedom moves together. c[0] belongs to the pair that would move
 * fastest. All frictions oppose the impending motion. */
static void tr_share_along_line(tr_sim *s, int n, const int *c) {
  const double *lever = TR_A(s, lever), way = tr_unheld_acceleration(s, n, c) < 0.0 ? -1.0 : 1.0;
  double v[n];
  for (int i = 0; i < n; ++i) v[i] = way * tr_freedom_response(s, c[i], c[0]);
  const int leader = tr_find_loaded_leader(s, n, c, tr_set_impending_axes(s, n, c, v));
  if (!(fabs(v[leader]) > 0.0)) return;
  for (int i = 0; i < n; ++i) TR_A(s, share)[c[i]] = v[i] * lever[c[i]] * lever[c[i]];
  for (int i = 0; i < n; ++i)
    if (i != leader) tr_follow_leader(s, c[i], c[leader]);
}

/* Share the load of each of the `rank` freedoms separately. Returns 0 unless each multiplier belongs to a single freedom, and all
 * multipliers of a pair belong to the same freedom. first: for each freedom, the index in c of one of its multipliers. */
static int tr_share_by_lines(tr_sim *s, int n, const int *c, const int *first, int rank) {
  int line[n], at;
  for (int i = 0; i < n; ++i) {
    line[i] = rank == 1 ? 0 : -1;
    for (int q = 0; q < rank && line[i] < 0; ++q)
      if (i == first[q] || tr_are_one_freedom(s, c[first[q]], c[i])) line[i] = q;
    if (line[i] < 0) return 0;
    for (int j = 0; j < i; ++j)
      if (line[j] != line[i] && tr_pair_of_multiplier(s, c[j], &at) == tr_pair_of_multiplier(s, c[i], &at)) return 0;
  }
  for (int q = 0; q < rank; ++q) {
    int own[n], count = 1;
    own[0] = c[first[q]];
    for (int i = 0; i < n; ++i)
      if (line[i] == q && i != first[q]) own[count++] = c[i];
    if (count > 1) tr_share_along_line(s, count, own);
  }
  return 1;
}

/* Creep minimisation with a reserve: use only the smallest fraction 1 − 2⁻ᵏ of the capacities at which all pairs hold. A growing
 * load then does not overload a pair at once. */
static void tr_creep_with_reserve(tr_sim *s, tr_creep_problem *c, const int *law) {
  double *eta = TR_A(s, z) + s->k->active, start[s->k->neta + 1], spare = 1.0;
  memcpy(start, eta, sizeof(double) * s->k->neta);
  for (int rests = 0; !rests && spare > SPARE_LEAST;) {
    rests = 1, spare *= 0.5, c->share = 1.0 - spare;
    memcpy(eta, start, sizeof(double) * s->k->neta);
    tr_creep_minimise(s, c, law);
    for (int q = 0; q < c->n; ++q) rests &= tr_creep_smoothed_size(c, q) <= CREEP_MOVES * c->eps[q];
  }
}

/* Store the loads of the n multipliers c, whose responses A have the given rank. `rank` multipliers take the changes of load: those
 * with the largest reserve and a fixed direction. All others keep their loads. Returns 0 if no loads can be stored. */
static int tr_store_loads(tr_sim *s, int n, const int *c, const double *A, int rank) {
  const int e = s->k->neta;
  int law[e], pairs[n], index[n], first[n + 1], lead[n], perm[n], count = 0, at;
  double B[n * n], w0[n], w[n], x[n], u[n], cap[n], eps[n], d[n], L[n * n];
  tr_creep_problem creep = {.pairs = pairs, .index = index, .first = first, .lead = lead, .B = B, .w0 = w0, .w = w, .x = x, .u = u, .cap = cap, .eps = eps, .share = 1.0};
  for (int i = 0; i < e; ++i) law[i] = tr_row_kinds(s)[i] == TR_ROW_LAW;
  for (int i = 0; i < n; ++i) {
    const int owner = tr_pair_of_multiplier(s, c[i], &at);
    if (!tr_contains(pairs, count, owner)) pairs[count++] = owner;
  }
  creep.n = count;
  if (count <= KEPT_MORE_THAN && !s->friction.stored) return 0;
  tr_creep_collect_multipliers(s, &creep);
  if (creep.m > n) return 0;
  tr_creep_factor_responses(s, &creep);
  if (s->friction.stored != TR_STORES_PLACED) {
    if (count <= KEPT_MORE_THAN || s->friction.reserve) tr_creep_with_reserve(s, &creep, law);
    else tr_creep_minimise(s, &creep, law);
  }
  for (int i = 0; i < n; ++i) { /* a ball takes no changes of load, because the direction of its load changes with its force */
    const int owner = tr_pair_of_multiplier(s, c[i], &at);
    const double spare = fmax(1.0 - tr_friction_ratio(s, owner), 0.0) + SHARE_WEIGHT;
    d[i] = tr_pair_of(s, owner)->cone ? 0.0 : tr_hold_of(s, owner)->capacity * TR_A(s, lever)[c[i]] * spare;
  }
  if (tr_cholesky(n, A, d, L, perm, 0, 0.0, 0.0) < rank) return 0;
  for (int i = rank; i < n; ++i) tr_row_kinds(s)[c[perm[i]]] = TR_ROW_STORED;
  for (int i = 0; i < n; ++i) TR_A(s, share)[c[i]] = TR_A(s, z)[s->k->active + c[i]];
  s->friction.shared = 1;
  return 1;
}

/* Share the load of a connected set of dependent rest conditions, with multipliers c (n). (The rank is 0 only at a trial state with
 * infinite numbers; the step to this state is refused later.) */
static void tr_share_group(tr_sim *s, int n, const int *c) {
  int perm[n], owner[n], at;
  double A[n * n], L[n * n], d[n], cap[n], x[n], share[n];
  for (int i = 0; i < n; ++i) {
    owner[i] = tr_pair_of_multiplier(s, c[i], &at);
    for (int j = 0; j < n; ++j) A[i + j * n] = tr_freedom_response(s, c[i], c[j]);
    d[i] = tr_response_scale(s, c[i], A[i + i * n]);
  }
  int rank = tr_cholesky(n, A, d, L, perm, 0, RANK_PIVOT, RANK_PIVOT);
  if (rank == 0 || rank == n || (s->friction.stored && tr_store_loads(s, n, c, A, rank))) return;
  if (tr_share_by_lines(s, n, c, perm, rank) || tr_store_loads(s, n, c, A, rank)) return;
  tr_share_loads(s, n, c, owner, A, cap, x);
  const int loaded = tr_set_aside_unloaded(s, n, c, A, cap, rank, perm), active = loaded - rank + 1;
  for (int i = 0; i < n; ++i) share[i] = tr_pair_share(n, owner, cap, x, owner[i]);
  for (int i = 0; i < loaded; ++i) /* sort by share, largest first */
    for (int j = i + 1; j < loaded; ++j)
      if (share[perm[j]] > share[perm[i]]) {
        int t = perm[i];
        perm[i] = perm[j], perm[j] = t;
      }
  if (!(fabs(x[perm[0]]) > 0.0)) return;
  for (int i = 0; i < loaded; ++i) TR_A(s, share)[c[perm[i]]] = x[perm[i]];
  for (int i = 1; i < active; ++i) tr_follow_leader(s, c[perm[i]], c[perm[0]]);
}

/* In each group without balls, make the next member the leader. Returns 0 if no group changes. */
static int tr_lead_by_next(tr_sim *s) {
  const int e = s->k->neta;
  int *row = tr_row_kinds(s), any = 0, at;
  tr_leader *lead = tr_leaders(s);
  for (int i = 0; i < e; ++i) {
    if (row[i] != TR_ROW_REST) continue;
    int next = -1, balls = tr_pair_of(s, tr_pair_of_multiplier(s, i, &at))->cone;
    for (int j = 0; j < e; ++j) {
      if (row[j] != TR_ROW_SHARE || lead[j].multiplier != i) continue;
      balls |= tr_pair_of(s, tr_pair_of_multiplier(s, j, &at))->cone;
      if (next < 0 || (j > i && next < i)) next = j; /* the member that follows i cyclically */
    }
    if (next < 0 || balls) continue;
    any = 1;
    for (int j = 0; j < e; ++j)
      if (row[j] == TR_ROW_SHARE && lead[j].multiplier == i && j != next) tr_follow_leader(s, j, next);
    /* marks a new leader; the loop below replaces this mark by TR_ROW_REST, when all old leaders are handled */
    row[next] = TR_ROW_LAW;
    tr_follow_leader(s, i, next);
  }
  for (int i = 0; i < e; ++i)
    if (row[i] == TR_ROW_LAW && tr_is_stuck(s, tr_pair_of_multiplier(s, i, &at))) row[i] = TR_ROW_REST;
  return any;
}

/* Like tr_newton, with other leaders of the groups at rest. (Newton's method cannot find a root where the leader carries no
 * load.) */
static int tr_newton_with_other_leaders(tr_sim *s, const double *warm) {
  double *eta = TR_A(s, z) + s->k->active;
  for (int tried = 1; s->friction.shared && tried < s->k->nsliders; ++tried) {
    if (!tr_lead_by_next(s)) return 0;
    memcpy(eta, warm, sizeof(double) * s->k->neta);
    if (tr_newton(s, eta)) return 1;
    memset(eta, 0, sizeof(double) * s->k->neta);
    if (tr_newton(s, eta)) return 1;
  }
  return 0;
}

/* Set the rows and directions of pairs that yield. In an impulse step no pair yields, because the step decides all modes anew. */
static void tr_set_yielding_rows(tr_sim *s) {
  int *row = tr_row_kinds(s);
  for (int m = 0; m < s->k->nsliders && !(s->moreau.h > 0.0); ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    for (int j = 0; j < pair->neta && tr_yields(s, m); ++j) {
      const int i = pair->eta0 + j;
      if (row[i] != TR_ROW_REST) continue;
      row[i] = TR_ROW_FULL, s->friction.shared = 1;
      TR_A(s, share)[i] = tr_mode_of(s, m)->direction[j] * TR_A(s, lever)[i] * TR_A(s, lever)[i];
    }
  }
}

/* Find the groups of stuck pairs that one freedom would move together, and share their loads. Requires held maps. */
static void tr_share_groups(tr_sim *s) {
  tr_form_all_maps(s);
  const tr_kernel *k = s->k;
  int e = k->neta, *row = tr_row_kinds(s), left[e + 1], c[e + 1];
  const double *Qe = TR_A(s, Q) + e;
  memset(TR_A(s, share), 0, sizeof(double) * e);
  memset(TR_A(s, impending), 0, sizeof(double) * k->nrates);
  tr_set_yielding_rows(s);
  for (int i = 0; i < e; ++i) left[i] = row[i] == TR_ROW_REST;
  for (int i = 0; i < e; ++i) {
    if (!left[i]) continue;
    int n = 0;
    c[n++] = i, left[i] = 0;
    for (int p = 0; p < n; ++p)
      for (int j = 0; j < e; ++j)
        if (left[j] && Qe[c[p] + j * e] * Qe[c[p] + j * e] > GROUP_COUPLED * Qe[c[p] + c[p] * e] * Qe[j + j * e]) c[n++] = j, left[j] = 0;
    if (n > 1) tr_share_group(s, n, c);
  }
}
