/* Moreau's time stepping: friction and loops as impulses over a fixed step, at the level of velocities. No event is located, so that
 * any number of them may fall into a step; first order. For scenes whose events accumulate, and for hosts that want a fixed cost.
 *
 * With the maps at the middle position, v⁺ = v + h (a + A η): a pair sticks when its rate vanishes at the end of the step, and slips
 * along its rate there. That is what ``decide.c`` decides at rest, with the accelerations of the freedoms replaced by v⁺/h
 * (``tr_held_maps``). */
#include "modes.h"

#define MOREAU_STEP 0.03   /* of √rtol / rate, where no step is given */
#define MOREAU_EVENTS 40   /* events in as many steps of that size: they accumulate */
#define SLIVER 1e-9        /* of a step: what is left of the way at the end is taken with it */
#define MOREAU_STAY 400    /* steps before locating events is tried again */

static double tr_moreau_step(const tr_sim *s) { return s->set.hfixed > 0.0 ? s->set.hfixed : MOREAU_STEP * sqrt(s->set.rtol) / s->set.rate; }

/* y moved along its own rates v for a time h. */
static void tr_drift(const tr_sim *s, double *y, const double *v, double h) {
  const tr_kernel *k = s->k;
  double dq[k->nq + 4];
  k->qdot(y, v, dq);
  for (int i = 0; i < k->nq; ++i) y[i] += h * dq[i];
  if (k->nquat) tr_normalize(s, y);
}

/* Modes and friction of the step from the state `mid` (middle position, old rates), whose maps are put in place. */
static int tr_moreau_solve(tr_sim *s, double t, double *mid, double h) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], n = 0;
  tr_set_time(s, t);
  k->stage1(TR_A(s, x), mid, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  if (k->active + k->neta == 0) return 1;
  for (int i = 0; i < k->nsliders; ++i)
    if (tr_is_set(s, i)) rest[n++] = i;
  s->moreau.h = h;
  int ok = n ? tr_settle_from(s, rest, n) || tr_decide(s, rest, n, -1) : tr_multipliers(s);
  s->moreau.h = 0.0;
  if (ok) k->stage2(TR_A(s, x), mid, TR_A(s, c), TR_A(s, w), TR_A(s, z), TR_A(s, dy));
  return ok;
}

/* One step to at most `limit`; waits as pending. */
static int tr_attempt_moreau(tr_sim *s, double limit) {
  const tr_kernel *k = s->k;
  int n = tr_width(s), kinds[k->nsliders + 1];
  double left = limit - s->clock.t, h = fmin(tr_moreau_step(s), left), *y = TR_A(s, y), *mid = TR_A(s, ytmp), *ynew = TR_A(s, ynew);
  double *R = TR_A(s, kstep);
  tr_mode modes[k->nsliders + 1];
  if (left - h < SLIVER * h) h = left;
  tr_moment_of(s)->inside = s->clock.t + 0.5 * h, s->step.watch = 0;
  tr_keep_modes(s, modes);
  tr_turn_directions(s);
  memcpy(mid, y, sizeof(double) * n);
  tr_drift(s, mid, y + k->nq, 0.5 * h);
  if (!tr_moreau_solve(s, s->clock.t + 0.5 * h, mid, h)) return TR_FAIL_MODES;
  const double *f = TR_A(s, dy);
  memcpy(ynew, mid, sizeof(double) * n);
  for (int i = k->nq; i < s->ny + k->nquad + k->naudit; ++i) ynew[i] = y[i] + h * f[i];
  tr_keep_still(s, ynew);
  tr_drift(s, ynew, ynew + k->nq, 0.5 * h);
  if (!tr_finite(s->ny + k->nquad, ynew)) return TR_FAIL_NOT_FINITE;
  if (!tr_project(s, s->clock.t + h, ynew)) return s->step.trouble;
  int changed = 0;
  for (int i = 0; i < k->nsliders; ++i) {
    kinds[i] = tr_is_set(s, i) ? tr_change(s, i, modes + i) : 0;
    changed += kinds[i] != 0;
    if (kinds[i]) tr_log(s, s->clock.t + h, kinds[i], i, 0, 0, 0), s->stats.events++;
  }
  s->moreau.calm = changed ? 0 : s->moreau.calm + 1;
  memcpy(TR_A(s, yold), y, sizeof(double) * n);
  for (int q = 0; q < n; ++q) R[q] = ynew[q] - y[q];
  memcpy(TR_A(s, zstart), TR_A(s, z), sizeof(double) * (k->active + k->neta)), tr_note_end(s);
  s->step.t0 = s->clock.t, s->step.size = h, s->step.dense_rows = 1, s->step.have_dense = 1;
  s->pending.t = h == left ? limit : s->clock.t + h, s->pending.theta = 1.0, s->pending.h = h, s->pending.grow = 1.0, s->pending.kind = TR_IMPULSE_STEP;
  s->stats.steps++, s->stats.of_method[s->step.method]++;
  return TR_OK;
}

/* Hand over to time stepping when events accumulate, and back when nothing has changed for a while. Only with method auto. */
static void tr_hand_over(tr_sim *s) {
  if (!tr_chooses(s) || !s->k->sets) return;
  for (int i = 0; i < s->k->nsliders; ++i) /* laws that are stiff near rest are not for impulses */
    if (!tr_is_set(s, i) && tr_pair_of(s, i)->kind != TR_KIND_SMOOTH) return;
  if (tr_method_of(s)->kind == TR_IMPULSES) {
    if (++s->moreau.steps >= MOREAU_STAY && s->moreau.calm >= MOREAU_STAY / 4) s->step.method = TR_AUTO_TIGHT, s->step.have_k1 = s->step.have_jac = 0;
    return;
  }
  if (s->stats.events - s->moreau.burst_events < MOREAU_EVENTS) return;
  if (s->clock.t - s->moreau.burst_t < MOREAU_EVENTS * tr_moreau_step(s)) {
    s->step.method = TR_AUTO_ACCUMULATING, s->moreau.steps = s->moreau.calm = s->step.aside = 0;
    if (s->moreau.first_t < 0.0) s->moreau.first_t = s->clock.t;
  }
  s->moreau.burst_events = s->stats.events, s->moreau.burst_t = s->clock.t;
}
