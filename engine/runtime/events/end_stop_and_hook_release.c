/* Corners of a step: places where a damped end stop releases, or where the signal of a hook passes its release value. The step must
 * end at the first corner. Each corner is a root of a smooth function. The state at a hook's corner determines whether the hook
 * falls. */
#include "events/events.h"

#define CORNER_NEAR 1e-9  /* relative to the elastic force: a smaller corner distance counts as zero */
/* relative to the tolerance: largest distance of a step's end from a corner at which this end counts as the corner */
#define CORNER_PART 0.1
#define CORNER_ROOT 80    /* largest number of iterations; they alternate between secant and halving */
#define CORNER_LATE 1e-12 /* relative to the step: a corner closer to the step's end counts as the end */
/* excess of a hook's signal over its release value at the end of a step that ends at the corner; above TOL_STOP */
#define HOOK_BEYOND 1e-11
#define HOOK_POINTS 32    /* number of points of a step at which a hook's signal is evaluated */
/* relative to the distance of two of the HOOK_POINTS points: finite difference that gives the slope at an end of the step */
#define HOOK_EDGE 1e-3
#define HOOK_SECTIONS 40  /* largest number of golden sections between two of the HOOK_POINTS points */

/* Distance of stop i from its corner at θ of the last step: the factor of its elastic force, which is 0 at release. For a hook:
 * excess of its signal over the release value. side: sign of the signal beyond this value. */
static double tr_corner_distance(tr_sim *s, int i, double side, double theta) {
  double depth[s->k->nstops + 1], pushes[s->k->nstops + 1], *y = TR_A(s, yout);
  tr_evaluate_dense(s, theta, y);
  tr_set_time(s, s->step.t0 + theta * s->step.size); /* sets the drives and signals at θ */
  tr_stop_depths_and_pushes(s, y, depth, pushes);
  return tr_is_hook(s, i) ? side * pushes[i] - HOOK_BEYOND : pushes[i];
}

/* A place in a…b where stop i has just passed its corner. f, g: corner distances at a and b, of opposite signs. A hook's signal may
 * rise by less than CORNER_NEAR beyond its release value. For a hook, both ends of the bracket must therefore come near the root,
 * and secants aim beyond the root. */
static double tr_find_corner(tr_sim *s, int i, double side, double a, double b, double f, double g) {
  const int hook = tr_is_hook(s, i);
  for (int it = 0; it < CORNER_ROOT && fabs(g) > 0.0; ++it) {
    const double pace = (b - a) / (g - f);
    double m = it & 1 ? 0.5 * (a + b) : (a * g - b * f) / (g - f);
    if (hook && !(it & 1) && it > 0) m = fabs(g) < fabs(f) ? b - 2.0 * g * pace : a - 2.0 * f * pace;
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    const double at = tr_corner_distance(s, i, side, m);
    if (at * f > 0.0) a = m, f = at; else b = m, g = at;
    if (fabs(g) < CORNER_NEAR && (!hook || fabs(f) < CORNER_NEAR || b - a < CORNER_LATE)) break;
  }
  return b;
}

/* Place of the largest corner distance in a…b, by golden sections that end at the first positive distance. *most receives this
 * distance. */
static double tr_find_signal_top(tr_sim *s, int hook, double side, double a, double b, double *most) {
  const double part = 0.61803398874989485;
  double x = b - part * (b - a), y = a + part * (b - a);
  double fx = tr_corner_distance(s, hook, side, x), fy = tr_corner_distance(s, hook, side, y);
  for (int it = 0; it < HOOK_SECTIONS && fmax(fx, fy) <= 0.0; ++it) {
    if (fx > fy) b = y, y = x, fy = fx, x = b - part * (b - a), fx = tr_corner_distance(s, hook, side, x);
    else a = x, x = y, fx = fy, y = a + part * (b - a), fy = tr_corner_distance(s, hook, side, y);
  }
  *most = fmax(fx, fy);
  return fx > fy ? x : y;
}

/* First place in the last step where the signal of a hook passes its release value; 1 if there is none. begin: excess of the signal
 * over this value at the start. A signal that starts at its release value may rise or fall. A signal can pass the value twice
 * between two points, so maxima between points are also located. */
static double tr_find_hook_corner(tr_sim *s, int hook, double begin) {
  const double side = begin > HOOK_BEYOND || (begin >= -HOOK_BEYOND && !tr_is_pressed(s, hook)) ? -1.0 : 1.0;
  const double near = HOOK_EDGE / HOOK_POINTS;
  double f[HOOK_POINTS + 1] = {side * begin - HOOK_BEYOND};
  for (int q = 1; q <= HOOK_POINTS; ++q) {
    const double x = q / (double)HOOK_POINTS, before = (q - 1) / (double)HOOK_POINTS;
    f[q] = tr_corner_distance(s, hook, side, x);
    if (f[q] > 0.0) return tr_find_corner(s, hook, side, before, x, f[q - 1], f[q]);
    if (q == 2 && f[0] == f[1] && f[1] == f[2]) return 1.0; /* a constant signal has no corner */
    double from = -1.0, to = x, top; /* `from`: start of an interval with a maximum; −1: none */
    if (q > 1 && f[q - 1] > f[q - 2] && f[q - 1] >= f[q]) from = before - 1.0 / HOOK_POINTS;
    else if (q == 1 && f[1] <= f[0] && tr_corner_distance(s, hook, side, near) > f[0]) from = 0.0;
    else if (q == HOOK_POINTS && f[q] >= f[q - 1] && tr_corner_distance(s, hook, side, 1.0 - near) > f[q]) from = before;
    if (from < 0.0) continue;
    const double at = tr_find_signal_top(s, hook, side, from, to, &top);
    if (top > 0.0) return tr_find_corner(s, hook, side, from, at, fmin(f[(int)(from * HOOK_POINTS)], -NO_FORCE), top);
  }
  return 1.0;
}

static double tr_find_first_corner(tr_sim *s, double most) {
  const int n = s->k->nstops;
  double depth[n + 1], begin[n + 1], end[n + 1], first = most, kept[tr_solution_size(s)];
  const double near = fmax(CORNER_NEAR, CORNER_PART * s->set.rtol);
  int any = s->k->nlatches;
  for (int i = 0; i < n; ++i) any |= tr_is_pressed(s, i) && !tr_is_hook(s, i);
  if (!any || !s->set.locate || s->set.hfixed > 0.0) return 1.0;
  tr_set_time(s, s->step.t0 + s->step.size);
  tr_stop_depths_and_pushes(s, TR_A(s, ynew), depth, end);
  tr_set_time(s, s->step.t0);
  tr_stop_depths_and_pushes(s, TR_A(s, y), depth, begin);
  tr_save_solution(s, kept); /* stores the solution, because evaluations inside the step overwrite it */
  for (int i = 0; i < n; ++i) {
    if (tr_is_hook(s, i)) first = tr_ensure_dense(s) ? fmin(first, tr_find_hook_corner(s, i, begin[i])) : first;
    else if (tr_is_pressed(s, i) && begin[i] * end[i] < 0.0 && fabs(begin[i]) >= near && fabs(end[i]) >= near && tr_ensure_dense(s))
      first = fmin(first, tr_find_corner(s, i, 0.0, 0.0, 1.0, begin[i], end[i]));
  }
  tr_set_time(s, s->step.t0 + s->step.size);
  if (first < most) tr_restore_solution(s, kept);
  return first < most - CORNER_LATE ? first : 1.0;
}
