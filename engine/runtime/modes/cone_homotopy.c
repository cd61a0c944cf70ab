/* Path of solutions along which friction grows from zero to its full value (theory, "Many pairs"). The path is followed where
 * Newton's method fails or finds an unstable root. Continuation by arc length passes folds. A root at the end of the path must be
 * stable: its determinant has the same sign as without friction. */
#include "modes/modes.h"

#define GROWTH_FIRST 0.3   /* first step; an arc length of 1 corresponds to full friction */
#define GROWTH_LONGEST 0.5 /* longest step */
#define GROWTH_SHORT 1e-4  /* if the path turns sharply, the step is accepted only below this size */
#define GROWTH_LEAST 1e-8  /* if the step must become smaller, the path has a kink; a step of GROWTH_AFTER passes the kink */
#define GROWTH_AFTER 3e-4
#define GROWTH_STEPS 7     /* largest number of Newton iterations that correct a predicted point back to the path */
#define GROWTH_BACK 1e-4   /* relative to the step: a point whose last correction is smaller is on the path */
#define GROWTH_SHRINKS 0.5 /* relative to the previous correction: if a correction is larger, the step is shortened */
#define GROWTH_ASIDE 0.5   /* relative to the step: largest distance between the predicted and the corrected point */
#define GROWTH_TURNS 0.3   /* cosine of the largest turn of the tangent in one step */
#define GROWTH_KINKS 4     /* number of kinks at one place, after which the search fails */
#define CONES_MOST 40        /* largest number of Newton iterations */
#define CONES_HALVES 14      /* largest number of halvings of a Newton step in the search for a smaller residual */
#define CONES_SLOPE 1e-4     /* relative to the decrease predicted by the linear model: smallest accepted decrease (Armijo) */
#define CONES_FOUND 1e-13    /* relative to the largest friction: a smaller residual is round-off */
#define CONES_NEARLY 1e-10   /* relative to the largest friction: largest residual that is accepted when no step reduces it */

/* State of the continuation. A point has e + 1 components: y, then the fraction of friction. */
typedef struct tr_homotopy_path {
  double load;     /* N: unit of y */
  double *at, *way;/* e + 1: present point, and unit tangent at this point */
  double *by;      /* e components: derivative of y by the fraction, at the point evaluated last */
} tr_homotopy_path;

/* Newton's method with a line search, starting from c->y. Returns the sign of the determinant at the root (1: stable root); 0 if no
 * root is found. */
static int tr_cones_newton(tr_sim *s, tr_cone_problem *c) {
  const int e = c->e;
  double step[e + 1], from[e + 1], sum = tr_cones_residual(s, c);
  int sense = 1;
  for (int it = 0; it < CONES_MOST && c->most > 0; ++it) {
    if (sqrt(sum) <= CONES_FOUND * tr_largest_size(e, c->y)) return sense;
    if (tr_is_cancelled(s, 2.0 * e * e * e) || !(sense = tr_cones_factor(s, c))) return 0;
    memcpy(step, c->g, sizeof(double) * e), memcpy(from, c->y, sizeof(double) * e);
    tr_lu_solve(e, TR_A(s, lu), (const int *)TR_A(s, perm) + s->k->active, step);
    double cut = 1.0, last = sum;
    for (int half = 0; half < CONES_HALVES; ++half, cut *= 0.5) {
      for (int i = 0; i < e; ++i) c->y[i] = from[i] - cut * step[i];
      sum = tr_cones_residual(s, c);
      if (sqrt(sum) <= (1.0 - CONES_SLOPE * cut) * sqrt(last)) break;
    }
    if (!(sqrt(sum) <= (1.0 - CONES_SLOPE * cut) * sqrt(last))) {
      memcpy(c->y, from, sizeof(double) * e);
      return sqrt(tr_cones_residual(s, c)) <= CONES_NEARLY * tr_largest_size(e, c->y) ? sense : 0;
    }
  }
  return 0;
}

/* Inner product of two points: the mean product of the components of y, in units of the load, plus the product of the fractions. */
static double tr_path_product(const tr_homotopy_path *w, int e, const double *a, const double *b) {
  return tr_dot(a, b, e) / (w->load * w->load * e) + a[e] * b[e];
}

/* At the point z, compute the Newton step `step` (e components) at fixed fraction of friction, and w->by. Returns the sign of the
 * determinant; 0 if the matrix is singular. */
static int tr_path_evaluate(tr_sim *s, tr_cone_problem *c, tr_homotopy_path *w, const double *z, double *step) {
  const int e = c->e, *perm = (const int *)TR_A(s, perm) + s->k->active;
  memcpy(c->y, z, sizeof(double) * e), c->part = z[e];
  tr_cones_residual(s, c);
  tr_cones_part_derivative(s, c, w->by);
  const int sense = tr_cones_factor(s, c);
  if (!sense) return 0;
  memcpy(step, c->g, sizeof(double) * e);
  tr_lu_solve(e, TR_A(s, lu), perm, step);
  tr_lu_solve(e, TR_A(s, lu), perm, w->by);
  return sense;
}

/* Unit tangent at the point evaluated last. Along the tangent, friction grows if `sense` is 1, and decreases if `sense` is −1. */
static void tr_path_tangent(const tr_homotopy_path *w, int e, int sense, double *way) {
  for (int i = 0; i < e; ++i) way[i] = sense * w->by[i];
  way[e] = sense;
  const double size = sqrt(tr_path_product(w, e, way, way));
  for (int i = 0; i <= e; ++i) way[i] /= size;
}

/* Correct z back to the path, perpendicular to the tangent w->way. last: 1 corrects at constant, full friction instead. turned
 * receives the tangent at the first iterate, and *steps the number of iterations. Returns the sign of the determinant; 0 without
 * convergence. */
static int tr_path_correct(tr_sim *s, tr_cone_problem *c, tr_homotopy_path *w, double *z, double length, int last, double *turned, int *steps) {
  const int e = c->e;
  double step[e + 1], expected[e + 1], off[e + 1], before = INFINITY;
  memcpy(expected, z, sizeof expected);
  for (*steps = 0; *steps < GROWTH_STEPS; ++*steps) {
    const int sense = tr_path_evaluate(s, c, w, z, step);
    if (!sense) return 0;
    if (*steps == 0) tr_path_tangent(w, e, sense, turned);
    double grows = 0.0, size;
    if (!last) {
      double by[e + 1];
      memcpy(by, w->by, sizeof(double) * e), by[e] = 1.0, step[e] = 0.0;
      for (int i = 0; i <= e; ++i) off[i] = z[i] - expected[i] - step[i];
      grows = -tr_path_product(w, e, w->way, off) / tr_path_product(w, e, w->way, by);
    }
    for (int i = 0; i < e; ++i) step[i] = grows * w->by[i] - step[i];
    step[e] = grows;
    for (int i = 0; i <= e; ++i) z[i] += step[i], off[i] = z[i] - expected[i];
    size = sqrt(tr_path_product(w, e, step, step));
    if (size <= GROWTH_BACK * length) return last || sqrt(tr_path_product(w, e, off, off)) <= GROWTH_ASIDE * length || length <= GROWTH_SHORT ? sense : 0;
    if (!(size <= (*steps ? GROWTH_SHRINKS * before : INFINITY))) return 0;
    before = size;
  }
  return 0;
}

/* Follow the path from zero friction to full friction. Returns the sign of the determinant at the root; 0 if there is no root. */
static int tr_cones_follow_path(tr_sim *s, tr_cone_problem *c) {
  const int e = c->e;
  double at[e + 1], way[e + 1], by[e + 1], z[e + 1], on[e + 1], turned[e + 1], step[e + 1], length = GROWTH_FIRST;
  tr_homotopy_path w = {.load = tr_largest_size(s->k->nn, TR_A(s, Np)), .at = at, .way = way, .by = by};
  int sense, steps, kinks = 0, balls = 0;
  for (int q = 0; q < c->n; ++q) balls += c->mu[q] > 0.0 && c->rho[q] > 0.0;
  if (!c->all && !balls) return tr_cones_newton(s, c);
  c->part = 0.0;
  if (!(w.load > 0.0) || (!c->all && tr_cones_newton(s, c) != 1)) return 0;
  memcpy(at, c->y, sizeof(double) * e), at[e] = 0.0;
  if (!(sense = tr_path_evaluate(s, c, &w, at, step))) return 0;
  tr_path_tangent(&w, e, sense, way);
  while (c->most > 0 && at[e] >= 0.0 && !tr_is_cancelled(s, 10.0 * e * e * e)) {
    const int last = at[e] + length * way[e] >= 1.0;
    const double far = last ? (1.0 - at[e]) / way[e] : length;
    for (int i = 0; i <= e; ++i) z[i] = at[i] + far * way[i];
    if (last) z[e] = 1.0;
    sense = tr_path_correct(s, c, &w, z, far, last, turned, &steps);
    if (sense && last) {
      memcpy(c->y, z, sizeof(double) * e), c->part = 1.0;
      return tr_cones_newton(s, c);
    }
    if (sense) tr_path_tangent(&w, e, sense, on);
    if (sense && (tr_path_product(&w, e, on, way) >= GROWTH_TURNS || length <= GROWTH_SHORT)) {
      memcpy(at, z, sizeof at), memcpy(way, on, sizeof way);
      if (steps < 3) length = fmin(1.6 * length, GROWTH_LONGEST);
      kinks = 0;
      continue;
    }
    length *= sense ? 0.4 : length > 10.0 * GROWTH_SHORT ? 0.3 : 0.1;
    if (sense || length > GROWTH_LEAST) continue;
    if (++kinks > GROWTH_KINKS) return 0;
    memcpy(way, turned, sizeof way), length = GROWTH_AFTER;
  }
  return 0;
}
