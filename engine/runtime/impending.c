/* Shares of a load that pairs at rest carry together, each a number η_i in proportion to a value of its own (METHOD, "Shared loads").
 *
 * One component: what the pair can hold. A ball in a group that one freedom would move: the friction it would have in that motion, so
 * that the group lets go exactly where all of it can slide. A ball holds no torque about its force, which turns while it holds. Where that
 * has no solution (near a ball's cone friction is no smooth function of the force): what it can hold, times the part of the turning
 * axis of that motion that lies across its force. */
#include "modes.h"

#define NO_PRESSURE 1e-300 /* N: stands for a force of nothing, so that it can be divided by */

/* Whether pair m is a ball of such a group: then the axis of its motion there is given. */
static inline int tr_impends(const tr_sim *s, int m) {
  const double *w = TR_A(s, impend) + tr_pair_of(s, m)->rate0;
  return tr_pair_of(s, m)->cone && (w[0] != 0.0 || w[1] != 0.0 || w[2] != 0.0);
}

/* Part of ball m's axis across its force f, and its derivative by f (3×3, a column each). */
static void tr_across(const tr_sim *s, int m, double *t, double *dt) {
  const double *w = TR_A(s, impend) + tr_pair_of(s, m)->rate0, *f = TR_A(s, NN) + s->k->element[tr_pair_of(s, m)->element].n0;
  double F = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]) + NO_PRESSURE, along = (f[0] * w[0] + f[1] * w[1] + f[2] * w[2]) / F;
  for (int i = 0; i < 3; ++i) {
    t[i] = w[i] - f[i] / F * along;
    for (int q = 0; q < 3; ++q) dt[i + 3 * q] = -((i == q) * along + f[i] / F * (w[q] - 2.0 * f[q] / F * along)) / F;
  }
}

/* The law of all pairs (limit, dlimit) at the reactions in place, balls whose motion impends sliding that way, or turning in their cone. */
static void tr_impending_law(tr_sim *s) {
  const tr_kernel *k = s->k;
  double x[k->nx], rates[k->nrates + 1];
  tr_sliding speed[k->nsliders + 1];
  tr_mode *modes = (tr_mode *)(x + ((const double *)tr_mode_of(s, 0) - TR_A(s, x)));
  memcpy(x, TR_A(s, x), sizeof x);
  memcpy(rates, map_rates(k, TR_A(s, maps)), sizeof(double) * k->nrates);
  for (int m = 0; m < k->nsliders; ++m) {
    if (!tr_impends(s, m)) continue;
    int r0 = tr_pair_of(s, m)->rate0;
    modes[m].flag = TR_SLIPS, modes[m].tilt = 0.0;
    for (int j = 0; j < 3; ++j) modes[m].direction[j] = rates[r0 + j] = TR_A(s, impend)[r0 + j];
  }
  for (int pass = 0, inside = 1; pass < 2 && inside; ++pass) {
    k->laws(TR_A(s, NN), rates, x, TR_A(s, c) + k->c_laws, TR_A(s, limit), TR_A(s, dlimit), (double *)speed);
    inside = 0;
    for (int m = 0; m < k->nsliders && pass == 0; ++m)
      if (tr_impends(s, m) && speed[m].cone < 0.0) modes[m].flag = TR_CONE, inside = 1;
  }
}

/* Value of multiplier i of pair m (its derivative of the capacity begins at `at`), and its derivative by η into d (neta). */
static double tr_share_value(tr_sim *s, int m, int at, int i, double *d) {
  const tr_kernel *k = s->k;
  int e = k->neta, n = k->nn, impends = tr_impends(s, m), ball = impends && !s->friction.by_law, part = i - tr_pair_of(s, m)->eta0;
  const tr_element *el = k->element + tr_pair_of(s, m)->element;
  const tr_hold *hold = tr_hold_of(s, m);
  const double *Ne = tr_by_friction(s);
  double t[3], dt[9], unit = ball ? TR_A(s, arm)[i] : TR_A(s, share)[i] / hold->size;
  if (impends && !ball) {
    for (int j = 0; j < e; ++j) {
      d[j] = 0.0;
      for (int q = 0; q < el->needs; ++q) d[j] += TR_A(s, dlimit)[el->dn0 + i - el->eta0 + q * el->neta] * Ne[el->n0 + q + j * n];
    }
    return TR_A(s, limit)[i];
  }
  if (ball) tr_across(s, m, t, dt);
  for (int j = 0; j < e; ++j) {
    d[j] = 0.0;
    for (int q = 0; q < el->needs; ++q) {
      double slope = TR_A(s, dhold)[at + q];
      if (ball) slope = slope * t[part] + (q < 3 ? hold->capacity * dt[part + 3 * q] : 0.0);
      d[j] += unit * slope * Ne[el->n0 + q + j * n];
    }
  }
  return unit * hold->capacity * (ball ? t[part] : 1.0);
}

/* Residual and row i of the Jacobian J of a multiplier of pair m that carries a share of a group's load: it is to the leader's as their
 * values are. */
static double tr_share_row(tr_sim *s, int m, int at, int i, const double *eta, double *J) {
  int e = s->k->neta;
  const tr_leader *lead = tr_leaders(s) + i;
  double d[e], dl[e], mine = tr_share_value(s, m, at, i, d), leads = tr_share_value(s, lead->pair, lead->dhold, lead->multiplier, dl);
  double part = mine / leads, load = eta[lead->multiplier];
  for (int j = 0; j < e; ++j) J[i + j * e] = (i == j) - load / leads * (d[j] - part * dl[j]) - (j == lead->multiplier ? part : 0.0);
  return load * part - eta[i];
}

/* Residual and row i of the Jacobian J of a multiplier of pair m that keeps its load: what of that lies across the force, where it is a ball's. */
static double tr_kept_row(const tr_sim *s, int m, int i, const double *eta, double *J) {
  const int e = s->k->neta, nn = s->k->nn, first = tr_pair_of(s, m)->eta0, n0 = s->k->element[tr_pair_of(s, m)->element].n0;
  const double *kept = TR_A(s, share) + first, *f = TR_A(s, NN) + n0, *Ne = tr_by_friction(s) + n0;
  for (int j = 0; j < e; ++j) J[i + j * e] = i == j;
  if (!tr_pair_of(s, m)->cone) return kept[i - first] - eta[i];
  double F = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] + NO_PRESSURE, along = (f[0] * kept[0] + f[1] * kept[1] + f[2] * kept[2]) / F;
  for (int j = 0; j < e; ++j, Ne += nn) {
    double turn = (kept[0] * Ne[0] + kept[1] * Ne[1] + kept[2] * Ne[2] - 2.0 * along * (f[0] * Ne[0] + f[1] * Ne[1] + f[2] * Ne[2])) / F;
    J[i + j * e] += turn * f[i - first] + along * Ne[i - first];
  }
  return kept[i - first] - along * f[i - first] - eta[i];
}

/* Groups whose load has come to pull the other way than their motion was taken to impend (friction of the leading multiplier against its
 * value): they are turned round. 1 when balls were, whose friction then is another. After tr_newton. */
static int tr_turn_impending(tr_sim *s, const double *eta) {
  const tr_kernel *k = s->k;
  int turns[k->neta], turned = 0;
  double d[k->neta];
  memset(turns, 0, sizeof turns);
  for (int i = 0; i < k->neta; ++i) {
    const tr_leader *lead = tr_leaders(s) + i;
    if (tr_row_kinds(s)[i] != TR_ROW_SHARE) continue;
    turns[i] = turns[lead->multiplier] = eta[lead->multiplier] * tr_share_value(s, lead->pair, lead->dhold, lead->multiplier, d) < 0.0;
  }
  for (int m = 0; m < k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    const int ball = tr_impends(s, m);
    for (int j = 0; j < pair->neta; ++j) {
      if (!turns[pair->eta0 + j]) continue;
      TR_A(s, share)[pair->eta0 + j] *= -1.0;
      if (ball) TR_A(s, impend)[pair->rate0 + j] *= -1.0, turned = 1;
    }
  }
  return turned;
}
