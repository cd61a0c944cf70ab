/* Friction at rest of any number of pairs as one equation (METHOD, "Many pairs").
 *
 * Of a pair that starts, what its friction y (N) and its surface acceleration x (m/s²) have to do with each other under a load is known once
 * p = y + ρ x is, ρ a mass: y = R(load, p) is unique and continuous, and has one kink, at the edge of the friction cone. With y, x and the loads
 * affine in each other y − R = 0 is an equation as smooth as that, whatever sticks, slides or spins. It is solved by Newton's method with a line
 * search from no friction at all, or along the path on which friction grows from none (``growth.c``); the exact equations are solved afterwards. */
#include "ball.c"

#define CONES_TRIED 1e-7     /* part of a ball's friction, for the derivative by it */
#define CONES_GRIP 1e-6      /* of friction: by less at rest none holds more than it rubs with while it slides */
#define CONES_SLACK 1e-9     /* where loads are redundant: so stiff are pairs that stick (as GROUP_PIVOT), which keeps their loads near where they were */

/* The problem. */
typedef struct tr_cones {
  int n, e;
  const int *pairs; /* n: at rest */
  double part;      /* of the friction of balls, which grows from none on a path; */
  int all;          /* and with it that of the others, where it does not lead there otherwise */
  int most;         /* matrices that may still be factorised */
  double *rho;      /* n: ρ, kg; 0: its motion is prescribed, or it does not feel its friction */
  int grips;        /* some hold more at rest than they rub with while they slide, and this is what counts: */
  double *grip;     /* e: by this factor, of pairs that are no balls; */
  double *mu;       /* n: of a ball the ratio in force (< 0: no ball), */
  double *slides;   /* n: and that of sliding */
  int *holds;       /* n: it sticks, whatever it has to hold */
  double *turn;     /* n: of a ball ±1, the sense of its frame */
  double *x, *y, *g;/* e: surface accelerations, m/s²; frictions and what is left of the equations, N */
  int *mode;        /* n: TR_… */
} tr_cones;

/* Surface direction d (unit) of a pair of one or two components put into its mode. */
static void tr_point(tr_sim *s, int i, const double *d) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double length = pair->nrates > 1 ? tr_onset_length(s) : 1.0;
  for (int j = 0; j < pair->nrates; ++j) tr_mode_of(s, i)->direction[j] = length * d[j] / (pair->nrates > 1 ? TR_A(s, arm)[pair->eta0 + j] : 1.0);
}

/* Unit loads of the balls, and directions in which all pairs slide: balls across these loads, or (spins) turning about their contacts obliquely to
 * them; frictions `u` (e) along these directions. */
static void tr_cones_ask(tr_sim *s, const tr_cones *c, int spins, double *u) {
  const double load[3] = {0.0, 0.0, 1.0}, along[3] = {1.0, 0.0, 0.0}, oblique[3] = {sqrt(0.5), 0.0, sqrt(0.5)};
  memset(u, 0, sizeof(double) * c->e);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    tr_mode_of(s, c->pairs[q])->flag = pair->cone && spins ? TR_CONE : TR_SLIPS;
    tr_point(s, c->pairs[q], pair->cone && spins ? oblique : along);
    u[pair->eta0] = TR_A(s, arm)[pair->eta0];
    if (pair->nrates == 3) memcpy(TR_A(s, NN) + s->k->element[pair->element].n0, load, sizeof load);
  }
  s->k->laws(TR_A(s, NN), map_rates(s->k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + s->k->c_laws, TR_A(s, law), TR_A(s, dn), TR_A(s, sliding));
}

/* What the laws of the pairs say: ratios and senses of balls, and how much more pairs hold than they rub with while they slide. A ball whose friction
 * is not of this form (Adams') has the ratio NAN. */
static void tr_cones_laws(tr_sim *s, tr_cones *c) {
  const tr_kernel *k = s->k;
  double u[c->e + 1], none[c->e + 1];
  memset(none, 0, sizeof none);
  tr_law(s, none);
  tr_cones_ask(s, c, 0, u);
  k->held_alone(TR_A(s, NN), u, TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold));
  for (int i = 0; i < c->e; ++i) c->grip[i] = 1.0;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    const double rubs = fabs(TR_A(s, law)[pair->eta0]) / TR_A(s, arm)[pair->eta0], holds = tr_hold_of(s, c->pairs[q])->capacity;
    c->mu[q] = c->slides[q] = pair->nrates < 3 ? -1.0 : pair->cone ? rubs / sqrt(1.0 - rubs * rubs) : NAN;
    if (!(holds > (1.0 + CONES_GRIP) * rubs)) continue;
    if (pair->cone) c->mu[q] = holds / sqrt(1.0 - holds * holds), c->grips = 1;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta && pair->nrates < 3 && rubs > 0.0; ++i) c->grip[i] = holds / rubs, c->grips = 1;
  }
  tr_cones_ask(s, c, 1, u);
  for (int q = 0; q < c->n; ++q) c->turn[q] = TR_A(s, law)[tr_pair_of(s, c->pairs[q])->eta0 + (c->mu[q] >= 0.0)] < 0.0 ? -1.0 : 1.0;
}

/* Set up the problem at the state whose maps are in place, from no friction; 0: not of this form. */
static int tr_cones_begin(tr_sim *s, tr_cones *c, double mass) {
  const int e = s->k->neta;
  const double *Qe = TR_A(s, Q) + e, *arm = TR_A(s, arm);
  c->part = 1.0, c->grips = 0;
  memset(c->holds, 0, sizeof(int) * c->n);
  tr_cones_laws(s, c);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    double own = 0.0;
    int free = 0;
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
      if (!tr_is_prescribed(s, i)) own -= Qe[i + i * e] * arm[i] * arm[i], ++free;
    c->rho[q] = own > 0.0 && c->pairs[q] != s->friction.freed ? mass * free / own : 0.0;
    if (!(c->mu[q] == c->mu[q]) || pair->neta != pair->nrates) return 0;
  }
  memset(c->y, 0, sizeof(double) * e);
  return 1;
}

/* How much of what its law says multiplier i has, of a pair that is no ball. */
static inline double tr_cones_share(const tr_cones *c, int i) { return (c->all ? c->part : 1.0) * (c->grips ? c->grip[i] : 1.0); }

/* p = y + ρ x of pair q (up to 3). */
static inline void tr_cones_p(const tr_sim *s, const tr_cones *c, int q, double *p) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  for (int j = 0; j < pair->neta; ++j) p[j] = c->y[pair->eta0 + j] + c->rho[q] * c->x[pair->eta0 + j];
}

/* What is left of the equations of pair q, a journal, shaft or sleeve, its law in place: it sticks while |p| is within its friction while it slides. */
static void tr_cones_row(tr_sim *s, tr_cones *c, int q) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  double p[3], most = 0.0;
  tr_cones_p(s, c, q, p);
  for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) {
    const double law = tr_cones_share(c, i) * TR_A(s, law)[i] / TR_A(s, arm)[i];
    most += law * law;
  }
  c->mode[q] = c->holds[q] || tr_dot(p, p, pair->neta) <= most ? TR_STUCK : TR_SLIPS;
  for (int j = 0; j < pair->neta && c->mode[q] == TR_STUCK; ++j) c->g[pair->eta0 + j] = c->y[pair->eta0 + j] - p[j];
}

/* What is left of the equations at the frictions y, in g; their largest size, N². */
static double tr_cones_try(tr_sim *s, tr_cones *c) {
  const int e = c->e;
  const double *Q0 = TR_A(s, Q), *arm = TR_A(s, arm);
  double *eta = TR_A(s, z) + s->k->active, sum = 0.0, p[3], R[3];
  for (int i = 0; i < e; ++i) eta[i] = c->y[i] * arm[i];
  tr_affine(e, e, Q0, Q0 + e, eta, c->x);
  for (int i = 0; i < e; ++i) c->x[i] *= arm[i];
  for (int q = 0; q < c->n; ++q) {
    const int several = tr_pair_of(s, c->pairs[q])->nrates;
    if (c->mu[q] >= 0.0) continue;
    tr_cones_p(s, c, q, p);
    if (several == 1) p[0] = p[0] < 0.0 ? -1.0 : 1.0;
    else if (!(tr_unit(several, p) > 0.0)) p[0] = 1.0;
    tr_point(s, c->pairs[q], p);
  }
  tr_law(s, eta);
  for (int i = 0; i < e; ++i) c->g[i] = c->y[i] - tr_cones_share(c, i) * TR_A(s, law)[i] / arm[i];
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    if (c->mu[q] < 0.0) {
      tr_cones_row(s, c, q);
    } else {
      tr_ball_rest b;
      tr_cones_p(s, c, q, p);
      tr_ball_at_rest(TR_A(s, NN) + s->k->element[pair->element].n0, p, c->part * c->mu[q], c->turn[q], &b, R);
      c->mode[q] = b.flag;
      for (int j = 0; j < 3; ++j) c->g[pair->eta0 + j] = c->y[pair->eta0 + j] - R[j];
    }
    for (int j = 0; j < pair->neta && !(c->rho[q] > 0.0); ++j) c->g[pair->eta0 + j] = c->y[pair->eta0 + j];
  }
  for (int i = 0; i < e; ++i) sum += c->g[i] * c->g[i];
  return sum;
}

/* Rows of J of ball q. */
static void tr_cones_ball_rows(const tr_sim *s, const tr_cones *c, int q, double *J) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  const int e = c->e, at = pair->eta0, n = s->k->nn, n0 = s->k->element[pair->element].n0;
  const double *Qe = TR_A(s, Q) + e + at, *Ne = tr_by_friction(s) + n0, *arm = TR_A(s, arm);
  double p[3], R[3], Df[9], Dp[9];
  tr_ball_rest b;
  tr_cones_p(s, c, q, p);
  tr_ball_at_rest(TR_A(s, NN) + n0, p, c->part * c->mu[q], c->turn[q], &b, R);
  tr_ball_slopes(&b, p, Df, Dp);
  for (int j = 0; j < e; ++j) {
    double moved[3], own = arm[j];
    for (int r = 0; r < 3; ++r) moved[r] = (at + r == j) + c->rho[q] * arm[at + r] * Qe[r + j * e] * own;
    for (int r = 0; r < 3; ++r) {
      double a = at + r == j;
      for (int i = 0; i < 3; ++i) a -= Df[r + 3 * i] * Ne[i + j * n] * own + Dp[r + 3 * i] * moved[i];
      J[at + r + j * e] = a;
    }
  }
}

/* Rows of J of a pair q that sticks: −ρ x; where loads are redundant a little of what its friction changes by. */
static void tr_cones_stuck_rows(const tr_sim *s, const tr_cones *c, int q, double *J) {
  const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
  const double *Qe = TR_A(s, Q) + c->e, *arm = TR_A(s, arm), slack = s->k->active ? CONES_SLACK : 0.0;
  for (int j = 0; j < c->e; ++j)
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i)
      J[i + j * c->e] = (i == j) * slack - c->rho[q] * arm[i] * Qe[i + j * c->e] * arm[j];
}

/* What the turning of the directions of shafts that slide adds to J, by differences. */
static void tr_cones_turn_rows(tr_sim *s, tr_cones *c, double *J) {
  const tr_kernel *k = s->k;
  const int e = c->e;
  const double *Qe = TR_A(s, Q) + e, *arm = TR_A(s, arm);
  double law[e], dn[k->ndn + 1], p[3], size[c->n];
  tr_sliding sliding[k->nsliders + 1];
  int turns = 0;
  for (int q = 0; q < c->n; ++q) {
    if (tr_pair_of(s, c->pairs[q])->nrates != 2 || c->mode[q] != TR_SLIPS || !(c->rho[q] > 0.0)) continue;
    tr_cones_p(s, c, q, p);
    size[q] = tr_unit(2, p);
    const double turned[2] = {p[0] - TURN_TRIED * p[1], p[1] + TURN_TRIED * p[0]};
    tr_point(s, c->pairs[q], turned), turns = 1;
  }
  if (!turns) return;
  k->laws(TR_A(s, NN), map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, law, dn, (double *)sliding);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    if (pair->nrates != 2 || c->mode[q] != TR_SLIPS || !(c->rho[q] > 0.0)) continue;
    tr_cones_p(s, c, q, p);
    tr_unit(2, p);
    tr_point(s, c->pairs[q], p);
    for (int r = 0; r < 2; ++r) {
      const int i = pair->eta0 + r;
      const double slope = tr_cones_share(c, i) * (law[i] - TR_A(s, law)[i]) / (TURN_TRIED * arm[i] * size[q]);
      for (int j = 0; j < e; ++j) {
        double across = 0.0;
        for (int a = 0; a < 2; ++a) across += (a ? p[0] : -p[1]) * ((pair->eta0 + a == j) + c->rho[q] * arm[pair->eta0 + a] * Qe[pair->eta0 + a + j * e] * arm[j]);
        J[i + j * e] -= slope * across;
      }
    }
  }
}

/* The factors of the derivative of g by y, in `lu`, at what tr_cones_try has left; ±1: the sense of its determinant, 0: singular. */
static int tr_cones_factor(tr_sim *s, tr_cones *c) {
  const int e = c->e;
  const double *arm = TR_A(s, arm);
  double *J = TR_A(s, lu);
  int *perm = (int *)TR_A(s, perm) + s->k->active;
  tr_law_jacobian(s);
  for (int j = 0; j < e; ++j)
    for (int i = 0; i < e; ++i) J[i + j * e] = (i == j) + tr_cones_share(c, i) * (J[i + j * e] - (i == j)) * arm[j] / arm[i];
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    if (c->mu[q] >= 0.0) tr_cones_ball_rows(s, c, q, J);
    else if (c->mode[q] == TR_STUCK) tr_cones_stuck_rows(s, c, q, J);
    for (int i = pair->eta0; i < pair->eta0 + pair->neta && !(c->rho[q] > 0.0); ++i)
      for (int j = 0; j < e; ++j) J[i + j * e] = i == j;
  }
  tr_cones_turn_rows(s, c, J);
  s->stats.newton_iterations++, c->most--;
  return tr_lu(e, J, perm) ? tr_lu_sense(e, J, perm) : 0;
}

/* How the frictions asked for by the equations grow with their part, at what tr_cones_try has left: −∂g/∂part (e). */
static void tr_cones_by_part(tr_sim *s, const tr_cones *c, double *by) {
  double p[3], R[3], more[3];
  tr_ball_rest b;
  for (int i = 0; i < c->e; ++i) by[i] = c->all ? (c->grips ? c->grip[i] : 1.0) * TR_A(s, law)[i] / TR_A(s, arm)[i] : 0.0;
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    const double *f = TR_A(s, NN) + s->k->element[pair->element].n0;
    for (int j = 0; j < pair->neta && (c->mode[q] == TR_STUCK || !(c->rho[q] > 0.0)); ++j) by[pair->eta0 + j] = 0.0;
    if (c->mu[q] < 0.0 || !(c->rho[q] > 0.0)) continue;
    tr_cones_p(s, c, q, p);
    tr_ball_at_rest(f, p, c->part * c->mu[q], c->turn[q], &b, R);
    tr_ball_at_rest(f, p, (c->part + CONES_TRIED) * c->mu[q], c->turn[q], &b, more);
    for (int j = 0; j < 3; ++j) by[pair->eta0 + j] = (more[j] - R[j]) / CONES_TRIED;
  }
}
