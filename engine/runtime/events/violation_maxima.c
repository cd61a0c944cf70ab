/* Violations on the dense output of the last step, and their maxima between its points. */
#include "events/events.h"

#define SAMPLES 8       /* dense points at which a suspect step is evaluated */
#define SAMPLES_BOUNDED 4 /* the same number for a bounded step, and its iterations on θ */
#define TOP_STEPS 12    /* parabola steps towards one maximum; each raises the order of the error */
#define TOP_NEAR 1e-9   /* × the step: a maximum this close to an evaluated point is that point */
#define TOP_SURE 0.01   /* × its distance from release: a maximum that changes by less per iteration stays below release */
#define EDGE 1e-3       /* × the spacing of the points: distance from an end of the step at which the slope there is measured */

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

/* A point of the dense output: its place, the violation of one pair or stop there, and the largest violation of all. */
typedef struct tr_point {
  double x, own, all;
} tr_point;

/* Violations at the dense points of a step. A freewheel has one for each direction: in terms of the friction of one direction, they
 * are smooth where the load changes its sign. */
typedef struct tr_samples {
  const char *suspect; /* TR_SUSPECT, TR_BY_SIDES or 0 for each pair and stop */
  int watched, sided;  /* pairs and stops; whether any pair is searched by sides */
  double *x, *all;     /* per point: place, largest violation */
  double *own;         /* per point: violations of pairs and stops, then those of pairs in the other direction; all less 1 */
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

/* Violations less 1 of pair i, at rest, by its friction forward (*forth) and backward (*back). opposite: its capacity against the
 * present friction. */
static void tr_violations_by_sides(const tr_sim *s, int i, double opposite, double *forth, double *back) {
  const double with = tr_friction_ratio(s, i), against = -tr_hold_of(s, i)->size / opposite;
  const int forward = TR_A(s, z)[s->k->active + tr_pair_of(s, i)->eta0] > 0.0;
  *forth = ((forward ? with : against) - 1.0) / TOL_RELEASE - 1.0;
  *back = ((forward ? against : with) - 1.0) / TOL_RELEASE - 1.0;
}

/* Write all violations, less 1, to `own`. from: the violations as they are stored; sided: the current state has its own by sides. */
static void tr_list_violations(tr_sim *s, const tr_samples *at, const double *from, int sided, double *own) {
  double opposite[s->k->nsliders + 1];
  if (sided) tr_evaluate_opposite_capacities(s, opposite);
  for (int i = 0; i < at->watched; ++i) {
    if (i < s->k->nsliders) own[at->watched + i] = NAN;
    if (sided && at->suspect[i] == TR_BY_SIDES) tr_violations_by_sides(s, i, opposite[i], own + i, own + at->watched + i);
    else own[i] = from[i] - 1.0;
  }
}

/* Evaluate and store point q. Returns its largest violation less 1, with the worst pair or stop in *worst. At the start, modes were
 * decided, so there is no event. last: worst pair or stop at the end. from: as in tr_violation_at_from. */
static double tr_store_sample(tr_sim *s, const tr_samples *at, int q, int last, const double *from, int *worst) {
  const int end = q == tr_sample_count(s), known = end || (q == 0 && s->step.margin == s->step.margin);
  double all, *own = at->own + q * tr_sample_width(s);
  int w = *worst;
  at->x[q] = q / (double)tr_sample_count(s);
  if (!known || at->sided) all = tr_violation_at_from(s, at->x[q], from, &w);
  if (known) all = end ? s->step.margin_end : s->step.margin, w = end ? last : *worst;
  *worst = w;
  tr_list_violations(s, at, tr_violations_at(s, !known ? TR_NOW : end ? TR_AT_END : TR_AT_START), at->sided, own);
  for (int i = 0; q == 0 && i < tr_sample_width(s); ++i) own[i] = known && !at->sided && !s->step.far_known ? NAN : own[i] < 0.0 ? own[i] : 0.0;
  return at->all[q] = q == 0 ? fmin(all, 0.0) : all;
}

/* Evaluate a point of item i, which is the violation of a pair or stop, or of a pair in the other direction. */
static tr_point tr_point_at(tr_sim *s, const tr_samples *at, int i, double x, int *worst) {
  double own[tr_sample_width(s) + 1];
  tr_point p = {.x = x, .all = tr_violation_at(s, x, worst)};
  tr_list_violations(s, at, tr_violations_at(s, TR_NOW), at->sided && p.all == p.all, own);
  p.own = own[i];
  return p;
}

/* Place of the maximum of the parabola through the own violations of three points. */
static double tr_parabola_top(const tr_point *p) {
  const double l = (p[1].x - p[0].x) * (p[1].own - p[2].own), r = (p[1].x - p[2].x) * (p[1].own - p[0].own);
  return p[1].x - 0.5 * ((p[1].x - p[0].x) * l - (p[1].x - p[2].x) * r) / (l - r);
}

/* Locate the maximum of item i near the middle of three points p. Returns 1 if any violation is positive at a point evaluated; p[1]
 * and *which then describe that point, and no violation is positive at p[0]. */
static int tr_find_maximum(tr_sim *s, const tr_samples *at, int i, tr_point *p, int *which) {
  for (int it = 0; it < TOP_STEPS; ++it) {
    const double top = tr_parabola_top(p);
    if (!(top > p[0].x && top < p[2].x) || fabs(top - p[1].x) < TOP_NEAR) return 0;
    const int right = top > p[1].x;
    int w = *which;
    const tr_point found = tr_point_at(s, at, i, top, &w);
    if (!(found.all == found.all)) return 0;
    if (found.all > 0.0) {
      if (right) p[0] = p[1];
      p[1] = found, *which = w;
      return 1;
    }
    if (fabs(found.own - p[1].own) < TOP_SURE * fabs(found.own)) return 0;
    if (found.own > p[1].own) p[right ? 0 : 2] = p[1], p[1] = found;
    else p[right ? 2 : 0] = found;
  }
  return 0;
}

/* As tr_find_maximum, for a maximum between the end of the step (`end`: p[2], otherwise p[0]) and the point beside it. Near the end
 * the parabola through equidistant points may miss it; the slope at the end shows it. */
static int tr_find_maximum_at_end(tr_sim *s, const tr_samples *at, int i, int end, tr_point *p, int *which) {
  const tr_point outer = p[end ? 2 : 0], inner = p[1];
  int w = *which;
  const tr_point edge = tr_point_at(s, at, i, outer.x + EDGE * (inner.x - outer.x), &w);
  if (!(edge.all > 0.0) && !(edge.own > outer.own)) return 0;
  p[0] = end ? inner : outer, p[1] = edge, p[2] = end ? outer : inner;
  if (!(edge.all > 0.0)) return tr_find_maximum(s, at, i, p, which);
  *which = w;
  return 1;
}

/* Whether item i is positive at a maximum between three equidistant points. The parabola through them may be wrong by as much as it
 * changes. */
static int tr_has_maximum(tr_sim *s, const tr_samples *at, int i, int q, tr_point *p, int *which) {
  const int width = tr_sample_width(s);
  for (int j = 0; j < 3; ++j) p[j] = (tr_point){at->x[q - 2 + j], at->own[(q - 2 + j) * width + i], at->all[q - 2 + j]};
  const double bend = 2.0 * p[1].own - p[0].own - p[2].own, from_middle = 0.5 * (p[2].own - p[0].own) / bend;
  if (!(bend > 0.0)) return 0;
  const tr_point kept[3] = {p[0], p[1], p[2]};
  const double top = p[1].own + 0.5 * bend * from_middle * from_middle;
  if (fabs(from_middle) < 1.0 && top + (top - fmin(p[0].own, p[2].own)) > 0.0 && tr_find_maximum(s, at, i, p, which)) return 1;
  for (int end = 0; end < 2; ++end) {
    const double outer = kept[end ? 2 : 0].own;
    memcpy(p, kept, sizeof kept);
    if (q != (end ? tr_sample_count(s) : 2) || outer < kept[1].own || !(outer + bend > 0.0)) continue;
    if (tr_find_maximum_at_end(s, at, i, end, p, which)) return 1;
  }
  return 0;
}

/* Whether a violation is positive at a maximum of its own between points q - 2 and q. Their largest value has kinks, where no
 * parabola finds its maximum; each is therefore searched alone. Of several maxima, the first counts; p[0], p[1] then bracket its
 * root. */
static int tr_find_maximum_between(tr_sim *s, const tr_samples *at, int q, tr_point *p, int *which) {
  int any = 0;
  for (int i = 0; i < tr_sample_width(s); ++i) {
    const int index = i < at->watched ? i : i - at->watched;
    tr_point own[3];
    int w = index;
    if (!at->suspect[index] || (i >= at->watched && at->suspect[index] != TR_BY_SIDES)) continue;
    if (!tr_has_maximum(s, at, i, q, own, &w) || (any && own[1].x >= p[1].x)) continue;
    any = 1, *which = w, memcpy(p, own, sizeof own);
  }
  return any;
}
