/* Pairs that come to rest: which they are, and how what is left of their speed is taken from them. */
#include "modes.h"

#define HELD_SPEED 1e-12 /* of the speed unit: what is slower is at rest, but for round-off of closing the loops */
#define NOT_QUITE 1e-10 /* of the fastest rate: round-off of one that vanishes because others do */
#define HELD_PART 0.25 /* of a period or a turn: eight points see every top of a margin that swings with it (``search.c``) */

/* Whether pair i, of a class, is as slow as the class is while pair j of it is as good as at rest. */
static int tr_rests_with(const tr_sim *s, int i, int j) {
  if (!tr_bound_to(s, i, j)) return 0;
  double ratio = tr_line_speed(s, i) / fmax(tr_line_speed(s, j), NO_FORCE);
  return tr_pair_speed(s, i) <= REST_SPEED * tr_speed_unit(s) * fmax(1.0, ratio);
}

/* Pairs that are stuck, or as good as at rest, and those in `also` (−1: none); with them those that the loops bind to them. Maps in place. */
static int tr_at_rest(tr_sim *s, int also, int *rest) {
  const int pairs = s->k->nsliders;
  int n = 0, resting[pairs + 1];
  for (int i = 0; i < pairs; ++i) {
    resting[i] = tr_is_set(s, i) && (tr_is_stuck(s, i) || i == also || tr_ends(s)[i] || tr_pair_speed(s, i) <= REST_SPEED * tr_speed_unit(s));
    n += resting[i];
  }
  if (!n) return 0;
  tr_bind(s);
  n = 0;
  for (int i = 0; i < pairs; ++i) {
    int rests = resting[i];
    for (int j = 0; j < pairs && !rests && tr_is_set(s, i); ++j) rests = resting[j] && tr_rests_with(s, i, j);
    if (rests) rest[n++] = i;
  }
  return n;
}

/* Fastest rate of the pairs `rest`, as the maps in place have them. */
static double tr_fastest(const tr_sim *s, const int *rest, int n) {
  const double *rates = map_rates(s->k, TR_A(s, maps));
  double biggest = 0.0;
  for (int q = 0; q < n; ++q) {
    const tr_pair *pair = tr_pair_of(s, rest[q]);
    for (int j = 0; j < pair->nrates; ++j) biggest = fmax(biggest, fabs(rates[pair->rate0 + j]));
  }
  return biggest;
}

/* Whether rates of the pairs `rest` follow from those of others, in loops or where a drive gives some of them: no zero in the state stops them. */
static int tr_rates_follow(const tr_sim *s, const int *rest, int n) {
  int follow = s->k->rows > 0;
  for (int q = 0; q < n; ++q) follow |= tr_pair_of(s, rest[q])->v0 < 0;
  return follow;
}

/* Impulses of friction (deta, all multipliers) that stop the pairs `rest`: those of least norm where they depend on each other, none
 * along freedoms whose motion is prescribed. 0 when there are none. After tr_held_maps. */
static int tr_stopping_impulses(tr_sim *s, const int *rest, int n, int own, double *deta) {
  tr_form_all(s);
  const tr_kernel *k = s->k;
  int e = k->neta, c[e + 1], count = 0;
  const double *Qe = TR_A(s, Q) + e, *rates = map_rates(k, TR_A(s, maps));
  double v[e + 1];
  for (int q = 0; q < n; ++q) {
    const tr_pair *pair = tr_pair_of(s, rest[q]);
    for (int j = 0; j < pair->nrates; ++j) {
      int i = pair->eta0 + j;
      const int follows = own && s->friction.still && tr_row_kinds(s)[i] != TR_ROW_STILL;
      if (!follows && !tr_is_prescribed(s, i)) v[count] = rates[pair->rate0 + j], c[count++] = i;
    }
  }
  if (!count) return 0;
  double A[count * count], L[count * count], d[count], x[count];
  int perm[count];
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) A[i + j * count] = -0.5 * (Qe[c[i] + c[j] * e] + Qe[c[j] + c[i] * e]);
    d[i] = tr_response_unit(s, c[i], A[i + i * count]);
  }
  int rank = tr_cholesky(count, A, d, L, perm, 0, GROUP_PIVOT, GROUP_PIVOT);
  tr_cholesky_solve(count, rank, L, perm, d, v, x);
  memset(deta, 0, sizeof(double) * e);
  for (int i = 0; i < count; ++i) deta[c[i]] = x[i];
  return 1;
}

/* Take what is left of their rates from the pairs at rest: by impulses of their own friction, then exactly. Maps in place. */
static void tr_bring_to_rest(tr_sim *s, double *y, const int *rest, int n, int own) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta;
  const double *rates = map_rates(k, TR_A(s, maps));
  if (tr_fastest(s, rest, n) > (tr_rates_follow(s, rest, n) ? 0.0 : REST_SPEED * s->set.rate)) {
    double deta[e + 1], dlam[a + 1], response[e + 1], dv[k->nv + 1];
    tr_without_loops(s, 1);
    const double *raw = map_Qe(k, TR_A(s, maps)), *T = TR_A(s, T);
    if (tr_stopping_impulses(s, rest, n, own, deta)) {
      for (int i = 0; i < a; ++i) {
        dlam[i] = 0.0;
        for (int j = 0; j < e; ++j) dlam[i] -= T[i + j * a] * deta[j];
      }
      for (int i = 0; i < e; ++i) response[i] = raw[i + i * e];
      tr_impulse(s, y, dlam, deta, response, 0, dv);
      for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
      for (int q = 0; q < n; ++q) { /* their work: the friction of element m is the m-th power */
        const tr_pair *pair = tr_pair_of(s, rest[q]);
        double work = 0.0;
        for (int j = 0; j < pair->nrates; ++j) work -= 0.5 * deta[pair->eta0 + j] * rates[pair->rate0 + j];
        if (s->nworks) y[s->ny + pair->element] += work;
        if (s->naudit) y[s->ny + s->nworks] += work;
      }
    }
  }
  for (int q = 0; q < n && !own; ++q) {
    const tr_pair *pair = tr_pair_of(s, rest[q]);
    for (int j = 0; j < pair->nrates && pair->v0 >= 0; ++j) y[k->nq + pair->v0 + j] = 0.0;
  }
}

/* Bring the pairs `rest` (n) to rest at the state y whose maps are in place, and with them those that come to rest because these do: in a
 * loop one pair's stop may be that of others, whose speeds were small before, and not nothing. `also`: as in tr_at_rest. How many there are
 * then; maps in place. */
static int tr_all_to_rest(tr_sim *s, double *y, int also, int *rest, int n) {
  const tr_kernel *k = s->k;
  for (int more = n; n; n = more) {
    tr_bring_to_rest(s, y, rest, n, 0);
    tr_maps_of(s, y);
    if (!k->active) break; /* in a tree no pair's rest follows from another's */
    more = tr_at_rest(s, also, rest);
    if (more <= n) break;
  }
  return n;
}

/* Rates of stuck tree joints (or their derivatives) stay exactly zero. Where rest follows from that of others it may do so not quite: such a pair moves
 * with the mechanism, by more than round-off, and would hold all of it if it were stopped. */
static void tr_keep_still(const tr_sim *s, double *v) {
  double most = 0.0;
  for (int i = 0; i < s->k->nv && s->k->active; ++i) most = fmax(most, fabs(v[s->k->nq + i]));
  const double small = fmax(NOT_QUITE * most, HELD_SPEED * s->set.rate);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_stuck(s, i) || pair->v0 < 0) continue;
    for (int j = 0; j < pair->nrates; ++j) {
      double *rate = v + s->k->nq + pair->v0 + j;
      if (tr_row_kinds(s)[pair->eta0 + j] == TR_ROW_STILL || !s->friction.still || fabs(*rate) <= small) *rate = 0.0;
    }
  }
}

/* Pairs at rest stay there at the state y, whose loops have just been closed by whatever moves most easily, held or not: the rates that this
 * has given them are taken by impulses of their own friction, which leave the loops closed. */
static void tr_hold_still(tr_sim *s, double *y) {
  int rest[s->k->nsliders + 1], n = 0, moves = 0;
  tr_maps_of(s, y);
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_stuck(s, i)) rest[n++] = i, moves |= tr_pair_speed(s, i) > HELD_SPEED * tr_speed_unit(s);
  if (moves) tr_bring_to_rest(s, y, rest, n, 1), tr_keep_still(s, y);
}

/* Longest step of a mechanism whose pairs may stick: a quarter of the fastest load's period, and while something is held, whose load shows
 * in no error, of the fastest turn. */
static double tr_held_step(const tr_sim *s) {
  double pace = s->friction.pace;
  for (int i = 0; i < s->k->nv && s->friction.still; ++i)
    if (s->k->vkind[i] == TR_COORDINATE_ANGLE) pace = fmax(pace, fabs(TR_A(s, y)[s->k->nq + i]) / TURN);
  return pace > 0.0 ? HELD_PART / pace : INFINITY;
}
