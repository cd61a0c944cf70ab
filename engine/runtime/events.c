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
#define NEAR_MISS 1e-10   /* of the speed unit: a turn of more than a right angle at a higher speed is no stop, but too large a step */
#define PARTS 8           /* parts of a suspicious step that are looked at one by one */
#define ROOT_STEPS 80     /* iterations on θ at most; so many of them by the secant, then by halves, which cannot stall */
#define SECANT_STEPS 60
#define ROOT_ROUND_OFF 1e-14 /* of θ */

/* Rates of a slider from the maps in place. */
static const double *tr_slider_rates(const tr_sim *s, int i) { return map_rates(s->k, TR_A(s, maps)) + tr_pair_of(s, i)->rate0; }

/* Freeze the direction of sliding as it is now. */
static void tr_freeze(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *r = tr_slider_rates(s, i);
  tr_mode *m = tr_mode_of(s, i);
  if (pair->nrates == 1)
    m->direction[0] = r[0] < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < 3; ++j) m->direction[j] = j < pair->nrates ? r[j] : 0.0;
}

/* How far a pair with a set-valued law is beyond its mode, in units of its tolerance: the end of sliding, release (after tr_holding), and
 * the border between sliding and spinning. */
static double tr_set_violation(tr_sim *s, int i) {
  const tr_sliding *v = tr_sliding_of(s, i);
  int flag = tr_flag(tr_mode_of(s, i));
  if (flag == TR_STUCK) return (tr_ratio(s, i) - 1.0) / TOL_RELEASE;
  if (flag == TR_CONE) return v->border / TOL_CONE;
  double stop = -v->speed / (tr_speed_unit(s) * TOL_SPEED);
  return tr_pair_of(s, i)->cone ? fmax(stop, -v->border / TOL_CONE) : stop;
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

/* How deep each stop is pressed at y, m or rad. */
static void tr_depths(tr_sim *s, const double *y, double *depth) {
  if (s->k->nstops) s->k->events(TR_A(s, x), y, TR_A(s, c) + s->k->c_events, depth);
}

/* Worst violation at a dense point, relative to tolerance; which one in *worst. NaN when the state cannot be evaluated. */
static double tr_probe(tr_sim *s, double theta, int *worst) {
  double *y = TR_A(s, yout), depth[s->k->nstops + 1], best = -INFINITY;
  tr_dense_eval(s, theta, y);
  if (s->k->nquat) tr_normalize(s, y);
  if (!tr_rhs(s, s->step.t0 + theta * s->step.size, y, TR_A(s, dy))) return NAN;
  tr_depths(s, y, depth);
  if (s->friction.still) tr_holding(s);
  for (int i = 0; i < tr_watched(s); ++i) {
    double v = tr_violation(s, i, depth);
    if (v > best) best = v, *worst = i;
  }
  return best - 1.0;
}

/* First θ in (a, b] where the probe turns positive, given g(b) > 0: a safeguarded secant (Illinois). */
static double tr_first_root(tr_sim *s, double a, double b, double ga, double gb, int *which) {
  int side = 0;
  for (int it = 0; it < ROOT_STEPS && b - a > ROOT_ROUND_OFF; ++it) {
    double m = (ga < 0.0 && it < SECANT_STEPS) ? (a * gb - b * ga) / (gb - ga) : 0.5 * (a + b);
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    int w = *which;
    double g = tr_probe(s, m, &w);
    if (!(g <= 0.0)) {
      b = m, gb = g, *which = w;
      if (side == 1) ga *= 0.5;
      side = 1;
      if (g < 1.0) break; /* within twice the tolerance: good enough, and on the far side */
    } else {
      a = m, ga = g;
      if (side == -1) gb *= 0.5;
      side = -1;
    }
  }
  return b;
}

/* What an event search in a step has found. */
enum { TR_NO_EVENT, TR_FOUND, TR_TOO_LARGE };

/* Whether what was found at θ is an event; a pair of several components that has merely turned fast asks for a smaller step. */
static int tr_event_at(tr_sim *s, double theta, int which) {
  if (which >= s->k->nsliders || !tr_is_set(s, which) || tr_pair_of(s, which)->nrates == 1 || !tr_slides(s, which)) return TR_FOUND;
  double *y = TR_A(s, yout);
  tr_dense_eval(s, theta, y);
  tr_set_time(s, s->step.t0 + theta * s->step.size);
  s->k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  const tr_mode *m = tr_mode_of(s, which);
  const double *r = tr_slider_rates(s, which), *arm = TR_A(s, arm) + tr_pair_of(s, which)->eta0;
  double along = 0.0;
  for (int j = 0; j < tr_pair_of(s, which)->nrates; ++j) along += r[j] * m->direction[j] * arm[j] * arm[j];
  if (!(along < 0.0 && tr_pair_speed(s, which) > NEAR_MISS * tr_speed_unit(s))) return TR_FOUND;
  s->friction.missed = which;
  return TR_TOO_LARGE;
}

/* At the end of the step just made (evaluated, in ynew): whether a mode has ended there (then `which`), and whether one may have ended and
 * begun again inside: the stages have come too near for that to be ruled out. */
TR_INLINE int tr_ended(tr_sim *s, int *which, int *suspect) {
  double depth[s->k->nstops + 1];
  int hit = 0;
  tr_depths(s, TR_A(s, ynew), depth);
  if (s->friction.still) tr_holding(s);
  *suspect = 0;
  for (int i = 0; i < tr_watched(s); ++i) {
    if (tr_violation(s, i, depth) > 1.0) hit = 1, *which = i;
    if (i >= s->k->nsliders) continue;
    const double lowest = TR_A(s, smin)[i], highest = TR_A(s, smax)[i];
    if (tr_is_set(s, i)) {
      *suspect |= highest > (tr_is_stuck(s, i) ? -NEAR_RELEASE / TOL_RELEASE : 1.0);
    } else if (tr_is_turn(s, i)) {
      *suspect |= highest > 1.0;
    } else if (tr_pair_of(s, i)->kind == TR_KIND_KINK) {
      double kink = tr_sliding_of(s, i)->border;
      *suspect |= tr_slides(s, i) ? lowest < -TOL_KINK * kink : highest > TOL_KINK * kink;
    }
  }
  return hit;
}

/* Look for the first event in the step just made (end state evaluated in ynew, K[end]): what, and at which θ. */
static int tr_find_event(tr_sim *s, int *which, double *theta) {
  int suspect;
  if (tr_watched(s) == 0 || !s->set.locate) return TR_NO_EVENT;
  if (!tr_ended(s, which, &suspect) && !suspect) return TR_NO_EVENT;
  if (!tr_have_dense(s)) return TR_TOO_LARGE;
  double a = 0.0, ga = -1.0, before = INFINITY;
  for (int q = 1; q <= PARTS; ++q) {
    double b = (double)q / PARTS;
    if (q < PARTS && !suspect) continue;
    int w = *which;
    double g = tr_probe(s, b, &w);
    if (g != g) return TR_TOO_LARGE;
    if (g > 0.0) {
      *which = w;
      *theta = tr_first_root(s, a, b, ga, g, which);
      return tr_event_at(s, *theta, *which);
    }
    if (suspect && s->friction.still && q > 1 && ga > before && ga > g && ga > -2.0 * NEAR_RELEASE / TOL_RELEASE) {
      /* three points with the middle one highest: the parabola through them may rise above zero between them */
      double top = a + 0.5 / PARTS * (before - g) / (before - 2.0 * ga + g), peak = tr_probe(s, top, &w);
      if (peak > 0.0) {
        *which = w;
        *theta = tr_first_root(s, top < a ? a - 1.0 / PARTS : a, top, top < a ? before : ga, peak, which);
        return tr_event_at(s, *theta, *which);
      }
    }
    before = ga, a = b, ga = g;
  }
  return TR_NO_EVENT;
}
