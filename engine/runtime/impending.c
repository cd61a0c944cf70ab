/* Shares of a load that pairs at rest carry together, each a number η_i in proportion to a value of its own (METHOD, "Shared loads").
 *
 * One component: what the pair can hold. A ball in a group that one freedom would move: the friction it would have if that motion began,
 * because what it can hold has no torque about its force, and the force turns while it holds. */
#include "modes.h"

/* Whether pair m shares by the friction of the motion that its group would make: its rates in that motion are given. */
static inline int tr_impends(const tr_sim *s, int m) {
  const tr_pair *pair = tr_pair_of(s, m);
  const double *v = TR_A(s, impend) + pair->rate0;
  return pair->cone && (v[0] != 0.0 || v[1] != 0.0 || v[2] != 0.0);
}

/* The law of all pairs (limit, dlimit) at the reactions in place, those whose motion impends sliding that way, or turning in their cone. */
static void tr_impending_law(tr_sim *s) {
  const tr_kernel *k = s->k;
  double x[k->nx], rates[k->nrates + 1], *mine = TR_A(s, impend);
  tr_sliding speed[k->nsliders + 1];
  tr_mode *modes = (tr_mode *)(x + ((const double *)tr_mode_of(s, 0) - TR_A(s, x)));
  memcpy(x, TR_A(s, x), sizeof x);
  memcpy(rates, map_rates(k, TR_A(s, maps)), sizeof(double) * k->nrates);
  for (int m = 0; m < k->nsliders; ++m) {
    if (!tr_impends(s, m)) continue;
    int r0 = tr_pair_of(s, m)->rate0;
    modes[m].flag = TR_SLIPS, modes[m].tilt = 0.0;
    for (int j = 0; j < 3; ++j) modes[m].direction[j] = rates[r0 + j] = mine[r0 + j];
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
  int e = k->neta, n = k->nn;
  const tr_element *el = k->element + tr_pair_of(s, m)->element;
  const tr_hold *hold = tr_hold_of(s, m);
  const double *Ne = tr_by_friction(s);
  int impends = tr_impends(s, m), row = i - el->eta0;
  double unit = impends ? 1.0 : TR_A(s, share)[i] / hold->size;
  for (int j = 0; j < e; ++j) {
    d[j] = 0.0;
    for (int q = 0; q < el->needs; ++q)
      d[j] += unit * (impends ? TR_A(s, dlimit)[el->dn0 + row + q * el->neta] : TR_A(s, dhold)[at + q]) * Ne[el->n0 + q + j * n];
  }
  return impends ? TR_A(s, limit)[i] : unit * hold->capacity;
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
