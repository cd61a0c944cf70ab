/* Constraint rows of joints that only push, in the maps and in the residuals of loops (``base/unilateral_contact.h``). */
#include "base/base.h"

/* Store the contacts' rows as the kernel wrote them. */
static void tr_keep_raw_rows(tr_sim *s) {
  const tr_kernel *k = s->k;
  const int a = k->active, e = k->neta;
  const double *S = TR_A(s, maps), *Se = map_Se(k, S), *g0 = map_g0(k, S);
  for (int c = 0; c < k->nunilateral; ++c) {
    const int i = tr_active_row(s, c);
    double *row = tr_raw_row(s, c);
    for (int j = 0; j < a; ++j) row[j] = S[i + (size_t)j * a];
    for (int j = 0; j < e; ++j) row[a + j] = Se[i + (size_t)j * a];
    row[a + e] = g0[i];
  }
}

/* Remove all forces from the maps, so that they describe impulses alone. */
static void tr_remove_forces(tr_sim *s) {
  const tr_kernel *k = s->k;
  double *maps = TR_A(s, maps);
  memset((double *)map_g0(k, maps), 0, sizeof(double) * k->active);
  memset((double *)map_N0(k, maps), 0, sizeof(double) * k->nn);
  if (k->sets) memset((double *)map_Q0(k, maps), 0, sizeof(double) * k->neta);
}

/* Uncouple row i from all others, and give its multiplier a value. The diagonal stays, so that the rank of S does not change. */
static void tr_give_multiplier(tr_sim *s, int i, double value) {
  const int a = s->k->active, e = s->k->neta;
  double *S = TR_A(s, maps), *Se = (double *)map_Se(s->k, S), *g0 = (double *)map_g0(s->k, S);
  for (int j = 0; j < a; ++j) {
    if (j == i) continue;
    g0[j] += S[j + (size_t)i * a] * value;
    S[j + (size_t)i * a] = S[i + (size_t)j * a] = 0.0;
  }
  for (int j = 0; j < e; ++j) Se[i + (size_t)j * a] = 0.0;
  g0[i] = -S[i + (size_t)i * a] * value;
}

static void tr_apply_contacts(tr_sim *s) {
  const tr_kernel *k = s->k;
  if (!k->nunilateral) return;
  tr_keep_raw_rows(s);
  if (s->impact.solving) tr_remove_forces(s);
  for (int c = 0; c < k->nunilateral; ++c) {
    const tr_touch *touch = tr_touch_of(s, c);
    const int i = tr_active_row(s, c), open = tr_is_contact_open(s, c);
    if (open || (s->impact.solving && touch->given)) tr_give_multiplier(s, i, open ? 0.0 : touch->multiplier);
    else if (s->impact.solving) ((double *)map_g0(k, TR_A(s, maps)))[i] += touch->shift;
  }
}

static void tr_evaluate_closure(tr_sim *s, const double *y, double *h) {
  const tr_kernel *k = s->k;
  k->closure(TR_A(s, x), y, TR_A(s, c) + k->c_closure, h);
  for (int c = 0; c < k->nunilateral; ++c)
    if (tr_is_contact_open(s, c)) h[tr_unilateral_of(s, c)->row] = h[k->rows + tr_unilateral_of(s, c)->row] = 0.0;
}

static void tr_evaluate_gaps(tr_sim *s, const double *y, double *gap, double *rate) {
  const tr_kernel *k = s->k;
  double h[2 * k->rows + 1];
  k->closure(TR_A(s, x), y, TR_A(s, c) + k->c_closure, h);
  for (int c = 0; c < k->nunilateral; ++c) gap[c] = h[tr_unilateral_of(s, c)->row], rate[c] = h[k->rows + tr_unilateral_of(s, c)->row];
}

static double tr_gap_acceleration(const tr_sim *s, int c, int forces) {
  const int n = s->k->active + s->k->neta;
  const double *row = tr_raw_row(s, c);
  return (forces ? row[n] : 0.0) + tr_dot(row, TR_A(s, z), n);
}
