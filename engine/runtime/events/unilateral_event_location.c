/* Location of the events of joints that only push: the normal force passes through zero, or the gap closes. */
#include "events/events.h"

#define SHORTLY_WITHIN 1e-3 /* relative to the step: time difference for the derivative of a normal force */
/* largest number of Newton steps on the time of a landing; the steps converge from the side of negative gaps */
#define LANDING_STEPS 12
#define LANDING_SAME 1e-15  /* relative to max(time, 1 s): a smaller Newton step is round-off */

/* State at the fraction theta of the last step. pull receives, for a closed contact, its pull; for an unloaded contact, the load
 * that it would have. Returns 0 if there is no solution. */
static int tr_pulls_inside(tr_sim *s, double theta, double *pull) {
  tr_dense_state(s, theta, TR_A(s, yout));
  if (s->k->nquat) tr_normalise_quaternions(s, TR_A(s, yout));
  if (!tr_rhs(s, s->step.t0 + theta * s->step.size, TR_A(s, yout), TR_A(s, dy))) return 0;
  for (int c = 0; c < s->k->nunilateral; ++c) pull[c] = tr_is_contact_unloaded(s, c) ? tr_load_of_open_contact(s, c) : -tr_normal_force(s, c);
  return 1;
}

static int tr_mark_pulls_inside(tr_sim *s, char *inside) {
  const int n = s->k->nunilateral, watch = s->step.watch;
  double pull[4][n + 1], kept[tr_solution_size(s)];
  int any = 0, closed = 0;
  for (int c = 0; c < n; ++c) closed |= !tr_is_contact_open(s, c) || tr_is_contact_unloaded(s, c);
  if (!closed || !tr_ensure_dense(s)) return 0;
  tr_save_solution(s, kept);
  s->step.watch = 0;
  const double at[4] = {0.0, SHORTLY_WITHIN, 1.0 - SHORTLY_WITHIN, 1.0};
  int known = 1;
  for (int q = 0; q < 4 && known; ++q) known = tr_pulls_inside(s, at[q], pull[q]);
  for (int c = 0; c < n && known; ++c) {
    const double g0 = pull[0][c], m0 = (pull[1][c] - g0) / SHORTLY_WITHIN, g1 = pull[3][c], m1 = (g1 - pull[2][c]) / SHORTLY_WITHIN;
    if (!tr_is_contact_open(s, c) || tr_is_contact_unloaded(s, c)) any |= inside[tr_unilateral_of(s, c)->stop] = tr_may_pass_zero(g0, m0, g1, m1);
  }
  s->step.watch = watch;
  tr_rhs(s, s->step.t0 + s->step.size, TR_A(s, ynew), TR_A(s, dy));
  tr_restore_solution(s, kept);
  return any;
}

static void tr_refine_landing(tr_sim *s, int c) {
  double theta = s->pending.theta, *y = TR_A(s, event_y), gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  for (int it = 0; it < LANDING_STEPS; ++it) {
    tr_dense_state(s, theta, y);
    if (!tr_project(s, s->step.t0 + theta * s->step.size, y)) return;
    tr_evaluate_gaps(s, y, gap, rate);
    if (!(rate[c] < 0.0)) return;
    const double dt = -gap[c] / rate[c];
    theta += dt / s->step.size;
    if (!(theta > 0.0 && theta <= 1.0)) return;
    s->pending.theta = theta, s->pending.t = s->step.t0 + theta * s->step.size;
    if (fabs(dt) <= LANDING_SAME * fmax(1.0, s->pending.t)) return;
  }
}
