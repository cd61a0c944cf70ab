/* Friction with the recursion: each Newton step on η is a pass over the bodies, without maps (theory, "Friction along the
 * recursion").
 *
 * Kernels of trees provide the functions `begin`, `narrow`, `respond`, `answer` and `derive`. Kernels of mechanisms with many loops
 * also provide `shift`; with it, a pass finds λ together with η. Maps are formed on demand (tr_form_all_maps): for decisions, other
 * roots, certificates, and states where the recursion fails. */
#include "friction/friction.h"

/* relative to a row's scale: with a smaller pivot, maps are used instead. The limit is 100 × KEEP_PIVOT. The pivots of 100 loops in
 * series are above this limit (1e-6 and more). */
#define CLEAR_ALONG 1e-7
#define PASS_WORK 1000 /* multiplications of a pass over the bodies, per friction */
/* relative to the largest friction: an iteration that starts from the loads of a close state fails if its second step is larger */
#define NEAR_ROOT 1e-2
/* relative to the least step so far: a larger step counts as no progress; near a fold, small steps without progress are
 * round-off */
#define STALLS 0.9
#define STALLED_MOST 8 /* number of successive steps without progress after which maps are used */
#define STEPS_TO_SLOW 0.1 /* relative to the last step: after a larger step, a new derivative is computed */

static int tr_is_recursive(const tr_sim *s) {
  const tr_friction *f = &s->friction;
  const int *row = tr_row_kinds(s);
  if (!s->k->begin || f->eased > 0.0 || f->freed >= 0 || f->from_anywhere || s->moreau.h > 0.0 || s->loops.rank < s->k->active) return 0;
  if (!f->held) return 1;
  if (f->impending_laws || (f->shared && !s->k->active)) return 0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j)
      if (row[j] == TR_ROW_SHARE || row[j] == TR_ROW_FULL || (row[j] == TR_ROW_FREE && s->k->active) ||
          (row[j] == TR_ROW_REST && pair->v0 < 0))
        return 0;
  }
  return 1;
}

/* Whether friction i is a function of the loads of its pair: its pair slides, or stores its load. */
static inline int tr_has_local_law(const tr_sim *s, int i) { return tr_row_kind(s, i) == TR_ROW_LAW || tr_row_kind(s, i) == TR_ROW_STORED; }

/* Evaluate the laws at the loads N, and with `slopes` their derivatives. For a multiplier with a stored load, this load takes the
 * place of the law. */
static void tr_evaluate_local_laws(tr_sim *s, const double *N, int slopes) {
  const tr_kernel *k = s->k;
  const double *rates = map_rates(k, TR_A(s, maps)), *x = TR_A(s, x), *c = TR_A(s, c) + k->c_laws;
  double *law = TR_A(s, law), *D = TR_A(s, dn);
  if (slopes) k->laws(N, rates, x, c, law, D, TR_A(s, sliding));
  else k->laws_alone(N, rates, x, c, law, TR_A(s, sliding));
  if (!s->friction.held || !s->friction.shared) return;
  for (int m = 0; m < k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    const tr_element *el = k->element + pair->element;
    for (int j = 0; j < pair->neta; ++j) {
      const int i = pair->eta0 + j;
      double slope[3];
      if (tr_row_kinds(s)[i] != TR_ROW_STORED) continue;
      law[i] = tr_stored_load(s, m, i, N, slope);
      for (int q = 0; q < el->needs && slopes; ++q) D[el->dn0 + i - el->eta0 + q * el->neta] = q < 3 ? slope[q] : 0.0;
    }
  }
}

/* Factorise the inertias with the laws' derivative `dlaw`, for the freedoms marked in `moves`. Returns the sign of the determinant
 * of Newton's matrix, which is 1 without friction. Returns 0 if this matrix is singular, or if a pivot of S is so small that only
 * maps can show which rows are independent. */
static int tr_factor_inertias(tr_sim *s) {
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
  s->loops.recursive_pivot = k->active ? sqrt(least) : 0.0;
  if (!(least > CLEAR_ALONG)) return 0;
  s->loops.rank_now = k->active;
  return sense;
}

/* Call tr_factor_inertias with the laws' derivative `dn`, in the modes in force. Requires the laws' values. */
static int tr_factor_with_laws(tr_sim *s) {
  const tr_kernel *k = s->k;
  double *moves = TR_A(s, moves), *D = TR_A(s, dlaw);
  memcpy(D, TR_A(s, dn), sizeof(double) * k->ndn);
  for (int i = 0; i < k->neta; ++i) moves[i] = tr_row_kind(s, i) != TR_ROW_REST;
  for (int m = 0; m < k->nelements && s->friction.held; ++m) {
    const tr_element *el = k->element + m;
    for (int j = 0; j < el->neta; ++j)
      if (!tr_has_local_law(s, el->eta0 + j))
        for (int q = 0; q < el->needs; ++q) D[el->dn0 + j + q * el->neta] = 0.0;
  }
  return tr_factor_inertias(s);
}

static int tr_factor_without_friction(tr_sim *s) {
  if (!s->k->begin || (s->k->active && !s->k->shift) || s->loops.rank < s->k->active) return 0;
  memset(TR_A(s, dlaw), 0, sizeof(double) * s->k->ndn);
  for (int i = 0; i < s->k->neta; ++i) TR_A(s, moves)[i] = 1.0;
  return tr_factor_inertias(s);
}

/* Compute η, N, and λ (in z) from the laws, linearised at the old N. law: η that the laws give at the old N. */
static void tr_solve_linear_laws(tr_sim *s, const double *law, double *N, double *eta) {
  const tr_kernel *k = s->k;
  double *D = TR_A(s, dlaw), *less = TR_A(s, less), *borne = TR_A(s, borne);
  for (int m = 0; m < k->nelements; ++m) {
    const tr_element *el = k->element + m;
    for (int j = 0; j < el->neta; ++j) {
      const int i = el->eta0 + j;
      double e = tr_has_local_law(s, i) ? law[i] : 0.0;
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
      eta[i] = tr_row_kind(s, i) == TR_ROW_REST ? -borne[i] : -less[i];
      for (int q = 0; q < el->needs; ++q) eta[i] += D[el->dn0 + j + q * el->neta] * N[el->n0 + q];
    }
  }
}

/* `step` and `size` receive the largest entries of `to` − `from` and of `to`, as surface forces. */
static void tr_compare_frictions(const tr_sim *s, const double *from, const double *to, double *step, double *size) {
  const double *lever = TR_A(s, lever);
  *step = *size = 0.0;
  for (int i = 0; i < s->k->neta; ++i) {
    const double f = lever[i] > 0.0 ? 1.0 / lever[i] : 1.0;
    *step = fmax(*step, fabs(to[i] - from[i]) * f), *size = fmax(*size, fabs(to[i]) * f);
    if (!(*step < INFINITY)) return;
  }
}

static int tr_loads_by_recursion(tr_sim *s, double *eta) {
  double law[s->k->neta];
  memset(TR_A(s, dn), 0, sizeof(double) * s->k->ndn);
  memcpy(law, eta, sizeof law);
  if (tr_factor_with_laws(s) <= 0) return 0;
  tr_solve_linear_laws(s, law, tr_stored_loads(s), eta);
  return 1;
}

/* Whether η obeys the laws evaluated last, up to round-off. Requires laws evaluated at the N of the same linear
 * solution as η. */
static int tr_obeys_laws(const tr_sim *s, const double *eta) {
  const double *law = TR_A(s, law), *lever = TR_A(s, lever);
  double gap = 0.0, size = 0.0;
  for (int i = 0; i < s->k->neta; ++i) {
    const double f = lever[i] > 0.0 ? 1.0 / lever[i] : 1.0;
    if (tr_has_local_law(s, i)) gap = tr_max_or_nan(gap, fabs(law[i] - eta[i]) * f);
    size = fmax(size, fabs(eta[i]) * f);
  }
  return gap <= NEWTON_EXACT * size;
}

static int tr_newton_recursive_from(tr_sim *s, int near, int least) {
  const tr_kernel *k = s->k;
  const int e = k->neta;
  double *eta = TR_A(s, z) + k->active, *N = tr_stored_loads(s), old[e], step, size, last = INFINITY, best = INFINITY;
  if (!near && !tr_loads_by_recursion(s, eta)) return 0;
  for (int it = 1, fresh = 1, stalled = 0; it <= NEWTON_MAX && stalled < STALLED_MOST; ++it) {
    if (tr_is_cancelled(s, (double)PASS_WORK * e)) return 0;
    tr_evaluate_local_laws(s, N, fresh);
    const int obeys = it > near && !least && tr_obeys_laws(s, eta);
    /* With loops, the pivot always comes from the factor with friction, so that pivots of two states can be compared. */
    const int sense = fresh && (!obeys || (it == 1 && k->active)) ? tr_factor_with_laws(s) : 1;
    if (obeys && sense) return 1;
    if (!sense || sense < least) return 0;
    memcpy(old, near && it == 1 ? TR_A(s, law) : eta, sizeof old);
    tr_solve_linear_laws(s, TR_A(s, law), N, eta);
    tr_compare_frictions(s, old, eta, &step, &size);
    s->stats.newton_iterations++;
    if (!(step < INFINITY) || (near && it == 2 && step > NEAR_ROOT * size)) return 0;
    stalled = step < STALLS * best ? 0 : stalled + 1, best = fmin(best, step);
    const double next = fresh ? (step <= NEWTON_QUADRATIC * size ? 0.0 : INFINITY) : step * step / last;
    const int round_off = step <= NEWTON_QUADRATIC * size && stalled > 1; /* steps stall because the equation is ill-conditioned */
    if (near && it == 1) { /* no test of convergence, because laws may jump between the loads of two states */
    } else if (step <= NEWTON_EXACT * size || (step <= NEWTON_SHRINKS * last && next <= NEWTON_EXACT * size) || round_off) {
      if (it > s->stats.newton_most) s->stats.newton_most = it;
      return 1;
    }
    fresh = step > STEPS_TO_SLOW * last;
    last = step;
  }
  return 0;
}

/* Whether the equations may have several roots, because a sliding ball was near its cone when the laws were last evaluated. The
 * choice of the root must then not depend on the start. */
static int tr_may_have_several_roots(const tr_sim *s) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_pair_of(s, i)->cone && !tr_is_stuck(s, i) && !(tr_sliding_of(s, i)->cone > BY_CONE)) return 1;
  return 0;
}

/* Find η with the recursion in the current state. near: whether z holds loads of a close state. On failure, restores z and
 * returns 0. */
static int tr_newton_recursive(tr_sim *s, int near) {
  const tr_kernel *k = s->k;
  double kept[tr_z_length(s)];
  memcpy(kept, TR_A(s, z), sizeof kept);
  for (near = near && s->step.loads_known && !tr_may_have_several_roots(s); near >= 0; --near) {
    s->step.recursive = tr_newton_recursive_from(s, near, 0) && !(near && tr_may_have_several_roots(s));
    if (s->step.recursive) {
      tr_copy(k->nn, tr_stored_loads(s), TR_A(s, NN));
      TR_MADE(s, TR_HAS_SOLUTION);
      return s->step.loads_known = 1;
    }
    memcpy(TR_A(s, z), kept, sizeof kept);
  }
  return 0;
}

static void tr_store_solution_loads(tr_sim *s) {
  if (!s->k->begin) return;
  tr_evaluate_loads(s, TR_A(s, z) + s->k->active);
  tr_copy(s->k->nn, TR_A(s, NN), tr_stored_loads(s));
  s->step.loads_known = 1;
}

static double tr_response_by_recursion(tr_sim *s, int i) {
  const tr_kernel *k = s->k;
  double less[k->neta], N[k->nn + 1], borne[k->neta], with[k->neta], without[k->neta], large = NO_LOAD;
  if (!tr_factor_without_friction(s)) return 0.0;
  for (int j = 0; j < k->nn; ++j) large = fmax(large, fabs(TR_A(s, NN)[j])); /* far above round-off of the loads */
  memset(less, 0, sizeof less);
  k->respond(TR_A(s, c), TR_A(s, w), less, N, borne, without);
  less[i] = large;
  k->respond(TR_A(s, c), TR_A(s, w), less, N, borne, with);
  return (with[i] - without[i]) / large;
}

/* Whether every held pair is held independently of the others. The freedoms of a held pair must be states of the tree. Returns 0
 * also if the body between two joints is so light that one joint holds the other. */
static int tr_are_held_pairs_independent(tr_sim *s) {
  const tr_kernel *k = s->k;
  double least = INFINITY, most = 0.0;
  if (!k->begin || k->active || s->moreau.h > 0.0) return 0;
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_stuck(s, i) && tr_pair_of(s, i)->v0 < 0) return 0;
  tr_narrow_without_friction(s);
  for (int i = 0; i < k->nbodies; ++i) least = fmin(least, TR_A(s, pivots)[i]), most = fmax(most, TR_A(s, pivots)[i]);
  return least > RANK_PIVOT * most;
}

static int tr_rhs_recursive(tr_sim *s, const double *y, double *dy) {
  const tr_kernel *k = s->k;
  tr_begin_recursion(s, y, dy);
  if (!tr_newton_recursive(s, 1)) return 0;
  k->derive(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, z), dy, TR_A(s, power));
  return 1;
}
