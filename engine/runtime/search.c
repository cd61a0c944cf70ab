/* Looking into a step that has been made for the first event: where a pair or a stop leaves its mode.
 *
 * What decides the modes was looked at at every stage and at the end. Where one of them is beyond its mode, or comes so near that it may
 * have been between stages, the step is looked at on its dense output. A pair that is held may be let go and caught again within a
 * step: the tops of its margin between the points are followed by parabolas, at the ends of the step too. */
#include "modes.h"

#define SAMPLES 8       /* dense points at which a suspect step is looked at */
#define SAMPLES_BOUNDED 4 /* the same of a bounded step, and iterations on θ */
#define ROOT_STEPS_BOUNDED 4
#define CLOSE_ROOT 1e6     /* tolerances: so near to it is good enough there: 1e-7 of the speed unit, 1e-4 of what a pair can hold; */
#define CLOSE_STOP 500.0   /* of a pair of several components a speed below NEAR_MISS */
#define ROOT_STEPS 80     /* iterations on θ at most; so many of them by the secant, then by halves, which cannot stall */
#define SECANT_STEPS 60
#define ROOT_ROUND_OFF 1e-14 /* of θ */
#define TOP_STEPS 12    /* parabolas a top is followed by: each takes the error to a higher power */
#define TOP_NEAR 1e-9   /* of the step: tops nearer to a point looked at are that point */
#define TOP_SURE 0.01   /* of its distance from release: a top that changes by less with another parabola stays below */
#define DIP 0.05        /* of what a sliding speed varies over the stages: by so much it may fall between them, to rest and up again */
#define TURN_DIP 0.5    /* the same where it falls at the start and rises at the end: it may come so far below the stages, the two next to its
                         least being up to half a step apart */
#define BY_CONE 0.25    /* of s²/|ω|²: a ball that is as near to its cone as this may have roots beside the one that is followed */
#define SWING 0.5       /* of what a margin varies over the stages: by so much it may rise between them (a quarter period between two) */
#define CONE_SWING 2.0  /* the same of a ball that turns about its contact: where it is slow its axis swings round in a part of a step */

/* By how many tolerances, after the first, the worst pair or stop is beyond its mode at y, which has just been evaluated; which one in
 * *worst. */
static double tr_beyond(tr_sim *s, const double *y, int *worst) {
  double depth[s->k->nstops + 1], best = -INFINITY;
  tr_depths(s, y, depth);
  if (s->friction.still) tr_holding_now(s);
  for (int i = 0; i < tr_watched(s); ++i) {
    const double v = tr_far(s, TR_NOW)[i] = tr_violation(s, i, depth);
    if (v > best) best = v, *worst = i;
  }
  return best - 1.0;
}

/* The same at a dense point; from: multipliers where Newton's iteration begins (0: between those of the step's ends). NaN when the state
 * cannot be evaluated. */
static double tr_probe_from(tr_sim *s, double theta, const double *from, int *worst) {
  double *y = TR_A(s, yout);
  tr_dense_state(s, theta, y);
  if (from) tr_copy(s->k->active + s->k->neta, from, TR_A(s, z));
  if (s->k->nquat) tr_normalize(s, y);
  const double t = s->step.t0 + theta * s->step.size;
  return tr_asks_look(s, t, y) || tr_rhs(s, t, y, TR_A(s, dy)) ? tr_beyond(s, y, worst) : NAN;
}

static double tr_probe(tr_sim *s, double theta, int *worst) { return tr_probe_from(s, theta, 0, worst); }

/* At how many dense points a suspect step is looked at. */
static inline int tr_samples(const tr_sim *s) { return s->bound.evaluations ? SAMPLES_BOUNDED : SAMPLES; }

/* The same at the q-th dense point, for its two ends as it is known from the steps' ends. */
static double tr_sample(tr_sim *s, int q, int last, const double *from, int *worst) {
  const int samples = tr_samples(s);
  if (q == 0 && s->step.margin == s->step.margin) return s->step.margin;
  if (q < samples) return tr_probe_from(s, q / (double)samples, from, worst);
  *worst = last;
  return s->step.margin_end;
}

/* A root of the probe in [a, b] by as few evaluations as a bounded step allows: on either side of it. */
static double tr_root_within(tr_sim *s, double a, double b, double ga, double gb, int *which) {
  double m = b;
  int side = 0;
  if (a == 0.0 && s->step.margin < ga) ga = s->step.margin;
  for (int it = 0; it < ROOT_STEPS_BOUNDED; ++it) {
    int w = *which;
    m = (a * gb - b * ga) / (gb - ga);
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    const double g = tr_probe(s, m, &w);
    if (g != g) return NAN;
    if (g > 0.0) {
      b = m, gb = g, *which = w, ga *= side == 1 ? 0.5 : 1.0, side = 1;
    } else {
      a = m, ga = g, gb *= side == -1 ? 0.5 : 1.0, side = -1;
    }
    if (fabs(g) < (w < s->k->nsliders && tr_pair_of(s, w)->nrates > 1 ? CLOSE_STOP : CLOSE_ROOT)) break;
  }
  return m;
}

/* First θ in (a, b] where the probe turns positive, given g(b) > 0: a safeguarded secant (Illinois). NaN where what turns there is whether
 * there is an answer at all. near: multipliers at a, followed from there (0: they are not). */
static double tr_first_root(tr_sim *s, double a, double b, double ga, double gb, double *near, int *which) {
  const int nz = tr_nz(s);
  int side = 0;
  if (s->bound.evaluations) return tr_root_within(s, a, b, ga, gb, which);
  for (int it = 0; it < ROOT_STEPS && b - a > ROOT_ROUND_OFF; ++it) {
    double m = (ga < 0.0 && it < SECANT_STEPS) ? (a * gb - b * ga) / (gb - ga) : 0.5 * (a + b);
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    int w = *which;
    double g = tr_probe_from(s, m, near, &w);
    if (!(g <= 0.0)) {
      b = m, gb = g, *which = w;
      if (side == 1) ga *= 0.5;
      side = 1;
      if (g < 1.0) break; /* within twice the tolerance: good enough, and on the far side */
    } else {
      a = m, ga = g;
      if (near) tr_copy(nz, TR_A(s, z), near);
      if (side == -1) gb *= 0.5;
      side = -1;
    }
  }
  if (near) { /* up to there what is between the step's ends is on the branch that ends there */
    for (int i = 0; i < nz; ++i) TR_A(s, zend)[i] = TR_A(s, zstart)[i] + (near[i] - TR_A(s, zstart)[i]) / b;
  }
  return gb == gb ? b : NAN;
}

/* What an event search in a step has found. */
enum { TR_NO_EVENT, TR_FOUND, TR_TOO_LARGE };

/* Whether what was found at θ is an event. A pair of several components that has merely turned fast asks for a smaller step, whatever its
 * friction, which has jumped there, has done to others: these have not come to the end of their modes. So does one that all but stops. */
static int tr_event_at(tr_sim *s, double theta, int *which) {
  if (!(theta == theta)) return TR_TOO_LARGE;
  if (!s->k->sets) return TR_FOUND;
  if (tr_turns_beyond(s, *which)) return TR_TOO_LARGE;
  int turned = -1;
  double *y = TR_A(s, yout), was[s->k->nsliders + 1], t = s->step.t0 + theta * s->step.size;
  tr_speeds_at_start(s, was);
  tr_dense_eval(s, theta, y);
  if (tr_only_seems_to_turn(s, *which, theta, y)) return TR_TOO_LARGE;
  tr_maps_at(s, t, y);
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_turned_back(s, i) || (i != *which && tr_flag(tr_mode_of(s, i)) == TR_CONE)) continue;
    if (tr_pair_speed(s, i) > NEAR_MISS * tr_speed_unit(s) && !tr_stops_on_line(s, i, t, y)) { /* on a line it has across what loops are open by */
      s->friction.missed = i;
      return TR_TOO_LARGE;
    }
    if (turned < 0 || i == *which) turned = i;
  }
  *which = turned >= 0 ? turned : tr_stops_first(s, *which, t, y);
  const int beside = turned < 0 && *which < s->k->nsliders ? tr_stops_beside(s, *which, was, t, y) : -1;
  if (beside >= 0) s->friction.missed = beside;
  return beside >= 0 ? TR_TOO_LARGE : TR_FOUND;
}

/* Whether the sliding speed of pair i (one component) falls at the start of the step just made and rises at its end: it has a least value
 * inside. A pair whose rate is none of the state's counts as one whose speed does. */
static int tr_turns_inside(const tr_sim *s, int i) {
  int v0 = tr_pair_of(s, i)->v0, n = tr_width(s);
  const double *start = TR_A(s, K) + s->k->nq, *end = start + tr_method_of(s)->end * n, side = tr_mode_of(s, i)->direction[0];
  return v0 < 0 || (start[v0] * side < 0.0 && end[v0] * side > 0.0);
}

/* Whether the stages of the step just made (end evaluated) give reason to look at it more closely for pair i. */
static int tr_suspect(const tr_sim *s, int i) {
  double most = TR_A(s, smax)[i], least = TR_A(s, smin)[i], kink = tr_sliding_of(s, i)->border;
  switch (tr_pair_of(s, i)->kind) {
    case TR_KIND_SMOOTH: return 0;
    case TR_KIND_TURN: return most > 1.0;
    case TR_KIND_KINK: return tr_slides(s, i) ? least < -TOL_KINK * kink : most > TOL_KINK * kink;
  }
  if (tr_flag(tr_mode_of(s, i)) == TR_CONE) return least < most && most > -CONE_SWING * (most - least);
  if (!tr_is_stuck(s, i)) {
    if (tr_pair_of(s, i)->nrates > 1 || !(least < most)) return most > 1.0;
    return most > -(tr_turns_inside(s, i) ? TURN_DIP : DIP) * (most - least);
  }
  double swing = least < most ? SWING * fmin(most - least, 1.0 / TOL_RELEASE) : 0.0;
  return most + swing > -NEAR_RELEASE / TOL_RELEASE;
}

/* Follow the top of the margins near the middle one of three dense points x (values f, the middle one no less than the parabola's slope
 * demands) until it is positive (1: x[1], f[1] are that point, which[0] what it is of) or sure to stay below (0). */
static int tr_top_above(tr_sim *s, double *x, double *f, int *which) {
  for (int it = 0; it < TOP_STEPS; ++it) {
    double p = (x[1] - x[0]) * (f[1] - f[2]), q = (x[1] - x[2]) * (f[1] - f[0]);
    double top = x[1] - 0.5 * ((x[1] - x[0]) * p - (x[1] - x[2]) * q) / (p - q);
    if (!(top > x[0] && top < x[2]) || fabs(top - x[1]) < TOP_NEAR) return 0;
    int w = *which, right = top > x[1];
    double v = tr_probe(s, top, &w);
    if (!(v == v)) return 0;
    if (v > 0.0) {
      x[1] = top, f[1] = v, *which = w;
      return 1;
    }
    if (fabs(v - f[1]) < TOP_SURE * fabs(v)) return 0;
    if (v > f[1]) x[right ? 0 : 2] = x[1], f[right ? 0 : 2] = f[1], x[1] = top, f[1] = v;
    else x[right ? 2 : 0] = top, f[right ? 2 : 0] = v;
  }
  return 0;
}

/* Whether what ends in the step just made may be a branch of a ball's friction that folds away: then the multipliers of its end are on the other
 * one, and inside the step they are followed from its start. Not where another ball is near its cone as well: of their four roots the one that
 * is followed ends where friction grows without bound. */
static int tr_may_fold(const tr_sim *s, int which) {
  if (!(s->step.margin_end > 0.0) || which >= s->k->nsliders || !tr_slides_on_cone(s, which)) return 0;
  for (int i = 0; i < s->k->nsliders; ++i)
    if (i != which && tr_pair_of(s, i)->cone && tr_slides(s, i) && fabs(tr_sliding_of(s, i)->cone) < BY_CONE) return 0;
  return 1;
}

enum { TR_BY_STOP = 2 }; /* a step is looked at closely for a stop that may be reached inside it */

/* The first event in a step that is looked at on its dense output; `closely`: at all points and between them, else only at its end, where
 * *which is the worst. */
static int tr_look_inside(tr_sim *s, int closely, int *which, double *theta) {
  const int nz = tr_nz(s);
  double x[SAMPLES + 1], g[SAMPLES + 1], followed[nz + 1], *near = tr_may_fold(s, *which) ? followed : 0;
  const int samples = tr_samples(s);
  int held = closely && (s->k->sets || closely == TR_BY_STOP), first = closely ? !held : samples, last = *which;
  tr_copy(nz, TR_A(s, zstart), followed), tr_copy(nz, TR_A(s, zend), TR_A(s, zbeyond));
  for (int q = first; q <= samples; ++q) {
    int w = *which;
    x[q] = q / (double)samples, g[q] = tr_sample(s, q, last, near, &w);
    if (near && q > 0 && q < samples && g[q] <= 0.0) tr_copy(nz, TR_A(s, z), near);
    if (g[q] != g[q]) return TR_TOO_LARGE;
    if (q == 0) { /* what has just been decided is no event */
      g[0] = fmin(g[0], 0.0);
      continue;
    }
    double a = q > first ? x[q - 1] : 0.0, ga = q > first ? g[q - 1] : -1.0, b = x[q], gb = g[q];
    if (held && q > 1 && g[q - 1] - g[q - 2] > g[q] - g[q - 1]) {
      double xx[3] = {x[q - 2], x[q - 1], x[q]}, f[3] = {g[q - 2], g[q - 1], g[q]};
      int t = *which;
      if (tr_top_above(s, xx, f, &t)) a = xx[0], b = xx[1], ga = f[0], gb = f[1], w = t;
    }
    if (gb > 0.0) {
      *which = w;
      *theta = tr_first_root(s, a, b, ga, gb, near, which);
      return tr_event_at(s, *theta, which);
    }
  }
  tr_copy(tr_nz(s), TR_A(s, zend), TR_A(s, z)); /* what follows looks at the end again */
  return !closely || tr_rhs(s, s->step.t0 + s->step.size, TR_A(s, ynew), TR_A(s, dy)) ? TR_NO_EVENT : TR_TOO_LARGE;
}

/* Look for the first event in the step just made (end state evaluated in ynew, K[end]): what, and at which θ. */
static int tr_find_event(tr_sim *s, int *which, double *theta) {
  int suspect = 0;
  if (tr_watched(s) == 0 || !s->set.locate) return TR_NO_EVENT;
  s->step.margin_end = tr_beyond(s, TR_A(s, ynew), which);
  tr_note_far(s, TR_NOW, TR_AT_END);
  for (int i = 0; i < s->k->nsliders; ++i) suspect |= tr_suspect(s, i);
  if (s->k->nstops && !suspect && !(s->step.margin_end > 0.0)) suspect = tr_stop_inside(s) ? TR_BY_STOP : 0;
  if (!(s->step.margin_end > 0.0) && !suspect) return TR_NO_EVENT;
  if (!tr_have_dense(s)) return TR_TOO_LARGE;
  return tr_look_inside(s, suspect, which, theta);
}
