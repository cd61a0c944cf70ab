/* Start values that close the loops: positions, then velocities, changing as little as possible.
 *
 * First only coordinates the user left open move, from zero and then from elsewhere, for what is given is kept where it can be; when that
 * is not enough everything may, given ones a hundred times less. Where that does not close either, the start may be singular (links
 * exactly in line, which would close to either side): it is nudged and all is tried again. */
#include "tr.h"

#define RATES_CLOSED 1e-15  /* of length · rate (rate): round-off of rates that agree, which are the solution of linear equations */
#define RATES_AGREE 1e-11   /* and the most that counts as agreeing: their condition takes four digits */
#define ROUNDED 1e-6        /* rad; of the length: gaps so small come of rounding, whatever else may close: places are not sought for them */
#define FEW_DIGITS 1e-2     /* rad; of the length: what given values of two digits miss by; beyond, they contradict each other */
#define MOVED_BY 10.0       /* of such a gap: the most that given values then move */
#define NEARER 0.1          /* of what the first search leaves: what another place must leave to be taken for it */
#define NUDGE 0.02 /* rad; of the length scale */
#define AFAR 3.141592653589793 /* rad; of the length scale: as far apart are starts of what is open */
#define HELD 0.01     /* what is given moves by this part of what is open */
#define TRIES_AFAR 24 /* what cannot be kept costs so many searches: a tenth of a second with forty loops */

/* Given ones a little too, from the state `near`, which open ones leave `gap` apart: they were rounded. 1 when closed, and they moved by no
 * more than the gap. */
static int tr_close_rounded(tr_closing *c, const double *near, double gap, double *y) {
  memcpy(y, near, sizeof(double) * c->s->ny);
  tr_weights(c, HELD);
  return tr_close_positions(c, y, 1) && c->moved <= MOVED_BY * gap;
}

/* Positions closed by open coordinates alone, from where they are and, where that leads nowhere, from places all over their range: a
 * chain that comes from far away may stall though there is a place for it. Then the same with longer steps. What is given as numbers of
 * few digits moves in the last of them. 1 when closed. */
static int tr_close_open(tr_closing *c, double *y) {
  const int ny = c->s->ny;
  int kept = 0, open = 0;
  double near[ny + 1], gap = INFINITY;
  for (int i = 0; i < c->s->k->nv; ++i) kept += c->given[i] != 0.0, open += c->given[i] == 0.0;
  for (int longer = 0; longer < 2; ++longer) {
    unsigned seed = 1u;
    tr_displace(c, 0.0, 0.0, 0, y);
    for (int attempt = 0; attempt <= TRIES_AFAR; ++attempt) {
      tr_weights(c, 0.0);
      if (tr_close_positions(c, y, longer)) return 1;
      if (!kept || !open) break;
      if (c->least < NEARER * gap) gap = c->least, memcpy(near, c->nearest, sizeof(double) * ny);
      if (attempt == 0 && gap <= ROUNDED && tr_close_rounded(c, near, gap, y)) return 1;
      tr_displace(c, AFAR, 0.0, &seed, y);
    }
  }
  return gap <= FEW_DIGITS && tr_close_rounded(c, near, gap, y);
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
  const double held[3] = {0.0, HELD, 1.0};
  tr_closing c = {s, qgiven, start, weight, G, TR_A(s, ynew), INFINITY, 0.0};
  int closed = tr_close_open(&c, y);
  for (int phase = 1; phase < 6 && !closed; ++phase) {
    tr_displace(&c, phase < 3 ? 0.0 : NUDGE, held[phase % 3], 0, y);
    tr_weights(&c, held[phase % 3]);
    closed = tr_close_positions(&c, y, 0) || tr_close_positions(&c, y, 1);
  }
  if (!closed && c.least < INFINITY) memcpy(y, c.nearest, sizeof(double) * s->ny);
  if (!closed) return 0;
  tr_constraint_jacobian(s, y, G);
  c.given = vgiven;
  for (int phase = 0; phase < 3; ++phase) {
    memcpy(y + k->nq, start + k->nq, sizeof(double) * k->nv);
    tr_weights(&c, held[phase]);
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
