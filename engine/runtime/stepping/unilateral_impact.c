/* Impacts of joints that only push (theory, "Contact that begins and ends"). One problem of impulses contains all touching
 * contacts, the loops and the friction of all joints. This problem is solved as an impulse step, which is so short that forces have
 * no effect. */
#include "stepping/stepping.h"

#define IMPACT_TIME 1e-12   /* in units of 1 / rate scale: length of this impulse step */
/* relative to the largest impulse, or the largest speed: smaller impulses and speeds are round-off, and have no meaningful sign */
#define IMPULSE_NOTHING 1e-11
#define PIVOTS_MOST 60      /* largest number of steps of the search, which opens or closes one contact per step */

/* One phase of an impact. at: contacts that touch. target: rate of each gap after the impact if its contact is closed, m/s. least:
 * lower bound of the impulse of each contact, N s. closed, impulse: results. */
typedef struct tr_phase {
  const char *at;
  const double *target, *least;
  char *closed;
  double *impulse;
} tr_phase;

/* Solve for the impulses with the contacts in `closed`. rate: rates of the gaps before the impact. Returns 0 on failure. */
static int tr_solve_impulses(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate) {
  const double h = IMPACT_TIME / s->set.rate;
  double *mid = TR_A(s, ytmp);
  for (int c = 0; c < s->k->nunilateral; ++c) {
    const int held = p->at[c] && p->closed[c];
    tr_touch *touch = tr_touch_of(s, c);
    touch->given = !held, touch->multiplier = p->least[c] / h, touch->shift = (rate[c] - p->target[c]) / h;
    tr_set_contact(s, c, held || p->least[c] > 0.0);
  }
  tr_evaluate_maps_at(s, t, y);
  for (int c = 0; c < s->k->nunilateral; ++c) { /* a contact that was open has no friction mode yet */
    const int i = tr_unilateral_of(s, c)->pair;
    if (i < 0 || !tr_is_set_valued(s, i) || !tr_is_sliding(s, i)) continue;
    if (tr_is_at_rest(s, i)) tr_mode_of(s, i)->flag = TR_STUCK;
    else tr_freeze_direction(s, i);
  }
  tr_copy(tr_state_width(s), y, mid);
  s->impact = (tr_impact){1, h};
  s->moreau.frozen = 0, s->moreau.decides = INFINITY, s->moreau.keeps = 0;
  const int ok = tr_moreau_solve(s, t - 0.5 * h, y, mid, h); /* the maps belong to the middle of the impulse step, here to t */
  s->impact.solving = 0;
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

/* Apply the impulses of the last solution to the rates of y. The work that friction takes is added to the works. */
static void tr_apply_impulses(tr_sim *s, double t, double *y) {
  const tr_kernel *k = s->k;
  const int a = k->active, e = k->neta;
  const double h = s->impact.h;
  double dlam[a + 1], deta[e + 1], response[e + 1], dv[k->nv + 1], before[k->nrates + 1];
  for (int i = 0; i < a; ++i) dlam[i] = h * TR_A(s, z)[i];
  for (int i = 0; i < e; ++i) deta[i] = h * TR_A(s, z)[a + i], response[i] = k->sets ? map_Qe(k, TR_A(s, maps))[i + i * e] : 1.0;
  memcpy(before, map_rates(k, TR_A(s, maps)), sizeof(double) * k->nrates);
  tr_rates_by_impulses(s, y, dlam, deta, response, 0, dv);
  for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
  tr_evaluate_maps_at(s, t, y);
  const double *after = map_rates(k, TR_A(s, maps));
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double work = 0.0;
    for (int j = 0; j < pair->nrates; ++j) work -= 0.5 * deta[pair->eta0 + j] * (before[pair->rate0 + j] + after[pair->rate0 + j]);
    if (s->nworks) y[s->ny + pair->element] += work;
    y[s->ny + s->nworks] += work;
  }
}

/* Make one phase. Returns 0 if no impulses satisfy all conditions. */
static int tr_make_phase(tr_sim *s, double t, double *y, const tr_phase *p) {
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  tr_set_time(s, t);
  tr_evaluate_gaps(s, y, gap, rate);
  for (int it = 0; it < PIVOTS_MOST; ++it) {
    if (!tr_solve_impulses(s, t, y, p, rate)) return 0;
    const int worst = tr_find_worst_contact(s, p, rate);
    if (worst < 0) {
      tr_apply_impulses(s, t, y);
      return 1;
    }
    p->closed[worst] = !p->closed[worst];
  }
  return 0;
}

/* Begin the record of an impact from the state y (tr_impact_length). */
static void tr_record_impact(tr_sim *s, const double *y) {
  double *out = s->step.impacts;
  if (out) out[0] = 0.0, memcpy(out + 1, y, sizeof(double) * (s->ny + s->nworks));
}

static void tr_record_phase(tr_sim *s, const tr_phase *p, const double *restitution) {
  const tr_kernel *k = s->k;
  const int nz = k->active + k->neta, n = k->nunilateral;
  double *out = s->step.impacts;
  if (!out) return;
  double *phase = out + 1 + s->ny + s->nworks + (size_t)out[0]++ * (k->nx + nz + 2 * n), *of = phase + k->nx + nz;
  memcpy(phase, TR_A(s, x), sizeof(double) * k->nx);
  for (int i = 0; i < nz; ++i) phase[k->nx + i] = s->impact.h * TR_A(s, z)[i];
  for (int c = 0; c < n; ++c) of[2 * c] = p->at[c] && p->closed[c] ? 1.0 : p->least[c] > 0.0 ? 2.0 : 0.0, of[2 * c + 1] = restitution[c];
}

static int tr_make_impact(tr_sim *s, double t, double *y, const char *at, const double *restitution) {
  const int n = s->k->nunilateral, poisson = tr_unilateral_of(s, 0)->poisson;
  double target[n + 1], least[n + 1], impulse[n + 1], gap[n + 1], rate[n + 1];
  char closed[n + 1];
  tr_set_time(s, t);
  tr_evaluate_gaps(s, y, gap, rate);
  for (int c = 0; c < n; ++c) target[c] = poisson ? 0.0 : -restitution[c] * fmin(rate[c], 0.0), least[c] = 0.0, closed[c] = at[c];
  const tr_phase p = {at, target, least, closed, impulse};
  tr_record_impact(s, y);
  if (!tr_make_phase(s, t, y, &p)) return 0;
  tr_record_phase(s, &p, restitution);
  double most = 0.0;
  for (int c = 0; c < n && poisson; ++c) {
    least[c] = at[c] ? restitution[c] * fmax(impulse[c], 0.0) : 0.0, closed[c] = at[c] && least[c] == 0.0;
    most = fmax(most, least[c]);
  }
  if (!(most > 0.0)) return 1;
  if (!tr_make_phase(s, t, y, &p)) return 0;
  tr_record_phase(s, &p, restitution);
  return 1;
}
