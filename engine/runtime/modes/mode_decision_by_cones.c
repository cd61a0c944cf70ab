/* Decisions by the cone equations (``modes/cone_equations.c``). The search follows a path on which the friction of balls grows,
 * then a path on which the friction of all pairs grows. Finally, it uses Newton's method alone. */
#include "modes/modes.h"

#define CONES_MASSES 3       /* number of masses ρ, which are tried one after another */
#define CONES_WORK 4e9       /* multiplications (half a second): limit of all attempts */
#define CONES_MATRICES 300   /* number of factorisations: limit of all attempts */

/* Masses ρ, relative to the mass that a pair's own friction moves. With a larger mass, the iteration meets fewer kinks. */
static const double tr_cones_masses[CONES_MASSES] = {10.0, 3.0, 1.0};

/* Apply the solution: a pair that accelerates slips in the direction of its acceleration; every other pair sticks. */
static void tr_cones_set_modes(tr_sim *s, const tr_cone_problem *c) {
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    tr_mode *m = tr_mode_of(s, c->pairs[q]);
    double d[3] = {0.0, 0.0, 0.0}, p[3] = {0.0, 0.0, 0.0};
    tr_cones_combination(s, c, q, p);
    memcpy(d, c->x + pair->eta0, sizeof(double) * pair->neta);
    const double size = tr_make_unit(pair->nrates, d);
    for (int j = 0; j < 3; ++j) m->direction[j] = 0.0;
    m->flag = TR_STUCK;
    if (!(c->rho[q] * size > TOL_RESOLVE * tr_make_unit(pair->nrates, p)) || c->mode[q] == TR_STUCK) continue;
    m->flag = c->mode[q];
    if (pair->nrates == 1) d[0] = d[0] < 0.0 ? -1.0 : 1.0;
    tr_set_direction(s, c->pairs[q], d);
  }
}

/* The pair that exceeds its capacity most, among the pairs forced to stick (`holds`); −1: no pair exceeds it. */
static int tr_cones_find_overloaded(const tr_sim *s, const tr_cone_problem *c) {
  double most = 1.0 + TOL_RESOLVE;
  int worst = -1;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    double load = 0.0, holds = 0.0;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta && c->holds[q]; ++i) {
      const double law = c->grip[i] * TR_A(s, law)[i] / TR_A(s, lever)[i];
      load += c->y[i] * c->y[i], holds += law * law;
    }
    if (sqrt(load) > most * sqrt(holds)) most = sqrt(load / holds), worst = q;
  }
  return worst;
}

/* Solve again, with sliding friction instead of the larger static friction in the pairs that slide. Stuck pairs are forced to
 * stick; overloaded pairs among them are then released one by one. Returns the sign of the determinant; 0 if there is no
 * solution. */
static int tr_cones_use_sliding_friction(tr_sim *s, tr_cone_problem *c) {
  int sense = 0, worst = 0;
  for (int q = 0; q < c->n; ++q) c->holds[q] = c->rho[q] > 0.0 && c->mode[q] == TR_STUCK;
  memcpy(c->mu, c->slides, sizeof(double) * c->n);
  for (c->grips = 0; worst >= 0 && (sense = tr_cones_newton(s, c)) && (worst = tr_cones_find_overloaded(s, c)) >= 0;) c->holds[worst] = 0;
  return sense;
}

static int tr_decide_by_cones(tr_sim *s, const int *rest, int n) {
  enum { BALLS_GROW, ALL_GROW, NONE_GROWS };
  const int e = s->k->neta;
  double rho[n + 1], mu[n + 1], slides[n + 1], turn[n + 1], grip[e + 1], x[e + 4], y[e + 1], g[e + 1];
  int mode[n + 1], holds[n + 1];
  tr_mode modes[s->k->nsliders + 1];
  tr_cone_problem c = {.n = n, .e = e, .pairs = rest, .rho = rho, .mu = mu, .slides = slides, .turn = turn, .grip = grip, .x = x, .y = y, .g = g, .mode = mode, .holds = holds};
  c.most = (int)fmin(CONES_MATRICES, CONES_WORK / ((double)e * e * e));
  tr_save_modes(s, modes);
  tr_form_maps_without_loops(s, 1);
  for (int way = BALLS_GROW; way <= NONE_GROWS; ++way)
    for (int q = 0; q < CONES_MASSES && c.most > 0; ++q) {
      if (!tr_cones_set_up(s, &c, tr_cones_masses[q])) c.most = 0;
      if (!c.most) break;
      c.all = way == ALL_GROW;
      if ((way == NONE_GROWS ? tr_cones_newton(s, &c) : tr_cones_follow_path(s, &c)) != 1) continue;
      if (c.grips && tr_cones_use_sliding_friction(s, &c) != 1) continue;
      tr_cones_set_modes(s, &c);
      if (tr_solve_in_modes(s) && tr_find_worst_misfit(s, rest, n) < 0 && tr_is_valid_decision(s, rest, n)) return tr_stick_idle_pairs(s, rest, n);
    }
  tr_restore_modes(s, modes);
  return 0;
}
