/* Accelerations of sliding freedoms, and their responses to friction, with closed loops. These quantities show which freedoms the
 * loops prescribe, which freedoms coincide, and which are at rest. */
#include "friction/friction.h"

/* relative to the stopping time at constant deceleration. If the signals have a break within this time, the freedom counts as at
 * rest. (Smooth stops take three times as long.) */
#define RESTS_BY 4.0
/* in units of 1 / rate scale: a pair with a longer stopping time counts as at rest. (A slow pair that reverses needs much less
 * time.) */
#define RESTS_FOR 1e-6
/* relative to a freedom's response without loops: smallest response from which a scale is formed; the round-off of this response is
 * below RANK_PIVOT */
#define RESPONSE_FLOOR 1e-4

static double tr_freedom_response(const tr_sim *s, int i, int j) {
  TR_NEED(s, TR_HAS_HELD);
  int e = s->k->neta;
  const double *Qe = TR_A(s, Q) + e;
  return -0.5 * (Qe[i + j * e] + Qe[j + i * e]);
}

static double tr_response_scale(const tr_sim *s, int i, double own) {
  double raw = fabs(map_Qe(s->k, TR_A(s, maps))[i + i * s->k->neta]);
  return 1.0 / sqrt(fmax(own, RESPONSE_FLOOR * raw));
}

static int tr_are_one_freedom(const tr_sim *s, int i, int j) {
  double own = tr_freedom_response(s, i, i), other = tr_freedom_response(s, j, j), with = tr_freedom_response(s, i, j);
  double ui = tr_response_scale(s, i, own), uj = tr_response_scale(s, j, other);
  return (own * other - with * with) * ui * ui * uj * uj <= RANK_PIVOT;
}

static int tr_pair_of_multiplier(const tr_sim *s, int e, int *at) {
  int where = 0;
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    if (e >= pair->eta0 && e < pair->eta0 + pair->neta) {
      *at = where;
      return m;
    }
    where += s->k->element[pair->element].needs;
  }
  return -1;
}

/* Whether loops have begun or ceased to prescribe the motion of a held freedom, for example at a dead centre. Requires held
 * maps. */
static int tr_has_prescribed_changed(const tr_sim *s) {
  const tr_kernel *k = s->k;
  const int *row = tr_row_kinds(s);
  for (int i = 0; i < k->nsliders; ++i) {
    if (!tr_is_stuck(s, i) || i == s->friction.freed) continue;
    const tr_pair *pair = tr_pair_of(s, i);
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j)
      if (tr_is_prescribed(s, j) != (row[j] == TR_ROW_FREE)) return 1;
  }
  return 0;
}

static double tr_held_acceleration(const tr_sim *s, int i, const double *eta) {
  const int e = s->k->neta;
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e;
  double acc = Q0[i];
  for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j];
  return acc;
}

static double tr_freedom_acceleration(tr_sim *s, int i) {
  if (s->step.recursive) return TR_A(s, acc)[i];
  TR_NEED(s, TR_HAS_HELD);
  return tr_held_acceleration(s, i, TR_A(s, z) + s->k->active);
}

static double tr_acceleration_and_terms(tr_sim *s, int i, double *size) {
  TR_NEED(s, TR_HAS_MAPS);
  const tr_kernel *k = s->k;
  tr_form_maps(s);
  const double *z = TR_A(s, z), *maps = TR_A(s, maps), *Ql = map_Ql(k, maps) + i, *Qe = map_Qe(k, maps) + i;
  double acc = map_Q0(k, maps)[i];
  *size = fabs(acc);
  for (int q = 0; q < k->active; ++q) acc += Ql[q * k->neta] * z[q], *size += fabs(Ql[q * k->neta] * z[q]);
  for (int q = 0; q < k->neta; ++q) acc += Qe[q * k->neta] * z[k->active + q], *size += fabs(Qe[q * k->neta] * z[k->active + q]);
  return acc;
}

static double tr_acceleration_by_maps(tr_sim *s, int i) {
  double size;
  if (s->step.recursive) return TR_A(s, acc)[i];
  return tr_acceleration_and_terms(s, i, &size);
}

/* Acceleration of freedom i divided by the sum of its absolute terms. Used for held freedoms that have no equation of rest: the
 * rest of other freedoms implies the rest of such a freedom, or contradicts it. */
static double tr_relative_acceleration(tr_sim *s, int i) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  tr_form_all_maps(s);
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e, *eta = TR_A(s, z) + k->active;
  double acc = Q0[i], size = fabs(Q0[i]);
  for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j], size += fabs(Qe[i + j * e] * eta[j]);
  return fabs(acc) / fmax(size, NO_FORCE);
}

static int tr_is_coming_to_rest(const tr_sim *s, int i, double acc) {
  TR_NEED(s, TR_HAS_MAPS);
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    if (i < pair->eta0 || i >= pair->eta0 + pair->nrates) continue;
    const double rate = map_rates(s->k, TR_A(s, maps))[pair->rate0 + i - pair->eta0];
    if (!(acc * rate < 0.0) || fabs(rate) * TR_A(s, lever)[i] > tr_crawl_speed(tr_speed_unit(s))) return 0;
    const double now = tr_moment_of(s)->t, left = fabs(rate / acc);
    return tr_break_after(s, now) - now <= RESTS_BY * left || left >= RESTS_FOR / s->set.rate;
  }
  return 0;
}

/* Whether the acceleration of freedom i is only an error of the present state. Returns 0 unless the loops alone hold this freedom,
 * without other pairs. open: largest error, relative to the sum of the absolute terms of the acceleration. */
static int tr_is_acceleration_an_error(tr_sim *s, int i, double open) {
  double size;
  if (!tr_is_prescribed(s, i)) return 0;
  const double acc = tr_acceleration_and_terms(s, i, &size);
  return fabs(acc) <= fmax(REST_BROKEN, open) * size;
}

static int tr_is_held_freedom_moving(tr_sim *s, int i, double open) {
  int kind = tr_row_kinds(s)[i];
  if (kind == TR_ROW_FREE && tr_is_coming_to_rest(s, i, tr_freedom_acceleration(s, i))) return 0;
  return kind >= TR_ROW_FREE && tr_relative_acceleration(s, i) > REST_BROKEN && !tr_is_acceleration_an_error(s, i, open);
}
