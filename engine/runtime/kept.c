/* Loads of large groups of pairs at rest, several freedoms of which would move the same pairs (METHOD, "Many pairs"): those of a creep that
 * carries them, in which every pair is asked for less than it can hold if that is possible at all. They are kept while the group rests; what
 * changes then is taken by as many pairs as there are freedoms. */
#include "modes.h"

#define SPARE_LEAST 1e-3 /* of what a pair can hold (as KEPT_GAIN) */
#define KEPT_MORE_THAN 8 /* pairs: the load of smaller groups is shared by least largest share (``groups.c``) */

/* The creep of a small group, or of any that shares its load anew, in which no pair is asked for more than it must be: of shares 1 − 2⁻ᵏ of what they can hold the least by which
 * all rest, so that what the load grows by does not at once ask too much of one. */
static void tr_creep_sparing(tr_sim *s, tr_creeping *c, const int *law) {
  double *eta = TR_A(s, z) + s->k->active, start[s->k->neta + 1], spare = 1.0;
  memcpy(start, eta, sizeof(double) * s->k->neta);
  for (int rests = 0; !rests && spare > SPARE_LEAST;) {
    rests = 1, spare *= 0.5, c->share = 1.0 - spare;
    memcpy(eta, start, sizeof(double) * s->k->neta);
    tr_creep_to_rest(s, c, law);
    for (int q = 0; q < c->n; ++q) rests &= tr_creep_speed(c, q) <= CREEP_MOVES * c->eps[q];
  }
}

/* Let the load of the multipliers c (n, of rank `rank`, with responses A) be kept: all but as many as there are freedoms, of
 * joints that hold in a fixed direction, those with the most to spare. 0 when there are no such. */
static int tr_keep_loads(tr_sim *s, int n, const int *c, const double *A, int rank) {
  const int e = s->k->neta;
  int law[e], pairs[n], index[n], first[n + 1], lead[n], perm[n], count = 0, at;
  double B[n * n], w0[n], w[n], x[n], u[n], cap[n], eps[n], d[n], L[n * n];
  tr_creeping creep = {.pairs = pairs, .index = index, .first = first, .lead = lead, .B = B, .w0 = w0, .w = w, .x = x, .u = u, .cap = cap, .eps = eps, .share = 1.0};
  for (int i = 0; i < e; ++i) law[i] = tr_row_kinds(s)[i] == TR_ROW_LAW;
  for (int i = 0; i < n; ++i) {
    const int owner = tr_owner(s, c[i], &at);
    if (!tr_is_one_of(pairs, count, owner)) pairs[count++] = owner;
  }
  creep.n = count;
  if (count <= KEPT_MORE_THAN && !s->friction.kept) return 0;
  tr_creep_index(s, &creep);
  if (creep.m > n) return 0;
  tr_creep_freedoms(s, &creep);
  if (s->friction.kept != TR_KEEPS_PLACED) {
    if (count <= KEPT_MORE_THAN || s->friction.sparing) tr_creep_sparing(s, &creep, law);
    else tr_creep_to_rest(s, &creep, law);
  }
  for (int i = 0; i < n; ++i) { /* balls hold across a force that turns: they do not take what changes */
    const int owner = tr_owner(s, c[i], &at);
    const double spare = fmax(1.0 - tr_ratio(s, owner), 0.0) + SHARE_WEIGHT;
    d[i] = tr_pair_of(s, owner)->cone ? 0.0 : tr_hold_of(s, owner)->capacity * TR_A(s, arm)[c[i]] * spare;
  }
  if (tr_cholesky(n, A, d, L, perm, 0, 0.0, 0.0) < rank) return 0;
  for (int i = rank; i < n; ++i) tr_row_kinds(s)[c[perm[i]]] = TR_ROW_KEPT;
  for (int i = 0; i < n; ++i) TR_A(s, share)[c[i]] = TR_A(s, z)[s->k->active + c[i]];
  s->friction.shares = 1;
  return 1;
}
