/* Impacts of joints that only push (theory, "Contact that begins and ends"). One problem of impulses contains all touching
 * contacts, the loops and the friction of all joints. This problem is solved as an impulse step, which is so short that forces have
 * no effect. */
#include "stepping/stepping.h"

#define IMPACT_TIME 1e-12   /* in units of 1 / rate scale: length of this impulse step */
/* relative to the largest impulse, or the largest speed: smaller impulses and speeds are round-off, and have no meaningful sign */
#define IMPULSE_NOTHING 1e-11
#define PIVOTS_MOST 60      /* largest number of steps of the search, which opens or closes one contact per step */
#define SAME_RATES 1e-9     /* relative to the largest change of a rate: rates that differ by less are the same */
#define PARTS_MOST 40       /* largest number of parts of a phase; each part ends where the sliding of a pair stops */

/* One phase of an impact. at: contacts that touch. target: rate of each gap after the impact if its contact is closed, m/s. least:
 * lower bound of the impulse of each contact, N s. closed, impulse: results. */
typedef struct tr_phase {
  const char *at;
  const double *target;
  double *least;
  char *closed;
  double *impulse;
} tr_phase;

/* Whether pair i has a direction of sliding that an impact can reverse. */
static int tr_has_one_direction(const tr_sim *s, int i) { return tr_is_set_valued(s, i) && tr_pair_of(s, i)->nrates == 1; }

/* Solve for the impulses with the contacts in `closed`. rate: rates of the gaps before the impact. slides: whether pairs that slide
 * keep their direction; otherwise their rates after the impact decide. Returns 0 on failure. */
static int tr_solve_impulses(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate, int slides) {
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
  for (int i = 0; i < s->k->nsliders && slides; ++i)
    if (tr_has_one_direction(s, i) && !tr_is_at_rest(s, i)) tr_mode_of(s, i)->flag = TR_SLIPS;
  tr_copy(tr_state_width(s), y, mid);
  s->impact = (tr_impact){1, slides, h};
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

/* Apply `part` of the impulses of the last solution to the rates of y. The work that friction takes is added to the works. */
static void tr_apply_impulses(tr_sim *s, double t, double *y, double part) {
  const tr_kernel *k = s->k;
  const int a = k->active, e = k->neta;
  const double h = part * s->impact.h;
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

/* Find the impulses with which all touching contacts fulfil their conditions. Returns 0 if there are none. */
static int tr_find_impulses(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate) {
  for (int it = 0; it < PIVOTS_MOST; ++it) {
    if (!tr_solve_impulses(s, t, y, p, rate, 0)) return 0;
    const int worst = tr_find_worst_contact(s, p, rate);
    if (worst < 0) return 1;
    p->closed[worst] = !p->closed[worst];
  }
  return 0;
}

/* Part of the impulses after which the first sliding pair stops; 1 if none stops. *which: this pair. before, after: all rates before
 * and after the impulses. */
static double tr_find_first_stop(const tr_sim *s, const double *before, const double *after, int *which) {
  const double rest = tr_rest_speed(tr_speed_unit(s));
  double first = 1.0;
  *which = -1;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    const double lever = TR_A(s, lever)[pair->eta0], v = before[pair->rate0], u = after[pair->rate0];
    if (!tr_has_one_direction(s, i) || fabs(v) * lever <= rest || (v * u > 0.0 && fabs(u) * lever > rest)) continue;
    if (*which < 0 || v / (v - u) < first) first = fmin(v / (v - u), 1.0), *which = i;
  }
  return first;
}

/* Make the part of a phase that ends where the first pair stops sliding (Routh). Before, the impulses of the contacts grow in the
 * ratio of the last solution, and sliding pairs keep their directions. *which: the pair that stops. Returns the part of the last
 * solution's impulses that was applied to `y`; 0 if no pair stops. */
static double tr_make_part(tr_sim *s, double t, double *y, const tr_phase *p, const double *rate, int *which) {
  const int n = s->k->nunilateral;
  char none[n + 1];
  double old[tr_state_width(s)], before[s->k->nrates + 1];
  memset(none, 0, n), memcpy(old, y, sizeof old);
  const tr_phase grown = {p->at, p->target, p->impulse, none, p->impulse};
  if (!tr_solve_impulses(s, t, y, &grown, rate, 1)) return 0.0;
  memcpy(before, map_rates(s->k, TR_A(s, maps)), sizeof(double) * s->k->nrates);
  tr_apply_impulses(s, t, y, 1.0);
  const double part = tr_find_first_stop(s, before, map_rates(s->k, TR_A(s, maps)), which);
  memcpy(y, old, sizeof old);
  if (*which < 0) return 0.0;
  tr_evaluate_maps_at(s, t, y);
  tr_apply_impulses(s, t, y, part);
  return part;
}

/* Begin the record of an impact from the state y (tr_impact_length). */
static void tr_record_impact(tr_sim *s, const double *y) {
  double *out = s->step.impacts;
  if (out) out[0] = 0.0, memcpy(out + 1, y, sizeof(double) * (s->ny + s->nworks));
}

/* Place of part `i` in the record of an impact. */
static double *tr_recorded_part(const tr_sim *s, int i) {
  const tr_kernel *k = s->k;
  return s->step.impacts + 1 + s->ny + s->nworks + (size_t)i * (k->nx + k->active + k->neta + 2 * k->nunilateral);
}

/* Record a part of a phase. stops: pair that stops sliding at its end; −1: the phase ends. part: applied part of the impulses. */
static void tr_record_part(tr_sim *s, const tr_phase *p, const double *restitution, int stops, double part) {
  const tr_kernel *k = s->k;
  const int nz = k->active + k->neta, n = k->nunilateral;
  if (!s->step.impacts || ++s->step.impacts[0] > TR_IMPACT_PARTS) return;
  double *out = tr_recorded_part(s, (int)s->step.impacts[0] - 1), *of = out + k->nx + nz;
  memcpy(out, TR_A(s, x), sizeof(double) * k->nx);
  for (int i = 0; i < nz; ++i) out[k->nx + i] = part * s->impact.h * TR_A(s, z)[i];
  for (int c = 0; c < n; ++c) {
    of[2 * c] = p->at[c] && p->closed[c] ? 1.0 : p->least[c] > 0.0 ? 2.0 : 0.0, of[2 * c + 1] = restitution[c];
    if (stops >= 0 && p->impulse[c] > 0.0) of[2 * c] = 3.0, of[2 * c + 1] = stops;
  }
}

/* Keep in the record either the phase as a whole, which is part `first`, or the parts after it. */
static void tr_choose_record(tr_sim *s, int first, int whole) {
  if (!s->step.impacts) return;
  const int made = (int)s->step.impacts[0], kept = made < TR_IMPACT_PARTS ? made : TR_IMPACT_PARTS;
  if (!whole && kept > first) memmove(tr_recorded_part(s, first), tr_recorded_part(s, first + 1), sizeof(double) * (tr_recorded_part(s, kept) - tr_recorded_part(s, first + 1)));
  s->step.impacts[0] = whole ? first + 1 : s->step.impacts[0] - 1.0;
}

/* Whether two states have the same rates. start: the state before the impact. */
static int tr_are_rates_same(const tr_sim *s, const double *y, const double *other, const double *start) {
  double most = 0.0, apart = 0.0;
  for (int i = s->k->nq; i < s->k->nq + s->k->nv; ++i) most = fmax(most, fabs(other[i] - start[i])), apart = fmax(apart, fabs(other[i] - y[i]));
  return apart <= SAME_RATES * most;
}

/* Make one phase in parts, each of which ends where a pair stops sliding (theory, "Contact that begins and ends"). If the rates
 * after the phase are those of one part, the record holds this one. Returns 0 if no impulses satisfy all conditions. */
static int tr_make_phase(tr_sim *s, double t, double *y, const tr_phase *p, const double *restitution) {
  const int n = s->k->nunilateral, width = tr_state_width(s), first = s->step.impacts ? (int)s->step.impacts[0] : 0;
  double gap[n + 1], rate[n + 1], sum[n + 1], start[width], whole[width], old[width], before[s->k->nrates + 1], part = 1.0;
  memset(sum, 0, sizeof sum), memcpy(start, y, sizeof start);
  for (int parts = 0; parts < PARTS_MOST; ++parts) {
    int stops;
    tr_set_time(s, t);
    tr_evaluate_gaps(s, y, gap, rate);
    if (!tr_find_impulses(s, t, y, p, rate)) return 0;
    memcpy(old, y, sizeof old), memcpy(before, map_rates(s->k, TR_A(s, maps)), sizeof(double) * s->k->nrates);
    tr_apply_impulses(s, t, y, 1.0);
    tr_find_first_stop(s, before, map_rates(s->k, TR_A(s, maps)), &stops);
    const int ends = stops < 0 || !(part > 0.0);
    if (ends || parts == 0) tr_record_part(s, p, restitution, -1, 1.0);
    if (parts == 0) memcpy(whole, y, sizeof whole);
    if (ends) {
      for (int c = 0; c < n; ++c) p->impulse[c] += sum[c];
      if (parts > 0) tr_choose_record(s, first, tr_are_rates_same(s, y, whole, start));
      return 1;
    }
    memcpy(y, old, sizeof old);
    part = tr_make_part(s, t, y, p, rate, &stops);
    if (part > 0.0) tr_record_part(s, p, restitution, stops, part);
    for (int c = 0; c < n; ++c) sum[c] += part * p->impulse[c], p->least[c] = fmax(p->least[c] - part * p->impulse[c], 0.0);
  }
  return 0;
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
  if (!tr_make_phase(s, t, y, &p, restitution)) return 0;
  double most = 0.0;
  for (int c = 0; c < n && poisson; ++c) {
    least[c] = at[c] ? restitution[c] * fmax(impulse[c], 0.0) : 0.0, closed[c] = at[c] && least[c] == 0.0;
    most = fmax(most, least[c]);
  }
  if (!(most > 0.0)) return 1;
  return tr_make_phase(s, t, y, &p, restitution);
}
