/* Detection of pairs of several components whose sliding direction turns inside a step. Their friction turns, too, and can carry
 * other pairs beyond the limits of their modes. Such a violation is not an event; the step is too long. */
#include "events/events.h"

/* relative to the speed at the start of the step: a slower pair has nearly stopped, and its direction is only integration error */
#define ALL_BUT_STOPPED 0.01
#define RIGHT_ANGLE 1e-12 /* relative to the sum of absolute products: a smaller scalar product of two directions is round-off */
/* cosine of 11 degrees: a pair whose velocity turns away from its line by a larger angle has nearly stopped */
#define LINE_TURNS 0.98
/* relative to the speed: largest speed perpendicular to the line on which a pair slides; if rtol is larger, rtol is used */
#define LINE_TURNED 1e-8

static int tr_has_reversed(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *dir = tr_mode_of(s, i)->direction, *r = tr_pair_rates(s, i), *lever = TR_A(s, lever) + pair->eta0;
  double along = 0.0, size = 0.0;
  if (!tr_is_set_valued(s, i) || pair->nrates == 1 || !tr_is_sliding(s, i)) return 0;
  for (int j = 0; j < pair->nrates; ++j) along += r[j] * dir[j] * lever[j] * lever[j], size += fabs(r[j] * dir[j]) * lever[j] * lever[j];
  return along < RIGHT_ANGLE * size && tr_pair_speed(s, i) > tr_stick_tolerance(tr_speed_unit(s));
}

/* Speeds of sliding pairs at the start of the last step, m/s; 0 for every other pair. May make the start of the step the current
 * state. */
static void tr_save_start_speeds(tr_sim *s, double *was) {
  for (int i = 0; i < s->k->nsliders; ++i)
    was[i] = tr_is_set_valued(s, i) && tr_is_sliding(s, i) ? tr_speed_of_state(s, i) : 0.0;
}

/* A pair of several components, other than `which`, that nearly stopped in the step; −1 if there is none. While this pair stops,
 * its friction turns and carries other pairs beyond the limits of their modes. Pairs that stop along a line are excluded. was:
 * speeds at the start of the step. Requires maps of (t, y). */
static int tr_find_pair_stopping_beside(tr_sim *s, int which, const double *was, double t, const double *y) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (i == which || tr_pair_of(s, i)->nrates == 1 || tr_frozen_length(s, i) > TR_LINE) continue;
    if (!(was[i] > tr_crawl_speed(tr_speed_unit(s)))) continue;
    if (tr_pair_speed(s, i) < ALL_BUT_STOPPED * was[i] && !tr_is_stopping_on_line(s, i, t, y)) return i;
  }
  return -1;
}

static double tr_speed_along(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *dir = tr_mode_of(s, i)->direction, *r = tr_pair_rates(s, i), *lever = TR_A(s, lever) + pair->eta0;
  double along = 0.0, size = 0.0;
  for (int j = 0; j < pair->nrates; ++j) along += r[j] * dir[j] * lever[j] * lever[j], size += dir[j] * dir[j] * lever[j] * lever[j];
  return along / sqrt(size);
}

static int tr_release_left_lines(tr_sim *s) {
  int any = 0;
  for (int i = 0; i < s->k->nsliders && s->set.hfixed <= 0.0; ++i) {
    const double *r = tr_pair_rates(s, i);
    double *d = tr_mode_of(s, i)->direction, along = 0.0;
    if (tr_pair_of(s, i)->nrates == 1 || !(tr_frozen_length(s, i) > TR_LINE) || !(tr_pair_speed(s, i) > tr_onset_speed(s))) continue;
    for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) along += r[j] * d[j];
    if (!(along > 0.0) || tr_is_on_line(s, i, r, fmax(LINE_TURNED, s->set.rtol))) continue;
    for (int j = 0; j < 3; ++j) d[j] *= TR_FROZEN / ON_LINE;
    any = 1;
  }
  return any;
}

/* The pair that stops at the state where pair `which` seems to leave its mode; `which` if no other pair stops. At this state the
 * friction of the stopping pair jumps, and carries `which` beyond its limit. was: speeds at the start of the step. A slow pair with
 * growing speed has just started, and does not stop. For a pair on a line, speed perpendicular to the line is an error of slightly
 * open loops. Requires maps of (t, y). */
static int tr_find_pair_stopping_first(tr_sim *s, int which, const double *was, double t, const double *y) {
  if (which < s->k->nsliders && tr_mode_flag(tr_mode_of(s, which)) == TR_SLIPS && !tr_pair_of(s, which)->cone) return which;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (i == which || !tr_is_set_valued(s, i) || tr_mode_flag(tr_mode_of(s, i)) != TR_SLIPS) continue;
    const double v = tr_pair_speed(s, i), along = tr_speed_along(s, i), none = tr_crawl_speed(tr_speed_unit(s));
    if (along >= LINE_TURNS * v && v > was[i]) continue;
    const int stops = tr_pair_of(s, i)->nrates > 1 && v <= none && !(v > was[i]);
    if (stops || ((along <= none || along < LINE_TURNS * v) && tr_is_stopping_on_line(s, i, t, y))) return i;
  }
  return which;
}

/* Whether another pair than `which` turned its direction by more than a right angle before the planned end of the step. Only pairs
 * of several components can turn. Returns 0 if `which` slides. Stiff directions oscillate in explicit steps that are too long, and
 * cause spurious events of other pairs. */
static int tr_has_other_pair_turned(tr_sim *s, int which) {
  if (which >= s->k->nsliders || !(tr_is_stuck(s, which) || tr_is_moving_ball(s, which))) return 0;
  const double end = s->step.t0 + s->step.size, *y = TR_A(s, ynew);
  tr_evaluate_maps_at(s, end, y);
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (i == which || !tr_has_reversed(s, i) || tr_is_crawling(s, i) || tr_is_stopping_on_line(s, i, end, y)) continue;
    s->friction.cutting_pair = i;
    return 1;
  }
  return 0;
}

/* Whether the reversal of pair i at θ is an artefact of the dense output, because the pair still accelerates at the state y of this
 * instant. Such artefacts occur only for pairs of one component that started from rest at the start of this step. */
static int tr_is_spurious_turn(tr_sim *s, int i, double theta, const double *y) {
  if (i >= s->k->nsliders || !tr_is_set_valued(s, i) || tr_mode_flag(tr_mode_of(s, i)) != TR_SLIPS || tr_pair_of(s, i)->nrates > 1) return 0;
  if (tr_speed_of_state(s, i) > tr_rest_speed(tr_speed_unit(s)) || !tr_rhs(s, s->step.t0 + theta * s->step.size, y, TR_A(s, dy))) return 0;
  return tr_acceleration_by_maps(s, tr_pair_of(s, i)->eta0) * tr_mode_of(s, i)->direction[0] > 0.0;
}
