/* Friction laws and capacities at given frictions, and the Jacobian of the complement equations. */
#include "friction/friction.h"

#define NO_FRICTION 1e-290 /* N: a smaller friction is caused by NO_FORCE in the laws, not by a load */
/* relative to the capacity: largest torque about the contact force that a ball at rest holds; above round-off */
#define TOL_TWIST 1e-9

/* Evaluate N at the frictions eta, without open reactions. Requires load maps. */
static inline void tr_evaluate_loads(tr_sim *s, const double *eta) {
  TR_NEED(s, TR_HAS_LOADS);
  const double *N0 = TR_A(s, Np);
  tr_affine_map(s->k->nn, s->k->neta, N0, N0 + s->k->nn, eta, TR_A(s, NN));
}

/* Arrays from which the laws are evaluated at the current state, and arrays of their values. */
typedef struct tr_law_arguments {
  const double *maps, *rates, *x, *c; /* maps: load maps */
  double *N, *law, *dn, *sliding;
} tr_law_arguments;

/* The arguments at the current state. Forms the load maps if necessary. */
static inline tr_law_arguments tr_arguments_of_laws(tr_sim *s) {
  tr_form_all_maps(s);
  return (tr_law_arguments){.maps = TR_A(s, Np), .rates = map_rates(s->k, TR_A(s, maps)), .x = TR_A(s, x), .c = TR_A(s, c) + s->k->c_laws,
                            .N = TR_A(s, NN), .law = TR_A(s, law), .dn = TR_A(s, dn), .sliding = TR_A(s, sliding)};
}

/* Evaluate the laws at the e frictions eta. */
TR_SIZED void tr_evaluate_laws_at(tr_sim *s, const tr_law_arguments *at, const int e, const double *eta) {
  const tr_kernel *k = s->k;
  TR_NEED(s, TR_HAS_LOADS);
  tr_affine_map(k->nn, e, at->maps, at->maps + k->nn, eta, at->N);
  if (tr_open_count(s)) tr_solve_internal_forces(s, eta, at->N);
  k->laws(at->N, at->rates, at->x, at->c, at->law, at->dn, at->sliding);
  TR_MADE(s, TR_HAS_LAW);
}

static void tr_evaluate_laws(tr_sim *s, const double *eta) {
  const tr_law_arguments at = tr_arguments_of_laws(s);
  tr_evaluate_laws_at(s, &at, s->k->neta, eta);
}

/* Compute `count` (at most 3) rows of J = E − D Ne', from row `first` on. The element has ne multipliers and needs `needs` reaction
 * components. E is the unit matrix, and D (ne×needs) the derivative of the laws. D is volatile, so that the compiler reads its numbers
 * one by one: a wide read of numbers that the laws have just written one by one waits until all of them are in the cache. */
TR_SIZED void tr_law_jacobian_rows(const int e, int n, int ne, const int needs, const int count, int first, const volatile double *D, const double *Ne, double *J) {
  static const double unit[8] = {0.0, 0.0, 1.0};
  TR_UNROLL
  for (int j = 0, own = -first; j < e; ++j, ++own, Ne += n, J += e) {
    const double *begin = unit + (own >= 0 && own < count ? 2 - own : 5);
    double row[3];
    TR_UNROLL
    for (int q = 0; q < count; ++q) row[q] = begin[q];
    TR_UNROLL
    for (int i = 0; i < needs; ++i) {
      TR_UNROLL
      for (int q = 0; q < count; ++q) row[q] = tr_multiply_subtract(row[q], D[q + i * ne], Ne[i]);
    }
    TR_UNROLL
    for (int q = 0; q < count; ++q) J[q] = row[q];
  }
}

static void tr_form_law_jacobian(tr_sim *s) {
  TR_NEED(s, TR_HAS_LAW);
  const int e = s->k->neta, n = s->k->nn;
  const double *by_friction = tr_loads_by_friction(s);
  for (int m = 0; m < s->k->nelements; ++m) {
    const tr_element *el = s->k->element + m;
    const int ne = el->neta, needs = el->needs;
    const double *D = TR_A(s, dn) + el->dn0, *Ne = by_friction + el->n0;
    double *J = TR_A(s, lu) + el->eta0;
    if (ne == 1 && needs == 4) tr_law_jacobian_rows(e, n, 1, 4, 1, el->eta0, D, Ne, J);
    else if (ne == 3 && needs == 3) tr_law_jacobian_rows(e, n, 3, 3, 3, el->eta0, D, Ne, J);
    else
      for (int r = 0, count; r < ne; r += count) {
        count = ne - r > 1 ? 2 : 1;
        if (count == 2) tr_law_jacobian_rows(e, n, ne, needs, 2, el->eta0 + r, D + r, Ne, J + r);
        else tr_law_jacobian_rows(e, n, ne, needs, 1, el->eta0 + r, D + r, Ne, J + r);
      }
  }
}

/* tr_form_law_jacobian for e frictions. Mechanisms with one frictional joint take their sizes from the joint's contact element. */
TR_SIZED void tr_form_law_jacobian_of_size(tr_sim *s, const int e) {
  const double *D = TR_A(s, dn), *Ne = tr_loads_by_friction(s);
  if (s->k->nelements == 1 && e == 1 && s->k->nn == 4) tr_law_jacobian_rows(1, 4, 1, 4, 1, 0, D, Ne, TR_A(s, lu));
  else if (s->k->nelements == 1 && e == 3 && s->k->nn == 3) tr_law_jacobian_rows(3, 3, 3, 3, 3, 0, D, Ne, TR_A(s, lu));
  else tr_form_law_jacobian(s);
}

static void tr_evaluate_capacities(tr_sim *s) {
  TR_NEED(s, TR_HAS_MAPS), TR_MADE(s, TR_HAS_CAPACITY);
  const tr_kernel *k = s->k;
  k->held_alone(TR_A(s, NN), TR_A(s, z) + k->active, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
  s->friction.faint = NO_FRICTION;
  for (int i = 0; i < k->nsliders; ++i) s->friction.faint = fmax(s->friction.faint, ROUND_OFF_FRICTION * tr_hold_of(s, i)->size);
}

static void tr_evaluate_capacities_at_solution(tr_sim *s) {
  TR_NEED(s, TR_HAS_SOLUTION);
  const tr_kernel *k = s->k;
  if (s->friction.shared && !s->step.recursive) {
    tr_form_all_maps(s);
    tr_evaluate_loads(s, TR_A(s, z) + k->active);
    if (tr_open_count(s)) tr_solve_internal_forces(s, TR_A(s, z) + k->active, TR_A(s, NN));
  }
  tr_evaluate_capacities(s);
}

static double tr_friction_ratio(const tr_sim *s, int i) {
  TR_NEED(s, TR_HAS_CAPACITY);
  const tr_hold *h = tr_hold_of(s, i);
  double cap = fmax(h->capacity, NO_FORCE);
  if (h->size <= s->friction.faint) return 0.0;
  return h->beyond > TOL_TWIST * cap ? fmax(h->size / cap, 1.0 + h->beyond / cap) : h->size / cap;
}

static double tr_reserve(const tr_sim *s, int i) { return (1.0 - tr_friction_ratio(s, i)) * fmax(tr_hold_of(s, i)->capacity, 0.0); }
