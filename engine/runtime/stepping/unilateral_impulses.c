/* Impulses of joints that only push in an impact (theory, "Contact that begins and ends"). One problem of impulses contains all
 * touching contacts, the loops and the friction of all joints. This problem is solved as an impulse step, which is so short that
 * forces have no effect. */
#include "stepping/stepping.h"

#define IMPACT_TIME 1e-12   /* in units of 1 / rate scale: length of this impulse step */
/* relative to the largest impulse, or the largest speed: smaller impulses and speeds are round-off, and have no meaningful sign */
#define IMPULSE_NOTHING 1e-11
#define REACHED 1e-6        /* relative to the change of rates: a closed contact may miss its target rate by this much */
#define PIVOTS_MOST 60      /* largest number of steps of the search, which opens or closes one contact per step */

static int tr_solve_impulses(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate, int slides) {
  const double h = IMPACT_TIME / s->set.rate;
  double *mid = TR_A(s, ytmp);
  s->impact = (tr_impact){0, slides, h, p->from};
  for (int c = 0; c < s->k->nunilateral; ++c) {
    const int held = p->at[c] && p->closed[c];
    tr_touch *touch = tr_touch_of(s, c);
    touch->given = !held, touch->multiplier = p->least[c] / h, touch->shift = (rate[c] - p->target[c]) / h;
    tr_set_contact(s, c, held || p->least[c] > 0.0);
  }
  tr_evaluate_maps_at(s, t, y);
  for (int c = 0; c < s->k->nunilateral && !p->keeps; ++c) { /* a contact that was open has no friction mode yet */
    const int i = tr_unilateral_of(s, c)->pair;
    if (i < 0 || !tr_is_set_valued(s, i) || !tr_is_sliding(s, i)) continue;
    if (tr_is_at_rest(s, i)) tr_mode_of(s, i)->flag = TR_STUCK;
    else tr_freeze_direction(s, i);
  }
  for (int i = 0; i < s->k->nsliders && slides && !p->keeps; ++i)
    if (tr_slides_in_impact(s, i)) tr_mode_of(s, i)->flag = TR_SLIPS;
  tr_copy(tr_state_width(s), y, mid);
  s->impact.solving = 1, s->moreau.frozen = 0, s->moreau.decides = INFINITY, s->moreau.keeps = p->keeps;
  const int ok = tr_moreau_solve(s, t - 0.5 * h, y, mid, h); /* the maps belong to the middle of the impulse step, here to t */
  s->impact.solving = 0, s->impact.from = 0, s->moreau.keeps = 0;
  return ok;
}

/* The contact that violates its condition most: a closed contact that pulls, or an open contact whose parts would penetrate; −1:
 * none. Requires the impulses. */
static int tr_find_worst_contact(tr_sim *s, const tr_phase *p, const double *rate) {
  const double h = s->impact.h;
  double pull = 0.0, speed = 0.0, most = 1.0, after[s->k->nunilateral + 1];
  int worst = -1;
  for (int c = 0; c < s->k->nunilateral; ++c) {
    p->impulse[c] = h * tr_normal_force(s, c), after[c] = rate[c] + h * tr_gap_acceleration(s, c, 0);
    pull = fmax(pull, fabs(p->impulse[c])), speed = fmax(speed, fmax(fabs(rate[c]), fabs(after[c])));
  }
  for (int c = 0; c < s->k->nunilateral; ++c) {
    if (!p->at[c]) continue;
    const double by = p->closed[c] ? (p->least[c] - p->impulse[c]) / (pull + NO_FORCE) : (p->target[c] - after[c]) / (speed + NO_FORCE);
    if (by / IMPULSE_NOTHING > most) most = by / IMPULSE_NOTHING, worst = c;
  }
  return worst;
}

static void tr_find_rate_changes(tr_sim *s, const double *y, double *dv) {
  const tr_kernel *k = s->k;
  const int a = k->active, e = k->neta;
  const double h = s->impact.h;
  double dlam[a + 1], deta[e + 1], response[e + 1];
  for (int i = 0; i < a; ++i) dlam[i] = h * TR_A(s, z)[i];
  for (int i = 0; i < e; ++i) deta[i] = h * TR_A(s, z)[a + i], response[i] = k->sets ? map_Qe(k, TR_A(s, maps))[i + i * e] : 1.0;
  tr_rates_by_impulses(s, y, dlam, deta, response, 0, dv);
}

static void tr_add_pair_works(const tr_sim *s, double *y, const double *works) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (s->nworks) y[s->ny + tr_pair_of(s, i)->element] += works[i];
    y[s->ny + s->nworks] += works[i];
  }
}

static void tr_apply_impulses(tr_sim *s, double t, double *y, double part) {
  const tr_kernel *k = s->k;
  double dv[k->nv + 1], before[k->nrates + 1], works[k->nsliders + 1];
  memcpy(before, map_rates(k, TR_A(s, maps)), sizeof(double) * k->nrates);
  tr_find_rate_changes(s, y, dv);
  for (int i = 0; i < k->nv; ++i) y[k->nq + i] += part * dv[i];
  tr_evaluate_maps_at(s, t, y);
  const double *after = map_rates(k, TR_A(s, maps)), *eta = TR_A(s, z) + k->active;
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    works[i] = 0.0;
    for (int j = 0; j < pair->nrates; ++j) works[i] -= 0.5 * part * s->impact.h * eta[pair->eta0 + j] * (before[pair->rate0 + j] + after[pair->rate0 + j]);
  }
  tr_add_pair_works(s, y, works);
}

/* Whether each closed contact has its target rate. Contacts whose rows depend on each other may have none in common. */
static int tr_reach_targets(const tr_sim *s, const tr_phase *p, const double *rate) {
  double speed = 0.0, apart = 0.0;
  for (int c = 0; c < s->k->nunilateral; ++c) {
    if (!p->at[c] || !p->closed[c]) continue;
    speed = fmax(speed, fabs(rate[c] - p->target[c]));
    apart = fmax(apart, fabs(rate[c] + s->impact.h * tr_gap_acceleration(s, c, 0) - p->target[c]));
  }
  return apart <= REACHED * speed + IMPULSE_NOTHING * tr_speed_unit(s);
}

/* Try all sets of closed contacts among those that touch. Returns whether the impulses of a set fulfil all conditions. */
static int tr_try_all_impulse_sets(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate) {
  int m = 0, all[s->k->nunilateral + 1];
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (p->at[c]) all[m++] = c;
  for (int set = 1; m <= SETS_OF_MOST && set < 1 << m; ++set) {
    for (int q = 0; q < m; ++q) p->closed[all[q]] = set >> q & 1;
    if (tr_solve_impulses(s, t, y, p, rate, 0) && tr_find_worst_contact(s, p, rate) < 0 && tr_reach_targets(s, p, rate)) return 1;
  }
  return 0;
}

static int tr_find_impulses(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate) {
  char seen[s->k->nunilateral + 1]; /* an earlier set: if it comes again, the search repeats itself */
  for (int it = 1; it <= PIVOTS_MOST; ++it) {
    if (!tr_solve_impulses(s, t, y, p, rate, 0)) return 0;
    const int worst = tr_find_worst_contact(s, p, rate);
    if (worst < 0 && tr_reach_targets(s, p, rate)) return 1;
    if (worst < 0 || (it > 1 && !memcmp(seen, p->closed, s->k->nunilateral))) break;
    if (!(it & (it - 1))) memcpy(seen, p->closed, s->k->nunilateral);
    p->closed[worst] = !p->closed[worst];
  }
  return tr_try_all_impulse_sets(s, t, y, p, rate);
}

