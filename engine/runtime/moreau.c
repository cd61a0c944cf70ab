/* A step of Moreau's time stepping: friction and loops as impulses over it, at the level of velocities. No event of friction is located;
 * first order. With fixed steps any number of events may fall into one: for hosts that want a fixed cost. Under error control
 * (``impulses.c``) the error follows the tolerance.
 *
 * With the maps at the middle position, v⁺ = v + h (a + A η): a pair sticks when its rate vanishes at the end of the step, and slips
 * along its rate there. That is what ``decide.c`` decides at rest, with the accelerations of the freedoms replaced by v⁺/h
 * (``tr_held_maps``). */
#include "modes.h"

#define MOREAU_STEP 0.03   /* of √rtol / rate: the first step, and the unit of time in which events accumulate */
#define FROZEN_TURN 0.5    /* rad: a direction of sliding that turns by more in a step is found at the step's end instead */
#define SLIVER 1e-9        /* of a step: what is left of the way at the end is taken with it */

static double tr_moreau_step(const tr_sim *s) { return s->set.hfixed > 0.0 ? s->set.hfixed : MOREAU_STEP * sqrt(s->set.rtol) / s->set.rate; }

/* y moved along its own rates v for a time h. */
static void tr_drift(const tr_sim *s, double *y, const double *v, double h) {
  const tr_kernel *k = s->k;
  double dq[k->nq + 4];
  k->qdot(y, v, TR_A(s, c), dq);
  for (int i = 0; i < k->nq; ++i) y[i] += h * dq[i];
  if (k->nquat) tr_normalize(s, y);
}

/* Whether pair i, of several components, slides so fast that its direction may be frozen over a step: a ball may have to go over to
 * turning without sliding, and one that has just started finds its direction at the end of the step. Maps in place. */
static int tr_runs(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  return s->moreau.frozen && pair->nrates > 1 && !pair->cone && !tr_is_stuck(s, i) && tr_pair_speed(s, i) > tr_onset_speed(s);
}

/* Modes from the rates alone, those in force having led to none that fit: what moves slips the way it does, what does not sticks. Maps in
 * place. */
static int tr_settle_as_moving(tr_sim *s, const int *rest, int n) {
  if (s->moreau.decides == INFINITY) return 0;
  for (int q = 0; q < n; ++q) {
    tr_mode *m = tr_mode_of(s, rest[q]);
    m->flag = tr_pair_speed(s, rest[q]) > REST_SPEED * tr_speed_unit(s) ? TR_SLIPS : TR_STUCK;
    if (tr_flag(m) == TR_SLIPS) tr_freeze(s, rest[q]);
  }
  memset(TR_A(s, z) + s->k->active, 0, sizeof(double) * s->k->neta);
  return tr_settle_from(s, rest, n);
}

/* Modes and friction of a step over h of the pairs `rest` (n), whose directions are not frozen. */
static int tr_moreau_decides(tr_sim *s, const int *rest, int n, double h) {
  if (tr_are_many(s, rest, n)) return tr_settle_at_once(s, rest, n) || tr_settle_together(s, rest, n);
  return tr_settle_from(s, rest, n) || tr_settle_as_moving(s, rest, n) || (h <= s->moreau.decides && tr_decide(s, rest, n, -1));
}

/* Modes and friction of the step from the state `mid` (middle position, old rates), whose maps are put in place. */
static int tr_moreau_solve(tr_sim *s, double t, double *mid, double h) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], n = 0, runs = 0;
  tr_maps_at(s, t, mid);
  if (k->active + k->neta == 0) return 1;
  for (int i = 0; i < k->nsliders; ++i) {
    if (!tr_is_set(s, i)) continue;
    if (tr_runs(s, i)) tr_freeze(s, i), runs = 1;
    else rest[n++] = i;
  }
  s->moreau.h = h;
  int ok = s->moreau.keeps ? tr_solve_modes(s) : n ? tr_moreau_decides(s, rest, n, h) : runs ? tr_solve_modes(s) : tr_multipliers(s, 1);
  s->moreau.h = 0.0;
  if (ok) tr_stage2(s, mid, TR_A(s, z), TR_A(s, dy));
  return ok;
}

/* Whether a direction that was frozen over the step to (t, y) has turned by more than FROZEN_TURN. */
static int tr_has_turned(tr_sim *s, double t, const double *y) {
  const tr_kernel *k = s->k;
  int turned = 0;
  for (int i = 0; i < k->nsliders && s->moreau.frozen && !turned; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_set(s, i) || pair->nrates == 1 || pair->cone || tr_is_stuck(s, i) || tr_starts_sliding(s, i)) continue;
    tr_maps_at(s, t, y);
    const double *r = tr_slider_rates(s, i), *d = tr_mode_of(s, i)->direction, *arm = TR_A(s, arm) + pair->eta0;
    double along = 0.0, size = 0.0;
    for (int j = 0; j < pair->nrates; ++j) along += r[j] * d[j] * arm[j] * arm[j], size += d[j] * d[j] * arm[j] * arm[j];
    turned = !(along > cos(FROZEN_TURN) * sqrt(size) * tr_pair_speed(s, i));
  }
  return turned;
}

/* Which stops are engaged in a step: those that are at the state y, its middle or (under error control, where steps end where stops are
 * reached and left) its start. What changes is recorded at time t. */
static void tr_moreau_stops(tr_sim *s, double t, const double *y) {
  double depth[s->k->nstops + 1];
  tr_depths(s, y, depth);
  for (int i = 0; i < s->k->nstops; ++i) {
    if (tr_pressed(s, i) == (depth[i] > 0.0)) continue;
    *tr_stop_flag(s, i) = depth[i] > 0.0 ? tr_flag_pressed(s, i, depth) : TR_STOP_OPEN;
    tr_log(s, t, tr_stop_event(s, i, depth[i] > 0.0), i, 0, 0, 0);
    s->stats.events++;
  }
}

/* What has come to rest in a step of impulses to (t, y), from the modes `then`. One whose sliding turned round inside has no speed at its end
 * either, for it is held there by an impulse that no force at rest would give, or its motion is prescribed: it slides on, the way that rest
 * lets it go. One on a loop has come to rest with others that stick, though the impulses of these are all that it took. ẏ of the step is kept. */
static void tr_moreau_rests(tr_sim *s, double t, const double *y, const tr_mode *then) {
  const int pairs = s->k->nsliders, n = tr_width(s);
  double slope[n];
  int held = 0, stopped = 0;
  for (int i = 0; i < pairs; ++i) held |= tr_is_stuck(s, i), stopped |= tr_is_stuck(s, i) && tr_flag(then + i) != TR_STUCK;
  if (!held || (!stopped && !s->k->active)) return;
  memcpy(slope, TR_A(s, dy), sizeof slope);
  tr_maps_at(s, t, y);
  for (int i = 0; i < pairs && s->k->active; ++i)
    if (tr_is_set(s, i) && !tr_is_stuck(s, i) && tr_pair_speed(s, i) <= REST_SPEED * tr_speed_unit(s)) tr_mode_of(s, i)->flag = TR_STUCK, stopped = 1;
  if (stopped && tr_rhs(s, t, y, TR_A(s, dy))) {
    tr_holding(s);
    tr_bind(s);
    for (int i = 0; i < pairs; ++i)
      if (tr_is_stuck(s, i) && tr_flag(then + i) != TR_STUCK && tr_misfit(s, i) > TOL_RELEASE) tr_let_slip(s, i);
  }
  memcpy(TR_A(s, dy), slope, sizeof slope);
}

/* One step of impulses from (t, y) over h: ynew, and the modes at its end. TR_OK, TR_MORE where a direction that was frozen turns too far, or
 * why there is no step. */
static int tr_moreau_part(tr_sim *s, double t, const double *y, double h, double *ynew) {
  const tr_kernel *k = s->k;
  double *mid = TR_A(s, ytmp);
  const double *f = TR_A(s, dy);
  tr_mode then[k->nsliders + 1];
  tr_keep_modes(s, then);
  memcpy(mid, y, sizeof(double) * tr_width(s));
  tr_drift(s, mid, y + k->nq, 0.5 * h);
  tr_set_time(s, t + 0.5 * h);
  if (s->set.hfixed > 0.0) tr_moreau_stops(s, t + 0.5 * h, mid);
  if (!tr_moreau_solve(s, t + 0.5 * h, mid, h)) return TR_FAIL_MODES;
  memcpy(ynew, mid, sizeof(double) * tr_width(s)), tr_copy(k->npowers, TR_A(s, power), TR_A(s, parted));
  for (int i = k->nq; i < s->ny + s->nworks + s->naudit; ++i) ynew[i] = y[i] + h * f[i];
  tr_keep_still(s, ynew);
  tr_drift(s, ynew, ynew + k->nq, 0.5 * h);
  if (!tr_finite(s->ny, ynew)) return TR_FAIL_NOT_FINITE;
  if (!tr_project(s, t + h, ynew)) return s->step.trouble;
  if (s->friction.still) tr_watch(s);
  if (!(s->set.hfixed > 0.0) && !s->moreau.keeps) tr_moreau_rests(s, t + h, ynew, then);
  return tr_has_turned(s, t + h, ynew) ? TR_MORE : TR_OK;
}
