/* Set-valued friction: which pairs stick and which slip, and what that asks of the state (METHOD, "Rest").
 *
 * Within a step modes and directions are frozen. At an event all pairs at rest are decided together: all are tried as stuck, and only
 * the worst violator is turned, until none is left; failing that, other starts and, for few pairs, all combinations. A pair sticks
 * while the friction it needs stays within what it can hold; it slips when friction then opposes its acceleration. */
#include "modes.h"

#define REST_SPEED 1e-11   /* of the speed unit: at rest */
#define TOL_RESOLVE 1e-11  /* of the friction ratio, when modes are decided (below TOL_RELEASE: no dwell time is needed) */
#define TOL_TWIST 1e-9     /* of the capacity: torque about the force that a ball at rest may have to hold */
#define PRESCRIBED 1e-9    /* response of a freedom through the loops over its own: below it, its motion is prescribed */
#define DECIDE_MAX 40
#define SHARE_MAX 30
#define SHARE_SAME 1e-3 /* of the largest share */
#define SHARE_WEIGHT 1e-6

/* Surface speed of a pair, m/s, from its rates. */
static double tr_pair_speed(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *r = map_rates(s->k, TR_A(s, maps)) + pair->rate0, *arm = TR_A(s, arm) + pair->eta0;
  double sum = 0.0;
  for (int j = 0; j < pair->nrates; ++j) sum += r[j] * r[j] * arm[j] * arm[j];
  return sqrt(sum);
}

/* Rates of a pair at the start of a step, when the maps in place may be of another state. */
static void tr_rates_of_state(tr_sim *s, int i, double *rates) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *from = TR_A(s, y) + s->k->nq + pair->v0;
  if (pair->v0 < 0) {
    tr_set_time(s, s->clock.t);
    s->k->stage1(TR_A(s, x), TR_A(s, y), TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, ytmp));
    from = map_rates(s->k, TR_A(s, maps)) + pair->rate0;
  }
  memcpy(rates, from, sizeof(double) * pair->nrates);
}

/* Directions of laws with a kink at rest, where a step starts past it (no events are located). */
static void tr_turn_directions(tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    double rate[3], *side = tr_mode_of(s, i)->direction;
    if (!tr_is_turn(s, i)) continue;
    tr_rates_of_state(s, i, rate);
    if (rate[0] * side[0] < 0.0) side[0] = -side[0];
  }
}

static double tr_speed_of_state(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double r[3], sum = 0.0;
  tr_rates_of_state(s, i, r);
  for (int j = 0; j < pair->nrates; ++j) sum += r[j] * r[j] * TR_A(s, arm)[pair->eta0 + j] * TR_A(s, arm)[pair->eta0 + j];
  return sqrt(sum);
}

/* Levers that turn rates into surface speeds: from the size of unit frictions. */
static void tr_set_arms(tr_sim *s) {
  const tr_kernel *k = s->k;
  double u[k->neta + 1], none[k->nn + 1];
  memset(none, 0, sizeof none);
  for (int part = 0; part < 3; ++part) {
    memset(u, 0, sizeof u);
    for (int i = 0; i < k->nsliders; ++i)
      if (part < tr_pair_of(s, i)->neta) u[tr_pair_of(s, i)->eta0 + part] = 1.0;
    k->held(none, u, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
    for (int i = 0; i < k->nsliders; ++i)
      if (part < tr_pair_of(s, i)->neta) TR_A(s, arm)[tr_pair_of(s, i)->eta0 + part] = 1.0 / fmax(tr_hold_of(s, i)->size, 1e-300);
  }
}

/* What all pairs hold of the friction in place (z): fills `hold`. */
static void tr_holding(tr_sim *s) {
  const tr_kernel *k = s->k;
  k->held(TR_A(s, NN), TR_A(s, z) + k->active, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
}

/* Friction ratio needed over the ratio available, after tr_holding. */
static double tr_ratio(const tr_sim *s, int i) {
  const tr_hold *h = tr_hold_of(s, i);
  double cap = fmax(h->capacity, 1e-300);
  if (h->size <= 1e-290) return 0.0;
  return h->beyond > TOL_TWIST * cap ? fmax(h->size / cap, 1.0 + h->beyond / cap) : h->size / cap;
}

static void tr_group(tr_sim *s);

/* How each multiplier is found in the modes in force. The maps of the state must be in place. */
static void tr_note_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, *row = tr_row_kinds(s);
  s->friction.still = s->friction.shares = 0;
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    int stuck = tr_is_stuck(s, i) || i == s->friction.freed;
    for (int j = 0; j < pair->neta; ++j) row[pair->eta0 + j] = i == s->friction.freed ? TR_ROW_FREE : stuck ? TR_ROW_STILL : TR_ROW_LAW;
    s->friction.still += stuck;
  }
  if (!s->friction.still) return;
  double lam0[a + 1];
  if (a) tr_factor(s);
  tr_eliminate(s, lam0);
  tr_held_maps(s, lam0);
  const double *Qe = TR_A(s, Q) + e, *raw = map_Qe(k, TR_A(s, maps));
  for (int i = 0; i < e; ++i)
    if (row[i] == TR_ROW_STILL && !(fabs(Qe[i + i * e]) > PRESCRIBED * fabs(raw[i + i * e]))) row[i] = TR_ROW_FREE;
  tr_group(s);
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

/* Loads x (n) of least largest share of capacity among those that leave no motion: A x = b (A: n×n response, rank r), by
 * reweighting (Lawson's algorithm: a share's weight in the sum of squares grows with its size). */
static void tr_least_share(int n, const double *A, const double *cap, const double *b, double *x) {
  double w[n], W[n * n], L[n * n], d[n], v[n];
  int perm[n];
  for (int i = 0; i < n; ++i) w[i] = 1.0;
  for (int it = 0; it < 300; ++it) { /* x = D Aᵀ (A D Aᵀ)⁺ b with D = cap²/w: least Σ w x²/cap² */
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double sum = 0.0;
        for (int q = 0; q < n; ++q) sum += A[i + q * n] * cap[q] * cap[q] / w[q] * A[j + q * n];
        W[i + j * n] = sum;
      }
    for (int i = 0; i < n; ++i) d[i] = W[i + i * n] > 0.0 ? 1.0 / sqrt(W[i + i * n]) : 1.0;
    int rank = tr_cholesky(n, W, d, L, perm, 0, 1e-10, 1e-10);
    tr_cholesky_solve(n, rank, L, perm, d, b, v);
    double total = 0.0;
    for (int q = 0; q < n; ++q) {
      double sum = 0.0;
      for (int i = 0; i < n; ++i) sum += A[i + q * n] * v[i];
      x[q] = cap[q] * cap[q] / w[q] * sum;
      total += w[q] *= fabs(x[q]) / cap[q];
    }
    if (!(total > 0.0)) return;
    for (int q = 0; q < n; ++q) w[q] = fmax(w[q] * n / total, SHARE_WEIGHT);
  }
}

/* Loads x of the multipliers c that leave no motion and ask for the least largest share of capacity. Capacities (cap) follow from the
 * loads, by iteration; the loads it ends with are where the multipliers' solution then starts (from none at all there may be no way:
 * without friction the pairs would carry quite other forces). */
static void tr_share_loads(tr_sim *s, int n, const int *c, const double *A, double *cap, double *x) {
  const tr_kernel *k = s->k;
  int e = k->neta, at;
  const double *Qe = TR_A(s, Q) + e;
  double unit[e + 1], mine[e + 1], b[n], *eta = TR_A(s, z) + k->active, moved = INFINITY;
  memset(mine, 0, sizeof mine);
  for (int i = 0; i < n; ++i) mine[c[i]] = 1.0, b[i] = TR_A(s, Q)[c[i]];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < e; ++j) b[i] += (1.0 - mine[j]) * Qe[c[i] + j * e] * eta[j];
  for (int it = 0; it < SHARE_MAX && moved > SHARE_SAME; ++it) {
    double size = 0.0;
    moved = 0.0;
    tr_law(s, eta);
    for (int i = 0; i < n; ++i) {
      memset(unit, 0, sizeof unit);
      unit[c[i]] = 1.0;
      int m = tr_owner(s, c[i], &at);
      k->held(TR_A(s, NN), unit, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
      cap[i] = fmax(tr_hold_of(s, m)->capacity / tr_hold_of(s, m)->size, 1e-12);
    }
    tr_least_share(n, A, cap, b, x);
    for (int i = 0; i < n; ++i) {
      moved = fmax(moved, fabs(x[i] - eta[c[i]]) / cap[i]), size = fmax(size, fabs(x[i]) / cap[i]);
      eta[c[i]] = x[i];
    }
    moved /= size;
  }
}

/* One connected set `c` (n multipliers) of rest conditions: where they depend on each other, the members that carry the largest share
 * of their capacity do so equally. */
static void tr_group_of(tr_sim *s, int n, const int *c) {
  const tr_kernel *k = s->k;
  int e = k->neta, perm[n];
  const double *Qe = TR_A(s, Q) + e;
  double A[n * n], L[n * n], d[n], cap[n], x[n], *u = TR_A(s, share), *arm = TR_A(s, arm);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) A[i + j * n] = -0.5 * (Qe[c[i] + c[j] * e] + Qe[c[j] + c[i] * e]);
    d[i] = 1.0 / sqrt(A[i + i * n]);
  }
  int rank = tr_cholesky(n, A, d, L, perm, 0, 1e-9, 1e-9), active = n - rank + 1;
  if (rank == n) return;
  int leader = perm[0];
  if (rank == 1) { /* one freedom: all oppose its motion */
    for (int i = 0; i < n; ++i) x[i] = A[i + leader * n] * arm[c[i]] * arm[c[i]];
  } else {
    tr_share_loads(s, n, c, A, cap, x);
    for (int i = 0; i < n; ++i) perm[i] = i;
    for (int i = 0; i < n; ++i) /* by share, largest first */
      for (int j = i + 1; j < n; ++j)
        if (fabs(x[perm[j]]) / cap[perm[j]] > fabs(x[perm[i]]) / cap[perm[i]]) {
          int t = perm[i];
          perm[i] = perm[j], perm[j] = t;
        }
    leader = perm[0];
  }
  if (!(fabs(x[leader]) > 0.0)) return;
  for (int i = 0; i < active; ++i) u[c[perm[i]]] = x[perm[i]];
  for (int i = 1; i < active; ++i) tr_share_with(s, c[perm[i]], c[leader]);
}

/* Redundant rest conditions: several stuck pairs that one freedom would move together. */
static void tr_group(tr_sim *s) {
  const tr_kernel *k = s->k;
  int e = k->neta, *row = tr_row_kinds(s), left[e + 1], c[e + 1];
  const double *Qe = TR_A(s, Q) + e;
  for (int i = 0; i < e; ++i) left[i] = row[i] == TR_ROW_STILL;
  memset(TR_A(s, share), 0, sizeof(double) * e);
  for (int i = 0; i < e; ++i) {
    if (!left[i]) continue;
    int n = 0;
    c[n++] = i, left[i] = 0;
    for (int p = 0; p < n; ++p)
      for (int j = 0; j < e; ++j)
        if (left[j] && Qe[c[p] + j * e] * Qe[c[p] + j * e] > 1e-16 * Qe[c[p] + c[p] * e] * Qe[j + j * e]) c[n++] = j, left[j] = 0;
    if (n > 1) tr_group_of(s, n, c);
  }
}

/* Acceleration of multiplier i's freedom at the solution in place. */
static double tr_freedom_acceleration(tr_sim *s, int i) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e, *eta = TR_A(s, z) + k->active;
  double acc = Q0[i];
  for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j];
  return acc;
}

/* Solve for the multipliers in the modes in force, and make the accelerations of the sliding freedoms available. */
static int tr_solve_modes(tr_sim *s) {
  const tr_kernel *k = s->k;
  int a = k->active;
  tr_note_modes(s);
  if (!tr_multipliers(s)) return 0;
  if (!s->friction.still) {
    double lam0[a + 1];
    for (int i = 0; i < a; ++i) {
      lam0[i] = TR_A(s, z)[i];
      for (int j = 0; j < k->neta; ++j) lam0[i] += TR_A(s, T)[i + j * a] * TR_A(s, z)[a + j];
    }
    tr_held_maps(s, lam0);
  }
  tr_law(s, TR_A(s, z) + a);
  tr_holding(s);
  return 1;
}
