/* The designer's static question: with every frictional pair held, what share of its capacity is asked of it? */
#include "modes.h"

/* At the block's state, after tr_start. out, 4 per pair: how it starts (0 sticks, 1 slips), share of its capacity needed to hold
 * (NaN: its law holds nothing), capacity (N at the surface), whether the share is one of several possible. The modes are left with
 * all pairs held, so that tr_evaluate then gives what moves in spite of that. 1 when the statics could be solved. */
int tr_hold(tr_sim *s, double *out) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const int *row = (const int *)TR_A(s, rowk), *lead = (const int *)TR_A(s, lead);
  for (int i = 0; i < k->nsliders; ++i) {
    out[4 * i] = tr_mode(s, i)[0] > 0.5, out[4 * i + 1] = NAN, out[4 * i + 2] = out[4 * i + 3] = 0.0;
    if (tr_is_set(s, i)) tr_mode(s, i)[0] = TR_STUCK;
  }
  if (e == 0) return 1;
  tr_set_time(s, s->t);
  k->stage1(TR_A(s, x), TR_A(s, y), TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dy));
  memset(TR_A(s, z) + k->active, 0, sizeof(double) * e);
  if (!tr_solve_modes(s)) return 0;
  tr_solve_modes(s); /* shares of a group follow from the loads of the first solution */
  for (int i = 0; i < k->nsliders; ++i) {
    const int *sl = tr_slider(s, i);
    if (!tr_is_set(s, i)) continue;
    out[4 * i + 1] = tr_ratio(s, i), out[4 * i + 2] = TR_A(s, hold)[3 * i];
    for (int m = 0; m < e; ++m) {
      int mine = m >= sl[1] && m < sl[1] + sl[2];
      int leads = row[m] == TR_ROW_SHARE && lead[m] >= sl[1] && lead[m] < sl[1] + sl[2];
      if (leads || (mine && row[m] == TR_ROW_SHARE)) out[4 * i + 3] = 1.0;
    }
  }
  return 1;
}
