/* Locate the first event inside a step: the first place where a pair or stop leaves its mode (theory, "Events").
 *
 * All stages and the end of the step were evaluated. The dense output is searched in two cases: one of these states violates a
 * mode, or a violation between them is possible. A stuck pair can be released and caught again within a step. Parabolas
 * therefore locate the maxima of its violation between points, also near the ends. */
#include "events/events.h"

#define SAMPLES 8       /* dense points at which a suspect step is evaluated */
#define SAMPLES_BOUNDED 4 /* the same number for a bounded step, and its iterations on θ */
#define ROOT_STEPS_BOUNDED 4
#define CLOSE_ROOT 1e6     /* violation accepted by a bounded step, in tolerances: 1e-7 of the speed unit, 1e-4 of a capacity */
#define CLOSE_STOP 500.0   /* the same for a pair of several components: a speed below NEAR_MISS */
#define ROOT_STEPS 80     /* iterations on θ; secants up to SECANT_STEPS, then halvings, which always converge */
#define SECANT_STEPS 60
#define ROOT_ROUND_OFF 1e-14 /* round-off of θ */
#define TOP_STEPS 12    /* parabola steps towards one maximum; each raises the order of the error */
#define TOP_NEAR 1e-9   /* × the step: a maximum this close to an evaluated point is that point */
#define TOP_SURE 0.01   /* × its distance from release: a maximum that changes by less per iteration stays below release */
#define DIP 0.05        /* × variation of a sliding speed over the stages: how far the speed may dip to rest between stages */
#define TURN_DIP 0.5    /* × that variation, for a speed with a minimum inside the step; stages are up to half a step apart */
#define BY_CONE 0.25    /* × s²/|ω|²: a ball closer to its cone may have several roots */
#define SWING 0.5       /* × variation of a violation over the stages: how far it may rise between stages, a quarter period apart */
#define CONE_SWING 2.0  /* × that variation for a spinning ball; at low speed its axis can turn within part of a step */
#define NEAR_RELEASE 0.05 /* × the friction ratio: a stage closer to release makes the step suspect */

static double tr_worst_violation(tr_sim *s, const double *y, int *worst) {
  double depth[s->k->nstops + 1], best = -INFINITY;
  tr_stop_depths(s, y, depth);
  if (s->friction.held) tr_evaluate_capacities_at_solution(s);
  for (int i = 0; i < tr_watched_count(s); ++i) {
    const double v = tr_violations_at(s, TR_NOW)[i] = tr_mode_violation(s, i, depth);
    if (v > best) best = v, *worst = i;
  }
  return best - 1.0;
}

/* tr_worst_violation at a point of the dense output. from: initial multipliers of Newton's method; 0: interpolated between the
 * ends of the step. NaN: no solution. */
static double tr_violation_at_from(tr_sim *s, double theta, const double *from, int *worst) {
  double *y = TR_A(s, yout);
  tr_dense_state(s, theta, y);
  if (from) tr_copy(s->k->active + s->k->neta, from, TR_A(s, z));
  if (s->k->nquat) tr_normalise_quaternions(s, y);
  const double t = s->step.t0 + theta * s->step.size;
  return tr_request_violations(s, t, y) || tr_rhs(s, t, y, TR_A(s, dy)) ? tr_worst_violation(s, y, worst) : NAN;
}

static double tr_violation_at(tr_sim *s, double theta, int *worst) { return tr_violation_at_from(s, theta, 0, worst); }

static inline int tr_sample_count(const tr_sim *s) { return s->bound.evaluations ? SAMPLES_BOUNDED : SAMPLES; }

/* The violation at dense point q. At both ends it is already known. last: worst pair at the end of the step. */
static double tr_violation_at_sample(tr_sim *s, int q, int last, const double *from, int *worst) {
  const int samples = tr_sample_count(s);
  if (q == 0 && s->step.margin == s->step.margin) return s->step.margin;
  if (q < samples) return tr_violation_at_from(s, q / (double)samples, from, worst);
  *worst = last;
  return s->step.margin_end;
}

/* An approximate root of the violation in [a, b], on either side of the exact root, with the few evaluations that a bounded
 * step allows. */
static double tr_find_root_bounded(tr_sim *s, double a, double b, double ga, double gb, int *which) {
  double m = b;
  int side = 0;
  if (a == 0.0 && s->step.margin < ga) ga = s->step.margin;
  for (int it = 0; it < ROOT_STEPS_BOUNDED; ++it) {
    int w = *which;
    m = (a * gb - b * ga) / (gb - ga);
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    const double g = tr_violation_at(s, m, &w);
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

/* First θ in (a, b] with a positive violation, given ga ≤ 0 < gb, by a safeguarded secant (Illinois). near: multipliers at a,
 * followed to the root; 0: they are not followed. NaN: the solution itself ends there. */
static double tr_find_first_root(tr_sim *s, double a, double b, double ga, double gb, double *near, int *which) {
  const int nz = tr_z_length(s);
  int side = 0;
  if (s->bound.evaluations) return tr_find_root_bounded(s, a, b, ga, gb, which);
  for (int it = 0; it < ROOT_STEPS && b - a > ROOT_ROUND_OFF; ++it) {
    double m = (ga < 0.0 && it < SECANT_STEPS) ? (a * gb - b * ga) / (gb - ga) : 0.5 * (a + b);
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    int w = *which;
    double g = tr_violation_at_from(s, m, near, &w);
    if (!(g <= 0.0)) {
      b = m, gb = g, *which = w;
      if (side == 1) ga *= 0.5;
      side = 1;
      if (g < 1.0) break; /* less than twice the tolerance beyond the root */
    } else {
      a = m, ga = g;
      if (near) tr_copy(nz, TR_A(s, z), near);
      if (side == -1) gb *= 0.5;
      side = -1;
    }
  }
  if (near) { /* interpolated multipliers must lie on the branch that ends at the root */
    for (int i = 0; i < nz; ++i) TR_A(s, zend)[i] = TR_A(s, zstart)[i] + (near[i] - TR_A(s, zstart)[i]) / b;
  }
  return gb == gb ? b : NAN;
}

/* Whether the violation at θ is an event: TR_FOUND or TR_TOO_LARGE. A pair of several components that turned fast, or nearly
 * stopped, requires a smaller step. Other pairs then leave their modes only because of its friction. *which may become the pair
 * that stops first. */
static int tr_classify_event(tr_sim *s, double theta, int *which) {
  if (!(theta == theta)) return TR_TOO_LARGE;
  if (!s->k->sets) return TR_FOUND;
  if (tr_has_other_pair_turned(s, *which)) return TR_TOO_LARGE;
  int turned = -1;
  double *y = TR_A(s, yout), was[s->k->nsliders + 1], t = s->step.t0 + theta * s->step.size;
  tr_save_start_speeds(s, was);
  tr_evaluate_dense(s, theta, y);
  if (tr_is_spurious_turn(s, *which, theta, y)) return TR_TOO_LARGE;
  tr_evaluate_maps_at(s, t, y);
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_has_reversed(s, i) || (i != *which && tr_mode_flag(tr_mode_of(s, i)) == TR_CONE)) continue;
    /* Speed across a line comes from open loops. */
    if (tr_pair_speed(s, i) > tr_crawl_speed(tr_speed_unit(s)) && !tr_is_stopping_on_line(s, i, t, y)) {
      s->friction.cutting_pair = i;
      return TR_TOO_LARGE;
    }
    if (turned < 0 || i == *which) turned = i;
  }
  *which = turned >= 0 ? turned : tr_find_pair_stopping_first(s, *which, was, t, y);
  const int beside = turned < 0 && *which < s->k->nsliders ? tr_find_pair_stopping_beside(s, *which, was, t, y) : -1;
  if (beside >= 0) s->friction.cutting_pair = beside;
  return beside >= 0 ? TR_TOO_LARGE : TR_FOUND;
}

/* Whether the speed of pair i (one component) falls at the start of the last step and rises at its end. Also 1 if its rate is
 * not in the state. */
static int tr_has_speed_minimum(const tr_sim *s, int i) {
  int v0 = tr_pair_of(s, i)->v0, n = tr_state_width(s);
  const double *start = TR_A(s, K) + s->k->nq, *end = start + tr_method_of(s)->end * n, side = tr_mode_of(s, i)->direction[0];
  return v0 < 0 || (start[v0] * side < 0.0 && end[v0] * side > 0.0);
}

static int tr_is_suspect(const tr_sim *s, int i) {
  double most = TR_A(s, smax)[i], least = TR_A(s, smin)[i], kink = tr_sliding_of(s, i)->border;
  switch (tr_pair_of(s, i)->kind) {
    case TR_KIND_SMOOTH: return 0;
    case TR_KIND_TURN: return most > 1.0;
    case TR_KIND_KINK: return tr_is_sliding(s, i) ? least < -TOL_KINK * kink : most > TOL_KINK * kink;
  }
  if (tr_mode_flag(tr_mode_of(s, i)) == TR_CONE) return least < most && most > -CONE_SWING * (most - least);
  if (!tr_is_stuck(s, i)) {
    if (tr_pair_of(s, i)->nrates > 1 || !(least < most)) return most > 1.0;
    return most > -(tr_has_speed_minimum(s, i) ? TURN_DIP : DIP) * (most - least);
  }
  double swing = least < most ? SWING * fmin(most - least, 1.0 / TOL_RELEASE) : 0.0;
  return most + swing > -NEAR_RELEASE / TOL_RELEASE;
}

/* Locate the maximum of the violation f near the middle of three points x of the dense output. Returns 1 if it is positive;
 * then x[1], f[1] and *which describe that maximum. */
static int tr_find_maximum(tr_sim *s, double *x, double *f, int *which) {
  for (int it = 0; it < TOP_STEPS; ++it) {
    double p = (x[1] - x[0]) * (f[1] - f[2]), q = (x[1] - x[2]) * (f[1] - f[0]);
    double top = x[1] - 0.5 * ((x[1] - x[0]) * p - (x[1] - x[2]) * q) / (p - q);
    if (!(top > x[0] && top < x[2]) || fabs(top - x[1]) < TOP_NEAR) return 0;
    int w = *which, right = top > x[1];
    double v = tr_violation_at(s, top, &w);
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

/* Whether a ball's branch of friction may end in the last step (a fold). The end's multipliers then belong to another branch,
 * and roots inside are followed from the start. 0 if a second ball is near its cone: with four roots, the followed root can end
 * in unlimited friction. */
static int tr_is_fold_possible(const tr_sim *s, int which) {
  if (!(s->step.margin_end > 0.0) || which >= s->k->nsliders || !tr_is_sliding_ball(s, which)) return 0;
  for (int i = 0; i < s->k->nsliders; ++i)
    if (i != which && tr_pair_of(s, i)->cone && tr_is_sliding(s, i) && fabs(tr_sliding_of(s, i)->cone) < BY_CONE) return 0;
  return 1;
}

static int tr_search_step(tr_sim *s, int closely, int *which, double *theta) {
  const int nz = tr_z_length(s);
  double x[SAMPLES + 1], g[SAMPLES + 1], followed[nz + 1], *near = tr_is_fold_possible(s, *which) ? followed : 0;
  const int samples = tr_sample_count(s);
  int held = closely && (s->k->sets || closely == TR_BY_STOP), first = closely ? !held : samples, last = *which;
  tr_copy(nz, TR_A(s, zstart), followed), tr_copy(nz, TR_A(s, zend), TR_A(s, zbeyond));
  for (int q = first; q <= samples; ++q) {
    int w = *which;
    x[q] = q / (double)samples, g[q] = tr_violation_at_sample(s, q, last, near, &w);
    if (near && q > 0 && q < samples && g[q] <= 0.0) tr_copy(nz, TR_A(s, z), near);
    if (g[q] != g[q]) return TR_TOO_LARGE;
    if (q == 0) { /* the modes were decided at the start: no event there */
      g[0] = fmin(g[0], 0.0);
      continue;
    }
    double a = q > first ? x[q - 1] : 0.0, ga = q > first ? g[q - 1] : -1.0, b = x[q], gb = g[q];
    if (held && q > 1 && g[q - 1] - g[q - 2] > g[q] - g[q - 1]) {
      double xx[3] = {x[q - 2], x[q - 1], x[q]}, f[3] = {g[q - 2], g[q - 1], g[q]};
      int t = *which;
      if (tr_find_maximum(s, xx, f, &t)) a = xx[0], b = xx[1], ga = f[0], gb = f[1], w = t;
    }
    if (gb > 0.0) {
      *which = w;
      *theta = tr_find_first_root(s, a, b, ga, gb, near, which);
      return tr_classify_event(s, *theta, which);
    }
  }
  tr_copy(tr_z_length(s), TR_A(s, zend), TR_A(s, z)); /* callers need the solution at the end */
  TR_MADE(s, TR_HAS_SOLUTION);
  return !closely || tr_rhs(s, s->step.t0 + s->step.size, TR_A(s, ynew), TR_A(s, dy)) ? TR_NO_EVENT : TR_TOO_LARGE;
}

static int tr_find_event(tr_sim *s, int *which, double *theta) {
  int suspect = 0;
  if (tr_watched_count(s) == 0 || !s->set.locate) return TR_NO_EVENT;
  s->step.margin_end = tr_worst_violation(s, TR_A(s, ynew), which);
  tr_copy_violations(s, TR_NOW, TR_AT_END);
  for (int i = 0; i < s->k->nsliders; ++i) suspect |= tr_is_suspect(s, i);
  if (s->k->nstops && !suspect && !(s->step.margin_end > 0.0)) suspect = tr_has_stop_event_inside(s) ? TR_BY_STOP : 0;
  if (!(s->step.margin_end > 0.0) && !suspect) return TR_NO_EVENT;
  if (!tr_ensure_dense(s)) return TR_TOO_LARGE;
  return tr_search_step(s, suspect, which, theta);
}
