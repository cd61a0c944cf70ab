/* One step of Moreau's time stepping: friction and loop reactions act as impulses on velocities. The step has order one and does
 * not locate friction events. A fixed step may contain any number of events, at constant cost.
 * ``time_stepping/moreau_error_control.c`` adds error control.
 *
 * The maps at the middle position give the accelerations a + A η as a function of the friction η. The rates at the end of the step
 * are then v⁺ = v + h (a + A η). A pair sticks if its rate vanishes at the end; otherwise it slips along its rate. The search of
 * ``modes/active_set.c`` decides which pairs stick, with v⁺/h in place of the accelerations (tr_form_held_maps). */
#include "time_stepping/time_stepping.h"

#define MOREAU_STEP 0.03   /* in units of √rtol / rate scale: size of the first impulse step; also the time unit of MOREAU_EVENTS */
#define IMPACT_REST 1e-9   /* in units of the speed unit: a slower pair is at rest in an impact; rates along its path have an error */
#define FROZEN_TURN 0.5    /* rad: a direction that turns by more in a step is not frozen, but found for the step's end */

static double tr_moreau_step_size(const tr_sim *s) { return s->set.hfixed > 0.0 ? s->set.hfixed : MOREAU_STEP * sqrt(s->set.rtol) / s->set.rate; }

static void tr_advance_positions(const tr_sim *s, double *y, const double *v, double h) {
  const tr_kernel *k = s->k;
  double dq[k->nq + 4];
  k->qdot(y, v, TR_A(s, c), dq);
  for (int i = 0; i < k->nq; ++i) y[i] += h * dq[i];
  if (k->nquat) tr_normalise_quaternions(s, y);
}

/* Whether the direction of pair i may be frozen over a step: the pair has several components and slides fast. Balls are
 * excluded, because they may start to spin. Requires maps of the current state. */
static int tr_is_sliding_fast(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  return s->moreau.frozen && pair->nrates > 1 && !pair->cone && !tr_is_stuck(s, i) && tr_pair_speed(s, i) > tr_onset_speed(s);
}

static double tr_rest_speed_in_impact(const tr_sim *s) { return IMPACT_REST * tr_speed_unit(s); }

static int tr_slides_on(const tr_sim *s, int i, int slides) {
  const int several = tr_pair_of(s, i)->nrates > 1;
  return tr_is_set_valued(s, i) && slides && (!several || (slides == TR_SLIDES_ALL && !tr_pair_of(s, i)->cone));
}

/* Rates of pair i that determine its sliding direction in an impulse step. */
static const double *tr_rates_of_direction(const tr_sim *s, int i) {
  return s->impact.from && tr_pair_of(s, i)->nrates == 1 ? s->impact.from + tr_pair_of(s, i)->rate0 : tr_pair_rates(s, i);
}

static int tr_slides_in_impact(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  return tr_slides_on(s, i, s->impact.slides) && tr_surface_speed(pair->nrates, tr_rates_of_direction(s, i), TR_A(s, lever) + pair->eta0) > tr_rest_speed_in_impact(s);
}

/* Whether pair i keeps its sliding direction in an impulse step. Requires maps of the current state. */
static int tr_keeps_direction(const tr_sim *s, int i) {
  if (!s->impact.solving || !s->impact.slides) return tr_is_sliding_fast(s, i);
  return !tr_is_stuck(s, i) && tr_slides_in_impact(s, i);
}

/* After a failed decision, search from modes that follow from the rates alone: moving pairs slip along their rate, other pairs
 * stick. Requires maps of the current state. Returns 1 on success. */
static int tr_decide_by_rates(tr_sim *s, const int *rest, int n) {
  if (s->moreau.decides == INFINITY) return 0;
  for (int q = 0; q < n; ++q) {
    tr_mode *m = tr_mode_of(s, rest[q]);
    m->flag = tr_pair_speed(s, rest[q]) > tr_rest_speed(tr_speed_unit(s)) ? TR_SLIPS : TR_STUCK;
    if (tr_mode_flag(m) == TR_SLIPS) tr_freeze_direction(s, rest[q]);
  }
  memset(TR_A(s, z) + s->k->active, 0, sizeof(double) * s->k->neta);
  return tr_resolve_misfits(s, rest, n);
}

/* Decide the modes of the n pairs `rest` for a step h. These pairs have no frozen direction. The full search runs only in short
 * steps, or if all pairs were stuck before. (If all pairs hold, they hold for any h.) Returns 1 on success. */
static int tr_moreau_decide(tr_sim *s, const int *rest, int n, double h) {
  int held = 1;
  for (int q = 0; q < n; ++q) held &= tr_is_stuck(s, rest[q]);
  if (tr_are_many_pairs(s, rest, n)) return tr_decide_by_cones(s, rest, n) || tr_decide_by_prediction(s, rest, n);
  return tr_resolve_misfits(s, rest, n) || tr_decide_by_rates(s, rest, n) || ((held || h <= s->moreau.decides) && tr_decide_modes(s, rest, n, -1));
}

/* Evaluate the maps of the state `mid`, the middle of the step h from (t, y). Pairs get the rates that they have at (t, y). (At the
 * middle position, rates of cut and driven joints follow from drives and positions of a later time than the rates of the state.) */
static void tr_evaluate_impulse_maps(tr_sim *s, double t, const double *y, double h, const double *mid) {
  const tr_kernel *k = s->k;
  double *rates = (double *)map_rates(k, TR_A(s, maps)), start[k->nrates + 1];
  int depends = 0;
  for (int i = 0; i < k->nsliders; ++i) depends |= tr_pair_of(s, i)->v0 < 0;
  if (depends) tr_evaluate_maps_at(s, t, y), memcpy(start, rates, sizeof(double) * k->nrates);
  tr_evaluate_maps_at(s, t + 0.5 * h, mid);
  if (depends) tr_form_maps(s), memcpy(rates, start, sizeof(double) * k->nrates);
}

static int tr_moreau_solve(tr_sim *s, double t, const double *y, double *mid, double h) {
  const tr_kernel *k = s->k;
  int rest[k->nsliders + 1], n = 0;
  tr_evaluate_impulse_maps(s, t, y, h, mid);
  if (k->active + k->neta == 0) return 1;
  for (int i = 0; i < k->nsliders; ++i) {
    if (!tr_is_set_valued(s, i)) continue;
    if (tr_keeps_direction(s, i)) tr_set_sliding_direction(s, i, tr_rates_of_direction(s, i));
    else rest[n++] = i, tr_mode_of(s, i)->tilt = 0.0; /* no pair yields in an impulse step */
  }
  s->moreau.h = h;
  int ok = s->moreau.keeps ? tr_solve_in_modes(s) : n ? tr_moreau_decide(s, rest, n, h) : k->sets ? tr_solve_in_modes(s) : tr_solve_multipliers(s, 1);
  s->moreau.h = 0.0;
  /* detects dead centres; decisions have checked the friction of pairs */
  if (ok && !k->neta) ok = !(tr_check_solution(s, mid, 0, 0) & TR_BREAKS_LOOP);
  if (ok) tr_evaluate_stage2(s, mid, TR_A(s, z), TR_A(s, dy));
  return ok;
}

/* Whether a direction frozen over the step to (t, y) turned by more than FROZEN_TURN. */
static int tr_has_direction_turned(tr_sim *s, double t, const double *y) {
  const tr_kernel *k = s->k;
  int turned = 0;
  for (int i = 0; i < k->nsliders && s->moreau.frozen && !turned; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_set_valued(s, i) || pair->nrates == 1 || pair->cone || tr_is_stuck(s, i) || tr_is_starting_to_slide(s, i)) continue;
    tr_evaluate_maps_at(s, t, y);
    const double *r = tr_pair_rates(s, i), *d = tr_mode_of(s, i)->direction, *lever = TR_A(s, lever) + pair->eta0;
    double along = 0.0, size = 0.0;
    for (int j = 0; j < pair->nrates; ++j) along += r[j] * d[j] * lever[j] * lever[j], size += d[j] * d[j] * lever[j] * lever[j];
    turned = !(along > cos(FROZEN_TURN) * sqrt(size) * tr_pair_speed(s, i));
  }
  return turned;
}

static void tr_moreau_update_stops(tr_sim *s, double t, const double *y) {
  double depth[s->k->nstops + 1];
  tr_set_time(s, t); /* signals of hooks, and drives of joints in loops, depend on time */
  for (int i = 0; i < s->k->nstops; ++i) {
    tr_stop_depths(s, y, depth); /* a hook that lifts changes the depth of the stop behind it */
    if (tr_is_pressed(s, i) == (depth[i] > 0.0)) continue;
    s->stats.events++;
    tr_switch_stop(s, i, t, y);
  }
}

static void tr_moreau_update_rest(tr_sim *s, double t, const double *y, const tr_mode *then) {
  const int pairs = s->k->nsliders, n = tr_state_width(s);
  double slope[n];
  int held = 0, stopped = 0;
  for (int i = 0; i < pairs; ++i) held |= tr_is_stuck(s, i), stopped |= tr_is_stuck(s, i) && tr_mode_flag(then + i) != TR_STUCK;
  if (!held || (!stopped && !s->k->active)) return;
  memcpy(slope, TR_A(s, dy), sizeof slope);
  tr_evaluate_maps_at(s, t, y);
  for (int i = 0; i < pairs && s->k->active; ++i)
    if (tr_is_set_valued(s, i) && !tr_is_stuck(s, i) && tr_is_at_rest(s, i)) tr_mode_of(s, i)->flag = TR_STUCK, stopped = 1;
  if (stopped && tr_rhs(s, t, y, TR_A(s, dy))) {
    tr_evaluate_capacities(s);
    tr_find_coupled_pairs(s);
    for (int i = 0; i < pairs; ++i)
      if (tr_is_stuck(s, i) && tr_mode_flag(then + i) != TR_STUCK && tr_mode_misfit(s, i) > TOL_RELEASE) tr_let_slip(s, i);
  }
  memcpy(TR_A(s, dy), slope, sizeof slope);
}

/* Whether drives determine all rates through redundant loops. Positions and rates must then satisfy the loops exactly; otherwise,
 * redundant rows contradict each other. */
static inline int tr_is_driven_alone(const tr_sim *s) { return s->loops.rank < s->k->active && s->loops.rank == s->k->nv; }

/* Remove from the rates of y the speed of a pair across its direction, if it is below the rest speed. This speed is round-off of
 * the rates before a reversal, and would grow if the direction repels. */
static void tr_remove_speed_across(const tr_sim *s, double *y) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (pair->nrates == 1 || pair->v0 < 0 || !(tr_frozen_length(s, i) > TR_LINE)) continue;
    const double *lever = TR_A(s, lever) + pair->eta0;
    double d[3], along = 0.0, across = 0.0, *rate = y + s->k->nq + pair->v0;
    for (int j = 0; j < pair->nrates; ++j) d[j] = tr_mode_of(s, i)->direction[j] / ON_LINE * lever[j];
    tr_make_unit(pair->nrates, d);
    for (int j = 0; j < pair->nrates; ++j) along += rate[j] * lever[j] * d[j];
    for (int j = 0; j < pair->nrates; ++j) across += pow(rate[j] * lever[j] - along * d[j], 2.0);
    for (int j = 0; j < pair->nrates && sqrt(across) <= tr_rest_speed(tr_speed_unit(s)); ++j) rate[j] = along * d[j] / lever[j];
  }
}

static int tr_moreau_substep(tr_sim *s, double t, const double *y, double h, double *ynew) {
  const tr_kernel *k = s->k;
  double *mid = TR_A(s, ytmp);
  const double *f = TR_A(s, dy);
  tr_mode then[k->nsliders + 1];
  tr_save_modes(s, then);
  memcpy(mid, y, sizeof(double) * tr_state_width(s));
  tr_advance_positions(s, mid, y + k->nq, 0.5 * h);
  tr_set_time(s, t + 0.5 * h);
  if (tr_is_driven_alone(s) && !tr_project(s, t + 0.5 * h, mid)) return s->step.failure;
  if (s->set.hfixed > 0.0) tr_moreau_update_stops(s, t + 0.5 * h, mid);
  if (!tr_moreau_solve(s, t, y, mid, h)) return TR_FAIL_MODES;
  memcpy(ynew, mid, sizeof(double) * tr_state_width(s)), tr_copy(k->npowers, TR_A(s, power), TR_A(s, part_power));
  for (int i = k->nq; i < s->ny + s->nworks + TR_AUDIT_SUMS; ++i) ynew[i] = y[i] + h * f[i];
  tr_zero_held_rates(s, ynew);
  tr_remove_speed_across(s, ynew);
  tr_advance_positions(s, ynew, ynew + k->nq, 0.5 * h);
  if (!tr_is_finite(s->ny, ynew)) return TR_FAIL_NOT_FINITE;
  if (!tr_project(s, t + h, ynew)) return s->step.failure;
  if (s->friction.held) tr_update_extremes(s);
  if (!(s->set.hfixed > 0.0) && !s->moreau.keeps) tr_moreau_update_rest(s, t + h, ynew, then);
  return tr_has_direction_turned(s, t + h, ynew) ? TR_MORE : TR_OK;
}
