/* Start values that close the loops: positions, then velocities, changing as little as possible.
 *
 * First only coordinates the user left open move, from zero and then from elsewhere, for what is given is kept where it can be; when that
 * is not enough everything may, given ones a hundred times less. Where that does not close either, the start may be singular (links
 * exactly in line, which would close to either side): it is nudged and all is tried again. */
#include "tr.h"

#define TIGHT 1e-13         /* of the length (rad): closed; a hundredth of it ends the search, the rest is for where round-off is larger */
#define TIGHT_ENDS 1e-2
#define RATES_CLOSED 1e-15  /* of length · rate (rate): round-off of rates that agree, which are the solution of linear equations */
#define RATES_AGREE 1e-11   /* and the most that counts as agreeing: their condition takes four digits */
#define NO_ROW 1e-30        /* squared unit changes: a row that nothing may change */
#define ROW_DEPENDS 1e-10   /* of a row's scale: pivots of rows that follow from others */
#define CLOSE_STEPS 200     /* Newton steps from far away, cut to */
#define CLOSE_CUT 0.3       /* rad; of the length */
#define CLOSE_STALLED 40    /* steps that did not halve the best residual: it will not close */
#define NUDGE 0.02 /* rad; of the length scale */
#define AFAR 3.141592653589793 /* rad; of the length scale: as far apart are starts of what is open */
#define TRIES_AFAR 24 /* what cannot be kept costs so many searches: a tenth of a second with forty loops */

/* G (rows × nv) of all rows at y, from differences of the (linear) velocity residual. */
static void tr_constraint_jacobian(tr_sim *s, double *y, double *G) {
  const tr_kernel *k = s->k;
  int rows = k->rows;
  double v[k->nv + 1], h0[2 * rows], h1[2 * rows];
  const double *c = TR_A(s, c) + k->c_closure;
  memcpy(v, y + k->nq, sizeof(double) * k->nv);
  memset(y + k->nq, 0, sizeof(double) * k->nv);
  k->closure(TR_A(s, x), y, c, h0);
  for (int j = 0; j < k->nv; ++j) {
    y[k->nq + j] = 1.0;
    k->closure(TR_A(s, x), y, c, h1);
    y[k->nq + j] = 0.0;
    for (int i = 0; i < rows; ++i) G[i + rows * j] = h1[rows + i] - h0[rows + i];
  }
  memcpy(y + k->nq, v, sizeof(double) * k->nv);
}

/* δ = W²Gᵀ (G W² Gᵀ)⁺ b: the smallest change in the weighted sense. weight: nv. */
static void tr_least_change(tr_sim *s, const double *G, const double *weight, const double *b, double *delta) {
  const tr_kernel *k = s->k;
  int n = k->rows;
  double *A = TR_A(s, jw), *L = A + n * n, d[n], x[n];
  int perm[n];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      double a = 0.0;
      for (int q = 0; q < k->nv; ++q) a += G[i + n * q] * weight[q] * weight[q] * G[j + n * q];
      A[i + n * j] = a;
    }
  for (int i = 0; i < n; ++i) d[i] = A[i + n * i] > NO_ROW ? 1.0 / sqrt(A[i + n * i]) : 0.0;
  int rank = tr_cholesky(n, A, d, L, perm, 0, ROW_DEPENDS, ROW_DEPENDS);
  tr_cholesky_solve(n, rank, L, perm, d, b, x);
  for (int q = 0; q < k->nv; ++q) {
    double a = 0.0;
    for (int i = 0; i < n; ++i) a += G[i + n * q] * x[i];
    delta[q] = weight[q] * weight[q] * a;
  }
}

/* Largest residual of all rows, positions or rates, in units of the length or of length · rate (turns: 1, rate). */
static double tr_all_residual(const tr_sim *s, const double *h, int rates) {
  const tr_kernel *k = s->k;
  double worst = 0.0;
  for (int i = 0; i < k->rows; ++i) {
    double unit = tr_row_unit(s, i);
    worst = fmax(worst, fabs(h[i + (rates ? k->rows : 0)]) / (unit * (rates ? s->set.rate : 1.0)));
  }
  return worst;
}

/* Newton on the positions with the given weights; 1 when closed. The state nearest to closing of all tries, `least` apart, is kept in
 * `nearest`. */
static int tr_close_positions(tr_sim *s, double *y, const double *weight, double *G, double *least, double *nearest) {
  const tr_kernel *k = s->k;
  const double *c = TR_A(s, c) + k->c_closure;
  double h[2 * k->rows], b[k->rows], dv[k->nv + 1], dq[k->nq + 4], best = INFINITY;
  int stalled = 0;
  for (int it = 0; it < CLOSE_STEPS; ++it) {
    k->closure(TR_A(s, x), y, c, h);
    double now = tr_all_residual(s, h, 0);
    if (!(now < INFINITY)) return 0;
    if (now < *least) *least = now, memcpy(nearest, y, sizeof(double) * s->ny);
    if (now <= TIGHT * TIGHT_ENDS) return 1;
    if (now > 0.5 * best) {
      if (now <= TIGHT) return 1;
      if (++stalled > CLOSE_STALLED) return 0;
    } else stalled = 0;
    best = fmin(best, now);
    tr_constraint_jacobian(s, y, G);
    for (int i = 0; i < k->rows; ++i) b[i] = -h[i];
    tr_least_change(s, G, weight, b, dv);
    double big = 0.0;
    for (int i = 0; i < k->nv; ++i) big = fmax(big, fabs(dv[i]) / tr_rate_unit(s, i));
    double cut = big > CLOSE_CUT ? CLOSE_CUT / big : 1.0;
    for (int i = 0; i < k->nv; ++i) dv[i] *= cut;
    k->qdot(y, dv, dq);
    for (int i = 0; i < k->nq; ++i) y[i] += dq[i];
    tr_normalize(s, y);
  }
  return 0;
}

/* How far each rate may move: in its unit, those the user has given by the part `held` of it. */
static void tr_weights(const tr_sim *s, const double *given, double held, double *weight) {
  for (int i = 0; i < s->k->nv; ++i) weight[i] = (given[i] != 0.0 ? held : 1.0) * tr_rate_unit(s, i);
}

/* Move every coordinate that may move a little, each by another amount. */
static void tr_nudge(tr_sim *s, double *y, const double *weight) {
  const tr_kernel *k = s->k;
  double dv[k->nv + 1], dq[k->nq + 4];
  for (int i = 0; i < k->nv; ++i) dv[i] = NUDGE * weight[i] / (1.0 + 0.618 * i);
  k->qdot(y, dv, dq);
  for (int i = 0; i < k->nq; ++i) y[i] += dq[i];
  tr_normalize(s, y);
}

/* Positions closed by open coordinates alone, sought from places all over their range where the one they have leads nowhere: a chain that
 * comes from far away may stall though there is a place for it. Only beside given ones: else nothing is kept by it. 1 when closed. */
static int tr_close_from_afar(tr_sim *s, double *y, const double *given, const double *start, double *G, double *least, double *nearest) {
  const tr_kernel *k = s->k;
  double weight[k->nv + 1], dv[k->nv + 1], dq[k->nq + 4];
  int kept = 0, open = 0;
  unsigned seed = 1u;
  tr_weights(s, given, 0.0, weight);
  for (int i = 0; i < k->nv; ++i) kept += given[i] != 0.0, open += given[i] == 0.0;
  for (int attempt = 0; attempt < TRIES_AFAR && kept && open; ++attempt) {
    memcpy(y, start, sizeof(double) * s->ny);
    for (int i = 0; i < k->nv; ++i) dv[i] = AFAR * weight[i] * tr_next_number(&seed);
    k->qdot(y, dv, dq);
    for (int i = 0; i < k->nq; ++i) y[i] += dq[i];
    tr_normalize(s, y);
    if (tr_close_positions(s, y, weight, G, least, nearest)) return 1;
  }
  return 0;
}

/* Make the start state consistent. qgiven, vgiven (nv each): 1 where the user said so. Returns 1; 0 positions cannot be closed;
 * −1 velocities cannot. The block's y holds the result, or the state found that is nearest to one. */
static int tr_assemble_state(tr_sim *s, const double *qgiven, const double *vgiven) {
  const tr_kernel *k = s->k;
  double *y = TR_A(s, y);
  tr_normalize(s, y);
  if (k->rows == 0) return 1;
  tr_set_time(s, s->clock.t);
  double weight[k->nv + 1], start[s->ny + 1], *G = TR_A(s, jac), h[2 * k->rows], b[k->rows], dv[k->nv + 1];
  memcpy(start, y, sizeof(double) * s->ny);
  const double held[3] = {0.0, 0.01, 1.0};
  int closed = 0;
  double least = INFINITY, *nearest = TR_A(s, ynew);
  for (int phase = 0; phase < 6 && !closed; ++phase) {
    memcpy(y, start, sizeof(double) * s->ny);
    tr_weights(s, qgiven, held[phase % 3], weight);
    if (phase >= 3) tr_nudge(s, y, weight);
    closed = tr_close_positions(s, y, weight, G, &least, nearest);
    if (!closed && phase == 0) closed = tr_close_from_afar(s, y, qgiven, start, G, &least, nearest);
  }
  if (!closed && least < INFINITY) memcpy(y, nearest, sizeof(double) * s->ny);
  if (!closed) return 0;
  tr_constraint_jacobian(s, y, G);
  for (int phase = 0; phase < 3; ++phase) {
    memcpy(y + k->nq, start + k->nq, sizeof(double) * k->nv);
    tr_weights(s, vgiven, held[phase], weight);
    for (int it = 0; it < 4; ++it) {
      k->closure(TR_A(s, x), y, TR_A(s, c) + k->c_closure, h);
      if (tr_all_residual(s, h, 1) <= RATES_CLOSED) return 1;
      for (int i = 0; i < k->rows; ++i) b[i] = -h[k->rows + i];
      tr_least_change(s, G, weight, b, dv);
      for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
    }
    k->closure(TR_A(s, x), y, TR_A(s, c) + k->c_closure, h);
    if (tr_all_residual(s, h, 1) <= RATES_AGREE) return 1;
  }
  return -1;
}
