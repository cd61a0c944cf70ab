/* Friction at rest along the path on which it grows from none to its whole (METHOD, "Many pairs"): where Newton's method finds nothing, or a root
 * that does not last. The path is followed by its arc, round its folds: as long as it does not end it comes to a root at which the determinant
 * has the sense that it has without friction. */
#include "modes.h"

#define GROWTH_FIRST 0.3   /* of the path's length, of which 1 is the whole friction: the first step, */
#define GROWTH_LONGEST 0.5 /* the longest, */
#define GROWTH_SHORT 1e-4  /* one so short that the path may turn in it, */
#define GROWTH_LEAST 1e-8  /* and one below which it does: at a kink, from where it is followed on by */
#define GROWTH_AFTER 3e-4
#define GROWTH_STEPS 7     /* of Newton's method back to the path */
#define GROWTH_BACK 1e-4   /* of the step: so near to the path it may remain; */
#define GROWTH_SHRINKS 0.5 /* every one over the one before; else the step is made shorter */
#define GROWTH_ASIDE 0.5   /* of the step: so far the path may be from where it was expected, */
#define GROWTH_TURNS 0.3   /* cosine: and by so much it may turn */
#define GROWTH_KINKS 4     /* turns at one place: then the path ends there */

/* Where the path is followed. Its points are y (e) and, behind it, the part of the friction. */
typedef struct tr_growth {
  double load;     /* N: unit of y */
  double *at, *way;/* e + 1: a point, and the unit vector along the path there */
  double *by;      /* e: dy/dpart along the path at the point looked at last */
} tr_growth;

/* Product of two steps; y counts as the mean square of its parts, in units of the load. */
static double tr_grow_dot(const tr_growth *w, int e, const double *a, const double *b) {
  return tr_dot(a, b, e) / (w->load * w->load * e) + a[e] * b[e];
}

/* At the point z: Newton's step `step` (e) at a fixed part, and `by`; ±1, the sense of the determinant, or 0. */
static int tr_grow_look(tr_sim *s, tr_cones *c, tr_growth *w, const double *z, double *step) {
  const int e = c->e, *perm = (const int *)TR_A(s, perm) + s->k->active;
  memcpy(c->y, z, sizeof(double) * e), c->part = z[e];
  tr_cones_try(s, c);
  tr_cones_by_part(s, c, w->by);
  const int sense = tr_cones_factor(s, c);
  if (!sense) return 0;
  memcpy(step, c->g, sizeof(double) * e);
  tr_lu_solve(e, TR_A(s, lu), perm, step);
  tr_lu_solve(e, TR_A(s, lu), perm, w->by);
  return sense;
}

/* The way on from the point looked at: friction grows where the determinant has the sense that it has without friction, and wanes elsewhere. */
static void tr_grow_along(const tr_growth *w, int e, int sense, double *way) {
  for (int i = 0; i < e; ++i) way[i] = sense * w->by[i];
  way[e] = sense;
  const double size = sqrt(tr_grow_dot(w, e, way, way));
  for (int i = 0; i <= e; ++i) way[i] /= size;
}

/* From z back to the path: across `way`, or (last) at the whole friction. Its sense there, 0: not found. turned: the way on from the first point;
 * steps: of Newton's method. */
static int tr_grow_back(tr_sim *s, tr_cones *c, tr_growth *w, double *z, double length, int last, double *turned, int *steps) {
  const int e = c->e;
  double step[e + 1], expected[e + 1], off[e + 1], before = INFINITY;
  memcpy(expected, z, sizeof expected);
  for (*steps = 0; *steps < GROWTH_STEPS; ++*steps) {
    const int sense = tr_grow_look(s, c, w, z, step);
    if (!sense) return 0;
    if (*steps == 0) tr_grow_along(w, e, sense, turned);
    double grows = 0.0, size;
    if (!last) {
      double by[e + 1];
      memcpy(by, w->by, sizeof(double) * e), by[e] = 1.0, step[e] = 0.0;
      for (int i = 0; i <= e; ++i) off[i] = z[i] - expected[i] - step[i];
      grows = -tr_grow_dot(w, e, w->way, off) / tr_grow_dot(w, e, w->way, by);
    }
    for (int i = 0; i < e; ++i) step[i] = grows * w->by[i] - step[i];
    step[e] = grows;
    for (int i = 0; i <= e; ++i) z[i] += step[i], off[i] = z[i] - expected[i];
    size = sqrt(tr_grow_dot(w, e, step, step));
    if (size <= GROWTH_BACK * length) return last || sqrt(tr_grow_dot(w, e, off, off)) <= GROWTH_ASIDE * length || length <= GROWTH_SHORT ? sense : 0;
    if (!(size <= (*steps ? GROWTH_SHRINKS * before : INFINITY))) return 0;
    before = size;
  }
  return 0;
}

/* From no friction (of balls, or of all) along the path to the whole of it. The sense of the determinant at the root found, 0: none. */
static int tr_cones_grow(tr_sim *s, tr_cones *c) {
  const int e = c->e;
  double at[e + 1], way[e + 1], by[e + 1], z[e + 1], on[e + 1], turned[e + 1], step[e + 1], length = GROWTH_FIRST;
  tr_growth w = {.load = tr_largest(s->k->nn, TR_A(s, Np)), .at = at, .way = way, .by = by};
  int sense, steps, kinks = 0, balls = 0;
  for (int q = 0; q < c->n; ++q) balls += c->mu[q] > 0.0 && c->rho[q] > 0.0;
  if (!c->all && !balls) return tr_cones_newton(s, c);
  c->part = 0.0;
  if (!(w.load > 0.0) || (!c->all && tr_cones_newton(s, c) != 1)) return 0;
  memcpy(at, c->y, sizeof(double) * e), at[e] = 0.0;
  if (!(sense = tr_grow_look(s, c, &w, at, step))) return 0;
  tr_grow_along(&w, e, sense, way);
  while (c->most > 0 && at[e] >= 0.0 && !tr_gives_up(s, 10.0 * e * e * e)) {
    const int last = at[e] + length * way[e] >= 1.0;
    const double far = last ? (1.0 - at[e]) / way[e] : length;
    for (int i = 0; i <= e; ++i) z[i] = at[i] + far * way[i];
    if (last) z[e] = 1.0;
    sense = tr_grow_back(s, c, &w, z, far, last, turned, &steps);
    if (sense && last) {
      memcpy(c->y, z, sizeof(double) * e), c->part = 1.0;
      return tr_cones_newton(s, c);
    }
    if (sense) tr_grow_along(&w, e, sense, on);
    if (sense && (tr_grow_dot(&w, e, on, way) >= GROWTH_TURNS || length <= GROWTH_SHORT)) {
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
