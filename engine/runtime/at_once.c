/* Modes of any number of pairs at rest from the roots of their one equation (``cones.c``): by Newton's method with a line search from no friction
 * at all, or along the path on which the friction of balls grows from none (``growth.c``). The exact equations are then solved in these modes, and
 * looked at as any answer is. */

#define CONES_MOST 40        /* steps of Newton's method, */
#define CONES_HALVES 14      /* of each so many halves, until what is left decreases */
#define CONES_SLOPE 1e-4     /* by so much of what the step promises (Armijo) */
#define CONES_FOUND 1e-13    /* of the largest friction: what is left is round-off, */
#define CONES_NEARLY 1e-10   /* or nearly, where no step makes it less */
#define CONES_STILL 1e-11    /* of what its friction accelerates: a pair that accelerates by less is at rest (as TOL_RESOLVE) */
#define CONES_MASSES 3       /* masses ρ tried one after the other: */
static const double tr_cones_masses[CONES_MASSES] = {10.0, 3.0, 1.0}; /* of what a pair's own friction moves; the larger, the fewer kinks are met */
#define CONES_WORK 4e9       /* multiplications (half a second) for all of it, */
#define CONES_MATRICES 300   /* and matrices factorised */

#include "cones.c"

/* The largest of n numbers. */
static double tr_largest(int n, const double *v) {
  double most = 0.0;
  for (int i = 0; i < n; ++i) most = fmax(most, fabs(v[i]));
  return most;
}

/* Newton's method with a line search from y. Returns the sense of the determinant at its end (1: a root that lasts), 0: nothing found. */
static int tr_cones_newton(tr_sim *s, tr_cones *c) {
  const int e = c->e;
  double step[e + 1], from[e + 1], sum = tr_cones_try(s, c);
  int sense = 1;
  for (int it = 0; it < CONES_MOST && c->most > 0; ++it) {
    if (sqrt(sum) <= CONES_FOUND * tr_largest(e, c->y)) return sense;
    if (tr_gives_up(s, 2.0 * e * e * e) || !(sense = tr_cones_factor(s, c))) return 0;
    memcpy(step, c->g, sizeof(double) * e), memcpy(from, c->y, sizeof(double) * e);
    tr_lu_solve(e, TR_A(s, lu), (const int *)TR_A(s, perm) + s->k->active, step);
    double cut = 1.0, last = sum;
    for (int half = 0; half < CONES_HALVES; ++half, cut *= 0.5) {
      for (int i = 0; i < e; ++i) c->y[i] = from[i] - cut * step[i];
      sum = tr_cones_try(s, c);
      if (sqrt(sum) <= (1.0 - CONES_SLOPE * cut) * sqrt(last)) break;
    }
    if (!(sqrt(sum) <= (1.0 - CONES_SLOPE * cut) * sqrt(last))) {
      memcpy(c->y, from, sizeof(double) * e);
      return sqrt(tr_cones_try(s, c)) <= CONES_NEARLY * tr_largest(e, c->y) ? sense : 0;
    }
  }
  return 0;
}

/* Put in force what has been found: a pair that accelerates starts that way, any other sticks. */
static void tr_cones_put(tr_sim *s, const tr_cones *c) {
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    tr_mode *m = tr_mode_of(s, c->pairs[q]);
    double d[3] = {0.0, 0.0, 0.0}, p[3] = {0.0, 0.0, 0.0};
    tr_cones_p(s, c, q, p);
    memcpy(d, c->x + pair->eta0, sizeof(double) * pair->neta);
    const double size = tr_unit(pair->nrates, d);
    for (int j = 0; j < 3; ++j) m->direction[j] = 0.0;
    m->flag = TR_STUCK;
    if (!(c->rho[q] * size > CONES_STILL * tr_unit(pair->nrates, p)) || c->mode[q] == TR_STUCK) continue;
    m->flag = c->mode[q];
    if (pair->nrates == 1) d[0] = d[0] < 0.0 ? -1.0 : 1.0;
    tr_point(s, c->pairs[q], d);
  }
}

#include "growth.c"

/* The pair that is said to stick and has to hold most beyond what it can; -1: none. */
static int tr_cones_overcome(const tr_sim *s, const tr_cones *c) {
  double most = 1.0 + TOL_RESOLVE;
  int worst = -1;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    double load = 0.0, holds = 0.0;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta && c->holds[q]; ++i) {
      const double law = c->grip[i] * TR_A(s, law)[i] / TR_A(s, arm)[i];
      load += c->y[i] * c->y[i], holds += law * law;
    }
    if (sqrt(load) > most * sqrt(holds)) most = sqrt(load / holds), worst = q;
  }
  return worst;
}

/* Where pairs hold more at rest than they rub with while they slide, what has been found is for the most that they hold: what sticks then does, but
 * for what the others let go of, and what slides rubs with its own. The sense of the determinant, 0: not found. */
static int tr_cones_let_slide(tr_sim *s, tr_cones *c) {
  int sense = 0, worst = 0;
  for (int q = 0; q < c->n; ++q) c->holds[q] = c->rho[q] > 0.0 && c->mode[q] == TR_STUCK;
  memcpy(c->mu, c->slides, sizeof(double) * c->n);
  for (c->grips = 0; worst >= 0 && (sense = tr_cones_newton(s, c)) && (worst = tr_cones_overcome(s, c)) >= 0;) c->holds[worst] = 0;
  return sense;
}

/* Modes and frictions of the pairs `rest` (n) at the state whose maps are in place, all at once; 1 when found. */
static int tr_settle_at_once(tr_sim *s, const int *rest, int n) {
  enum { BALLS_GROW, ALL_GROW, NONE_GROWS };
  const int e = s->k->neta;
  double rho[n + 1], mu[n + 1], slides[n + 1], turn[n + 1], grip[e + 1], x[e + 4], y[e + 1], g[e + 1];
  int mode[n + 1], holds[n + 1];
  tr_mode modes[s->k->nsliders + 1];
  tr_cones c = {.n = n, .e = e, .pairs = rest, .rho = rho, .mu = mu, .slides = slides, .turn = turn, .grip = grip, .x = x, .y = y, .g = g, .mode = mode, .holds = holds};
  c.most = (int)fmin(CONES_MATRICES, CONES_WORK / ((double)e * e * e));
  tr_keep_modes(s, modes);
  tr_without_loops(s, 1);
  for (int way = BALLS_GROW; way <= NONE_GROWS; ++way)
    for (int q = 0; q < CONES_MASSES && c.most > 0; ++q) {
      if (!tr_cones_begin(s, &c, tr_cones_masses[q])) c.most = 0;
      if (!c.most) break;
      c.all = way == ALL_GROW;
      if ((way == NONE_GROWS ? tr_cones_newton(s, &c) : tr_cones_grow(s, &c)) != 1) continue;
      if (c.grips && tr_cones_let_slide(s, &c) != 1) continue;
      tr_cones_put(s, &c);
      if (tr_solve_modes(s) && tr_worst_misfit(s, rest, n) < 0 && tr_holds(s, rest, n)) return 1;
    }
  tr_put_modes(s, modes);
  return 0;
}
