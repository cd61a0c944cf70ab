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

static void tr_evaluate_laws(tr_sim *s, const double *eta) {
  const tr_kernel *k = s->k;
  tr_form_all_maps(s);
  double *N = TR_A(s, NN);
  tr_evaluate_loads(s, eta);
  if (tr_open_count(s)) tr_solve_internal_forces(s, eta, N);
  k->laws(N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
  TR_MADE(s, TR_HAS_LAW);
}

/* Compute `count` (at most 3) rows of J = E − D Ne', from row `first` on. The element has ne multipliers and needs `needs` reaction
 * components. E is the unit matrix, and D (ne×needs) the derivative of the laws. */
TR_SIZED void tr_law_jacobian_rows(int e, int n, int ne, const int needs, const int count, int first, const double *D, const double *Ne, double *J) {
  static const double unit[8] = {0.0, 0.0, 1.0};
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
