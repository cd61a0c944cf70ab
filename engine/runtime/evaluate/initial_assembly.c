/* Initial assembly. Newton's method finds the positions that close the loops with the smallest change. Rates that satisfy the loops
 * are then computed. */
#include "evaluate/evaluate.h"

/* in units of length · rate (rotations: rate): a smaller residual of the rates is round-off */
#define RATES_CLOSED 1e-15
/* in units of length · rate (rotations: rate): largest residual of consistent rates, which may have lost 4 digits */
#define RATES_AGREE 1e-11
/* rad, or relative to the length scale: a smaller gap counts as rounding of the given values, which may then change a little */
#define ROUNDED 1e-6
/* rad, or relative to the length scale: largest gap that values with two digits can cause. With a larger gap, the given values
 * contradict each other. */
#define FEW_DIGITS 1e-2
#define MOVED_BY 10.0       /* relative to the gap: largest change of given values */
#define NEARER 0.1 /* relative to the smallest residual of earlier searches: a later search must end at a smaller residual */
#define NUDGE 0.02 /* rad, or relative to the length scale: displacement of the start in later phases of the search */
#define AFAR (0.5 * TURN) /* rad, or relative to the length scale: spread of random starts of open coordinates */
#define HELD 0.01     /* relative to the change of open coordinates: allowed change of given coordinates */
#define TRIES_AFAR 24 /* number of random starts; with forty loops, they take a tenth of a second in all */
#define TIGHT 1e-13 /* relative to the length scale, or rad: residual of closed loops; a search ends below TIGHT_ENDS × TIGHT */
#define TIGHT_ENDS 1e-2
#define NO_LEVER 1e-12      /* relative to the length scale, or rad: a smaller effect of a unit change on a row is round-off */
#define ROW_DEPENDS 1e-10   /* relative to a row's scale: largest pivot of a dependent row */
/* relative to the number of rows: largest pivot that only round-off causes. Far from closed loops, pivots between this limit and
 * ROW_DEPENDS belong to nearly singular poses (links nearly in line). In these poses, a small change of an angle decides to which
 * side the loop closes. */
#define ROW_ROUND_OFF 1e-15
#define TIGHT_LAST 4e-15    /* relative to the largest coordinate, in rad or lengths: round-off of this coordinate */
#define TIGHT_MOST 5e-9     /* largest tolerance of closed loops; below the gap that later checks call open */
#define CLOSE_STEPS 200     /* largest number of Newton steps; far from the solution, steps are shortened */
#define CLOSE_CUT 0.3       /* rad, or relative to the length scale: largest change in a shortened step */
#define CLOSE_STALLED 40    /* number of steps after which a search has failed if its best residual was not halved */
#define LONGER 4.0          /* ratio of successive trial fractions of a step, in a search with long steps */
#define PAYS 0.5            /* relative to the reduction that the linear model predicts: smallest accepted reduction */
#define BODY_COSTS 100.0    /* multiplications per body and freedom in one evaluation */
#define FARTHEST 1e7        /* rad, or relative to the length scale: longest step, about a million turns of a screw */

/* A search for closed positions. given (nv), for each freedom: 0 if its start coordinate is open, 1 if it is given, 2 if it is exact
 * and must not change. start: the state before the search. weight (nv): allowed change of position along each rate. G: the
 * constraint Jacobian. nearest, least: best state of all searches, and its residual. moved: largest change of given coordinates in
 * the last search, in units of tr_rate_unit. */
typedef struct tr_position_search {
  tr_sim *s;
  const double *given, *start;
  double *weight, *G, *nearest, least, moved;
} tr_position_search;

/* Allowed change of freedom i in its unit: 1 if its value is open, `held` if it is given, 0 if it is exact. */
static double tr_allowed_change(const tr_position_search *c, int i, double held) {
  return c->given[i] == 0.0 ? 1.0 : c->given[i] == 1.0 ? held : 0.0;
}

/* Set `weight`, the allowed changes in the units of the rates. */
static void tr_set_weights(tr_position_search *c, double held) {
  for (int i = 0; i < c->s->k->nv; ++i) c->weight[i] = tr_allowed_change(c, i, held) * tr_rate_unit(c->s, i);
}

/* Largest residual of all rows, of positions or of rates. Units for translation: length scale, and length · rate for rates. Units
 * for rotation: 1 rad, and rate. */
static double tr_largest_residual(const tr_sim *s, const double *h, int rates) {
  const tr_kernel *k = s->k;
  double worst = 0.0;
  for (int i = 0; i < k->rows; ++i) {
    double unit = tr_row_unit(s, i);
    worst = fmax(worst, fabs(h[i + (rates ? k->rows : 0)]) / (unit * (rates ? s->set.rate : 1.0)));
  }
  return worst;
}

/* Largest position residual at y. h receives the residuals of all rows. */
static double tr_position_residual(tr_sim *s, const double *y, double *h) {
  tr_evaluate_closure(s, y, h);
  return tr_largest_residual(s, h, 0);
}

/* Largest residual at y with which the loops count as closed. This residual is round-off, which grows with the coordinates
 * (example: a screw thousands of turns from zero). */
static double tr_closed_tolerance(const tr_sim *s, const double *y) {
  double far = 0.0;
  for (int i = 0; i < s->k->nq; ++i) far = fmax(far, fabs(y[i]) / (s->k->qkind[i] == TR_COORDINATE_LENGTH ? s->set.length : 1.0));
  return fmin(fmax(TIGHT, TIGHT_LAST * far), TIGHT_MOST);
}

/* h (2·rows) ← residuals at y with rate j = 1 and all other rates 0; for j = −1, with all rates 0. The velocity residual is linear
 * in the rates, so the difference of two results is a column of the constraint Jacobian. All rates in y must be zero. */
static void tr_residual_of_rate(tr_sim *s, double *y, int j, double *h) {
  const tr_kernel *k = s->k;
  if (j >= 0) y[k->nq + j] = 1.0;
  tr_evaluate_closure(s, y, h);
  if (j >= 0) y[k->nq + j] = 0.0;
}

/* Constraint Jacobian G (rows × nv) of all rows at y. */
static void tr_constraint_jacobian(tr_sim *s, double *y, double *G) {
  TR_SPOILT(s, TR_HAS_JACOBIAN);
  const tr_kernel *k = s->k;
  int rows = k->rows;
  double v[k->nv + 1], h0[2 * rows], h1[2 * rows];
  memcpy(v, y + k->nq, sizeof(double) * k->nv);
  memset(y + k->nq, 0, sizeof(double) * k->nv);
  tr_residual_of_rate(s, y, -1, h0);
  for (int j = 0; j < k->nv; ++j) {
    tr_residual_of_rate(s, y, j, h1);
    for (int i = 0; i < rows; ++i) G[i + rows * j] = h1[rows + i] - h0[rows + i];
  }
  memcpy(y + k->nq, v, sizeof(double) * k->nv);
}

/* delta = W²Gᵀ (G W² Gᵀ)⁺ b: the smallest weighted change that removes the residual b. W = diag(weight), with nv entries. far:
 * whether rows are dependent only by round-off (ROW_ROUND_OFF). */
static void tr_least_change(tr_sim *s, const double *G, const double *weight, const double *b, int far, double *delta) {
  const tr_kernel *k = s->k;
  int n = k->rows;
  double *A = TR_A(s, jw), *L = A + n * n, d[n], x[n];
  int perm[n], moved[n];
  memset(A, 0, sizeof(double) * n * n);
  /* lower triangle of G W² Gᵀ, from nonzero entries alone, because each freedom changes few rows */
  for (int q = 0; q < k->nv; ++q) {
    const double *g = G + (size_t)n * q;
    int count = 0;
    for (int i = 0; i < n; ++i)
      if (g[i] != 0.0) moved[count++] = i;
    for (int j = 0; j < count; ++j)
      for (int i = j; i < count; ++i) A[moved[i] + n * moved[j]] += g[moved[i]] * weight[q] * weight[q] * g[moved[j]];
  }
  for (int i = 0; i < n; ++i) {
    const double lever = sqrt(A[i + n * i]);
    d[i] = lever > NO_LEVER * tr_row_unit(s, i) ? 1.0 / lever : 0.0;
  }
  int rank = tr_cholesky(n, A, d, L, perm, 0, ROW_DEPENDS, ROW_DEPENDS);
  double left = 0.0;
  for (int i = rank; i < n; ++i) left = fmax(left, L[i + i * n]);
  if (far && left > n * ROW_ROUND_OFF) rank = tr_cholesky(n, A, d, L, perm, 0, n * ROW_ROUND_OFF, n * ROW_ROUND_OFF);
  tr_cholesky_solve(n, rank, L, perm, d, b, x);
  for (int q = 0; q < k->nv; ++q) {
    double a = 0.0;
    for (int i = 0; i < n; ++i) a += G[i + n * q] * x[i];
    delta[q] = weight[q] * weight[q] * a;
  }
}

/* y ← the positions `from`, moved with the rates part · dv for one second. */
static void tr_move_positions(const tr_sim *s, const double *from, const double *dv, double part, double *y) {
  const tr_kernel *k = s->k;
  double v[k->nv + 1], dq[k->nq + 4];
  for (int i = 0; i < k->nv; ++i) v[i] = part * dv[i];
  k->qdot(from, v, TR_A(s, c), dq);
  for (int i = 0; i < k->nq; ++i) y[i] = from[i] + dq[i];
  tr_normalise_quaternions(s, y);
}

/* Fraction of the step dv to take. By default, the largest change is at most CLOSE_CUT. With `longer`, the fraction is the largest
 * that reduces the residual `now` by at least PAYS × the predicted reduction. For a screw with an unknown number of turns, the
 * largest component of dv is then tried alone; on success, this component replaces dv. */
static double tr_step_part(tr_position_search *c, const double *y, double *dv, double now, int longer) {
  tr_sim *s = c->s;
  const int nv = s->k->nv;
  double big = 0.0, h[2 * s->k->rows], at[s->ny + 1], alone[nv + 1];
  int farthest = 0;
  for (int i = 0; i < nv; ++i)
    if (fabs(dv[i]) / tr_rate_unit(s, i) > big) big = fabs(dv[i]) / tr_rate_unit(s, i), farthest = i;
  double cut = big > CLOSE_CUT ? CLOSE_CUT / big : 1.0;
  memcpy(at, y, sizeof(double) * s->ny);
  for (double part = 1.0; longer && part > cut; part /= LONGER) {
    if (part * big > FARTHEST) continue;
    tr_move_positions(s, y, dv, part, at);
    if (tr_position_residual(s, at, h) <= (1.0 - PAYS * part) * now) return part;
    for (int i = 0; i < nv; ++i) alone[i] = i == farthest ? dv[i] : 0.0;
    tr_move_positions(s, y, alone, part, at);
    if (tr_position_residual(s, at, h) > (1.0 - PAYS * part) * now) continue;
    memcpy(dv, alone, sizeof(double) * nv);
    return part;
  }
  return cut;
}

/* Newton's method on the positions of y. Returns 1 if the loops are closed, 0 on failure or cancellation. */
static int tr_close_positions(tr_position_search *c, double *y, int longer) {
  tr_sim *s = c->s;
  const tr_kernel *k = s->k;
  double h[2 * k->rows], b[k->rows], dv[k->nv + 1], from[s->ny + 1], total[k->nv + 1], best = INFINITY;
  int stalled = 0;
  memset(total, 0, sizeof total);
  for (int it = 0; it < CLOSE_STEPS; ++it) {
    if (tr_is_cancelled(s, k->nv * ((double)k->rows * k->rows + BODY_COSTS * k->nbodies))) return 0;
    double now = tr_position_residual(s, y, h), tight = tr_closed_tolerance(s, y);
    if (!(now < INFINITY)) return 0;
    if (now < c->least) c->least = now, memcpy(c->nearest, y, sizeof(double) * s->ny);
    c->moved = 0.0;
    for (int i = 0; i < k->nv; ++i) c->moved = c->given[i] != 0.0 ? fmax(c->moved, fabs(total[i]) / tr_rate_unit(s, i)) : c->moved;
    if (now <= tight * TIGHT_ENDS) return 1;
    if (now > 0.5 * best) {
      if (now <= tight) return 1;
      if (++stalled > CLOSE_STALLED) return 0;
    } else stalled = 0;
    best = fmin(best, now);
    tr_constraint_jacobian(s, y, c->G);
    for (int i = 0; i < k->rows; ++i) b[i] = -h[i];
    tr_least_change(s, c->G, c->weight, b, now > FEW_DIGITS, dv);
    const double part = tr_step_part(c, y, dv, now, longer);
    memcpy(from, y, sizeof(double) * s->ny);
    tr_move_positions(s, from, dv, part, y);
    for (int i = 0; i < k->nv; ++i) total[i] += part * dv[i];
  }
  return 0;
}

/* Close the loops from the state `near`. Given values may change a little, because the user rounded them. Returns 1 if the loops
 * are closed and no given value changed by more than MOVED_BY × gap. */
static int tr_close_rounded(tr_position_search *c, const double *near, double gap, double *y) {
  memcpy(y, near, sizeof(double) * c->s->ny);
  tr_set_weights(c, HELD);
  return tr_close_positions(c, y, 1) && c->moved <= MOVED_BY * gap;
}

/* Displace open coordinates from the start by up to `far`, and given coordinates by up to `held` · `far`. With a null pointer
 * `seed`, the displacements are fixed and differ from each other; otherwise they are random. */
static void tr_displace_start(const tr_position_search *c, double far, double held, unsigned *seed, double *y) {
  const int nv = c->s->k->nv;
  double dv[nv + 1];
  for (int i = 0; i < nv; ++i)
    dv[i] = far * tr_allowed_change(c, i, held) * tr_rate_unit(c->s, i) * (seed ? tr_next_random(seed) : 1.0 / (1.0 + 0.618 * i));
  memcpy(y, c->start, sizeof(double) * c->s->ny);
  tr_move_positions(c->s, c->start, dv, 1.0, y);
}

/* Close the positions by changes of open coordinates alone. The first search begins at the start state, later searches at random
 * starts. If all fail, the searches are repeated with long steps. If this fails and the gap is small, given values with few digits
 * may change too. Returns 1 if the loops are closed. */
static int tr_close_with_open_coordinates(tr_position_search *c, double *y) {
  const int ny = c->s->ny;
  int kept = 0, open = 0;
  double near[ny + 1], gap = INFINITY;
  for (int i = 0; i < c->s->k->nv; ++i) kept += c->given[i] != 0.0, open += c->given[i] == 0.0;
  for (int longer = 0; longer < 2; ++longer) {
    unsigned seed = 1u;
    tr_displace_start(c, 0.0, 0.0, 0, y);
    for (int attempt = 0; attempt <= TRIES_AFAR; ++attempt) {
      tr_set_weights(c, 0.0);
      if (tr_close_positions(c, y, longer)) return 1;
      if (!kept || !open) break;
      if (c->least < NEARER * gap) gap = c->least, memcpy(near, c->nearest, sizeof(double) * ny);
      if (attempt == 0 && gap <= ROUNDED && tr_close_rounded(c, near, gap, y)) return 1;
      tr_displace_start(c, AFAR, 0.0, &seed, y);
    }
  }
  return gap <= FEW_DIGITS && tr_close_rounded(c, near, gap, y);
}

/* Close the positions from random starts. Returns 0 if the scene has given values: searches from the same starts have then already
 * failed. */
static int tr_close_from_afar(tr_position_search *c, double *y) {
  unsigned seed = 1u;
  for (int i = 0; i < c->s->k->nv; ++i)
    if (c->given[i] != 0.0) return 0;
  tr_set_weights(c, 0.0);
  for (int attempt = 0; attempt < TRIES_AFAR; ++attempt) {
    tr_displace_start(c, AFAR, 0.0, &seed, y);
    if (tr_close_positions(c, y, 0)) return 1;
  }
  return 0;
}

static int tr_assemble_state(tr_sim *s, const double *qgiven, const double *vgiven) {
  const tr_kernel *k = s->k;
  double *y = TR_A(s, y);
  tr_normalise_quaternions(s, y);
  if (k->rows == 0) return 1;
  tr_set_time(s, s->clock.t);
  double weight[k->nv + 1], start[s->ny + 1], *G = TR_A(s, jac), h[2 * k->rows], b[k->rows], dv[k->nv + 1];
  memcpy(start, y, sizeof(double) * s->ny);
  const double held[3] = {0.0, HELD, 1.0};
  tr_position_search c = {s, qgiven, start, weight, G, TR_A(s, ynew), INFINITY, 0.0};
  int closed = tr_close_with_open_coordinates(&c, y);
  for (int phase = 1; phase < 6 && !closed; ++phase) {
    tr_displace_start(&c, phase < 3 ? 0.0 : NUDGE, held[phase % 3], 0, y);
    tr_set_weights(&c, held[phase % 3]);
    closed = tr_close_positions(&c, y, 0) || tr_close_positions(&c, y, 1);
  }
  closed = closed || tr_close_from_afar(&c, y);
  if (!closed && c.least < INFINITY) memcpy(y, c.nearest, sizeof(double) * s->ny);
  if (!closed) return 0;
  c.given = vgiven;
  int formed = 0;
  for (int phase = 0; phase < 3; ++phase) {
    memcpy(y + k->nq, start + k->nq, sizeof(double) * k->nv);
    tr_set_weights(&c, held[phase]);
    for (int it = 0; it < 4; ++it) {
      tr_evaluate_closure(s, y, h);
      if (tr_largest_residual(s, h, 1) <= RATES_CLOSED) return 1;
      if (!formed) tr_constraint_jacobian(s, y, G), formed = 1;
      for (int i = 0; i < k->rows; ++i) b[i] = -h[k->rows + i];
      tr_least_change(s, G, weight, b, 0, dv);
      for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
    }
    tr_evaluate_closure(s, y, h);
    if (tr_largest_residual(s, h, 1) <= RATES_AGREE) return 1;
  }
  return -1;
}

static int tr_has_idle_rows(tr_sim *s, double *y) {
  const tr_kernel *k = s->k;
  const int rows = k->rows;
  double v[k->nv + 1], h0[2 * rows], h1[2 * rows];
  int idle = 1;
  memcpy(v, y + k->nq, sizeof(double) * k->nv);
  memset(y + k->nq, 0, sizeof(double) * k->nv);
  tr_residual_of_rate(s, y, -1, h0);
  for (int j = 0; j < k->nv && idle; ++j) {
    tr_residual_of_rate(s, y, j, h1);
    for (int i = 0, r; i < k->active && idle; ++i)
      r = k->active_rows[i], idle = !(fabs(h1[rows + r] - h0[rows + r]) * tr_rate_unit(s, j) > NO_LEVER * tr_row_unit(s, r));
  }
  memcpy(y + k->nq, v, sizeof(double) * k->nv);
  return idle;
}
