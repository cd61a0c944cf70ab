/* Stopping impulses: friction impulses that bring pairs to rest. */
#include "evaluate/evaluate.h"

/* relative to the kinetic energy: if stopping a rate near zero takes more work, this rate passes through zero */
#define PASSING_WORK 1e-6
#define PASSING_LEAST 1e-16 /* relative to the energy unit: least value of the limit by PASSING_WORK, for a mechanism at rest */

/* Largest surface speed of the pairs `rest` (n) in the current state, m/s. */
static double tr_largest_speed(const tr_sim *s, const int *rest, int n) {
  double biggest = 0.0;
  for (int q = 0; q < n; ++q) biggest = fmax(biggest, tr_pair_speed(s, rest[q]));
  return biggest;
}

/* Whether rates of the pairs `rest` (n) depend on other rates, through loops or drives. Zeros in the state would then not stop
 * these pairs. */
static int tr_has_dependent_rates(const tr_sim *s, const int *rest, int n) {
  int follow = s->k->rows > 0;
  for (int q = 0; q < n; ++q) follow |= tr_pair_of(s, rest[q])->v0 < 0;
  return follow;
}

/* Whether the rate v of multiplier i's freedom passes through zero without stopping. Near a dead centre of a crank, this rate is
 * almost zero while other bodies move fast; v is then the error of event location. Friction that holds the rate at zero would have
 * to stop these bodies. A: change of the rate by a unit impulse. */
static int tr_passes_zero(tr_sim *s, const double *y, int i, double v, double A) {
  double energy[2];
  if (fabs(v) * TR_A(s, lever)[i] > tr_rest_speed(tr_speed_unit(s))) return 0;
  s->k->energy(TR_A(s, x), y, TR_A(s, c) + s->k->c_energy, energy);
  return v * v > 2.0 * A * fmax(PASSING_WORK * energy[0], PASSING_LEAST * s->set.energy);
}

/* Find the friction impulses deta (all multipliers) that stop the pairs `rest` (n). Prescribed freedoms get no impulse. If freedoms
 * are dependent, only an independent subset of them gets impulses. Returns 0 if no impulse is needed. Requires held maps. */
static int tr_find_stopping_impulses(tr_sim *s, const double *y, const int *rest, int n, int own, double *deta) {
  tr_form_all_maps(s);
  const tr_kernel *k = s->k;
  int e = k->neta, c[e + 1], count = 0;
  const double *Qe = TR_A(s, Q) + e, *rates = map_rates(k, TR_A(s, maps));
  double v[e + 1];
  for (int q = 0; q < n; ++q) {
    const tr_pair *pair = tr_pair_of(s, rest[q]);
    for (int j = 0; j < pair->nrates; ++j) {
      int i = pair->eta0 + j;
      const int follows = own && s->friction.held && tr_row_kinds(s)[i] != TR_ROW_REST;
      if (!follows && !tr_is_prescribed(s, i) && !tr_passes_zero(s, y, i, rates[pair->rate0 + j], -Qe[i + i * e])) v[count] = rates[pair->rate0 + j], c[count++] = i;
    }
  }
  if (!count) return 0;
  double A[count * count], L[count * count], d[count], x[count];
  int perm[count];
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) A[i + j * count] = -0.5 * (Qe[c[i] + c[j] * e] + Qe[c[j] + c[i] * e]);
    d[i] = tr_response_scale(s, c[i], A[i + i * count]);
  }
  int rank = tr_cholesky(count, A, d, L, perm, 0, RANK_PIVOT, RANK_PIVOT);
  tr_cholesky_solve(count, rank, L, perm, d, v, x);
  memset(deta, 0, sizeof(double) * e);
  for (int i = 0; i < count; ++i) deta[c[i]] = x[i];
  return 1;
}

static void tr_bring_to_rest(tr_sim *s, double *y, const int *rest, int n, int own) {
  TR_NEED(s, TR_HAS_MAPS);
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta;
  const double *rates = map_rates(k, TR_A(s, maps));
  if (tr_largest_speed(s, rest, n) > (tr_has_dependent_rates(s, rest, n) ? 0.0 : tr_rest_speed(tr_speed_unit(s)))) {
    double deta[e + 1], dlam[a + 1], response[e + 1], dv[k->nv + 1];
    tr_form_maps_without_loops(s, 1);
    const double *raw = map_Qe(k, TR_A(s, maps));
    if (tr_find_stopping_impulses(s, y, rest, n, own, deta)) {
      memset(dlam, 0, sizeof dlam);
      tr_add_columns(a, e, TR_A(s, T), deta, -1.0, dlam);
      for (int i = 0; i < e; ++i) response[i] = raw[i + i * e];
      tr_rates_by_impulses(s, y, dlam, deta, response, 0, dv);
      for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
      for (int q = 0; q < n; ++q) { /* work of the impulses; `power` has one entry for the friction of each element */
        const tr_pair *pair = tr_pair_of(s, rest[q]);
        double work = 0.0;
        for (int j = 0; j < pair->nrates; ++j) work -= 0.5 * deta[pair->eta0 + j] * rates[pair->rate0 + j];
        if (s->nworks) y[s->ny + pair->element] += work;
        y[s->ny + s->nworks] += work;
      }
    }
  }
  for (int q = 0; q < n && !own; ++q) {
    const tr_pair *pair = tr_pair_of(s, rest[q]);
    for (int j = 0; j < pair->nrates && pair->v0 >= 0; ++j) y[k->nq + pair->v0 + j] = 0.0;
  }
}

/* Stop held pairs that loop closure has set in motion at the state y. The friction impulses that stop these pairs keep the loops
 * closed. */
static void tr_hold_at_rest(tr_sim *s, double *y) {
  int rest[s->k->nsliders + 1], n = 0, moves = 0;
  tr_evaluate_maps(s, y);
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_stuck(s, i)) rest[n++] = i, moves |= tr_pair_speed(s, i) > HELD_SPEED * tr_speed_unit(s);
  if (moves) tr_bring_to_rest(s, y, rest, n, 1), tr_zero_held_rates(s, y);
}
