/* Pairs of several components that turn inside a step: their friction turns with them and takes others beyond their modes, which is no event of
 * those. */
#include "modes.h"

#define ALL_BUT_STOPPED 0.01 /* of its speed at the step's start: what is left of it turns by the step's error */
#define RIGHT_ANGLE 1e-12 /* of what cancels in a product of directions: its round-off, where the two were found to be at a right angle */
#define LINE_TURNS 0.98 /* cosine of eleven degrees: by no more does a line that the loops leave turn within a step */
#define LINE_TURNED 1e-8 /* of the speed, and rtol: by no more may a pair be across the line along which it is said to move */

/* Whether pair i, of several components, slides the other way than at the start of the step: its direction was frozen there, and its
 * friction has jumped where the two came to be at a right angle. Maps in place. */
static int tr_turned_back(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *dir = tr_mode_of(s, i)->direction, *r = tr_slider_rates(s, i), *arm = TR_A(s, arm) + pair->eta0;
  double along = 0.0, size = 0.0;
  if (!tr_is_set(s, i) || pair->nrates == 1 || !tr_slides(s, i)) return 0;
  for (int j = 0; j < pair->nrates; ++j) along += r[j] * dir[j] * arm[j] * arm[j], size += fabs(r[j] * dir[j]) * arm[j] * arm[j];
  return along < RIGHT_ANGLE * size && tr_pair_speed(s, i) > TOL_SPEED * tr_speed_unit(s);
}

/* Speeds of pairs of several components at the start of the step just made; 0 of all others. */
static void tr_speeds_at_start(tr_sim *s, double *was) {
  for (int i = 0; i < s->k->nsliders; ++i)
    was[i] = tr_is_set(s, i) && tr_slides(s, i) && tr_pair_of(s, i)->nrates > 1 ? tr_speed_of_state(s, i) : 0.0;
}

/* A pair of several components, other than ``which``, that has all but stopped since the step's start, where its speed was `was`: its
 * friction turns on its way to rest and takes others beyond their modes. -1: there is none. Along a line nothing turns. Maps in place. */
static int tr_stops_beside(tr_sim *s, int which, const double *was, double t, const double *y) {
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (i == which || !(was[i] > NEAR_MISS * tr_speed_unit(s)) || tr_frozen_length(s, i) > TR_LINE) continue;
    if (tr_pair_speed(s, i) < ALL_BUT_STOPPED * was[i] && !tr_stops_on_line(s, i, t, y)) return i;
  }
  return -1;
}

/* Speed of pair i along the direction in which it slid at the step's start, m/s. Maps in place. */
static double tr_speed_along(const tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *dir = tr_mode_of(s, i)->direction, *r = tr_slider_rates(s, i), *arm = TR_A(s, arm) + pair->eta0;
  double along = 0.0, size = 0.0;
  for (int j = 0; j < pair->nrates; ++j) along += r[j] * dir[j] * arm[j] * arm[j], size += dir[j] * dir[j] * arm[j] * arm[j];
  return along / sqrt(size);
}

/* Whether pairs that slid along lines at the start of the step have left them by its end (a reversal in a loop whose joints all turn: the line
 * is that of the instant), by so much that friction with the direction of the start is off. Theirs is then that of a first step, for which this
 * one is to be refused. Maps in place. */
static int tr_leaves_lines(tr_sim *s) {
  int any = 0;
  for (int i = 0; i < s->k->nsliders && s->set.hfixed <= 0.0; ++i) {
    const double *r = tr_slider_rates(s, i);
    double *d = tr_mode_of(s, i)->direction, along = 0.0;
    if (tr_pair_of(s, i)->nrates == 1 || !(tr_frozen_length(s, i) > TR_LINE) || !(tr_pair_speed(s, i) > tr_onset_speed(s))) continue;
    for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) along += r[j] * d[j];
    if (!(along > 0.0) || tr_is_on_line(s, i, r, fmax(LINE_TURNED, s->set.rtol))) continue;
    for (int j = 0; j < 3; ++j) d[j] *= TR_FROZEN / ON_LINE;
    any = 1;
  }
  return any;
}

/* The pair that comes to the end of its sliding where another one, `which`, seems to leave its mode: its friction jumps there, and takes that one
 * along. On a line it has across it what the step leaves the loops open by, to which its friction turns already. `which` where there is none. Maps
 * in place. */
static int tr_stops_first(tr_sim *s, int which, double t, const double *y) {
  if (which < s->k->nsliders && tr_flag(tr_mode_of(s, which)) == TR_SLIPS && !tr_pair_of(s, which)->cone) return which;
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (i == which || !tr_is_set(s, i) || tr_flag(tr_mode_of(s, i)) != TR_SLIPS) continue;
    const double v = tr_pair_speed(s, i), along = tr_speed_along(s, i), none = NEAR_MISS * tr_speed_unit(s);
    if (v <= none || ((along <= none || along < LINE_TURNS * v) && tr_stops_on_line(s, i, t, y))) return i;
  }
  return which;
}

/* Whether a pair of several components other than ``which`` has turned by more than a right angle where the step was to end: stages of an explicit
 * step that is too long for how fast its direction answers to friction went to and fro, and what they have others do at an earlier time is no event. */
static int tr_turns_beyond(tr_sim *s, int which) {
  if (which >= s->k->nsliders || !(tr_is_stuck(s, which) || tr_moving_ball(s, which))) return 0;
  const double end = s->step.t0 + s->step.size, *y = TR_A(s, ynew);
  tr_maps_at(s, end, y);
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (i == which || !tr_turned_back(s, i) || tr_pair_speed(s, i) <= NEAR_MISS * tr_speed_unit(s) || tr_stops_on_line(s, i, end, y)) continue;
    s->friction.missed = i;
    return 1;
  }
  return 0;
}
