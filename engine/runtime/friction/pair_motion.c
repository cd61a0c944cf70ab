/* Rates, surface speeds and levers of friction pairs. */
#include "friction/friction.h"

/* relative to the fastest rate (of translations: divided by the length scale): round-off of a rate that other pairs keep at zero */
#define NOT_QUITE 1e-10

static void tr_zero_held_rates(const tr_sim *s, double *v) {
  double most = 0.0;
  for (int i = 0; i < s->k->nv && s->k->active; ++i) most = fmax(most, fabs(v[s->k->nq + i]) / tr_rate_unit(s, i));
  const double small = fmax(NOT_QUITE * most, HELD_SPEED * s->set.rate);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_stuck(s, i) || pair->v0 < 0) continue;
    for (int j = 0; j < pair->nrates; ++j) {
      double *rate = v + s->k->nq + pair->v0 + j;
      if (tr_row_kinds(s)[pair->eta0 + j] == TR_ROW_REST || !s->friction.held || fabs(*rate) <= small * tr_rate_unit(s, pair->v0 + j)) *rate = 0.0;
    }
  }
}

static double tr_pair_speed(const tr_sim *s, int i) {
  TR_NEED(s, TR_HAS_MAPS);
  const tr_pair *pair = tr_pair_of(s, i);
  return tr_surface_speed(pair->nrates, map_rates(s->k, TR_A(s, maps)) + pair->rate0, TR_A(s, lever) + pair->eta0);
}

static int tr_is_moving_ball(const tr_sim *s, int i) {
  return tr_pair_of(s, i)->cone && !tr_is_stuck(s, i) && tr_pair_speed(s, i) > tr_crawl_speed(tr_speed_unit(s));
}

static double tr_pair_speed_unit(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double most = 0.0;
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) most = fmax(most, TR_A(s, lever)[j] == 1.0 ? s->set.length : TR_A(s, lever)[j]);
  return most * s->set.rate;
}

static void tr_rates_of_state(tr_sim *s, int i, double *rates) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *from = TR_A(s, y) + s->k->nq + pair->v0;
  if (pair->v0 < 0) {
    tr_set_time(s, s->clock.t);
    if (!s->step.have_k1 || !tr_is_current_state(s, s->clock.t, TR_A(s, y))) tr_evaluate_maps(s, TR_A(s, y));
    from = map_rates(s->k, TR_A(s, maps)) + pair->rate0;
  }
  memcpy(rates, from, sizeof(double) * pair->nrates);
}

static double tr_speed_of_state(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double r[3];
  tr_rates_of_state(s, i, r);
  return tr_surface_speed(pair->nrates, r, TR_A(s, lever) + pair->eta0);
}

static void tr_set_levers(tr_sim *s) {
  const tr_kernel *k = s->k;
  double u[k->neta + 1], none[k->nn + 1];
  memset(none, 0, sizeof none);
  /* a multiplier that belongs to no pair is the force of a freedom that does not slide */
  for (int i = 0; i < k->neta; ++i) TR_A(s, lever)[i] = 1.0;
  for (int part = 0; part < 3; ++part) {
    memset(u, 0, sizeof u);
    for (int i = 0; i < k->nsliders; ++i)
      if (part < tr_pair_of(s, i)->neta) u[tr_pair_of(s, i)->eta0 + part] = 1.0;
    k->held_alone(none, u, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
    for (int i = 0; i < k->nsliders; ++i)
      if (part < tr_pair_of(s, i)->neta) TR_A(s, lever)[tr_pair_of(s, i)->eta0 + part] = 1.0 / fmax(tr_hold_of(s, i)->size, NO_FORCE);
  }
}

static double tr_largest_surface_friction(const tr_sim *s) {
  double most = 0.0;
  for (int m = 0; m < s->k->nsliders; ++m)
    for (int i = tr_pair_of(s, m)->eta0; i < tr_pair_of(s, m)->eta0 + tr_pair_of(s, m)->neta; ++i) {
      const double lever = TR_A(s, lever)[i];
      if (lever > 0.0) most = fmax(most, fabs(TR_A(s, z)[s->k->active + i]) / lever);
    }
  return most;
}
