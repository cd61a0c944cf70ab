/* Corners of the motion that are no events: a damped stop pushes less the faster what it holds moves out, and lets go inside its reach from
 * some rate on. Its force stays continuous, its slope does not: a step across that corner is off by a hundred tolerances, which no embedded
 * estimate sees. So steps end there. */
#include "modes.h"

#define CORNER_NEAR 1e-9  /* of the elastic force, or */
#define CORNER_PART 0.1   /* of the tolerance: so near to a corner a step may begin or end */
#define CORNER_CUTS 3     /* steps made anew up to one corner: each is closer to it by the error of the dense output */
#define CORNER_ROOT 40    /* halvings, with secants between */
#define CORNER_LAST 0.999999 /* of the step: no shorter one is made for what is behind that */

/* How far stop i is from letting go at θ of the step just made, of whose ends it is known. */
static double tr_push_at(tr_sim *s, int i, double theta) {
  double depth[s->k->nstops + 1], pushes[s->k->nstops + 1], *y = TR_A(s, yout);
  tr_dense_eval(s, theta, y);
  tr_depths_pushes(s, y, depth, pushes);
  return pushes[i];
}

/* Where stop i lets go or takes hold again, from f and g at the ends of the step. */
static double tr_corner_at(tr_sim *s, int i, double f, double g) {
  double a = 0.0, b = 1.0;
  for (int it = 0; it < CORNER_ROOT && fabs(g) > 0.0; ++it) {
    double m = it & 1 ? 0.5 * (a + b) : (a * g - b * f) / (g - f);
    if (!(m > a && m < b)) m = 0.5 * (a + b);
    const double at = tr_push_at(s, i, m);
    if (at * f > 0.0) a = m, f = at; else b = m, g = at;
    if (fabs(g) < CORNER_NEAR) break;
  }
  return b;
}

/* Where in the acceptable step just made the first corner is; 1: there is none, or only at its ends. */
static double tr_first_corner(tr_sim *s, double most) {
  const int n = s->k->nstops;
  double depth[n + 1], begin[n + 1], end[n + 1], first = most, kept[tr_solution_size(s)];
  const double near = fmax(CORNER_NEAR, CORNER_PART * s->set.rtol);
  int any = 0;
  for (int i = 0; i < n; ++i) any |= tr_pressed(s, i) && !tr_is_hook(s, i);
  if (!any || !s->set.locate || s->set.hfixed > 0.0) return 1.0;
  tr_depths_pushes(s, TR_A(s, y), depth, begin), tr_depths_pushes(s, TR_A(s, ynew), depth, end);
  tr_keep_solution(s, kept); /* what the dense output is made of moves it */
  for (int i = 0; i < n; ++i) {
    if (!tr_pressed(s, i) || begin[i] * end[i] >= 0.0 || fabs(begin[i]) < near || fabs(end[i]) < near || !tr_have_dense(s)) continue;
    first = fmin(first, tr_corner_at(s, i, begin[i], end[i]));
  }
  if (first < most) tr_put_solution(s, kept);
  return first < most * CORNER_LAST ? first : 1.0;
}
