/* Equations of shared loads: the friction η_i of each member of a group is proportional to the member's "value" (theory, "Shared
 * loads").
 *
 * The value of a member with one component is its capacity. In a group with one freedom, the value of a ball is its friction in the
 * impending motion. The group then begins to slide at a state where all members can slide. Near its cone, however, this friction is
 * not a smooth function of the ball's force. The value is then the capacity times the part of the motion's axis that is
 * perpendicular to the force. (A ball holds no torque about its force.) The direction of this force changes while the ball is at
 * rest. */
#include "friction/friction.h"


/* Whether pair m is a ball for which an axis of impending motion is set. */
static inline int tr_has_impending_axis(const tr_sim *s, int m) {
  const double *w = TR_A(s, impending) + tr_pair_of(s, m)->rate0;
  return tr_pair_of(s, m)->cone && (w[0] != 0.0 || w[1] != 0.0 || w[2] != 0.0);
}

/* t: the part of the impending axis of ball m that is perpendicular to its force f. dt: ∂t/∂f (3×3, column-major). */
static void tr_axis_across_force(const tr_sim *s, int m, double *t, double *dt) {
  const double *w = TR_A(s, impending) + tr_pair_of(s, m)->rate0, *f = TR_A(s, NN) + s->k->element[tr_pair_of(s, m)->element].n0;
  double F = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]) + NO_FORCE, along = (f[0] * w[0] + f[1] * w[1] + f[2] * w[2]) / F;
  for (int i = 0; i < 3; ++i) {
    t[i] = w[i] - f[i] / F * along;
    for (int q = 0; q < 3; ++q) dt[i + 3 * q] = -((i == q) * along + f[i] / F * (w[q] - 2.0 * f[q] / F * along)) / F;
  }
}

/* Evaluate the laws of all pairs at the loads NN. A ball with an impending axis is evaluated as sliding about this axis. If the
 * ball then lies inside its cone, it is evaluated again as spinning. */
static void tr_evaluate_impending_laws(tr_sim *s) {
  const tr_kernel *k = s->k;
  double x[k->nx], rates[k->nrates + 1];
  tr_sliding speed[k->nsliders + 1];
  tr_mode *modes = (tr_mode *)(x + ((const double *)tr_mode_of(s, 0) - TR_A(s, x)));
  memcpy(x, TR_A(s, x), sizeof x);
  memcpy(rates, map_rates(k, TR_A(s, maps)), sizeof(double) * k->nrates);
  for (int m = 0; m < k->nsliders; ++m) {
    if (!tr_has_impending_axis(s, m)) continue;
    int r0 = tr_pair_of(s, m)->rate0;
    modes[m].flag = TR_SLIPS, modes[m].tilt = 0.0;
    for (int j = 0; j < 3; ++j) modes[m].direction[j] = rates[r0 + j] = TR_A(s, impending)[r0 + j];
  }
  for (int pass = 0, inside = 1; pass < 2 && inside; ++pass) {
    k->laws(TR_A(s, NN), rates, x, TR_A(s, c) + k->c_laws, TR_A(s, impending_law), TR_A(s, impending_dlaw), (double *)speed);
    inside = 0;
    for (int m = 0; m < k->nsliders && pass == 0; ++m)
      if (tr_has_impending_axis(s, m) && speed[m].cone < 0.0) modes[m].flag = TR_CONE, inside = 1;
  }
}

/* Value of multiplier i of pair m. at: offset of the derivative of the pair's capacity. d (neta) receives the derivative of the
 * value by η. */
static double tr_share_value(tr_sim *s, int m, int at, int i, double *d) {
  const tr_kernel *k = s->k;
  int e = k->neta, n = k->nn, impends = tr_has_impending_axis(s, m), ball = impends && !s->friction.impending_laws, part = i - tr_pair_of(s, m)->eta0;
  const tr_element *el = k->element + tr_pair_of(s, m)->element;
  const tr_hold *hold = tr_hold_of(s, m);
  const double *Ne = tr_loads_by_friction(s);
  double t[3], dt[9], unit = ball ? TR_A(s, lever)[i] : TR_A(s, share)[i] / hold->size;
  if (impends && !ball) {
    for (int j = 0; j < e; ++j) {
      d[j] = 0.0;
      for (int q = 0; q < el->needs; ++q) d[j] += TR_A(s, impending_dlaw)[el->dn0 + i - el->eta0 + q * el->neta] * Ne[el->n0 + q + j * n];
    }
    return TR_A(s, impending_law)[i];
  }
  if (ball) tr_axis_across_force(s, m, t, dt);
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

/* Residual of multiplier i, which shares a load; also writes row i of J. Equation: η_i divided by the leader's η equals the ratio
 * of the two values. */
static double tr_form_share_row(tr_sim *s, int m, int at, int i, const double *eta, double *J) {
  int e = s->k->neta;
  const tr_leader *lead = tr_leaders(s) + i;
  double d[e], dl[e], mine = tr_share_value(s, m, at, i, d), leads = tr_share_value(s, lead->pair, lead->dhold, lead->multiplier, dl);
  double part = mine / leads, load = eta[lead->multiplier];
  for (int j = 0; j < e; ++j) J[i + j * e] = (i == j) - load / leads * (d[j] - part * dl[j]) - (j == lead->multiplier ? part : 0.0);
  return load * part - eta[i];
}

/* Residual of multiplier i of pair m, which yields; also writes row i of J. Equation: η_i equals the value of the multiplier. */
static double tr_form_full_row(tr_sim *s, int m, int at, int i, const double *eta, double *J) {
  const int e = s->k->neta;
  double d[e];
  const double mine = tr_share_value(s, m, at, i, d);
  for (int j = 0; j < e; ++j) J[i + j * e] = (i == j) - d[j];
  return mine - eta[i];
}

static double tr_stored_load(const tr_sim *s, int m, int i, const double *N, double *slope) {
  const int j = i - tr_pair_of(s, m)->eta0;
  const double *kept = TR_A(s, share) + tr_pair_of(s, m)->eta0, *f = N + s->k->element[tr_pair_of(s, m)->element].n0;
  slope[0] = slope[1] = slope[2] = 0.0;
  if (!tr_pair_of(s, m)->cone) return kept[j];
  const double F = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] + NO_FORCE, along = (f[0] * kept[0] + f[1] * kept[1] + f[2] * kept[2]) / F;
  for (int q = 0; q < 3; ++q) slope[q] = -(q == j) * along - f[j] * (kept[q] - 2.0 * along * f[q]) / F;
  return kept[j] - along * f[j];
}

/* Residual of multiplier i of pair m, which keeps its stored load; also writes row i of J. */
static double tr_form_stored_row(const tr_sim *s, int m, int i, const double *eta, double *J) {
  const int e = s->k->neta;
  const double *Ne = tr_loads_by_friction(s) + s->k->element[tr_pair_of(s, m)->element].n0;
  double slope[3];
  const double kept = tr_stored_load(s, m, i, TR_A(s, NN), slope);
  for (int j = 0; j < e; ++j, Ne += s->k->nn) {
    J[i + j * e] = i == j;
    for (int q = 0; q < 3 && tr_pair_of(s, m)->cone; ++q) J[i + j * e] -= slope[q] * Ne[q];
  }
  return kept - eta[i];
}

/* Reverse the impending motion of groups in which the solution's friction has the wrong sign. Returns 1 if the reversal changes the
 * value of a member. (Such members are balls, and pairs whose capacity depends on the sense of friction, such as threads.) The
 * equations must then be solved again. Requires a solution of tr_newton. */
static int tr_reverse_impending(tr_sim *s, const double *eta) {
  const tr_kernel *k = s->k;
  int turns[k->neta], turned = 0, any = 0;
  double d[k->neta], before[k->nsliders];
  memset(turns, 0, sizeof turns);
  for (int i = 0; i < k->neta; ++i) {
    const tr_leader *lead = tr_leaders(s) + i;
    if (tr_row_kinds(s)[i] != TR_ROW_SHARE) continue;
    turns[i] = turns[lead->multiplier] = eta[lead->multiplier] * tr_share_value(s, lead->pair, lead->dhold, lead->multiplier, d) < 0.0;
    any |= turns[i];
  }
  if (!any) return 0;
  for (int m = 0; m < k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    const int ball = tr_has_impending_axis(s, m);
    for (int j = 0; j < pair->neta; ++j) {
      if (!turns[pair->eta0 + j]) continue;
      TR_A(s, share)[pair->eta0 + j] *= -1.0;
      if (ball) TR_A(s, impending)[pair->rate0 + j] *= -1.0, turned = 1;
    }
  }
  for (int m = 0; m < k->nsliders; ++m) before[m] = tr_hold_of(s, m)->capacity;
  k->held(TR_A(s, NN), TR_A(s, share), TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
  for (int m = 0; m < k->nsliders; ++m) turned |= tr_hold_of(s, m)->capacity != before[m];
  return turned;
}
