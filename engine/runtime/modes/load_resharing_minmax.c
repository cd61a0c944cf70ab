/* Stored loads that minimise the largest share of capacity among the pairs at rest (theory, "Shared loads"). The minimum depends
 * only on the state, and so does the time of release. A search that stopped early would make the release depend on earlier
 * loads. */
#include "modes/modes.h"

/* relative to the capacity: the search ends when the largest share is below this value. (A minimum may not exist, because growing
 * preloads may raise capacities without limit.) */
#define SHARE_ENOUGH 0.9
#define PRESSED_MOST 10.0  /* relative to the largest friction: upper limit of a stored load */
#define SPARE_TRIED 1e-6   /* relative to the capacity: change of a stored load in difference quotients */
#define SPARE_FIRST 0.1    /* relative to the capacity: first trust-region radius */
/* relative to the expected gain: if a step gains less, the trust-region radius is multiplied by this number */
#define SPARE_REFUSED 0.25
#define SPARE_TAKEN 3.0    /* factor on the trust-region radius after an accepted step */
#define SPARE_GAIN 1e-10   /* relative to the capacity: the search continues while a step gains more */
#define SPARE_SOLVED 400   /* largest number of solutions of the friction equations */
#define MOVED_FIRST 0.1    /* relative to the capacity: first change of a load in the one-by-one search */
#define MOVED_LEAST 1e-3   /* relative to the capacity: smallest change of a load in the one-by-one search */
#define MOVES_MOST 200     /* largest number of trials in the one-by-one search */
#define SPARE_WEIGHTS 300  /* number of exchanges of weight between two pairs; each costs one inner product */

/* The pairs that stick, and their stored loads. Comments give array sizes before the colon. */
typedef struct tr_minmax_problem {
  int n, m;
  const int *pairs, *kept; /* n: pairs; m: multipliers of the stored loads */
  double most, *unit;      /* largest friction allowed, N; m: units of the stored loads */
  double *share, *slope;   /* n: shares of capacity; m×n: derivatives of the shares by the stored loads, in these units */
} tr_minmax_problem;

static double tr_largest_share(const tr_sim *s, const int *rest, int n) {
  double worst = 0.0;
  for (int q = 0; q < n; ++q) worst = fmax(worst, tr_friction_ratio(s, rest[q]));
  return worst;
}

/* Write the shares of the pairs at the present stored loads to `share`. Returns the largest share. Returns INFINITY if there is no
 * root, or if the largest friction exceeds its limit. */
static double tr_minmax_shares(tr_sim *s, const tr_minmax_problem *c, double *share) {
  double *eta = TR_A(s, z) + s->k->active, worst = 0.0;
  if (!tr_newton(s, eta) || !(tr_largest_surface_friction(s) <= c->most)) return INFINITY;
  tr_evaluate_laws(s, eta);
  tr_evaluate_capacities(s);
  for (int q = 0; q < c->n; ++q) share[q] = tr_friction_ratio(s, c->pairs[q]), worst = fmax(worst, share[q]);
  return worst;
}

/* Derivatives of the shares by the stored loads, from differences. Returns 0 on failure. */
static int tr_minmax_slopes(tr_sim *s, tr_minmax_problem *c) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *load = TR_A(s, share), old[e], moved[c->n];
  memcpy(old, eta, sizeof old);
  for (int j = 0; j < c->m; ++j) {
    const double was = load[c->kept[j]];
    load[c->kept[j]] = was + SPARE_TRIED * c->unit[j];
    const double worst = tr_minmax_shares(s, c, moved);
    load[c->kept[j]] = was;
    memcpy(eta, old, sizeof old);
    if (!(worst < INFINITY)) return 0;
    for (int q = 0; q < c->n; ++q) c->slope[j + q * c->m] = (moved[q] - c->share[q]) / SPARE_TRIED;
  }
  return 1;
}

/* Find the change d (m) of the loads that minimises the largest linearised share plus |d|²/(2 reach). In the dual problem, d =
 * −reach Σ w slope, with weights w ≥ 0 that add up to 1. Each iteration moves weight from one pair to another. Returns the expected
 * decrease. */
static double tr_minmax_step(const tr_minmax_problem *c, double reach, double *d) {
  double w[c->n], now = 0.0, then = -INFINITY;
  for (int q = 0; q < c->n; ++q) w[q] = 1.0 / c->n, now = fmax(now, c->share[q]);
  memset(d, 0, sizeof(double) * c->m);
  for (int q = 0; q < c->n; ++q)
    for (int j = 0; j < c->m; ++j) d[j] -= reach * w[q] * c->slope[j + q * c->m];
  for (int it = 0; it < SPARE_WEIGHTS; ++it) {
    int up = -1, down = -1;
    double high = -INFINITY, low = INFINITY, bend = 0.0;
    for (int q = 0; q < c->n; ++q) {
      const double share = c->share[q] + tr_dot(c->slope + q * c->m, d, c->m);
      if (share > high) high = share, up = q;
      if (w[q] > 0.0 && share < low) low = share, down = q;
    }
    if (!(high - low > SPARE_GAIN)) break;
    const double *to = c->slope + up * c->m, *from = c->slope + down * c->m;
    for (int j = 0; j < c->m; ++j) bend += (to[j] - from[j]) * (to[j] - from[j]);
    const double by = bend > 0.0 ? fmin((high - low) / (reach * bend), w[down]) : w[down];
    w[up] += by, w[down] = by < w[down] ? w[down] - by : 0.0;
    for (int j = 0; j < c->m; ++j) d[j] -= reach * by * (to[j] - from[j]);
  }
  for (int q = 0; q < c->n; ++q) then = fmax(then, c->share[q] + tr_dot(c->slope + q * c->m, d, c->m));
  return now - then;
}

/* Minimise the largest share by steps of tr_minmax_step, down to SHARE_ENOUGH. Returns the largest share. */
static double tr_minmax_descend(tr_sim *s, tr_minmax_problem *c) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *load = TR_A(s, share), d[c->m], old[e], was[e], moved[c->n], reach = SPARE_FIRST;
  double best = tr_minmax_shares(s, c, c->share);
  for (int solved = 1, known = 0; solved < SPARE_SOLVED && best > SHARE_ENOUGH && best < INFINITY; ++solved) {
    if (!known && !tr_minmax_slopes(s, c)) break;
    solved += known ? 0 : c->m;
    const double gain = tr_minmax_step(c, reach, d);
    if (!(gain > SPARE_GAIN)) break;
    memcpy(old, eta, sizeof old), memcpy(was, load, sizeof was);
    for (int j = 0; j < c->m; ++j) load[c->kept[j]] += d[j] * c->unit[j];
    const double worst = tr_minmax_shares(s, c, moved);
    known = !(best - worst > SPARE_REFUSED * gain);
    if (known) {
      memcpy(eta, old, sizeof old), memcpy(load, was, sizeof was);
      reach *= SPARE_REFUSED;
    } else {
      best = worst, reach *= SPARE_TAKEN;
      memcpy(c->share, moved, sizeof moved);
    }
  }
  return best;
}

/* Change one load after another, by decreasing amounts, while the largest share falls. Where loads press pairs together, the
 * largest share has several local minima; this search can leave local minima at which tr_minmax_descend ends. */
static void tr_minmax_one_by_one(tr_sim *s, tr_minmax_problem *c) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *load = TR_A(s, share), old[e], best = tr_minmax_shares(s, c, c->share);
  int tried = 0;
  for (double part = MOVED_FIRST; part >= MOVED_LEAST && tried < MOVES_MOST; part *= 0.5)
    for (int j = 0; j < c->m && best > SHARE_ENOUGH; ++j) {
      double by = part * c->unit[j];
      for (int failed = 0; failed < 2 && best > SHARE_ENOUGH && tried < MOVES_MOST; ++tried) {
        const double was = load[c->kept[j]];
        memcpy(old, eta, sizeof old);
        load[c->kept[j]] += by;
        const double worst = tr_minmax_shares(s, c, c->share);
        if (worst < best) best = worst, by *= 2.0;
        else memcpy(eta, old, sizeof old), load[c->kept[j]] = was, by = failed++ ? by : -part * c->unit[j];
      }
    }
}

/* Change the stored loads until the largest share of the stuck pairs in `rest` is minimal, or below SHARE_ENOUGH. Each trial solves
 * the equations, because capacities depend on all loads. Requires tr_solve_in_modes. */
static void tr_minimise_stored_shares(tr_sim *s, const int *rest, int n) {
  const int e = s->k->neta;
  int pairs[n], kept[e], at;
  double unit[e], share[n], slope[(size_t)n * e], *eta = TR_A(s, z) + s->k->active;
  tr_minmax_problem c = {.pairs = pairs, .kept = kept, .unit = unit, .share = share, .slope = slope, .most = PRESSED_MOST * tr_largest_surface_friction(s)};
  for (int q = 0; q < n; ++q)
    if (tr_is_stuck(s, rest[q])) pairs[c.n++] = rest[q];
  for (int i = 0; i < e; ++i)
    if (tr_row_kinds(s)[i] == TR_ROW_STORED) {
      const double holds = tr_hold_of(s, tr_pair_of_multiplier(s, i, &at))->capacity;
      if (holds > 0.0) kept[c.m] = i, unit[c.m++] = holds * TR_A(s, lever)[i];
    }
  if (c.n && c.m && !(tr_minmax_descend(s, &c) <= 1.0)) {
    tr_minmax_one_by_one(s, &c);
    tr_minmax_descend(s, &c);
  }
  tr_solve_multipliers(s, 1);
  tr_evaluate_laws(s, eta);
  tr_evaluate_capacities(s);
}
