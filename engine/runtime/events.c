/* When the mode of a pair or a stop ends inside a step.
 *
 * Within a step every mode is frozen, so that what is integrated is smooth; at its end (and at every stage) the quantities that
 * decide the modes are looked at, and when one has crossed its threshold the earliest crossing is located on the dense output.
 * Tolerances are small enough for what happens to be the same at any tolerance of the integration, and large enough to stand above the
 * round-off of what they are compared with. */
#include "modes.h"

#define TOL_KINK 1e-9     /* of the kink speed: how far past it a step may end unnoticed */
#define TOL_STOP 1e-12    /* m (turns: rad): how deep in a stop, or how far out of one, a step may end unnoticed */
#define TOL_SPEED 1e-13   /* of the speed unit: how far past the end of sliding a step may end unnoticed */
#define TOL_RELEASE 1e-10 /* of the friction ratio: by so much more than it can hold a pair may be asked for, unnoticed */
#define TOL_CONE 1e-10    /* of s²/|ω|²: how far a ball may be past the border between sliding and spinning, unnoticed */
#define NEAR_RELEASE 0.05 /* of the friction ratio: a stage this close to release makes the step worth a closer look */
#define MOVES_ALONG 2.0   /* times REST_BROKEN: a pair that is let go does not rest with the others when that is decided either */
#define SHORTLY 1e-3      /* of the step: over so much of it a depth's rate is told by a difference */
#define TOP_POINTS 16     /* of a cubic over the step: its top is looked for among them */
#define TOP_DIP 0.1       /* of what a depth varies over the step: so much higher than the cubic its top may be */
#define NEAR_MISS 1e-10   /* of the speed unit: a turn of more than a right angle at a higher speed is no stop, but too large a step */

/* Rates of a slider from the maps in place. */
static const double *tr_slider_rates(const tr_sim *s, int i) { return map_rates(s->k, TR_A(s, maps)) + tr_pair_of(s, i)->rate0; }

/* Freeze the direction of sliding as it is with the rates r. */
static void tr_freeze_as(tr_sim *s, int i, const double *r) {
  const tr_pair *pair = tr_pair_of(s, i);
  tr_mode *m = tr_mode_of(s, i);
  if (pair->nrates == 1)
    m->direction[0] = r[0] < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < 3; ++j) m->direction[j] = j < pair->nrates ? r[j] : 0.0;
}

/* The same as it is now, maps in place. */
static void tr_freeze(tr_sim *s, int i) { tr_freeze_as(s, i, tr_slider_rates(s, i)); }

/* Freeze the direction of pair i as it is at the start of a step. */
static void tr_freeze_at_start(tr_sim *s, int i) {
  double rates[3];
  tr_rates_of_state(s, i, rates), tr_freeze_as(s, i, rates);
}

/* Whether pair i is a ball in motion. */
static int tr_moving_ball(const tr_sim *s, int i) {
  return tr_pair_of(s, i)->cone && !tr_is_stuck(s, i) && tr_pair_speed(s, i) > NEAR_MISS * tr_speed_unit(s);
}

/* How far a held pair whose rest follows from others' is from resting with them, of what is too far: near positions in which it does it moves by a
 * small part of what the mechanism does, and then by more. */
static double tr_moves_along(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double most = 0.0;
  if (!s->k->active || !(tr_pair_speed(s, i) > REST_SPEED * tr_speed_unit(s))) return -INFINITY;
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e)
    if (tr_contradicts(s, e)) most = fmax(most, tr_unrest(s, e) / REST_BROKEN - MOVES_ALONG);
  return most > 0.0 ? most : -INFINITY;
}

/* How far a pair with a set-valued law is beyond its mode, in units of its tolerance: the end of sliding, release (after tr_holding), and
 * the border between sliding and spinning. */
static double tr_set_violation(tr_sim *s, int i) {
  const tr_sliding *v = tr_sliding_of(s, i);
  int flag = tr_flag(tr_mode_of(s, i));
  if (flag == TR_STUCK) return fmax((tr_ratio(s, i) - 1.0) / TOL_RELEASE, tr_moves_along(s, i));
  if (flag == TR_CONE) return v->cone / TOL_CONE;
  double stop = -v->speed / (tr_speed_unit(s) * TOL_SPEED);
  return tr_pair_of(s, i)->cone ? fmax(stop, -v->cone / TOL_CONE) : stop;
}

/* The same for a law with a kink at rest: the end of its direction. */
static double tr_turn_violation(const tr_sim *s, int i) { return -tr_sliding_of(s, i)->speed / (tr_speed_unit(s) * TOL_SPEED); }

/* How far pair or stop i is beyond its mode (> 1: an event), in units of its tolerance. Needs the state evaluated, and tr_holding when
 * something is held. */
static double tr_violation(tr_sim *s, int i, const double *depth) {
  const tr_kernel *k = s->k;
  if (i < k->nsliders) {
    int kind = tr_pair_of(s, i)->kind;
    if (kind == TR_KIND_SMOOTH) return -1.0;
    if (kind == TR_KIND_SET) return tr_set_violation(s, i);
    if (kind == TR_KIND_TURN) return tr_turn_violation(s, i);
    double speed = tr_sliding_of(s, i)->speed, kink = tr_sliding_of(s, i)->border;
    return (tr_slides(s, i) ? (kink - speed) / kink : (fabs(speed) - kink) / kink) / TOL_KINK;
  }
  int j = i - k->nsliders;
  return (tr_pressed(s, j) ? -depth[j] : depth[j]) / TOL_STOP;
}

/* Pairs and stops, in this order, are numbered as what may end. */
static inline int tr_watched(const tr_sim *s) { return s->k->nsliders + s->k->nstops; }

/* What happens where a stop or the hook of a latch is reached (`pressed`) or left. */
static int tr_stop_event(const tr_sim *s, int stop, int pressed) {
  if (tr_is_hook(s, stop)) return pressed ? TR_EV_LATCH : TR_EV_UNLATCH;
  return pressed ? TR_EV_STOP_ON : TR_EV_STOP_OFF;
}

/* The flag of a stop that was open and is pressed: of a hook the tooth that it falls on. depth: with it open. */
static double tr_flag_pressed(const tr_sim *s, int stop, const double *depth) {
  return tr_is_hook(s, stop) ? -depth[tr_pressed_by(s, stop)] : TR_STOP_PRESSED;
}

/* Whether a stop may be reached and left again inside the step just made (end state in ynew, K[end]), or left and reached: its depth, by the
 * cubic of its values and rates at both ends, has a top that comes so far. */
static int tr_stop_inside(tr_sim *s) {
  const int n = tr_width(s), ns = s->k->nstops;
  const double h = s->step.size, *ends[2] = {TR_A(s, y), TR_A(s, ynew)}, *rates[2] = {TR_A(s, K), TR_A(s, K) + tr_method_of(s)->end * n};
  double depth[2][ns + 1], near[2][ns + 1], *y = TR_A(s, yout);
  for (int e = 0; e < 2; ++e) {
    for (int i = 0; i < n; ++i) y[i] = ends[e][i] + (e ? -SHORTLY : SHORTLY) * h * rates[e][i];
    tr_depths(s, ends[e], depth[e]), tr_depths(s, y, near[e]);
  }
  for (int i = 0; i < ns; ++i) {
    const double side = tr_pressed(s, i) ? -1.0 : 1.0, g0 = side * depth[0][i], g1 = side * depth[1][i];
    const double m0 = (side * near[0][i] - g0) / SHORTLY, m1 = (g1 - side * near[1][i]) / SHORTLY;
    if (!(m0 > 0.0 && m1 < 0.0)) continue;
    double top = fmax(g0, g1);
    for (int q = 1; q < TOP_POINTS; ++q) {
      const double x = q / (double)TOP_POINTS;
      top = fmax(top, g0 + x * (m0 + x * (3.0 * (g1 - g0) - 2.0 * m0 - m1 + x * (2.0 * (g0 - g1) + m0 + m1))));
    }
    if (top > -TOP_DIP * (top - fmin(g0, g1))) return 1;
  }
  return 0;
}

/* Whether pair i, of one component, which has started from rest with the step, gains speed where the step's dense output has it turn round (at θ,
 * where its state is y): then that output is not good enough to tell how the pair has started. */
static int tr_only_seems_to_turn(tr_sim *s, int i, double theta, const double *y) {
  if (i >= s->k->nsliders || !tr_is_set(s, i) || tr_flag(tr_mode_of(s, i)) != TR_SLIPS || tr_pair_of(s, i)->nrates > 1) return 0;
  if (tr_speed_of_state(s, i) > REST_SPEED * tr_speed_unit(s) || !tr_rhs(s, s->step.t0 + theta * s->step.size, y, TR_A(s, dy))) return 0;
  return tr_acceleration_now(s, tr_pair_of(s, i)->eta0) * tr_mode_of(s, i)->direction[0] > 0.0;
}
