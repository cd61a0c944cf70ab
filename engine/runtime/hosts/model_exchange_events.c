/* Event handling of model exchange, at the time and state of the importer. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

/* relative to the speed of the last failed attempt to bring the pair to rest: the next attempt is made below this speed */
#define ENDS_AGAIN 0.5
#define TURNS_ROUND -0.9   /* cosine: if the velocity turned by more, the pair has stopped in between */
#define LAST_MOST 60       /* largest number of evaluations to find the direction in which a pair comes to rest */
/* fraction of the predicted turn that is applied first; after an oscillation, the fraction is also multiplied by this number */
#define LAST_PART 0.5
#define LAST_GROWS 1.1     /* factor on the applied fraction after a step without oscillation */
#define LAST_FOUND 1e-6    /* tangent of the angle between direction and acceleration at which the search has converged */
#define ROUNDS 4           /* largest number of times that the mode of a pair or stop may end at one instant */
/* distance s²/|ω|²: a ball closer to its cone counts as a ball at its cone, because importers may stop just before an event */
#define DUE_CONE 1e-9
#define NEAR_CONE 1e-3     /* distance s²/|ω|²: a ball closer to its cone is evaluated a second time, slightly later */
#define LOOKED 1e-9        /* in units of 1 / rate scale: time after which a ball near its cone is evaluated again */

/* Index of a pair or stop whose mode ends; −1: none. Sliding pairs come first, because their events change the loads of other
 * pairs. */
static int tr_find_mode_end(const tr_sim *s) {
  const double *z = TR_A(s, indicators), *handled = tr_handled_counts(s);
  int found = -1;
  for (int i = 0; i < tr_watched_count(s); ++i) {
    const int pair = i < s->k->nsliders;
    const double least = pair ? fmin(z[2 * i], z[2 * i + 1]) : z[s->k->nsliders + i];
    if ((least > 0.0 && !(pair && tr_distance_to_cone(s, i) <= DUE_CONE)) || handled[i] >= ROUNDS) continue;
    if (found < 0 || (pair && !tr_is_stuck(s, i) && found < s->k->nsliders && tr_is_stuck(s, found))) found = i;
  }
  return found;
}

/* Index of a ball whose friction jumps across its cone slightly later; −1: none. No indicator has a root at this jump, so importers
 * stop slightly before the jump. Restores the indicators. */
static int tr_find_cone_jump_ahead(tr_sim *s) {
  const double ahead = LOOKED / s->set.rate, t = s->clock.t;
  const int n = tr_state_width(s), numbers = 2 * s->k->nsliders + s->k->nstops + 1;
  double *y = TR_A(s, y), here[n], told[numbers];
  int balls = 0;
  for (int i = 0; i < s->k->nsliders; ++i) balls += tr_distance_to_cone(s, i) < NEAR_CONE;
  if (!balls) return -1;
  tr_copy(n, y, here), tr_copy(numbers, TR_A(s, indicators), told);
  for (int i = 0; i < s->ny; ++i) y[i] += ahead * TR_A(s, dy)[i];
  s->clock.t += ahead;
  if (tr_rhs_in_modes(s)) tr_evaluate_indicators(s);
  const int due = tr_find_mode_end(s), at_cone = due >= 0 && due < s->k->nsliders && tr_distance_to_cone(s, due) <= DUE_CONE;
  s->clock.t = t;
  tr_copy(n, here, y), tr_copy(numbers, told, TR_A(s, indicators));
  return tr_rhs_in_modes(s) && at_cone ? due : -1;
}

/* Whether pair i, with several components, stops at the block's state. The pair is slow, or slides against its direction. */
static int tr_is_pair_stopping(tr_sim *s, int i) {
  const double speed = tr_pair_speed(s, i), unit = tr_pair_speed_unit(s, i);
  const int back = tr_speed_in_mode(s, i) < 0.0;
  if (back && tr_speed_along(s, i) > TURNS_ROUND * speed && speed > 2.0 * tr_last_speed(unit)) return 0;
  if (!back && !(tr_time_to_rest_by_braking(s, i) < INFINITY)) return 0;
  tr_copy(tr_state_width(s), TR_A(s, y), TR_A(s, yold));
  const int stops = tr_has_answer_at_rest(s, s->clock.t, TR_A(s, yold), i);
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  return tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) && stops;
}

/* Decide the modes of pair i and of all pairs at rest at the block's (t, y). Restores modes and state on failure. Returns a
 * status. */
static int tr_decide_exchange_event(tr_sim *s, int i) {
  const int events = s->events.count;
  double *y = TR_A(s, y);
  tr_copy(tr_state_width(s), y, TR_A(s, ynew));
  tr_save_modes(s, (tr_mode *)TR_A(s, saved_modes));
  const int code = tr_handle_event(s, s->clock.t, y, i, 0);
  if (code == TR_OK) {
    s->stats.events += s->events.count > events;
    return code;
  }
  tr_restore_modes(s, (const tr_mode *)TR_A(s, saved_modes));
  tr_copy(tr_state_width(s), TR_A(s, ynew), y);
  s->friction.failed = i;
  return code;
}

/* Renew the sliding direction of pair i, a pair with several components. The new direction is that of the pair's motion. If the
 * pair moves along a line, the direction is that of the line. */
static void tr_renew_direction(tr_sim *s, int i) {
  const double *rates = tr_pair_rates(s, i);
  const int line = tr_frozen_length(s, i) > TR_LINE;
  if (line ? !tr_is_on_line(s, i, rates, LINE_LEFT) : !tr_is_on_line(s, i, rates, LINE_WIDTH)) tr_freeze_direction(s, i);
  else if (!line) tr_freeze_line_direction(s, i, rates, tr_pair_speed(s, i));
  TR_A(s, end_speed)[i] = tr_last_speed(tr_pair_speed_unit(s, i));
}

/* Surface acceleration of pair i when it slides along the surface direction d. Returns 0 on failure. */
static int tr_evaluate_acceleration_along(tr_sim *s, int i, const double *d, double *acc) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *lever = TR_A(s, lever) + pair->eta0;
  for (int j = 0; j < pair->nrates; ++j) tr_mode_of(s, i)->direction[j] = ON_LINE * d[j] / lever[j];
  if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return 0;
  for (int j = 0; j < pair->nrates; ++j) acc[j] = tr_acceleration_by_maps(s, pair->eta0 + j) * lever[j];
  return 1;
}

/* Find the direction in which pair i, with several components, comes to rest at the block's state. The pair gets this direction. As
 * the pair slows down, its motion turns towards this direction. The last velocities do not show this direction, because they
 * contain the errors of the importer's solver. */
static void tr_find_last_direction(tr_sim *s, int i) {
  const int n = tr_pair_of(s, i)->nrates;
  const double *lever = TR_A(s, lever) + tr_pair_of(s, i)->eta0;
  const tr_mode was = *tr_mode_of(s, i);
  double d[3] = {0.0, 0.0, 0.0}, last[3] = {0.0, 0.0, 0.0}, acc[3], across = 1.0, along = -1.0, part = LAST_PART;
  for (int j = 0; j < n; ++j) d[j] = was.direction[j] * lever[j] / tr_frozen_length(s, i);
  for (int it = 0; it < LAST_MOST && across > LAST_FOUND && along < 0.0; ++it) {
    if (!(tr_make_unit(n, d) > 0.0) || !tr_evaluate_acceleration_along(s, i, d, acc)) break;
    double back = across = along = 0.0;
    for (int j = 0; j < n; ++j) along += acc[j] * d[j];
    for (int j = 0; j < n; ++j) acc[j] = (acc[j] - along * d[j]) / fabs(along), across += acc[j] * acc[j], back += acc[j] * last[j];
    across = sqrt(across);
    part *= back < 0.0 ? LAST_PART : LAST_GROWS;
    for (int j = 0; j < n; ++j) last[j] = acc[j], d[j] += part * acc[j] / fmax(1.0, across);
  }
  if (across <= LAST_FOUND && along < 0.0) return;
  *tr_mode_of(s, i) = was;
  tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy));
}

/* Set the speed of a spinning ball to zero before its mode is decided. The decision then does not depend on the ball's branch. */
static void tr_stop_spinning_ball(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  if (tr_mode_flag(tr_mode_of(s, i)) != TR_CONE || pair->v0 < 0) return;
  for (int j = 0; j < pair->nrates; ++j) TR_A(s, y)[s->k->nq + pair->v0 + j] = 0.0;
  tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy));
}

/* End the mode of the set-valued pair i at the block's state, which was evaluated last. Returns a status. */
static int tr_end_set_valued_mode(tr_sim *s, int i) {
  const double *z = TR_A(s, indicators) + 2 * i;
  const int several = tr_pair_of(s, i)->nrates > 1 && !tr_is_stuck(s, i);
  double *y = TR_A(s, y);
  if (z[0] > 0.0 && (!several || tr_direction_indicator(s, i) > 0.0)) {
    s->stats.events++;
    return tr_handle_cone_event(s, s->clock.t, y, i);
  }
  if (z[0] > 0.0) {
    tr_renew_direction(s, i);
  } else if (several && !tr_is_pair_stopping(s, i)) {
    TR_A(s, end_speed)[i] = ENDS_AGAIN * tr_pair_speed(s, i);
    tr_freeze_direction(s, i);
  } else {
    if (several) tr_find_last_direction(s, i), tr_stop_spinning_ball(s, i);
    return tr_decide_exchange_event(s, i);
  }
  return tr_rhs(s, s->clock.t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* End the mode of pair or stop i at the block's state, which was evaluated last. Returns a status. */
static int tr_end_mode(tr_sim *s, int i) {
  const int pairs = s->k->nsliders;
  tr_handled_counts(s)[i] += 1.0;
  if (i < pairs && tr_is_set_valued(s, i)) return tr_end_set_valued_mode(s, i);
  if (i < pairs && TR_A(s, indicators)[2 * i] > 0.0) {
    tr_zone_of(s, i)->reversal = s->clock.t;
    return TR_OK;
  }
  tr_switch_mode(s, i, s->clock.t, TR_A(s, y));
  return tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
}

/* Continue with another root at the block's (t, y), where the present root has ended at a fold. Returns 1 on success. */
static int tr_pass_exchange_fold(tr_sim *s) {
  const tr_kernel *k = s->k;
  double jump;
  tr_mode *modes = (tr_mode *)TR_A(s, saved_modes);
  if (!k->neta) return 0;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  tr_save_modes(s, modes);
  if (!tr_find_root_on_branches(s) || !tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy)) || !tr_is_on_branches(s)) {
    tr_restore_modes(s, modes);
    return 0;
  }
  const int pair = tr_find_most_changed(s, TR_A(s, zend) + k->active, TR_A(s, z) + k->active, &jump);
  if (jump > FOLD_JUMP) tr_log_event(s, s->clock.t, TR_EV_FOLD, pair, 0, 0, 0), s->stats.events++;
  return 1;
}

/* Call tr_let_ball_spin and log a fold for the ball whose mode changed. */
static int tr_let_exchange_ball_spin(tr_sim *s) {
  const int events = s->events.count;
  tr_mode *modes = (tr_mode *)TR_A(s, saved_modes);
  tr_save_modes(s, modes);
  if (!tr_let_ball_spin(s)) return 0;
  for (int i = 0; i < s->k->nsliders && s->events.count == events; ++i)
    if (tr_mode_flag(modes + i) != tr_mode_flag(tr_mode_of(s, i))) tr_log_event(s, s->clock.t, TR_EV_FOLD, i, 0, 0, 0);
  return 1;
}

/* Whether the run can continue after a failure at the block's (t, y). tried: number of earlier attempts at this event. */
static int tr_continue_exchange(tr_sim *s, int code, int tried) {
  s->step.have_k1 = 0;
  if (code == TR_FAIL_MULTIPLIERS && tried < s->k->nsliders && (tr_let_exchange_ball_spin(s) || tr_stop_slow_pair(s) || tr_pass_exchange_fold(s))) return 1;
  s->step.have_k1 = 0;
  return tr_continue_after_failure(s, code);
}

int tr_update(tr_sim *s, int jumped, int *changed) {
  const double slack = BREAK_REACHED * fmax(1.0, fabs(s->clock.t));
  double *y = TR_A(s, y);
  jumped |= tr_pass_breaks(s, s->clock.t + slack);
  memset(tr_handled_counts(s), 0, sizeof(double) * tr_watched_count(s));
  s->step.have_k1 = s->step.have_jac = 0, s->clock.status = TR_OK;
  tr_copy(tr_state_width(s), y, TR_A(s, kstep));
  tr_set_moment_between_breaks(s);
  if (!tr_project(s, s->clock.t, y)) return tr_end_run(s, TR_FAIL_CLOSURE);
  int looked = 0, tried = 0, code = tr_rhs_in_modes(s) ? TR_OK : TR_FAIL_MULTIPLIERS;
  if (code == TR_OK && jumped && (s->friction.held || tr_has_stopped_with_drive(s))) code = tr_decide_exchange_event(s, -1);
  for (;;) {
    if (code == TR_OK) {
      tr_evaluate_indicators(s);
      int i = tr_find_mode_end(s);
      if (i < 0 && !looked) i = tr_find_cone_jump_ahead(s), looked = 1;
      if (i < 0) break;
      code = tr_end_mode(s, i);
      if (code == TR_OK) tr_save_followed(s);
    }
    if (code == TR_OK) continue;
    if (!tr_continue_exchange(s, code, tried++)) return tr_end_run(s, code);
    code = tr_rhs(s, s->clock.t, y, TR_A(s, dy)) ? TR_OK : TR_FAIL_MULTIPLIERS;
    if (code == TR_OK) tr_save_followed(s);
  }
  tr_clear_margin(s);
  tr_complete_followed(s);
  *changed = memcmp(TR_A(s, kstep), y, sizeof(double) * tr_states(s)) != 0;
  return TR_OK;
}
