/* Detection of loops at the end of their reach, at a state where no further step is possible (theory, "End of reach").
 *
 * At the end of reach, the constraint rows of a loop become dependent. A wrench λ with S λ = 0 then exists, which does no work in
 * any free joint of the loop. Drives may still move the loop. If λ is a pure couple, all rotation axes of the loop lie in one plane
 * (a gimbal; a Cardan joint at a right angle). Otherwise the loop is fully stretched or folded. */
#include "diagnosis/diagnosis.h"

/* relative to the smallest pivot at an accurate state: largest pivot that counts as the end of reach. A pivot is the square of the
 * relative distance from the end of reach. Steps that cannot close loops end at a distance of at most 0.01. With friction the limit
 * is stricter, because a toggle jams at a distance of μ times the radius of its pin. */
#define LOST 1e-4
#define LOST_RUBBING 1e-7
/* largest ratio (force · length) / couple of a pure couple. The ratio has this value at a distance of 0.01 from the end of
 * reach. */
#define PURE_COUPLE 1e-2

/* Write to `lost` (a) the direction of λ that has just lost its effect. This direction is the null vector of the last pivot within
 * the rank, plus the combination of open directions that makes its forces smallest. Returns the ratio (force · length scale) /
 * couple of this direction. */
static double tr_find_lost_direction(tr_sim *s, double *lost) {
  const tr_kernel *k = s->k;
  int a = k->active, m = 0, travel[a], out = ((const int *)TR_A(s, perm))[s->loops.rank_now - 1];
  double *open = TR_A(s, open_lambda), *N = TR_A(s, jw), kappa[a], x[a], b[a], couple = 0.0, force = 0.0;
  int r = tr_null_space(s, open);
  for (int i = 0; i < a; ++i) b[i] = -TR_A(s, maps)[i + out * a];
  s->loops.rank_now--;
  if (k->nlight) tr_factor_light_rows(s);
  tr_solve_loops(s, b, lost);
  s->loops.rank_now++;
  lost[out] = 1.0;
  for (int i = 0; i < tr_loop_rows(s); ++i)
    if (k->row_kind[k->active_rows[i]] == TR_CONSTRAINS_TRAVEL) travel[m++] = i;
  for (int i = 0; i < m; ++i) {
    kappa[i] = lost[travel[i]];
    for (int q = 0; q < r; ++q) N[i + q * m] = open[travel[i] + q * a];
  }
  if (r && m) {
    tr_least_squares least = tr_least_squares_factor(m, r, N, TR_A(s, gram));
    tr_least_squares_solve(&least, kappa, 0, x);
    tr_add_columns(a, r, open, x, 1.0, lost);
  }
  for (int i = 0; i < tr_loop_rows(s); ++i) {
    if (k->row_kind[k->active_rows[i]] == TR_CONSTRAINS_TURNING) couple += lost[i] * lost[i];
    else force += lost[i] * lost[i] * s->set.length * s->set.length;
  }
  return couple > 0.0 ? sqrt(force / couple) : INFINITY;
}

/* Returns TR_FAIL_CLOSURE or TR_FAIL_GIMBAL if the loops are at the end of their reach at the state `y`, otherwise TR_OK. least:
 * largest pivot that counts as the end of reach. Sets fail_detail to the constraint row with the largest component in the lost
 * direction. Sets fail_number to the smallest pivot (1: independent, 0: dependent). */
static int tr_check_end_of_reach(tr_sim *s, double least) {
  const tr_kernel *k = s->k;
  const int a = k->active, n = tr_loop_rows(s);
  if (!a || s->loops.rank < 1) return TR_OK;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  if (!tr_is_finite(k->nmaps, TR_A(s, maps))) return TR_OK;
  double *L = TR_A(s, S), lost[a], most = 0.0;
  s->loops.sparse = 0;
  TR_MADE(s, TR_HAS_FACTOR);
  s->loops.rank_now = tr_cholesky(n, tr_loop_matrix(s), TR_A(s, d), L, (int *)TR_A(s, perm), s->loops.rank, 0.0, GROW_PIVOT);
  if (s->loops.rank_now < 1) return TR_OK;
  double last = L[(s->loops.rank_now - 1) * (n + 1)], pivot = s->loops.rank_now < s->loops.rank ? 0.0 : last * last;
  if (pivot > least * s->loops.least_pivot) return TR_OK;
  double pitch = tr_find_lost_direction(s, lost);
  for (int i = 0; i < n; ++i)
    if (fabs(lost[i]) / TR_A(s, d)[i] > most) most = fabs(lost[i]) / TR_A(s, d)[i], s->audit.fail_detail = k->active_rows[i];
  s->audit.fail_number = pivot;
  return pitch < PURE_COUPLE ? TR_FAIL_GIMBAL : TR_FAIL_CLOSURE;
}

/* The constraint row with the largest residual after a failed loop closure. */
static int tr_find_open_row(const tr_sim *s) {
  const tr_kernel *k = s->k;
  double most = 0.0;
  int row = -1;
  for (int i = 0; i < k->rows; ++i) {
    double gap = fabs(TR_A(s, loop_error)[i]) / tr_row_unit(s, i);
    if (gap > most) most = gap, row = i;
  }
  return row;
}

static int tr_end_run(tr_sim *s, int code) {
  const int slow = code == TR_FAIL_STEP || code == TR_FAIL_STALLED || code == TR_FAIL_CLOSURE;
  if (slow || code == TR_FAIL_MULTIPLIERS || code == TR_FAIL_MODES) {
    s->audit.fail_detail = code == TR_FAIL_CLOSURE ? tr_find_open_row(s) : -1, s->audit.fail_number = -1.0;
    int limit = tr_check_end_of_reach(s, slow ? LOST : LOST_RUBBING);
    if (limit != TR_OK) code = limit;
  }
  return s->clock.status = code;
}

int tr_fail_row(const tr_sim *s, double *number) {
  *number = s->audit.fail_number;
  const int status = s->clock.status;
  return status == TR_FAIL_CLOSURE || status == TR_FAIL_GIMBAL || status == TR_FAIL_PENETRATION ? s->audit.fail_detail : -1;
}
