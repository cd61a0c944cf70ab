/* Newton's search for positions that close the loops, changing as little as possible: one from where the coordinates are, with short steps
 * or long ones. */
#include "tr.h"

#define TIGHT 1e-13         /* of the length (rad): closed; a hundredth of it ends the search, the rest is for where round-off is larger */
#define TIGHT_ENDS 1e-2
#define NO_ROW 1e-30        /* squared unit changes: a row that nothing may change */
#define NO_LEVER 1e-12      /* of the length (rad): what a unit change moves no row by more than is round-off */
#define ROW_DEPENDS 1e-10   /* of a row's scale: pivots of rows that follow from others */
#define TIGHT_LAST 4e-15    /* of the largest coordinate (rad; of the length) where that is far out: its own round-off */
#define TIGHT_MOST 5e-9     /* below what counts as open later */
#define CLOSE_STEPS 200     /* Newton steps from far away, cut to */
#define CLOSE_CUT 0.3       /* rad; of the length */
#define CLOSE_STALLED 40    /* steps that did not halve the best residual: it will not close */
#define LONGER 4.0          /* a whole step, or parts of it in this ratio, where the loops close far beyond what so many cut steps go */
#define PAYS 0.5            /* of what a part of a step promises to take from the residual: what it must take */
#define BODY_COSTS 100.0    /* multiplications for where a body is, once for each freedom */
#define FARTHEST 1e7        /* rad; of the length: no part of a step is longer; a million turns of a screw */

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

/* Whether no freedom moves any active row at y by more than round-off: all that the loops ask follows from the joints outside of them, as for a
 * door on two hinges. In axes that are not the world's nothing else tells what is left from rows. */
static int tr_rows_hold_nothing(tr_sim *s, double *y) {
  const tr_kernel *k = s->k;
  double *G = TR_A(s, jac);
  tr_constraint_jacobian(s, y, G);
  for (int i = 0; i < k->active; ++i)
    for (int j = 0, r = k->active_rows[i]; j < k->nv; ++j)
      if (fabs(G[r + k->rows * j]) * tr_rate_unit(s, j) > NO_LEVER * tr_row_unit(s, r)) return 0;
  return 1;
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

/* A search for closed positions. given, weight (nv): what the user said, and how far each rate may move; start: the state as given;
 * nearest: the state nearest to closing of all searches, `least` apart; moved: how far the last one moved given
 * ones. */
typedef struct tr_closing {
  tr_sim *s;
  const double *given, *start;
  double *weight, *G, *nearest, least, moved;
} tr_closing;

/* y ← from, moved by `part` of the rates dv, as if they lasted a second. */
static void tr_move(const tr_sim *s, const double *from, const double *dv, double part, double *y) {
  const tr_kernel *k = s->k;
  double v[k->nv + 1], dq[k->nq + 4];
  for (int i = 0; i < k->nv; ++i) v[i] = part * dv[i];
  k->qdot(from, v, TR_A(s, c), dq);
  for (int i = 0; i < k->nq; ++i) y[i] = from[i] + dq[i];
  tr_normalize(s, y);
}

/* Largest residual of the positions at y, of which all rows' go to h. */
static double tr_gap_at(tr_sim *s, const double *y, double *h) {
  s->k->closure(TR_A(s, x), y, TR_A(s, c) + s->k->c_closure, h);
  return tr_all_residual(s, h, 0);
}

/* What counts as closed at y: round-off, that of coordinates far out too (a screw some thousand turns from its zero). */
static double tr_tight(const tr_sim *s, const double *y) {
  double far = 0.0;
  for (int i = 0; i < s->k->nq; ++i) far = fmax(far, fabs(y[i]) / (s->k->qkind[i] == TR_COORDINATE_LENGTH ? s->set.length : 1.0));
  return fmin(fmax(TIGHT, TIGHT_LAST * far), TIGHT_MOST);
}

/* How much of the step dv is made: what CLOSE_CUT leaves of it; with `longer` all of it, that of the farthest coordinate alone (a screw,
 * on which something turns that cannot know how often), or the largest part, that takes from the residual `now` what it should. */
static double tr_part(tr_closing *c, const double *y, double *dv, double now, int longer) {
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
    tr_move(s, y, dv, part, at);
    if (tr_gap_at(s, at, h) <= (1.0 - PAYS * part) * now) return part;
    for (int i = 0; i < nv; ++i) alone[i] = i == farthest ? dv[i] : 0.0;
    tr_move(s, y, alone, part, at);
    if (tr_gap_at(s, at, h) > (1.0 - PAYS * part) * now) continue;
    memcpy(dv, alone, sizeof(double) * nv);
    return part;
  }
  return cut;
}

/* Newton on the positions from y; 1 when closed, 0 also when it is given up. */
static int tr_close_positions(tr_closing *c, double *y, int longer) {
  tr_sim *s = c->s;
  const tr_kernel *k = s->k;
  double h[2 * k->rows], b[k->rows], dv[k->nv + 1], from[s->ny + 1], total[k->nv + 1], best = INFINITY;
  int stalled = 0;
  memset(total, 0, sizeof total);
  for (int it = 0; it < CLOSE_STEPS; ++it) {
    if (tr_gives_up(s, k->nv * ((double)k->rows * k->rows + BODY_COSTS * k->nbodies))) return 0;
    double now = tr_gap_at(s, y, h), tight = tr_tight(s, y);
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
    tr_least_change(s, c->G, c->weight, b, dv);
    const double part = tr_part(c, y, dv, now, longer);
    memcpy(from, y, sizeof(double) * s->ny);
    tr_move(s, from, dv, part, y);
    for (int i = 0; i < k->nv; ++i) total[i] += part * dv[i];
  }
  return 0;
}

/* Move every coordinate from where it starts, given ones by the part `held` of it: each by another amount, or (seed) by chance. */
static void tr_displace(const tr_closing *c, double far, double held, unsigned *seed, double *y) {
  const int nv = c->s->k->nv;
  double dv[nv + 1];
  for (int i = 0; i < nv; ++i)
    dv[i] = far * (c->given[i] != 0.0 ? held : 1.0) * tr_rate_unit(c->s, i) * (seed ? tr_next_number(seed) : 1.0 / (1.0 + 0.618 * i));
  memcpy(y, c->start, sizeof(double) * c->s->ny);
  tr_move(c->s, c->start, dv, 1.0, y);
}

/* How far each rate may move: in its unit, those the user has given by the part `held` of it. */
static void tr_weights(tr_closing *c, double held) {
  for (int i = 0; i < c->s->k->nv; ++i) c->weight[i] = (c->given[i] != 0.0 ? held : 1.0) * tr_rate_unit(c->s, i);
}
