/* Stage `evaluate`: the right-hand side ẏ(t, y), and states on the manifold. */
#ifndef TR_EVALUATE_H
#define TR_EVALUATE_H
#include "friction/friction.h"

/* Number of doubles that tr_save_solution stores. */
static inline int tr_solution_size(const tr_sim *s) {
  return 2 + tr_z_length(s) + (s->k->nmore ? s->k->active : 0);
}

/* Whether the SIMD lanes can serve a request at the current state. Lanes require independent loop rows, no tables and no open
 * reactions. The friction of every pair must follow from its law, so no pair may be held. */
static inline int tr_has_lane(const tr_sim *s) {
  const tr_kernel *k = s->k;
  const tr_friction *f = &s->friction;
  if (!s->lane || k->ntables || k->begin || k->shift || k->nfill || k->nkappa || k->nunilateral || s->loops.rank != k->active || !s->set.project) return 0;
  return !k->neta || !(f->held || f->freed >= 0 || f->eased > 0.0 || f->from_anywhere || s->moreau.h > 0.0 || s->ask.cancelled);
}

/* Update the extremes of each pair over the stages of a step. The recorded quantity is the distance of the speed from the kink, or
 * the violation of a set-valued mode. Also records the reserves of pairs at rest. Requires a solution. */
static void tr_update_extremes(tr_sim *s);

/* Reset the extremes, the recorded reserves and the smallest independence for a new step. */
static void tr_clear_extremes(tr_sim *s);

/* Evaluate ẏ at (t, y) in the modes in force. Returns 0 if no multipliers are found; step.failure then contains the reason. */
static int tr_rhs(tr_sim *s, double t, const double *y, double *dy);

/* Interpolate η at the fraction theta of the last step, between the multipliers at both ends. Newton's method must start from this
 * η, because another start might lead to another root. */
static void tr_interpolate_multipliers(tr_sim *s, double theta);

/* Store the solution in `kept` (tr_solution_size doubles), before evaluations that are not part of the motion. */
static void tr_save_solution(const tr_sim *s, double *kept);

/* Restore the solution that tr_save_solution stored. */
static void tr_restore_solution(tr_sim *s, const double *kept);

/* Store the present multipliers as those at the end of the last step. */
static inline void tr_store_end_multipliers(tr_sim *s) { tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zend)); }

/* A request to the lane of this case: kind TR_ASK_…, at (t, y). */
static tr_request tr_lane_request(tr_sim *s, int kind, double t, double *y);

/* Whether the case must wait for lanes; the caller then returns TR_WAITS. On the next call, the result is 0. tr_wait_for_step: the
 * lanes compute a trial step of size h (all stages, the end and the errors). tr_wait_for_dense: the lanes compute the extra stages
 * of the last step's dense output. tr_wait_for_end: the lanes project ynew at time t, and compute ẏ of the result (`slope`). */
static int tr_wait_for_step(tr_sim *s, double h);
static int tr_wait_for_dense(tr_sim *s);
static int tr_wait_for_end(tr_sim *s, double t, double *slope);

/* Take the results of a served request of this kind, and count `evaluations` for it. Returns 0 if no request was served, or if
 * lanes could not serve it. */
static int tr_take_from_lane(tr_sim *s, int kind, int evaluations);

/* Stop the pairs `rest` (n) in y by impulses of their own friction, then set their rates to exactly zero. own: 1 after loop
 * closure; only rates that depend on no other rates then become zero. Requires maps of y. */
static void tr_bring_to_rest(tr_sim *s, double *y, const int *rest, int n, int own);

/* Scale the quaternions of y to norm 1. */
static void tr_normalise_quaternions(const tr_sim *s, double *y);

/* Largest residuals of the active rows in h. Units for translation: length scale, and length · rate for velocities. Units for
 * rotation: 1 rad, and rate. */
static void tr_loop_residual(const tr_sim *s, const double *h, double *position, double *velocity);

/* Project y at time t onto closed loops and unit quaternions, with held pairs at rest. Returns 0 if the loops stay open;
 * step.failure then contains the reason. */
static int tr_project(tr_sim *s, double t, double *y);

/* Close the loops from the state `y` at the time of the clock. qgiven, vgiven (nv each): 0 for an open value, 1 for a given value,
 * 2 for an exact one, which may not change. `y` receives the result, or the nearest state found. Returns 1 on success, 0 if no
 * closed positions are found, −1 if no consistent rates are found. */
static int tr_assemble_state(tr_sim *s, const double *qgiven, const double *vgiven);

/* Whether all freedoms together change the active rows at y only by round-off. Every motion of the tree then satisfies the rows
 * (example: a door on two hinges). */
static int tr_has_idle_rows(tr_sim *s, double *y);
#endif
