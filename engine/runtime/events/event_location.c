/* Location of the first event inside a step: the first place where a pair or stop leaves its mode (theory, "Events").
 *
 * The stages and the end of the step are already evaluated. The dense output is searched if one of these states violates a mode, or
 * if a violation between these states is possible. A stuck pair can be released and caught again within a step. The maxima of its
 * violation between points are therefore located by parabolas, also near the ends. */
#include "events/events.h"

#define ROOT_STEPS_BOUNDED 4
#define CLOSE_ROOT 1e6     /* violation that a bounded step accepts, in tolerances: 1e-7 of the speed unit, 1e-4 of a capacity */
/* replaces CLOSE_ROOT for a pair of several components, whose speed at this violation is below NEAR_MISS */
#define CLOSE_STOP 500.0
/* largest number of iterations on θ: up to SECANT_STEPS by interpolation, then by halvings, which always converge */
#define ROOT_STEPS 80
#define SECANT_STEPS 40
/* number of halvings after which a point next to the step's start is tried; the violation may already be positive there */
#define START_HALVES 2
/* relative to the tolerance: if `a` is within a tolerance of the root, the next point lies this far beyond the expected root */
#define JUST_BEYOND 0.01
#define ROOT_ROUND_OFF 1e-14 /* round-off of θ */
#define DIP 0.05 /* relative to the variation of a sliding speed over the stages: possible drop of the speed between stages */
#define TURN_DIP 0.5    /* replaces DIP between distant stages, if the speed has a minimum inside the step */
/* relative to the variation of a stuck pair's violation over the stages: possible further rise between stages. (The distance
 * between two stages is at most a quarter of the period of the fastest load.) */
#define SWING 0.5
/* replaces SWING for a spinning ball, whose axis at low speed turns within part of a step */
#define CONE_SWING 2.0
#define NEAR_RELEASE 0.05 /* relative to the friction ratio: if a stage is closer to release, the step may contain an event */

/* An approximate root of the violation in [a, b], found with the few evaluations that a bounded step allows. The result may lie on
 * either side of the exact root. */
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

/* The bracket of a root, as fractions of the step. f: violation, minus 1, of the pair or stop with the largest violation at b. The
 * search interpolates f. The search uses only the sign of the largest of all violations, because the largest of several functions
 * has kinks. */
typedef struct tr_root_search {
  double a, b;        /* no violation is positive at a; a violation is positive at b */
  double ga, gb;      /* largest violation, minus 1, at a and b */
  double fa, fb;      /* f at a and b */
  double left, f_left; /* former end that the newest end replaced, and f there; NaN: unknown */
  int at_b;           /* whether b is the newest end */
  const double *at_a; /* violations, minus 1, of all pairs and stops at a; null pointer: unknown */
  double *near;       /* multipliers at a, which are followed to the root; null pointer: not followed */
} tr_root_search;

/* The next point of a search, after `it` points, by inverse quadratic interpolation through both ends and the replaced end. Where
 * Chandrupatla's criterion does not guarantee progress, the next point is the middle of the bracket. least: smallest width of the
 * bracket. */
static double tr_next_root_point(const tr_root_search *r, int it, double least) {
  const double half = 0.5 * (r->a + r->b), aim = r->fa > -1.0 ? JUST_BEYOND : 0.0;
  const double x1 = r->at_b ? r->b : r->a, x2 = r->at_b ? r->a : r->b, x3 = r->left;
  const double f1 = (r->at_b ? r->fb : r->fa) - aim, f2 = (r->at_b ? r->fa : r->fb) - aim, f3 = r->f_left - aim;
  if (!(r->fa < 0.0)) return it == START_HALVES ? r->a + least : half; /* f is probably positive at a: no root inside */
  double part = f1 / (f1 - f2);
  if (f3 == f3) {
    const double width = (x1 - x2) / (x3 - x2), rise = (f1 - f2) / (f3 - f2);
    if (it >= SECANT_STEPS || !(1.0 - sqrt(1.0 - width) < rise && rise < sqrt(width))) return half;
    part = part * f3 / (f3 - f2) - (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f2 - f3);
  }
  const double m = x1 + part * (x2 - x1); /* interpolation to f = `aim`: a point slightly beyond the root ends the search */
  return m > r->a && m < r->b ? m : half;
}

/* First θ in (a, b] where the violation, minus 1, of a pair or stop is positive. *which: the expected pair or stop before the call,
 * and the pair or stop found after the call. Returns NaN if the solution itself ends at this place. */
static double tr_find_first_root(tr_sim *s, tr_root_search r, int *which) {
  const int nz = tr_z_length(s), watched = tr_watched_count(s);
  const double least = fmax(ROOT_ROUND_OFF, TIME_ROUND_OFF * fabs(s->step.t0) / s->step.size);
  double own[watched + 1];
  if (s->bound.evaluations) return tr_find_root_bounded(s, r.a, r.b, r.ga, r.gb, which);
  for (int i = 0; i < watched; ++i) own[i] = r.at_a ? r.at_a[i] : NAN;
  r.fa = own[*which] < 0.0 ? own[*which] : r.ga, r.fb = r.gb, r.f_left = NAN;
  for (int it = 0; it < ROOT_STEPS && r.b - r.a > least; ++it) {
    const double m = tr_next_root_point(&r, it, least);
    int w = *which;
    const double g = tr_violation_at_from(s, m, r.near, &w);
    r.at_b = !(g <= 0.0);
    if (r.at_b) {
      r.left = r.b, r.f_left = w == *which ? r.fb : NAN;
      if (w != *which) r.fa = own[w] < 0.0 ? own[w] : r.ga;
      r.b = m, r.gb = r.fb = g, *which = w;
      if (g < 1.0) break; /* the violation at m is below two tolerances */
    } else {
      for (int i = 0; i < watched; ++i) own[i] = tr_violations_at(s, TR_NOW)[i] - 1.0;
      r.left = r.a, r.f_left = r.fa;
      r.a = m, r.ga = g, r.fa = own[*which];
      if (r.near) tr_copy(nz, TR_A(s, z), r.near);
    }
  }
  for (int i = 0; i < nz && r.near; ++i) /* interpolated multipliers must lie on the branch that ends at the root */
    TR_A(s, zend)[i] = TR_A(s, zstart)[i] + (r.near[i] - TR_A(s, zstart)[i]) / r.b;
  return r.gb == r.gb ? r.b : NAN;
}

/* Whether the violation at θ is an event (TR_FOUND), or whether the step is too large (TR_TOO_LARGE). The step is too large if a
 * pair of several components turned fast or nearly stopped. In such a step, the friction of this pair carries other pairs beyond
 * the limits of their modes. *which may become the pair that stops first. */
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
    /* For a pair on a line, speed perpendicular to the line is an error of open loops. */
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

/* Whether the speed of pair i (one component) falls at the start of the last step and rises at its end. Returns 1 also if the
 * pair's rate is not in the state. */
static int tr_has_speed_minimum(const tr_sim *s, int i) {
  int v0 = tr_pair_of(s, i)->v0, n = tr_state_width(s);
  const double *start = TR_A(s, K) + s->k->nq, *end = start + tr_method_of(s)->end * n, side = tr_mode_of(s, i)->direction[0];
  return v0 < 0 || (start[v0] * side < 0.0 && end[v0] * side > 0.0);
}

static int tr_is_suspect(const tr_sim *s, int i) {
  double most = TR_A(s, smax)[i], least = TR_A(s, smin)[i], kink = tr_sliding_of(s, i)->border;
  switch (tr_kind_of(s, i)) {
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
  /* if a host lifts a brake for a short time, the friction ratio has a sharp peak */
  if (swing > 0.0 && tr_has_input_turn(s, s->step.t0, s->step.t0 + s->step.size)) return 1;
  return most + swing > -NEAR_RELEASE / TOL_RELEASE;
}

/* Whether a ball's branch of friction may end in the last step (a fold). The multipliers at the end then belong to another branch,
 * so roots inside the step are followed from its start. Returns 0 if a second ball is near its cone: there may then
 * be four roots, and friction of the followed root can grow without bound. */
static int tr_is_fold_possible(const tr_sim *s, int which) {
  if (!(s->step.margin_end > 0.0) || which >= s->k->nsliders || !tr_is_sliding_ball(s, which)) return 0;
  for (int i = 0; i < s->k->nsliders; ++i)
    if (i != which && tr_pair_of(s, i)->cone && tr_is_sliding(s, i) && fabs(tr_sliding_of(s, i)->cone) < BY_CONE) return 0;
  return 1;
}

/* The bracket of the first root up to point q, from maxima between points q − 2 and q, and from point q itself. Each violation is
 * searched by itself, because the largest of all has kinks, where a parabola finds no maximum. */
static tr_bracket tr_bracket_first_root(tr_sim *s, const tr_samples *at, int q, int first, int worst) {
  tr_bracket b = {.left = {q > first ? at->x[q - 1] : 0.0, NAN, q > first ? at->all[q - 1] : -1.0}, .right = {NAN, NAN, NAN}, .which = worst};
  if (at->all[q] > 0.0) b.right = (tr_point){at->x[q], NAN, at->all[q]};
  b.begin = b.left;
  if (!at->between || q < 1 || (q == 1 && !(at->all[1] > 0.0))) return b;
  tr_bracket before = b;
  if (q > 1) before.begin = before.left = (tr_point){at->x[q - 2], NAN, at->all[q - 2]};
  for (int i = 0; i < tr_sample_width(s); ++i) {
    const int index = i < at->watched ? i : i - at->watched;
    if (at->suspect[index] && (i < at->watched || at->suspect[index] == TR_BY_SIDES)) tr_search_item(s, at, i, q, &before);
  }
  for (int i = 0; i < s->k->nsliders && q > 1 && !s->bound.evaluations; ++i)
    if (at->suspect[i] && tr_is_stuck(s, i)) tr_search_dips(s, at, i, q, &before);
  return before.right.x < at->x[q] ? before : b;
}

static int tr_search_step(tr_sim *s, const char *suspect, int *which, double *theta) {
  const int nz = tr_z_length(s), samples = tr_sample_count(s), last = *which;
  double x[TR_SAMPLES + 1], g[TR_SAMPLES + 1], own[(TR_SAMPLES + 1) * tr_sample_width(s)], followed[nz + 1];
  double reserve[(TR_SAMPLES + 1) * s->k->nsliders + 1];
  double *near = tr_is_fold_possible(s, *which) ? followed : 0;
  tr_samples at = {suspect, tr_watched_count(s), 0, 0, x, g, own, reserve};
  for (int i = 0; suspect && i < at.watched; ++i) {
    at.between |= suspect[i] && (s->k->sets || i >= s->k->nsliders), at.sided |= suspect[i] == TR_BY_SIDES;
  }
  const int first = !suspect ? samples : !at.between;
  tr_copy(nz, TR_A(s, zstart), followed), tr_copy(nz, TR_A(s, zend), TR_A(s, zbeyond));
  for (int q = first; q <= samples; ++q) {
    int w = *which;
    const double found = tr_store_sample(s, &at, q, last, near, &w);
    if (near && q > 0 && q < samples && found <= 0.0) tr_copy(nz, TR_A(s, z), near);
    if (found != found) return TR_TOO_LARGE;
    if (q == 0) continue;
    const tr_bracket b = tr_bracket_first_root(s, &at, q, first, w);
    if (b.right.all > 0.0) {
      *which = b.which;
      const double *at_left = q > first && b.left.x == x[q - 1] && !at.sided ? own + (q - 1) * tr_sample_width(s) : 0;
      const tr_root_search bracket = {.a = b.left.x, .b = b.right.x, .ga = b.left.all, .gb = b.right.all, .at_a = at_left, .near = near};
      *theta = tr_find_first_root(s, bracket, which);
      return tr_classify_event(s, *theta, which);
    }
  }
  tr_copy(tr_z_length(s), TR_A(s, zend), TR_A(s, z)); /* callers need the solution at the end of the step */
  TR_MADE(s, TR_HAS_SOLUTION);
  return !suspect || tr_rhs(s, s->step.t0 + s->step.size, TR_A(s, ynew), TR_A(s, dy)) ? TR_NO_EVENT : TR_TOO_LARGE;
}

/* Whether the friction ratio of pair i, which is stuck, varies by more than round-off over the stages. */
static int tr_has_varying_load(const tr_sim *s, int i) {
  const double varies = ROUND_OFF_FRICTION / TOL_RELEASE;
  return tr_is_set_valued(s, i) && tr_is_stuck(s, i) && tr_pair_of(s, i)->neta == 1 && TR_A(s, smin)[i] + varies < TR_A(s, smax)[i];
}

static int tr_mark_suspect_pairs(tr_sim *s, char *suspect) {
  const int pairs = s->k->nsliders;
  double opposite[pairs + 1];
  int any = 0, varies = 0;
  for (int i = 0; i < pairs; ++i) {
    any |= suspect[i] = tr_is_suspect(s, i);
    varies |= tr_has_varying_load(s, i);
  }
  any |= tr_mark_dips(s, suspect);
  if (!varies) return any;
  tr_evaluate_opposite_capacities(s, opposite);
  for (int i = 0; i < pairs; ++i) {
    const double capacity = fmax(tr_hold_of(s, i)->capacity, NO_FORCE);
    if (tr_has_varying_load(s, i) && fabs(opposite[i] - capacity) > ROUND_OFF_FRICTION * capacity) any = suspect[i] = TR_BY_SIDES;
  }
  return any;
}

static int tr_find_event(tr_sim *s, int *which, double *theta) {
  char suspect[tr_watched_count(s) + 1];
  if (tr_watched_count(s) == 0 || !s->set.locate) return TR_NO_EVENT;
  s->step.margin_end = tr_worst_violation(s, TR_A(s, ynew), which);
  tr_copy_violations(s, TR_NOW, TR_AT_END);
  int any = tr_mark_suspect_pairs(s, suspect);
  if (s->k->nstops) any |= tr_mark_stops_with_events_inside(s, suspect + s->k->nsliders);
  if (s->k->nunilateral) any |= tr_mark_pulls_inside(s, suspect + s->k->nsliders);
  if (!(s->step.margin_end > 0.0) && !any) return TR_NO_EVENT;
  if (!tr_ensure_dense(s)) return TR_TOO_LARGE;
  return tr_search_step(s, any ? suspect : 0, which, theta);
}
