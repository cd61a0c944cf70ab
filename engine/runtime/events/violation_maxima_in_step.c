/* Violations on the dense output of the last step, and the maxima of violations between its points. */
#include "events/events.h"

#define SAMPLES_BOUNDED 4 /* number of points in a bounded step */
#define TOP_STEPS 12    /* largest number of parabola steps towards one maximum; each step raises the order of the error */
#define TOP_NEAR 1e-9   /* relative to the step: if a maximum is closer to an evaluated point, this point counts as the maximum */
#define EDGE 1e-3       /* relative to the spacing of the points: finite difference that gives the slope at an end of the step */

static double tr_worst_violation(tr_sim *s, const double *y, int *worst) {
  double depth[s->k->nstops + 1], best = -INFINITY;
  tr_stop_depths(s, y, depth);
  if (s->friction.held) tr_evaluate_capacities_at_solution(s);
  for (int i = 0; i < tr_watched_count(s); ++i) {
    const int counts = !s->step.only || (i < s->k->nsliders && s->step.only[i]);
    const double v = tr_violations_at(s, TR_NOW)[i] = counts ? tr_mode_violation(s, i, depth) : -INFINITY;
    if (v > best) best = v, *worst = i;
  }
  for (int i = 0; i < s->k->nsliders; ++i) tr_reserves_at(s, TR_NOW)[i] = tr_is_stuck(s, i) ? tr_reserve(s, i) : NAN;
  return best - 1.0;
}

/* Call tr_worst_violation at a point of the dense output. from: initial multipliers of Newton's method; null pointer: multipliers
 * interpolated between the ends of the step. Returns NaN if there is no solution. */
static double tr_violation_at_from(tr_sim *s, double theta, const double *from, int *worst) {
  double *y = TR_A(s, yout);
  tr_dense_state(s, theta, y);
  if (from) tr_copy(s->k->active + s->k->neta, from, TR_A(s, z));
  if (s->k->nquat) tr_normalise_quaternions(s, y);
  const double t = s->step.t0 + theta * s->step.size;
  return tr_rhs(s, t, y, TR_A(s, dy)) ? tr_worst_violation(s, y, worst) : NAN;
}

static double tr_violation_at(tr_sim *s, double theta, int *worst) { return tr_violation_at_from(s, theta, 0, worst); }

static inline int tr_sample_count(const tr_sim *s) { return s->bound.evaluations ? SAMPLES_BOUNDED : TR_SAMPLES; }

/* A point of the dense output: its place, the violation of one pair or stop, and the largest of all violations. */
typedef struct tr_point {
  double x, own, all;
} tr_point;

/* Violations at the dense points of a step. A freewheel has one violation for each direction. Where the load changes its sign, each
 * of these violations is smooth, but the larger one has a kink. */
typedef struct tr_samples {
  const char *suspect; /* TR_SUSPECT, TR_BY_SIDES or 0 for each pair and stop */
  int watched, between, sided; /* number of pairs and stops; whether to search between points; whether any pair has two sides */
  double *x, *all;     /* per point: place, and largest violation minus 1 */
  double *own;         /* per point: violations of pairs and stops, then of pairs in the other direction; all minus 1 */
  double *reserve;     /* per point: reserves of pairs at rest; NaN for other pairs */
} tr_samples;

static inline int tr_sample_width(const tr_sim *s) { return tr_watched_count(s) + s->k->nsliders; }

static void tr_evaluate_opposite_capacities(tr_sim *s, double *capacity) {
  TR_NEED(s, TR_HAS_CAPACITY);
  const tr_kernel *k = s->k;
  double eta[k->neta + 1];
  tr_hold hold[k->nsliders + 1];
  for (int e = 0; e < k->neta; ++e) eta[e] = -TR_A(s, z)[k->active + e];
  k->held_alone(TR_A(s, NN), eta, TR_A(s, x), TR_A(s, c) + k->c_held, (double *)hold);
  for (int i = 0; i < k->nsliders; ++i) capacity[i] = fmax(hold[i].capacity, NO_FORCE);
}

/* Violations of pair i at rest, minus 1: *forth for forward friction, *back for backward friction. opposite: capacity of the pair
 * against its present friction. */
static void tr_violations_by_sides(const tr_sim *s, int i, double opposite, double *forth, double *back) {
  const double with = tr_friction_ratio(s, i), against = -tr_hold_of(s, i)->size / opposite;
  const int forward = TR_A(s, z)[s->k->active + tr_pair_of(s, i)->eta0] > 0.0;
  *forth = ((forward ? with : against) - 1.0) / TOL_RELEASE - 1.0;
  *back = ((forward ? against : with) - 1.0) / TOL_RELEASE - 1.0;
}

/* Write the violations of all pairs and stops, minus 1, to `own`. from: the stored violations, from which 1 is not yet subtracted.
 * sided: whether pairs marked TR_BY_SIDES get a violation for each direction of friction, from the current state. */
static void tr_list_violations(tr_sim *s, const tr_samples *at, const double *from, int sided, double *own) {
  double opposite[s->k->nsliders + 1];
  if (sided) tr_evaluate_opposite_capacities(s, opposite);
  for (int i = 0; i < at->watched; ++i) {
    if (i < s->k->nsliders) own[at->watched + i] = NAN;
    if (sided && at->suspect[i] == TR_BY_SIDES) tr_violations_by_sides(s, i, opposite[i], own + i, own + at->watched + i);
    else own[i] = from[i] - 1.0;
  }
}

/* Evaluate and store point q. Returns its largest violation minus 1, with the worst pair or stop in *worst. Point 0, the start, has
 * no event, because the modes were decided for this point. last: worst pair or stop at the end. from: as in
 * tr_violation_at_from. */
static double tr_store_sample(tr_sim *s, const tr_samples *at, int q, int last, const double *from, int *worst) {
  const int end = q == tr_sample_count(s), known = end || (q == 0 && s->step.margin == s->step.margin);
  double all, *own = at->own + q * tr_sample_width(s);
  int w = *worst;
  at->x[q] = q / (double)tr_sample_count(s);
  if (!known || at->sided) all = tr_violation_at_from(s, at->x[q], from, &w);
  if (known) all = end ? s->step.margin_end : s->step.margin, w = end ? last : *worst;
  *worst = w;
  const int when = !known ? TR_NOW : end ? TR_AT_END : TR_AT_START;
  tr_list_violations(s, at, tr_violations_at(s, when), at->sided, own);
  for (int i = 0; i < s->k->nsliders; ++i) at->reserve[q * s->k->nsliders + i] = q == 0 && known && !s->step.far_known ? NAN : tr_reserves_at(s, when)[i];
  for (int i = 0; q == 0 && i < tr_sample_width(s); ++i) own[i] = known && !at->sided && !s->step.far_known ? NAN : own[i] < 0.0 ? own[i] : 0.0;
  return at->all[q] = q == 0 ? fmin(all, 0.0) : all;
}

/* Evaluate a point for item i. Items are the violations of pairs and stops, then the violations of pairs in the other direction. */
static tr_point tr_point_at(tr_sim *s, const tr_samples *at, int i, double x, int *worst) {
  double own[tr_sample_width(s) + 1];
  tr_point p = {.x = x, .all = tr_violation_at(s, x, worst)};
  tr_list_violations(s, at, tr_violations_at(s, TR_NOW), at->sided && p.all == p.all, own);
  p.own = own[i];
  return p;
}

/* Place of the maximum of the parabola through the values `own` of three points. */
static double tr_parabola_top(const tr_point *p) {
  const double l = (p[1].x - p[0].x) * (p[1].own - p[2].own), r = (p[1].x - p[2].x) * (p[1].own - p[0].own);
  return p[1].x - 0.5 * ((p[1].x - p[0].x) * l - (p[1].x - p[2].x) * r) / (l - r);
}

/* The bracket of a root. At `left`, no violation is positive; at `right`, a violation is positive. If x of `right` is NaN, no such
 * point was found. begin: the first point of the search. */
typedef struct tr_bracket {
  tr_point begin, left, right;
  int which; /* the worst pair or stop at `right` */
} tr_bracket;

/* Narrow the bracket by a point. A positive violation at this point may belong to another item than the one of the search. */
static void tr_narrow_bracket(tr_bracket *b, const tr_point *p, int worst) {
  if (p->all > 0.0 && !(p->x >= b->right.x)) b->right = *p, b->which = worst;
  if (b->left.x >= b->right.x) b->left = b->begin;
  if (p->all <= 0.0 && p->x > b->left.x && !(p->x >= b->right.x)) b->left = *p;
}

/* Locate the maximum of item i near the middle of the three points p. Every evaluated point narrows the bracket. */
static void tr_find_maximum(tr_sim *s, const tr_samples *at, int i, tr_point *p, tr_bracket *b) {
  for (int it = 0; it < TOP_STEPS; ++it) {
    const double top = tr_parabola_top(p);
    if (!(top > p[0].x && top < p[2].x) || fabs(top - p[1].x) < TOP_NEAR) return;
    int w = i < at->watched ? i : i - at->watched;
    const int right = top > p[1].x;
    const tr_point found = tr_point_at(s, at, i, top, &w);
    if (!(found.all == found.all)) return;
    tr_narrow_bracket(b, &found, w);
    if (found.own > 0.0 || fabs(found.own - p[1].own) < TOP_SURE * fabs(found.own)) return;
    if (found.own > p[1].own) p[right ? 0 : 2] = p[1], p[1] = found;
    else p[right ? 2 : 0] = found;
  }
}

/* Like tr_find_maximum, for a maximum between the points `outer` and `inner`. end: 1 if `outer` is the last point of the search, 0
 * if it is the first. A parabola through equidistant points may miss this maximum, but the slope at `outer` shows it. */
static void tr_find_maximum_at_end(tr_sim *s, const tr_samples *at, int i, int end, tr_point outer, tr_point inner, tr_bracket *b) {
  int w = i < at->watched ? i : i - at->watched;
  const tr_point edge = tr_point_at(s, at, i, outer.x + EDGE * (inner.x - outer.x), &w);
  tr_narrow_bracket(b, &edge, w);
  if (edge.own > 0.0 || !(edge.own > outer.own)) return;
  tr_point p[3] = {end ? inner : outer, edge, end ? outer : inner};
  tr_find_maximum(s, at, i, p, b);
}

static tr_point tr_sample_of(const tr_sim *s, const tr_samples *at, int i, int q) {
  return (tr_point){at->x[q], at->own[q * tr_sample_width(s) + i], at->all[q]};
}

/* If the violation of item i has a positive maximum between points q − 2 and q, narrow the bracket to this maximum. The parabola
 * through these points can miss the true maximum by as much as the parabola varies between them. A parabola that is slightly
 * negative is therefore searched, too. q = 1: the search ends at point 1, where the violation of another item is positive. */
static void tr_search_item(tr_sim *s, const tr_samples *at, int i, int q, tr_bracket *b) {
  tr_point p[3];
  if (q == 1) {
    const tr_point end = tr_sample_of(s, at, i, 1);
    if (end.own <= 0.0) tr_find_maximum_at_end(s, at, i, 1, end, tr_sample_of(s, at, i, 0), b);
    return;
  }
  for (int j = 0; j < 3; ++j) p[j] = tr_sample_of(s, at, i, q - 2 + j);
  const double bend = 2.0 * p[1].own - p[0].own - p[2].own, from_middle = 0.5 * (p[2].own - p[0].own) / bend;
  const double top = p[1].own + 0.5 * bend * from_middle * from_middle, first = p[0].own, middle = p[1].own, last = p[2].own;
  if (!(bend > 0.0)) return;
  const tr_point outer[2] = {p[0], p[2]}, inner = p[1];
  const int begins = q == 2 && first >= middle && first + bend > 0.0;
  const int ends = (q == tr_sample_count(s) || at->all[q] > 0.0) && last >= middle && last + bend > 0.0 && !(last > 0.0);
  if (fabs(from_middle) < 1.0 && top + (top - fmin(first, last)) > 0.0) tr_find_maximum(s, at, i, p, b);
  if (begins) tr_find_maximum_at_end(s, at, i, 0, outer[0], inner, b);
  if (ends) tr_find_maximum_at_end(s, at, i, 1, outer[1], inner, b);
}
