/* Impacts of joints that only push (theory, "Contact that begins and ends"). */
#include "stepping/stepping.h"

#define SAME_RATES 1e-9     /* relative to the largest change of a rate: smaller differences between rates do not count */
#define PARTS_MOST 100      /* largest number of parts of a phase; friction in the last part follows from its final rates */

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

/* Record a part of a phase. stops: pair that stops sliding at the end of the part; −1: the phase ends. part: applied part of the
 * impulses. */
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

/* Keep in the record either part `first`, which is the whole phase, or the later parts, into which the phase was divided. */
static void tr_choose_record(tr_sim *s, int first, int whole) {
  if (!s->step.impacts) return;
  const int made = (int)s->step.impacts[0], kept = made < TR_IMPACT_PARTS ? made : TR_IMPACT_PARTS;
  if (!whole && kept > first) memmove(tr_recorded_part(s, first), tr_recorded_part(s, first + 1), sizeof(double) * (tr_recorded_part(s, kept) - tr_recorded_part(s, first + 1)));
  s->step.impacts[0] = whole ? first + 1 : s->step.impacts[0] - 1.0;
}

/* Whether the states `y` and `other` have the same rates, relative to the change of the rates since the state `start`. */
static int tr_are_rates_same(const tr_sim *s, const double *y, const double *other, const double *start) {
  double most = 0.0, apart = 0.0;
  for (int i = s->k->nq; i < s->k->nq + s->k->nv; ++i) most = fmax(most, fabs(other[i] - start[i])), apart = fmax(apart, fabs(other[i] - y[i]));
  return apart <= SAME_RATES * most;
}

/* Make one phase in parts, each of which ends where a pair stops sliding (theory, "Contact that begins and ends"). Where friction
 * against the sliding has no solution, the sliding stops at once, and the rates after the phase decide friction. If the phase made as
 * a whole leads to the same rates, the record contains the whole phase as one part. Returns 0 if no impulses satisfy all conditions. */
static int tr_make_phase(tr_sim *s, double t, double *y, const tr_phase *p, const double *restitution) {
  const int n = s->k->nunilateral, width = tr_state_width(s), first = s->step.impacts ? (int)s->step.impacts[0] : 0;
  double lack = 0.0, gap[n + 1], rate[n + 1], sum[n + 1], start[width], whole[width], old[width], before[s->k->nrates + 1], part = 1.0;
  memset(sum, 0, sizeof sum), memcpy(start, y, sizeof start);
  for (int parts = 0; parts < PARTS_MOST; ++parts) {
    int stops;
    tr_set_time(s, t);
    tr_evaluate_gaps(s, y, gap, rate);
    if (parts == 0) lack = tr_find_lack(s, p, rate);
    if (!tr_find_impulses(s, t, y, p, rate)) return 0;
    memcpy(old, y, sizeof old), memcpy(before, map_rates(s->k, TR_A(s, maps)), sizeof(double) * s->k->nrates);
    tr_apply_impulses(s, t, y, 1.0);
    tr_find_first_stop(s, before, map_rates(s->k, TR_A(s, maps)), &stops);
    const int last = !(part > 0.0) || parts == PARTS_MOST - 1;
    const int ends = last || (stops < 0 && !tr_has_slip_turned(s, before, map_rates(s->k, TR_A(s, maps))));
    if (ends || parts == 0) tr_record_part(s, p, restitution, -1, 1.0);
    if (parts == 0) memcpy(whole, y, sizeof whole);
    if (ends) {
      s->stats.stopped_at_once += last;
      for (int c = 0; c < n; ++c) p->impulse[c] += sum[c];
      if (parts > 0) tr_choose_record(s, first, tr_are_rates_same(s, y, whole, start));
      return 1;
    }
    memcpy(y, old, sizeof old);
    part = tr_make_part(s, t, y, p, rate, lack, &stops);
    if (!(part > 0.0)) {
      memcpy(y, old, sizeof old);
      continue;
    }
    tr_record_part(s, p, restitution, stops < 0 ? 0 : stops, part);
    for (int c = 0; c < n; ++c) sum[c] += p->impulse[c], p->least[c] = fmax(p->least[c] - p->impulse[c], 0.0);
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
  const tr_phase p = {at, target, least, closed, impulse, 0, 0};
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
