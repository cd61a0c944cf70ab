/* Limits on steps near singular positions of loops. */
#include "stepping/stepping.h"

#define INDEPENDENCE_LEAST 3.2e-5 /* √KEEP_PIVOT: a row with less independence is dropped */
/* factor by which the independence may change in the next step, as extrapolated from the last step */
#define APPROACH 4.0
/* largest accepted factor between the independence at the start and at the end of a step; otherwise the step is shortened */
#define LEAP 8.0
#define SHORTER 2.0               /* factor by which a step with a larger change of independence is shortened */
/* relative to the independence at the start of the run: at a smaller independence, the motion passes a dead centre */
#define PASSED 1e-3
#define PASSED_SECTIONS 24        /* number of golden-section iterations that find the least independence */
/* in units of 1 / rate scale: shortest step that is limited; in shorter steps, a new pivot order may change the last pivot */
#define SHORTEST 1e-9

/* Whether singular positions matter: joints with friction are in loops, and steps have error control. */
static inline int tr_has_friction_on_loops(const tr_sim *s) { return s->k->active && s->k->neta && s->set.hfixed <= 0.0; }

/* Whether loops and drives leave no freedom. Returns 0 also if there is no dense factorisation of the loop equations at the end of
 * the step. */
static inline int tr_leaves_no_freedom(const tr_sim *s) {
  return s->loops.rank > 0 && s->loops.rank == s->k->nv && !s->loops.sparse && !tr_has_lane(s) && s->set.hfixed <= 0.0;
}

/* Independence of the loops at the fraction theta of the last step. */
static double tr_independence_inside(tr_sim *s, double theta) {
  double *y = TR_A(s, yout);
  tr_dense_state(s, theta, y);
  tr_evaluate_maps_at(s, s->step.t0 + theta * s->step.size, y);
  tr_factor_loops(s);
  return tr_loop_independence(s);
}

/* Longest step from the state `y` that the approach to a singular position allows, s. Where a root of friction ends, the last pivot
 * of loops with friction jumps; its trend then has no meaning. */
static double tr_longest_singular_step(tr_sim *s) {
  tr_loops *l = &s->loops;
  if (!tr_has_friction_on_loops(s)) return INFINITY;
  if (!l->known) {
    tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
    if (!tr_factor_without_friction(s)) tr_factor_loops(s);
    l->known = 1, l->begin = tr_loop_independence(s), l->trend = 0.0;
  }
  if (l->begin <= INDEPENDENCE_LEAST || l->trend == 0.0) return INFINITY;
  return fmax(SHORTEST / s->set.rate, l->begin / fabs(l->trend) * (l->trend < 0.0 ? 1.0 - 1.0 / APPROACH : APPROACH - 1.0));
}

/* Error of the last step, in units of the tolerance, if the step passes a singular position or contains a jump of forces; otherwise
 * 0. Requires an evaluated end. */
static double tr_singular_error(tr_sim *s, const tr_method *m, double h) {
  tr_loops *l = &s->loops;
  if (!tr_has_friction_on_loops(s)) {
    l->end = tr_leaves_no_freedom(s) ? tr_loop_independence(s) : NAN;
    return 0.0;
  }
  l->end = tr_loop_independence(s), l->least = fmin(l->least, l->begin);
  if (h <= SHORTEST / s->set.rate) return 0.0;
  const double begin = fmax(l->begin, INDEPENDENCE_LEAST), least = fmax(l->least, INDEPENDENCE_LEAST);
  if (least * LEAP < begin || l->end > begin * LEAP) return pow(SHORTER, m->order);
  if (l->least > 0.0 || (l->begin == 0.0 && l->end == 0.0)) return 0.0;
  const int n = tr_state_width(s);
  const double *K = TR_A(s, K), *end = K + m->end * n;
  double *jump = TR_A(s, ytmp);
  for (int i = 0; i < n; ++i) jump[i] = h * (end[i] - K[i]);
  return pow(tr_squared_motion_error(s, jump, TR_A(s, y), TR_A(s, ynew)), 0.5 * m->order);
}

/* Record the first dead centre that a driven motion passes. At a dead centre, the independence falls to 0, and the drives do not
 * determine the direction in which the motion continues. Requires a whole step that is not yet completed. */
static void tr_record_dead_centre(tr_sim *s) {
  const double golden = 0.6180339887498949;
  tr_loops *l = &s->loops;
  if (!tr_leaves_no_freedom(s) || s->audit.dead_t >= 0.0) return;
  const double near = PASSED * sqrt(l->least_pivot);
  if (l->end < near) s->audit.dead_t = s->pending.t;
  if (l->end < near || !l->known || !(l->begin + l->trend * s->step.size < 0.0) || !tr_ensure_dense(s)) return;
  double a = 0.0, b = 1.0, p = b - golden, q = golden, at_p = tr_independence_inside(s, p), at_q = tr_independence_inside(s, q);
  for (int i = 0; i < PASSED_SECTIONS; ++i) {
    if (at_p < at_q) b = q, q = p, at_q = at_p, p = b - golden * (b - a), at_p = tr_independence_inside(s, p);
    else a = p, p = q, at_p = at_q, q = a + golden * (b - a), at_q = tr_independence_inside(s, q);
  }
  if (fmin(at_p, at_q) < near) s->audit.dead_t = s->step.t0 + p * s->step.size;
}

/* Store the change of independence over the whole step. The next step begins with the independence at the end of this step. */
static void tr_store_independence(tr_sim *s) {
  tr_loops *l = &s->loops;
  l->trend = (l->end - l->begin) / s->step.size;
  l->known = 1, l->begin = l->end;
}
