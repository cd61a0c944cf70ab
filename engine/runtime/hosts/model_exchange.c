/* Model exchange: an importer makes the steps. ẏ is evaluated in fixed modes, and event indicators show when a mode ends (theory,
 * "Model exchange").
 *
 * All results are functions of (t, y) and of stored data: modes, directions, and the multipliers from which a branch of friction is
 * followed. The stored data change at events, at completed steps, and when an importer requests indicators that are all positive.
 * Each pair has two indicators, which are positive while its mode lasts. One is for the end of the mode, the other for the branch
 * or direction within the mode. Each end stop has one indicator. The last indicator is negative if friction has no solution. Small
 * shifts keep indicators away from zero just after their event. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

#define SHIFT_SPEED 1e-10  /* relative to the pair's speed unit: negative speed that is allowed just after a pair has started */
#define SHIFT_RATIO TOL_RELEASE /* relative to the friction ratio: allowed excess just after a decision, for stuck pairs */
#define SHIFT_KINK TOL_KINK /* relative to the kink speed: allowed distance beyond a kink just after its event */
#define SHIFT_STOP 1e-11   /* relative to the length scale, or rad: allowed depth just after the event of a stop */
/* relative to the speed unit: at a higher speed, sliding has begun, and its direction is that of the motion */
#define BEGUN_SPEED 1e-6
/* in units of tolerance · length, or rad: if residuals of loops are larger, the state is projected. After a projection, a multi-step
 * method begins again at order 1. With the limit 1, the first steps of the method drifted so far that every third step requested
 * the next projection. */
#define DRIFT 100.0
#define DRIFT_TURN 1e-6    /* if the squared norm of a quaternion differs more from 1, the state is projected */
/* relative to the friction of a pair: a larger change since the last stored state may mean another branch */
#define FAR_BRANCH 0.02
#define FOLLOWED_PARTS 8   /* number of parts in which friction is then followed from the stored state */
/* relative to the scene's scales: nominal values of states. BDF methods of importers would be less accurate with the full scales
 * (fmu/README.md). */
#define NOMINAL 0.1

/* Array of counts: how often the mode of each pair and stop has ended in the present event. */
static inline double *tr_handled_counts(const tr_sim *s) { return TR_A(s, indicators) + 2 * s->k->nsliders + s->k->nstops + 1; }

/* Evaluate signals on the branch between the last break and the next one, whatever time the importer requests. */
static void tr_set_moment_between_breaks(tr_sim *s) {
  const double least = s->clock.last_break + JUST_AFTER, most = s->clock.next_break - JUST_AFTER;
  tr_moment_of(s)->inside = fmin(fmax(s->clock.t, least), most);
}

int tr_states(const tr_sim *s) { return s->ny + s->nworks; }

void tr_set_state(tr_sim *s, double t, const double *y) {
  s->clock.t = t;
  if (y) tr_copy(tr_states(s), y, TR_A(s, y));
}

/* Surface speed of pair i, m/s; negative if the pair slides against its direction. Requires a solution. */
static double tr_speed_in_mode(const tr_sim *s, int i) {
  if (tr_pair_of(s, i)->nrates == 1) return tr_sliding_of(s, i)->speed;
  if (tr_frozen_length(s, i) > TR_LINE) return tr_speed_along(s, i);
  return tr_has_reversed(s, i) ? -tr_pair_speed(s, i) : tr_pair_speed(s, i);
}

/* Indicator of a sliding pair of several components; positive until the direction must be renewed, or until the pair leaves its
 * line. */
static double tr_direction_indicator(const tr_sim *s, int i) {
  const double speed = tr_pair_speed(s, i), unit = tr_pair_speed_unit(s, i);
  if (tr_is_starting_to_slide(s, i)) return BEGUN_SPEED - speed / unit;
  if (!(tr_frozen_length(s, i) > TR_LINE)) return 1.0;
  if (!(TR_A(s, end_speed)[i] > 0.0)) return BEGUN_SPEED - speed / unit;
  if (!(speed > tr_last_speed(unit))) return 1.0;
  const double along = tr_speed_along(s, i) / speed;
  return LINE_LEFT * LINE_LEFT - fmax(0.0, 1.0 - along * along);
}

/* Motion of the stuck pair i, relative to its allowed motion; the mode ends above 1. Without loops, only a drive or the importer
 * moves such a pair. */
static double tr_motion_of_stuck_pair(tr_sim *s, int i) {
  return s->k->active ? tr_rest_violation(s, i) : tr_pair_speed(s, i) / tr_rest_speed(tr_speed_unit(s));
}

static void tr_set_valued_indicators(tr_sim *s, int i, double *z) {
  const int flag = tr_mode_flag(tr_mode_of(s, i));
  z[1] = 1.0;
  if (flag == TR_STUCK) {
    const double ratio = tr_friction_ratio(s, i), moves = tr_motion_of_stuck_pair(s, i);
    z[0] = fmin((1.0 + SHIFT_RATIO - ratio) / (1.0 + ratio), 1.0 - moves);
    return;
  }
  z[0] = (tr_speed_in_mode(s, i) - TR_A(s, end_speed)[i]) / tr_pair_speed_unit(s, i);
  if (tr_pair_of(s, i)->nrates > 1) z[1] = tr_direction_indicator(s, i);
  z[1] = fmin(z[1], tr_distance_to_cone(s, i));
}

/* Both indicators of pair i, whose law has a kink: one for the kink, one for a reversal inside the proportional zone. */
static void tr_kink_indicators(tr_sim *s, int i, double *z) {
  const double speed = tr_sliding_of(s, i)->speed, kink = tr_sliding_of(s, i)->border;
  const tr_zone *zone = tr_zone_of(s, i);
  const int turned = zone->reversal == zone->reversal;
  z[0] = SHIFT_KINK + (tr_is_sliding(s, i) ? speed / kink - 1.0 : 1.0 - fabs(speed) / kink);
  z[1] = zone->inside && !turned ? SHIFT_SPEED + tr_speed_along_entry(s, i) / s->set.rate : 1.0;
}

static void tr_evaluate_indicators(tr_sim *s) {
  const int pairs = s->k->nsliders;
  double *z = TR_A(s, indicators), *of_stops = z + 2 * pairs;
  if (s->friction.held) tr_evaluate_capacities_at_solution(s);
  for (int i = 0; i < pairs; ++i, z += 2) {
    z[0] = z[1] = 1.0;
    if (tr_is_set_valued(s, i)) tr_set_valued_indicators(s, i, z);
    else if (tr_has_kink_at_rest(s, i)) z[0] = SHIFT_SPEED + tr_sliding_of(s, i)->speed / tr_pair_speed_unit(s, i);
    else if (tr_pair_of(s, i)->kind == TR_KIND_KINK) tr_kink_indicators(s, i, z);
  }
  tr_stop_depths(s, TR_A(s, y), of_stops);
  for (int j = 0; j < s->k->nstops; ++j) of_stops[j] = SHIFT_STOP + (tr_is_pressed(s, j) ? of_stops[j] : -of_stops[j]);
  of_stops[s->k->nstops] = 1.0;
}

const double *tr_rates_known(const tr_sim *s) { return TR_A(s, dy); }

const double *tr_indicators(const tr_sim *s) { return TR_A(s, indicators); }

/* ẏ at the block's (t, y), starting from the stored multipliers. The equations are solved twice, the second time from the first
 * result, so that the stored values do not affect the result. Returns 0 on failure. */
static int tr_rhs_from_stored(tr_sim *s) {
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  for (int twice = 0; twice <= (s->k->neta > 0); ++twice)
    if (!tr_rhs(s, s->clock.t, TR_A(s, y), TR_A(s, dy))) return 0;
  return tr_is_finite(tr_states(s), TR_A(s, dy));
}

/* Whether the friction of a pair differs from its stored friction by more than FAR_BRANCH. Such a difference may mean another
 * branch. */
static int tr_has_friction_jumped(const tr_sim *s) {
  double most;
  tr_find_most_changed(s, TR_A(s, zold) + s->k->active, TR_A(s, z) + s->k->active, &most);
  return most > FAR_BRANCH;
}

/* ẏ at the block's (t, y), with friction followed from the stored state in FOLLOWED_PARTS parts. Returns 0 on failure. */
static int tr_rhs_followed(tr_sim *s) {
  const int n = tr_state_width(s);
  const double *from = TR_A(s, K) + n, *y = TR_A(s, y);
  double *between = TR_A(s, ytmp);
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  for (int p = 1; p < FOLLOWED_PARTS; ++p) {
    const double part = (double)p / FOLLOWED_PARTS;
    for (int i = 0; i < n; ++i) between[i] = from[i] + part * (y[i] - from[i]);
    if (!tr_rhs(s, s->step.t0 + part * (s->clock.t - s->step.t0), between, TR_A(s, dy))) return 0;
  }
  return tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_is_finite(tr_states(s), TR_A(s, dy));
}

/* ẏ at the block's (t, y) in the modes in force. Returns 0 on failure. */
static int tr_rhs_in_modes(tr_sim *s) {
  s->step.watch = 0;
  tr_set_moment_between_breaks(s);
  const int found = tr_rhs_from_stored(s);
  return (found && !tr_has_friction_jumped(s)) || !s->k->neta ? found : tr_rhs_followed(s);
}

const double *tr_rates_in_modes(tr_sim *s) {
  if (tr_rhs_in_modes(s)) {
    tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zend));
    tr_evaluate_indicators(s);
    return TR_A(s, dy);
  }
  TR_A(s, indicators)[2 * s->k->nsliders + s->k->nstops] = -1.0;
  if (!s->k->neta) return 0;
  tr_evaluate_maps(s, TR_A(s, y));
  tr_form_maps(s);
  tr_evaluate_stage2(s, TR_A(s, y), TR_A(s, zend), TR_A(s, dy));
  if (s->friction.held) tr_zero_held_rates(s, TR_A(s, dy));
  return tr_is_finite(tr_states(s), TR_A(s, dy)) ? TR_A(s, dy) : 0;
}

/* Set the speed, m/s, below which sliding of pair i counts as ended. Requires a solution. */
static void tr_set_end_speed(tr_sim *s, int i) {
  const double unit = tr_pair_speed_unit(s, i);
  double *slow = TR_A(s, end_speed) + i;
  const int several = tr_pair_of(s, i)->nrates > 1 && tr_is_set_valued(s, i) && tr_is_sliding(s, i);
  const double speed = several ? tr_speed_in_mode(s, i) : 0.0;
  if (several && !tr_is_starting_to_slide(s, i) && speed > 2.0 * tr_last_speed(unit)) *slow = tr_last_speed(unit);
  else if (!(*slow > 0.0 && speed > *slow)) *slow = -SHIFT_SPEED * unit;
}

/* Store the multipliers and the state from which friction is followed. */
static void tr_save_followed(tr_sim *s) {
  tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zold)), tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zend));
  tr_copy(tr_state_width(s), TR_A(s, y), TR_A(s, K) + tr_state_width(s));
  s->step.t0 = s->clock.t;
}

void tr_follow(tr_sim *s) {
  for (int i = 0; i <= 2 * s->k->nsliders + s->k->nstops; ++i)
    if (!(TR_A(s, indicators)[i] > 0.0)) return;
  tr_save_followed(s);
}

/* Complete a step of the importer at the block's (t, y), which was evaluated last. Stores this state, and renews directions and end
 * speeds. */
static void tr_complete_followed(tr_sim *s) {
  tr_save_followed(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const int several = tr_pair_of(s, i)->nrates > 1 && tr_is_sliding(s, i);
    if (several && !tr_is_set_valued(s, i)) tr_freeze_direction(s, i);
    if (several && tr_is_set_valued(s, i) && tr_frozen_length(s, i) < STILL_FROZEN * TR_FROZEN && tr_speed_in_mode(s, i) > tr_last_speed(tr_pair_speed_unit(s, i)))
      tr_freeze_direction(s, i);
    tr_set_end_speed(s, i);
  }
}

/* Whether the residuals of loops or quaternions at the state `y` exceed DRIFT or DRIFT_TURN. */
static int tr_has_drifted(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  double *h = TR_A(s, loop_error), pos = 0.0, vel = 0.0;
  for (int i = 0; i < k->nquat; ++i) {
    const double *e = y + k->quat[i];
    if (fabs(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3] - 1.0) > DRIFT_TURN) return 1;
  }
  if (!k->active || !s->set.project) return 0;
  tr_evaluate_closure(s, y, h);
  tr_loop_residual(s, h, &pos, &vel);
  return !(fmax(pos, vel) <= DRIFT * s->set.rtol);
}

int tr_completed(tr_sim *s) {
  if (s->clock.t > tr_next_break(s) + BREAK_REACHED * fmax(1.0, fabs(s->clock.t))) return 1;
  if (!tr_rhs_in_modes(s)) return 1;
  tr_complete_followed(s);
  return tr_has_drifted(s);
}

const double *tr_begin_exchange(tr_sim *s) {
  tr_save_followed(s);
  memset(TR_A(s, end_speed), 0, sizeof(double) * s->k->nsliders);
  if (!tr_rhs_in_modes(s)) return 0;
  tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zend));
  tr_complete_followed(s);
  tr_evaluate_indicators(s);
  return TR_A(s, dy);
}

int tr_row_in_modes(tr_sim *s, double *row) {
  tr_set_moment_between_breaks(s);
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  return tr_row(s, row);
}

double tr_nominal(const tr_sim *s, int i) { return NOMINAL * (i < s->ny ? TR_A(s, scale)[i] : s->set.energy); }
