/* Loads that are kept where the worst of the pairs at rest carries the least share of what it can hold (METHOD, "Shared loads"): a minimum of a
 * maximum, in as many unknowns as loads are kept. It hangs on the state alone where it is found to the last digits, and so does when the group
 * lets go; what stops short of it lets go at times that hang on how the run came there. */
#include "modes.h"

#define SHARE_ENOUGH 0.9   /* of what a pair can hold: no less is sought, for what pairs hold grows with what they press each other with, */
#define PRESSED_MOST 10.0  /* and no load may grow by more than this */
#define SPARE_TRIED 1e-6   /* of what a pair can hold, for the derivative by its load */
#define SPARE_FIRST 0.1    /* of what a pair can hold: about so far loads are moved first; */
#define SPARE_REFUSED 0.25 /* less by this where the largest share falls by less than that part of what it should, */
#define SPARE_TAKEN 3.0    /* and else more by this */
#define SPARE_GAIN 1e-10   /* of what a pair can hold: less to be gained is none */
#define SPARE_SOLVED 400   /* times the equations are solved */
#define MOVED_FIRST 0.1    /* of what a pair can hold: by so much a load is moved first where loads are moved by turns, */
#define MOVED_LEAST 1e-3   /* and last */
#define MOVES_MOST 200     /* such loads tried */
#define SPARE_WEIGHTS 300  /* exchanges of weight between two pairs; each is as cheap as an inner product */

/* The problem: pairs that stick, loads that are kept. */
typedef struct tr_sparing {
  int n, m;
  const int *pairs, *kept; /* n; m: multipliers */
  double most, *unit;      /* the largest friction there may be, N; m: of the loads */
  double *share, *slope;   /* n: shares; m×n: their derivatives by the loads over their units */
} tr_sparing;

/* The largest share of what they can hold that the pairs `rest` carry; after tr_holding. */
static double tr_worst_share(const tr_sim *s, const int *rest, int n) {
  double worst = 0.0;
  for (int q = 0; q < n; ++q) worst = fmax(worst, tr_ratio(s, rest[q]));
  return worst;
}

/* The largest friction in place, N. */
static double tr_most_friction(const tr_sim *s) {
  double most = 0.0;
  for (int i = 0; i < s->k->neta; ++i) most = fmax(most, fabs(TR_A(s, z)[s->k->active + i]) / TR_A(s, arm)[i]);
  return most;
}

/* Shares of the pairs with the loads in place, into `share`; the largest. Without a bound where there is no root, or a friction is too large. */
static double tr_spare_shares(tr_sim *s, const tr_sparing *c, double *share) {
  double *eta = TR_A(s, z) + s->k->active, worst = 0.0;
  if (!tr_newton(s, eta) || !(tr_most_friction(s) <= c->most)) return INFINITY;
  tr_law(s, eta);
  tr_holding(s);
  for (int q = 0; q < c->n; ++q) share[q] = tr_ratio(s, c->pairs[q]), worst = fmax(worst, share[q]);
  return worst;
}

/* Derivatives of the shares by the loads; 0: not to be had. */
static int tr_spare_slopes(tr_sim *s, tr_sparing *c) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *load = TR_A(s, share), old[e], moved[c->n];
  memcpy(old, eta, sizeof old);
  for (int j = 0; j < c->m; ++j) {
    const double was = load[c->kept[j]];
    load[c->kept[j]] = was + SPARE_TRIED * c->unit[j];
    const double worst = tr_spare_shares(s, c, moved);
    load[c->kept[j]] = was;
    memcpy(eta, old, sizeof old);
    if (!(worst < INFINITY)) return 0;
    for (int q = 0; q < c->n; ++q) c->slope[j + q * c->m] = (moved[q] - c->share[q]) / SPARE_TRIED;
  }
  return 1;
}

/* Where the largest of the linear shares and |d|²/(2 reach) are least together: d = −reach Σ w slope, with weights w ≥ 0 of sum 1, which are
 * exchanged between the two pairs that gain most by it. How much the largest share should fall is returned. */
static double tr_spare_step(const tr_sparing *c, double reach, double *d) {
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

/* Go there from the loads in place, step by step, until it is enough: the largest share. */
static double tr_spare_by(tr_sim *s, tr_sparing *c) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *load = TR_A(s, share), d[c->m], old[e], was[e], moved[c->n], reach = SPARE_FIRST;
  double best = tr_spare_shares(s, c, c->share);
  for (int solved = 1, known = 0; solved < SPARE_SOLVED && best > SHARE_ENOUGH && best < INFINITY; ++solved) {
    if (!known && !tr_spare_slopes(s, c)) break;
    solved += known ? 0 : c->m;
    const double gain = tr_spare_step(c, reach, d);
    if (!(gain > SPARE_GAIN)) break;
    memcpy(old, eta, sizeof old), memcpy(was, load, sizeof was);
    for (int j = 0; j < c->m; ++j) load[c->kept[j]] += d[j] * c->unit[j];
    const double worst = tr_spare_shares(s, c, moved);
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

/* The same by turns: one load after the other by less and less, as long as the largest share falls. Where loads press pairs together shares have
 * several least ones; this passes by some that the other way stops at. */
static void tr_spare_by_turns(tr_sim *s, tr_sparing *c) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *load = TR_A(s, share), old[e], best = tr_spare_shares(s, c, c->share);
  int tried = 0;
  for (double part = MOVED_FIRST; part >= MOVED_LEAST && tried < MOVES_MOST; part *= 0.5)
    for (int j = 0; j < c->m && best > SHARE_ENOUGH; ++j) {
      double by = part * c->unit[j];
      for (int failed = 0; failed < 2 && best > SHARE_ENOUGH && tried < MOVES_MOST; ++tried) {
        const double was = load[c->kept[j]];
        memcpy(old, eta, sizeof old);
        load[c->kept[j]] += by;
        const double worst = tr_spare_shares(s, c, c->share);
        if (worst < best) best = worst, by *= 2.0;
        else memcpy(eta, old, sizeof old), load[c->kept[j]] = was, by = failed++ ? by : -part * c->unit[j];
      }
    }
}

/* Move the loads that are kept to where the worst share of those of the pairs `rest` that stick is least, or enough. What pairs can hold hangs on
 * their loads, which all change with one: that is why the equations are solved for all that are tried. After tr_solve_modes. */
static void tr_spare(tr_sim *s, const int *rest, int n) {
  const int e = s->k->neta;
  int pairs[n], kept[e], at;
  double unit[e], share[n], slope[(size_t)n * e], *eta = TR_A(s, z) + s->k->active;
  tr_sparing c = {.pairs = pairs, .kept = kept, .unit = unit, .share = share, .slope = slope, .most = PRESSED_MOST * tr_most_friction(s)};
  for (int q = 0; q < n; ++q)
    if (tr_is_stuck(s, rest[q])) pairs[c.n++] = rest[q];
  for (int i = 0; i < e; ++i)
    if (tr_row_kinds(s)[i] == TR_ROW_KEPT) {
      const double holds = tr_hold_of(s, tr_owner(s, i, &at))->capacity;
      if (holds > 0.0) kept[c.m] = i, unit[c.m++] = holds * TR_A(s, arm)[i];
    }
  if (c.n && c.m && !(tr_spare_by(s, &c) <= 1.0)) {
    tr_spare_by_turns(s, &c);
    tr_spare_by(s, &c);
  }
  tr_multipliers(s, 1);
  tr_law(s, eta);
  tr_holding(s);
}
