/* Friction along the recursion: η of a tree by Newton's method whose every step is a pass over the bodies, without maps (METHOD, "Friction
 * along the recursion"). A kernel that has it brings `begin`, `narrow`, `respond`, `answer` and `derive`; of many loops, whose λ is found with
 * η, also `shift`. The maps are formed when something asks for them (tr_form_all): decisions, roots, certificates, and what this method does
 * not find. */

#include "multipliers.c"

#define CLEAR_ALONG 1e-7  /* of a row's scale: a hundred times KEEP_PIVOT; the outermost loop of a ladder of a hundred has 1e-6 */
#define PASS_WORK 1000    /* multiplications for each friction: what a pass over the bodies takes */
#define LIGHT 1e-9        /* of the largest pivot of a joint: as GROUP_PIVOT, below it what is held together shares its load (``groups.c``) */
#define NEAR_ROOT 1e-2    /* of the largest friction: the second step, where the loads of a state near by lead to the root that is followed */
#define STEPS_TO_SLOW 0.1 /* of the step before: where steps with an old derivative shrink by less, a new one is worth it */

/* Whether friction is found along the recursion in the modes in force: every pair slides, is held by itself, or has none. On loops that
 * are not redundant every pair slides. */
static int tr_recurs(const tr_sim *s) {
  const tr_friction *f = &s->friction;
  const int *row = tr_row_kinds(s);
  if (!s->k->begin || f->eased > 0.0 || f->freed >= 0 || f->anywhere || s->moreau.h > 0.0 || s->loops.rank < s->k->active) return 0;
  if (!f->still) return 1;
  if (f->shares || f->by_law || s->k->active) return 0;
  for (int i = 0; i < s->k->neta; ++i)
    if (row[i] > TR_ROW_FREE) return 0;
  return 1;
}

/* Those maps, and what is made of them without loops. */
static void tr_form_all(tr_sim *s) {
  if (s->step.mapped >= (s->k->sets ? TR_MAPS_HELD : TR_MAPS_OF_LOADS) || !s->k->begin) return;
  if (s->k->active) {
    tr_without_loops(s, s->k->sets);
    return;
  }
  double lam0[1];
  if (s->step.mapped < TR_MAPS_OF_LOADS) tr_eliminate(s, lam0);
  if (s->k->sets) tr_held_maps(s, lam0);
}

static inline int tr_row_kind(const tr_sim *s, int i) { return s->friction.still ? tr_row_kinds(s)[i] : TR_ROW_LAW; }

/* Inertias with the law's derivative in `dlaw`, of the freedoms that move. The sign of the determinant of Newton's matrix, which is 1 where
 * nothing rubs: every pivot is that without friction times a factor, those of cut joints' frictions and of S too. 0: it has none, or a pivot
 * of S is so small that which rows count has to be decided with maps. */
static int tr_pivots(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *pivot = TR_A(s, pivots), *own = pivot + k->nbodies + k->nelements, *d = TR_A(s, d);
  const int n = k->nbodies + (k->active ? k->nelements + k->active : 0);
  double least = INFINITY;
  int sense = 1;
  k->narrow(TR_A(s, c), TR_A(s, w), TR_A(s, moves), TR_A(s, dlaw), TR_A(s, pivots));
  for (int i = 0; i < n; ++i) {
    if (!(fabs(pivot[i]) > 0.0)) return 0;
    if (pivot[i] < 0.0) sense = -sense;
  }
  for (int i = 0; i < k->active; ++i) least = fmin(least, fabs(own[i]) * d[i] * d[i]);
  s->loops.apart = k->active ? sqrt(least) : 0.0;
  if (!(least > CLEAR_ALONG)) return 0;
  s->loops.rank_now = k->active; /* no row is given up */
  return sense;
}

/* The same with the law's derivative as it is in `dn` (rows of what no law tells zeroed) and the modes in force. */
static int tr_narrow(tr_sim *s) {
  const tr_kernel *k = s->k;
  double *moves = TR_A(s, moves), *D = TR_A(s, dlaw);
  memcpy(D, TR_A(s, dn), sizeof(double) * k->ndn);
  for (int i = 0; i < k->neta; ++i) moves[i] = tr_row_kind(s, i) != TR_ROW_STILL;
  for (int m = 0; m < k->nelements && s->friction.still; ++m) {
    const tr_element *el = k->element + m;
    for (int j = 0; j < el->neta; ++j)
      if (tr_row_kind(s, el->eta0 + j) != TR_ROW_LAW)
        for (int q = 0; q < el->needs; ++q) D[el->dn0 + j + q * el->neta] = 0.0;
  }
  return tr_pivots(s);
}

/* The same where nothing rubs and all moves, for the closing of many loops; 0: not so. */
static int tr_narrow_ideal(tr_sim *s) {
  if (!s->k->shift || s->loops.rank < s->k->active) return 0;
  memset(TR_A(s, dlaw), 0, sizeof(double) * s->k->ndn);
  for (int i = 0; i < s->k->neta; ++i) TR_A(s, moves)[i] = 1.0;
  return tr_pivots(s);
}

/* η (λ before it in z) and N that follow from the laws as they are linear about N with the derivative in place; law: η that they say at N. */
static void tr_respond(tr_sim *s, const double *law, double *N, double *eta) {
  const tr_kernel *k = s->k;
  double *D = TR_A(s, dlaw), *less = TR_A(s, less), *borne = TR_A(s, borne);
  for (int m = 0; m < k->nelements; ++m) {
    const tr_element *el = k->element + m;
    for (int j = 0; j < el->neta; ++j) {
      const int i = el->eta0 + j;
      double e = tr_row_kind(s, i) == TR_ROW_LAW ? law[i] : 0.0;
      for (int q = 0; q < el->needs; ++q) e -= D[el->dn0 + j + q * el->neta] * N[el->n0 + q];
      less[i] = -e;
    }
  }
  k->respond(TR_A(s, c), TR_A(s, w), less, N, borne, TR_A(s, acc));
  memcpy(TR_A(s, z), borne + k->neta, sizeof(double) * k->active);
  for (int m = 0; m < k->nelements; ++m) {
    const tr_element *el = k->element + m;
    for (int j = 0; j < el->neta; ++j) {
      const int i = el->eta0 + j;
      eta[i] = tr_row_kind(s, i) == TR_ROW_STILL ? -borne[i] : -less[i];
      for (int q = 0; q < el->needs; ++q) eta[i] += D[el->dn0 + j + q * el->neta] * N[el->n0 + q];
    }
  }
}

/* How far two sets of frictions are apart, and how large the second is, as forces at the surface. */
static void tr_compare(const tr_sim *s, const double *from, const double *to, double *step, double *size) {
  const double *arm = TR_A(s, arm);
  *step = *size = 0.0;
  for (int i = 0; i < s->k->neta; ++i) {
    const double f = arm[i] > 0.0 ? 1.0 / arm[i] : 1.0;
    *step = fmax(*step, fabs(to[i] - from[i]) * f), *size = fmax(*size, fabs(to[i]) * f);
    if (!(*step < INFINITY)) return;
  }
}

/* The loads that the frictions `eta` cause at the state that has begun; what is held is held. */
static int tr_loads_of(tr_sim *s, double *eta) {
  double law[s->k->neta];
  memset(TR_A(s, dn), 0, sizeof(double) * s->k->ndn);
  memcpy(law, eta, sizeof law);
  if (tr_narrow(s) <= 0) return 0;
  tr_respond(s, law, tr_loads(s), eta);
  return 1;
}

/* Newton's iteration at the state that has begun. near: from the loads in place, those of a state near by, as long as it closes in on a root
 * at once; else from those that the frictions in z cause here, as it goes with maps. Roots with a determinant of less than `least` (0, or −1: any)
 * are not followed. */
static int tr_iterate_along(tr_sim *s, int near, int least) {
  const tr_kernel *k = s->k;
  const int e = k->neta;
  double *eta = TR_A(s, z) + k->active, *N = tr_loads(s), old[e], step, size, last = INFINITY;
  const double *rates = map_rates(k, TR_A(s, maps)), *x = TR_A(s, x), *c = TR_A(s, c) + k->c_laws;
  if (!near && !tr_loads_of(s, eta)) return 0;
  for (int it = 1, fresh = 1; it <= NEWTON_MAX; ++it) {
    if (tr_gives_up(s, (double)PASS_WORK * e)) return 0;
    if (fresh) k->laws(N, rates, x, c, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
    else k->laws_alone(N, rates, x, c, TR_A(s, law), TR_A(s, sliding));
    const int sense = fresh ? tr_narrow(s) : 1;
    if (!sense || sense < least) return 0;
    memcpy(old, near && it == 1 ? TR_A(s, law) : eta, sizeof old);
    tr_respond(s, TR_A(s, law), N, eta);
    tr_compare(s, old, eta, &step, &size);
    s->stats.newton_iterations++;
    if (!(step < INFINITY) || (near && it == 2 && step > NEAR_ROOT * size)) return 0;
    const double next = fresh ? (step <= NEWTON_QUADRATIC * size ? 0.0 : INFINITY) : step * step / last;
    if (near && it == 1) { /* loads may have changed across what the laws say of them, too */
    } else if (step <= NEWTON_EXACT * size || (step <= NEWTON_SHRINKS * last && next <= NEWTON_EXACT * size)) {
      if (it > s->stats.newton_most) s->stats.newton_most = it;
      return 1;
    }
    fresh = step > STEPS_TO_SLOW * last;
    last = step;
  }
  return 0;
}

/* Whether a ball is among the pairs: its equations may have several roots, and which of them is followed must not hang on how. */
static int tr_any_ball(const tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_pair_of(s, i)->cone) return 1;
  return 0;
}

/* η at the state that has begun; 0: to be found in another way, from what was there. near: the loads in place are those of a state near by. */
static int tr_newton_along(tr_sim *s, int near) {
  const tr_kernel *k = s->k;
  double kept[tr_nz(s)];
  memcpy(kept, TR_A(s, z), sizeof kept);
  for (near = near && s->step.loaded && !tr_any_ball(s); near >= 0; --near) {
    s->step.along = tr_iterate_along(s, near, 0);
    if (s->step.along) {
      tr_copy(k->nn, tr_loads(s), TR_A(s, NN));
      return s->step.loaded = 1;
    }
    memcpy(TR_A(s, z), kept, sizeof kept);
  }
  return 0;
}

/* The loads of frictions that were found with maps, from which the next iteration may begin. */
static void tr_note_loads(tr_sim *s) {
  if (!s->k->begin) return;
  tr_loads_now(s, TR_A(s, z) + s->k->active);
  tr_copy(s->k->nn, TR_A(s, NN), tr_loads(s));
  s->step.loaded = 1;
}

/* The motion at y, whose signals are in place: what is found next goes without maps until they are asked for. */
static void tr_begin_along(tr_sim *s, const double *y, double *dy) {
  s->k->begin(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), dy);
  s->step.mapped = TR_MAPS_NONE, s->step.along = 0;
  if (y != TR_A(s, yeval)) memcpy(TR_A(s, yeval), y, sizeof(double) * s->ny);
#ifdef TR_POISON
  const int columns = 1 + s->k->active + s->k->neta;
  for (int i = 0; i < s->k->nn * columns; ++i) ((double *)map_N0(s->k, TR_A(s, maps)))[i] = NAN;
  for (int i = 0; i < s->k->neta * columns && s->k->sets; ++i) ((double *)map_Q0(s->k, TR_A(s, maps)))[i] = NAN;
  for (int i = 0; i < s->k->nn * (1 + s->k->neta); ++i) TR_A(s, Np)[i] = NAN;
  for (int i = 0; i < s->k->neta * (1 + s->k->neta) && s->k->sets; ++i) TR_A(s, Q)[i] = NAN;
#endif
}

/* Whether every pair that is held is so by itself: its freedoms are states of the tree, and no body between two joints is so light that to hold
 * one is to hold the other, but for round-off. Their rows are told. */
static int tr_hold_apart(tr_sim *s) {
  const tr_kernel *k = s->k;
  double least = INFINITY, most = 0.0;
  if (!k->begin || k->active || s->moreau.h > 0.0) return 0;
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_stuck(s, i) && tr_pair_of(s, i)->v0 < 0) return 0;
  memset(TR_A(s, dlaw), 0, sizeof(double) * k->ndn);
  for (int i = 0; i < k->neta; ++i) TR_A(s, moves)[i] = 1.0;
  k->narrow(TR_A(s, c), TR_A(s, w), TR_A(s, moves), TR_A(s, dlaw), TR_A(s, pivots));
  for (int i = 0; i < k->nbodies; ++i) least = fmin(least, TR_A(s, pivots)[i]), most = fmax(most, TR_A(s, pivots)[i]);
  return least > LIGHT * most;
}

/* ẏ at (t, y), whose signals are in place, along the recursion; 0: not found so. */
static int tr_rhs_along(tr_sim *s, const double *y, double *dy) {
  const tr_kernel *k = s->k;
  tr_begin_along(s, y, dy);
  if (!tr_newton_along(s, 1)) return 0;
  k->derive(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, z), dy, TR_A(s, power));
  return 1;
}
