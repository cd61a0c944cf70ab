/* Loops at the end of their reach: told from the state the run has come to, when no further step can be made.
 *
 * Where a loop cannot go on its constraint rows become dependent: a wrench λ appears that none of the free joints of the loop gives way
 * to (S λ = 0), while the drives still move it. When that wrench is a pure couple, no joint of the loop turns about its direction: all
 * turning axes lie in one plane (a gimbal; a Cardan joint at a right angle). Otherwise the loop is stretched or folded to its end. */
#include "modes.h"

/* Smallest pivot, of the smallest at the start: the square of the distance from the limit, in angles or lengths. Where loops cannot be
 * closed steps end 0.01 from it at most; friction that has no answer so far away is a jam (a toggle locks at μ r of its pin). */
#define LOST 1e-4
#define LOST_RUBBING 1e-7
#define PURE_COUPLE 1e-2 /* force · length of a couple: of the order of that distance */

/* λ that has come to move nothing (a): the open direction of the last pivot within the rank, with as little force as those allow that
 * the motion has always left open. Returns its force · length over its couple. */
static double tr_lost_direction(tr_sim *s, double *lost) {
  const tr_kernel *k = s->k;
  int a = k->active, m = 0, travel[a], out = ((const int *)TR_A(s, perm))[s->loops.rank_now - 1];
  double *open = TR_A(s, nul), *N = TR_A(s, jw), kappa[a], x[a], b[a], couple = 0.0, force = 0.0;
  int r = tr_null_space(s, open);
  for (int i = 0; i < a; ++i) b[i] = -TR_A(s, maps)[i + out * a];
  s->loops.rank_now--;
  tr_solve_S(s, b, lost);
  s->loops.rank_now++;
  lost[out] = 1.0;
  for (int i = 0; i < a; ++i)
    if (k->row_kind[k->active_rows[i]] == TR_CONSTRAINS_TRAVEL) travel[m++] = i;
  for (int i = 0; i < m; ++i) {
    kappa[i] = lost[travel[i]];
    for (int q = 0; q < r; ++q) N[i + q * m] = open[travel[i] + q * a];
  }
  if (r && m) {
    tr_least least = tr_least_of(m, r, N, TR_A(s, gram));
    tr_least_solve(&least, kappa, 0, x);
    tr_add_columns(a, r, open, x, 1.0, lost);
  }
  for (int i = 0; i < a; ++i) {
    if (k->row_kind[k->active_rows[i]] == TR_CONSTRAINS_TURNING) couple += lost[i] * lost[i];
    else force += lost[i] * lost[i] * s->set.length * s->set.length;
  }
  return couple > 0.0 ? sqrt(force / couple) : INFINITY;
}

/* Whether the loops are at the end of their reach at the block's state: TR_FAIL_CLOSURE, TR_FAIL_GIMBAL, or TR_OK. Then fail_detail is the
 * constraint row with the largest part in it, fail_number the smallest pivot (1: independent, 0: dependent). */
static int tr_limit(tr_sim *s, double least) {
  const tr_kernel *k = s->k;
  int a = k->active;
  if (!a || s->loops.rank < 1) return TR_OK;
  tr_maps_at(s, s->clock.t, TR_A(s, y));
  if (!tr_finite(k->nmaps, TR_A(s, maps))) return TR_OK;
  double *L = TR_A(s, S), lost[a], most = 0.0;
  s->loops.sparse = 0;
  s->loops.rank_now = tr_cholesky(a, TR_A(s, maps), TR_A(s, d), L, (int *)TR_A(s, perm), s->loops.rank, 0.0, GROW_PIVOT);
  if (s->loops.rank_now < 1) return TR_OK;
  double last = L[(s->loops.rank_now - 1) * (a + 1)], pivot = s->loops.rank_now < s->loops.rank ? 0.0 : last * last;
  if (pivot > least * s->loops.least_pivot) return TR_OK;
  double pitch = tr_lost_direction(s, lost);
  for (int i = 0; i < a; ++i)
    if (fabs(lost[i]) / TR_A(s, d)[i] > most) most = fabs(lost[i]) / TR_A(s, d)[i], s->audit.fail_detail = k->active_rows[i];
  s->audit.fail_number = pivot;
  return pitch < PURE_COUPLE ? TR_FAIL_GIMBAL : TR_FAIL_CLOSURE;
}

/* The row of the loops' residual that was largest when they could not be closed. */
static int tr_open_row(const tr_sim *s) {
  const tr_kernel *k = s->k;
  double most = 0.0;
  int row = -1;
  for (int i = 0; i < k->rows; ++i) {
    double gap = fabs(TR_A(s, h_res)[i]) / tr_row_unit(s, i);
    if (gap > most) most = gap, row = i;
  }
  return row;
}

/* The status of a run that cannot go on for the reason `code`. Loops at the end of their reach come first: near it reactions grow
 * without bound, and with them friction, steps and errors. */
static int tr_end(tr_sim *s, int code) {
  const int slow = code == TR_FAIL_STEP || code == TR_FAIL_STALLED || code == TR_FAIL_CLOSURE;
  if (slow || code == TR_FAIL_MULTIPLIERS || code == TR_FAIL_MODES) {
    s->audit.fail_detail = code == TR_FAIL_CLOSURE ? tr_open_row(s) : -1, s->audit.fail_number = -1.0;
    int limit = tr_limit(s, slow ? LOST : LOST_RUBBING);
    if (limit != TR_OK) code = limit;
  }
  return s->clock.status = code;
}

/* After a failure of loops: the constraint row it is about (−1: none known) and how independent the rows still are (1: fully, 0: one
 * depends on the others; −1: not the reason). */
int tr_fail_row(const tr_sim *s, double *number) {
  *number = s->audit.fail_number;
  return s->clock.status == TR_FAIL_CLOSURE || s->clock.status == TR_FAIL_GIMBAL ? s->audit.fail_detail : -1;
}
