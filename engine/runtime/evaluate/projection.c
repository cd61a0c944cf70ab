/* Projection onto the constraint manifold: quaternions of norm 1, and closed loops in positions and velocities (theory, "Closed
 * loops"). The correction δv = M⁻¹Gᵀ δλ is the smallest in the mass metric. The recursion computes δv, if the kernel has the
 * function `shift`. Otherwise δv is the difference of two evaluations of stage 2, with and without δλ. */
#include "evaluate/evaluate.h"

/* relative to the length scale, or rad: largest residual that counts as round-off; 100 × LOOP_CLOSED */
#define ROUND_OFF_MOST 4e-13
#define CLOSE_BOUNDED 3   /* largest number of iterations on positions in a bounded step */

static void tr_normalise_quaternions(const tr_sim *s, double *y) {
  for (int i = 0; i < s->k->nquat; ++i) {
    double *e = y + s->k->quat[i];
    double n = 1.0 / sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
    for (int j = 0; j < 4; ++j) e[j] *= n;
  }
}

static void tr_loop_residual(const tr_sim *s, const double *h, double *position, double *velocity) {
  const tr_kernel *k = s->k;
  *position = *velocity = 0.0;
  for (int i = 0; i < k->active; ++i) {
    int r = k->active_rows[i];
    double unit = tr_row_unit(s, r);
    *position = tr_max_or_nan(*position, fabs(h[r]) / unit);
    *velocity = tr_max_or_nan(*velocity, fabs(h[k->rows + r]) / (unit * s->set.rate));
  }
}

/* dv (nv) = M⁻¹Gᵀ δλ: the change that removes the residual h of the active rows (positions or rates) at y. again: whether to use
 * maps and factor of the previous call, whose state must be close. */
static void tr_loop_correction(tr_sim *s, const double *y, const double *h, int again, double *dv) {
  const tr_kernel *k = s->k;
  int a = k->active;
  double b[a], dlam[a];
  if (!again) {
    tr_evaluate_maps(s, y);
    if (!tr_factor_without_friction(s)) tr_factor_loops(s);
  }
  if (s->loops.recursive_pivot > 0.0) {
    for (int i = 0; i < a; ++i) b[i] = h[k->active_rows[i]];
    k->shift(TR_A(s, c), TR_A(s, w), b, dv);
    return;
  }
  for (int i = 0; i < a; ++i) b[i] = -h[k->active_rows[i]];
  tr_solve_loops(s, b, dlam);
  tr_rates_by_impulses(s, y, dlam, 0, 0, again, dv);
}

/* Whether the mechanism has many loops. Fewer corrections are then made, to save time. */
static inline int tr_has_many_loops(const tr_sim *s) { return s->k->nfill || s->k->shift; }

static int tr_project(tr_sim *s, double t, double *y) {
  const tr_kernel *k = s->k;
  if (k->nquat) tr_normalise_quaternions(s, y);
  if (k->active == 0 || !s->set.project) return 1;
  double *h = TR_A(s, loop_error), pos, vel, before = INFINITY, dv[k->nv], dq[k->nq + 4];
  const int most = s->bound.evaluations ? CLOSE_BOUNDED : CLOSURE_STEPS;
  const double closed = fmax(LOOP_CLOSED, s->loops.round_off);
  tr_set_time(s, t);
  for (int it = 0; it < most; ++it) {
    tr_evaluate_closure(s, y, h);
    tr_loop_residual(s, h, &pos, &vel);
    if (!(pos < INFINITY)) {
      s->step.failure = TR_FAIL_NOT_FINITE;
      return 0;
    }
    if (pos <= closed || (it > 1 && pos > CLOSURE_SHRINKS * before) || (tr_has_many_loops(s) && before <= LOOP_NEARLY_CLOSED)) break;
    before = pos;
    tr_loop_correction(s, y, h, 0, dv);
    k->qdot(y, dv, TR_A(s, c), dq);
    for (int i = 0; i < k->nq; ++i) y[i] += dq[i];
    if (k->nquat) tr_normalise_quaternions(s, y);
    s->stats.projections++;
  }
  if (tr_has_many_loops(s) && y == TR_A(s, ynew) && pos > CLOSURE_SHRINKS * before && before <= ROUND_OFF_MOST)
    s->loops.round_off = fmax(s->loops.round_off, before); /* only at ends of steps, so that output rows do not change the motion */
  s->audit.gap = pos;
  if (pos > LOOP_OPEN) {
    s->step.failure = TR_FAIL_CLOSURE;
    return 0;
  }
  for (int it = 0; it < CLOSURE_RATE_STEPS && vel > closed; ++it) {
    double was = vel;
    tr_loop_correction(s, y, h + k->rows, tr_has_many_loops(s) && before <= LOOP_NEARLY_CLOSED, dv);
    for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
    tr_evaluate_closure(s, y, h);
    tr_loop_residual(s, h, &pos, &vel);
    if (vel > CLOSURE_SHRINKS * was || (tr_has_many_loops(s) && was <= LOOP_NEARLY_CLOSED)) break;
  }
  if (s->friction.held) tr_hold_at_rest(s, y);
  return 1;
}
