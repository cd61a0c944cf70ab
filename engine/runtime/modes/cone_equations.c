/* Friction at rest of any number of pairs as one equation (theory, "Many pairs").
 *
 * Let y (N) be the friction and x (m/s²) the surface acceleration of a pair at rest or about to slide. The combination p = y + ρ x
 * (ρ: a mass) determines y and x. y = R(load, p) is unique and continuous; its only kink is at the edge of the friction cone. Loads
 * and x are affine functions of the frictions y. y − R = 0 is therefore a piecewise smooth equation for y, with sticking, sliding
 * and spinning. Newton's method with a line search solves this equation. The start is zero friction, or a path on which friction
 * grows from zero (``modes/cone_homotopy.c``). The caller verifies the result with the exact equations. */
#include "modes/modes.h"

#define CONES_TRIED 1e-7     /* step of the difference quotient by `part` */
#define CONES_GRIP 1e-6      /* relative to the sliding friction: a smaller excess of static friction is neglected */

/* Unknowns and data of the equation. The comments give array sizes before the colon; n: number of pairs, e: number of
 * multipliers. */
typedef struct tr_cone_problem {
  int n, e;
  const int *pairs; /* n: pairs at rest */
  double part;      /* fraction of the friction of balls; grows from 0 to 1 along a path */
  int all;          /* whether `part` applies to all pairs, not only to balls */
  int most;         /* number of factorisations that are still allowed */
  double *rho;      /* n: mass ρ, kg; 0 for a freed pair, and for a pair whose motion friction does not affect */
  int grips;        /* whether some pair has more static than sliding friction; static friction is then used */
  double *grip;     /* e: ratio of static to sliding friction, for pairs other than balls */
  double *mu;       /* n: present friction ratio of a ball; negative for other pairs */
  double *slides;   /* n: sliding friction ratio of a ball */
  int *holds;       /* n: whether the pair sticks at any load */
  double *turn;     /* n: ±1, orientation of a ball's frame (t, i) */
  double *x, *y, *g;/* e: surface accelerations, m/s²; frictions, N; residual, N */
  int *mode;        /* n: TR_STUCK, TR_SLIPS or TR_CONE */
} tr_cone_problem;

static void tr_set_direction(tr_sim *s, int i, const double *d) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double length = pair->nrates > 1 ? tr_onset_length(s) : 1.0;
  for (int j = 0; j < pair->nrates; ++j) tr_mode_of(s, i)->direction[j] = length * d[j] / (pair->nrates > 1 ? TR_A(s, lever)[pair->eta0 + j] : 1.0);
}

/* Evaluate the laws with unit loads on balls, with all pairs in motion. spins: 1 if balls spin about their contact, oblique to the
 * load; 0 if they slide perpendicular to the load. u (e) receives unit friction along these directions. */
static void tr_cones_evaluate_laws(tr_sim *s, const tr_cone_problem *c, int spins, double *u) {
  const double load[3] = {0.0, 0.0, 1.0}, along[3] = {1.0, 0.0, 0.0}, oblique[3] = {sqrt(0.5), 0.0, sqrt(0.5)};
  memset(u, 0, sizeof(double) * c->e);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    tr_mode_of(s, c->pairs[q])->flag = pair->cone && spins ? TR_CONE : TR_SLIPS;
    tr_set_direction(s, c->pairs[q], pair->cone && spins ? oblique : along);
    u[pair->eta0] = TR_A(s, lever)[pair->eta0];
    if (pair->nrates == 3) memcpy(TR_A(s, NN) + s->k->element[pair->element].n0, load, sizeof load);
  }
  s->k->laws(TR_A(s, NN), map_rates(s->k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + s->k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
}

/* Determine friction ratios and frames of balls, and ratios of static to sliding friction, from the laws. A ball whose law has
 * another form (Adams' law) gets the ratio NAN. */
static void tr_cones_read_laws(tr_sim *s, tr_cone_problem *c) {
  const tr_kernel *k = s->k;
  double u[c->e + 1], none[c->e + 1];
  memset(none, 0, sizeof none);
  tr_evaluate_laws(s, none);
  tr_cones_evaluate_laws(s, c, 0, u);
  k->held_alone(TR_A(s, NN), u, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
  for (int i = 0; i < c->e; ++i) c->grip[i] = 1.0;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    const double rubs = fabs(TR_A(s, law)[pair->eta0]) / TR_A(s, lever)[pair->eta0], holds = tr_hold_of(s, c->pairs[q])->capacity;
    c->mu[q] = c->slides[q] = pair->nrates < 3 ? -1.0 : pair->cone ? rubs / sqrt(1.0 - rubs * rubs) : NAN;
    if (!(holds > (1.0 + CONES_GRIP) * rubs)) continue;
    if (pair->cone) c->mu[q] = holds / sqrt(1.0 - holds * holds), c->grips = 1;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta && pair->nrates < 3 && rubs > 0.0; ++i) c->grip[i] = holds / rubs, c->grips = 1;
  }
  tr_cones_evaluate_laws(s, c, 1, u);
  for (int q = 0; q < c->n; ++q) c->turn[q] = TR_A(s, law)[tr_pair_of(s, c->pairs[q])->eta0 + (c->mu[q] >= 0.0)] < 0.0 ? -1.0 : 1.0;
}

/* Set up the problem with zero friction. mass: factor on ρ. Requires maps of the current state. Returns 0 if the law of a ball has
 * another form (tr_cones_read_laws). */
static int tr_cones_set_up(tr_sim *s, tr_cone_problem *c, double mass) {
  const int e = s->k->neta;
  const double *Qe = TR_A(s, Q) + e, *lever = TR_A(s, lever);
  c->part = 1.0, c->grips = 0;
  memset(c->holds, 0, sizeof(int) * c->n);
  tr_cones_read_laws(s, c);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    double own = 0.0;
    int free = 0;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
      if (!tr_is_prescribed(s, i)) own -= Qe[i + i * e] * lever[i] * lever[i], ++free;
    c->rho[q] = own > 0.0 && c->pairs[q] != s->friction.freed ? mass * free / own : 0.0;
    if (!(c->mu[q] == c->mu[q]) || pair->neta != pair->nrates) return 0;
  }
  memset(c->y, 0, sizeof(double) * e);
  return 1;
}

/* Factor on the law of multiplier i, which belongs to a pair other than a ball. */
static inline double tr_cones_friction_part(const tr_cone_problem *c, int i) { return (c->all ? c->part : 1.0) * (c->grips ? c->grip[i] : 1.0); }

/* p = y + ρ x of pair q, up to 3 components. */
static inline void tr_cones_combination(const tr_sim *s, const tr_cone_problem *c, int q, double *p) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  for (int j = 0; j < pair->neta; ++j) p[j] = c->y[pair->eta0 + j] + c->rho[q] * c->x[pair->eta0 + j];
}

/* Mode and residual of pair q, which is not a ball. The law of the pair must have been evaluated. The pair sticks if |p| is at most
 * its sliding friction. */
static void tr_cones_pair_residual(tr_sim *s, tr_cone_problem *c, int q) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  double p[3], most = 0.0;
  tr_cones_combination(s, c, q, p);
  for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) {
    const double law = tr_cones_friction_part(c, i) * TR_A(s, law)[i] / TR_A(s, lever)[i];
    most += law * law;
  }
  c->mode[q] = c->holds[q] || tr_dot(p, p, pair->neta) <= most ? TR_STUCK : TR_SLIPS;
  for (int j = 0; j < pair->neta && c->mode[q] == TR_STUCK; ++j) c->g[pair->eta0 + j] = c->y[pair->eta0 + j] - p[j];
}

/* Residual g at the frictions y. Returns |g|², N². */
static double tr_cones_residual(tr_sim *s, tr_cone_problem *c) {
  const int e = c->e;
  const double *Q0 = TR_A(s, Q), *lever = TR_A(s, lever);
  double *eta = TR_A(s, z) + s->k->active, sum = 0.0, p[3], R[3];
  for (int i = 0; i < e; ++i) eta[i] = c->y[i] * lever[i];
  tr_affine_map(e, e, Q0, Q0 + e, eta, c->x);
  for (int i = 0; i < e; ++i) c->x[i] *= lever[i];
  for (int q = 0; q < c->n; ++q) {
    const int several = tr_pair_of(s, c->pairs[q])->nrates;
    if (c->mu[q] >= 0.0) continue;
    tr_cones_combination(s, c, q, p);
    if (several == 1) p[0] = p[0] < 0.0 ? -1.0 : 1.0;
    else if (!(tr_make_unit(several, p) > 0.0)) p[0] = 1.0;
    tr_set_direction(s, c->pairs[q], p);
  }
  tr_evaluate_laws(s, eta);
  for (int i = 0; i < e; ++i) c->g[i] = c->y[i] - tr_cones_friction_part(c, i) * TR_A(s, law)[i] / lever[i];
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    if (c->mu[q] < 0.0) {
      tr_cones_pair_residual(s, c, q);
    } else {
      tr_ball_equation b;
      tr_cones_combination(s, c, q, p);
      tr_ball_friction(TR_A(s, NN) + s->k->element[pair->element].n0, p, c->part * c->mu[q], c->turn[q], &b, R);
      c->mode[q] = b.flag;
      for (int j = 0; j < 3; ++j) c->g[pair->eta0 + j] = c->y[pair->eta0 + j] - R[j];
    }
    for (int j = 0; j < pair->neta && !(c->rho[q] > 0.0); ++j) c->g[pair->eta0 + j] = c->y[pair->eta0 + j];
  }
  for (int i = 0; i < e; ++i) sum += c->g[i] * c->g[i];
  return sum;
}

/* Rows of J that belong to ball q. */
static void tr_cones_ball_rows(const tr_sim *s, const tr_cone_problem *c, int q, double *J) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  const int e = c->e, at = pair->eta0, n = s->k->nn, n0 = s->k->element[pair->element].n0;
  const double *Qe = TR_A(s, Q) + e + at, *Ne = tr_loads_by_friction(s) + n0, *lever = TR_A(s, lever);
  double p[3], R[3], Df[9], Dp[9];
  tr_ball_equation b;
  tr_cones_combination(s, c, q, p);
  tr_ball_friction(TR_A(s, NN) + n0, p, c->part * c->mu[q], c->turn[q], &b, R);
  tr_ball_friction_slopes(&b, p, Df, Dp);
  for (int j = 0; j < e; ++j) {
    double moved[3], own = lever[j];
    for (int r = 0; r < 3; ++r) moved[r] = (at + r == j) + c->rho[q] * lever[at + r] * Qe[r + j * e] * own;
    for (int r = 0; r < 3; ++r) {
      double a = at + r == j;
      for (int i = 0; i < 3; ++i) a -= Df[r + 3 * i] * Ne[i + j * n] * own + Dp[r + 3 * i] * moved[i];
      J[at + r + j * e] = a;
    }
  }
}

/* Rows of J of a stuck pair q: −ρ ∂x/∂y. With redundant loads, a small multiple of the unit matrix makes J regular. */
static void tr_cones_stuck_rows(const tr_sim *s, const tr_cone_problem *c, int q, double *J) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  const double *Qe = TR_A(s, Q) + c->e, *lever = TR_A(s, lever), slack = s->k->active ? RANK_PIVOT : 0.0;
  for (int j = 0; j < c->e; ++j)
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
      J[i + j * c->e] = (i == j) * slack - c->rho[q] * lever[i] * Qe[i + j * c->e] * lever[j];
}

/* Add to J, by differences, the effect of directions that turn, for sliding pairs with two components. */
static void tr_cones_turn_rows(tr_sim *s, tr_cone_problem *c, double *J) {
  const tr_kernel *k = s->k;
  const int e = c->e;
  const double *Qe = TR_A(s, Q) + e, *lever = TR_A(s, lever);
  double law[e], dn[k->ndn + 1], p[3], size[c->n];
  tr_sliding sliding[k->nsliders + 1];
  int turns = 0;
  for (int q = 0; q < c->n; ++q) {
    if (tr_pair_of(s, c->pairs[q])->nrates != 2 || c->mode[q] != TR_SLIPS || !(c->rho[q] > 0.0)) continue;
    tr_cones_combination(s, c, q, p);
    size[q] = tr_make_unit(2, p);
    const double turned[2] = {p[0] - TURN_TRIED * p[1], p[1] + TURN_TRIED * p[0]};
    tr_set_direction(s, c->pairs[q], turned), turns = 1;
  }
  if (!turns) return;
  k->laws(TR_A(s, NN), map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, law, dn, (double *)sliding);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    if (pair->nrates != 2 || c->mode[q] != TR_SLIPS || !(c->rho[q] > 0.0)) continue;
    tr_cones_combination(s, c, q, p);
    tr_make_unit(2, p);
    tr_set_direction(s, c->pairs[q], p);
    for (int r = 0; r < 2; ++r) {
      const int i = pair->eta0 + r;
      const double slope = tr_cones_friction_part(c, i) * (law[i] - TR_A(s, law)[i]) / (TURN_TRIED * lever[i] * size[q]);
      for (int j = 0; j < e; ++j) {
        double across = 0.0;
        for (int a = 0; a < 2; ++a) across += (a ? p[0] : -p[1]) * ((pair->eta0 + a == j) + c->rho[q] * lever[pair->eta0 + a] * Qe[pair->eta0 + a + j * e] * lever[j]);
        J[i + j * e] -= slope * across;
      }
    }
  }
}

/* Factorise J = ∂g/∂y into `lu`, at the frictions of the last tr_cones_residual. Returns the sign of the determinant; 0 if J is
 * singular. */
static int tr_cones_factor(tr_sim *s, tr_cone_problem *c) {
  const int e = c->e;
  const double *lever = TR_A(s, lever);
  double *J = TR_A(s, lu);
  int *perm = (int *)TR_A(s, perm) + s->k->active;
  tr_form_law_jacobian(s);
  for (int j = 0; j < e; ++j)
    for (int i = 0; i < e; ++i) J[i + j * e] = (i == j) + tr_cones_friction_part(c, i) * (J[i + j * e] - (i == j)) * lever[j] / lever[i];
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    if (c->mu[q] >= 0.0) tr_cones_ball_rows(s, c, q, J);
    else if (c->mode[q] == TR_STUCK) tr_cones_stuck_rows(s, c, q, J);
    for (int i = pair->eta0; i < pair->eta0 + pair->neta && !(c->rho[q] > 0.0); ++i)
      for (int j = 0; j < e; ++j) J[i + j * e] = i == j;
  }
  tr_cones_turn_rows(s, c, J);
  s->stats.newton_iterations++, c->most--;
  return tr_lu(e, J, perm) ? tr_lu_determinant_sign(e, J, perm) : 0;
}

/* by (e) = −∂g/∂part, at the frictions of the last tr_cones_residual. */
static void tr_cones_part_derivative(tr_sim *s, const tr_cone_problem *c, double *by) {
  double p[3], R[3], more[3];
  tr_ball_equation b;
  for (int i = 0; i < c->e; ++i) by[i] = c->all ? (c->grips ? c->grip[i] : 1.0) * TR_A(s, law)[i] / TR_A(s, lever)[i] : 0.0;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    const double *f = TR_A(s, NN) + s->k->element[pair->element].n0;
    for (int j = 0; j < pair->neta && (c->mode[q] == TR_STUCK || !(c->rho[q] > 0.0)); ++j) by[pair->eta0 + j] = 0.0;
    if (c->mu[q] < 0.0 || !(c->rho[q] > 0.0)) continue;
    tr_cones_combination(s, c, q, p);
    tr_ball_friction(f, p, c->part * c->mu[q], c->turn[q], &b, R);
    tr_ball_friction(f, p, (c->part + CONES_TRIED) * c->mu[q], c->turn[q], &b, more);
    for (int j = 0; j < 3; ++j) by[pair->eta0 + j] = (more[j] - R[j]) / CONES_TRIED;
  }
}
