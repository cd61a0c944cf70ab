/* The designer's static question: with every frictional pair held, what share of its capacity is asked of it? */
#include "modes.h"

/* At the block's state, after tr_start: the answer for each pair in `out`. The modes are left with all pairs held, so that tr_evaluate
 * then gives what moves in spite of that. 1 when the statics could be solved. */
int tr_hold_all(tr_sim *s, tr_held *out) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const int *row = tr_row_kinds(s);
  const tr_leader *lead = tr_leaders(s);
  int rest[k->nsliders + 1], n = 0;
  for (int i = 0; i < k->nsliders; ++i) {
    out[i] = (tr_held){.slips = tr_slides(s, i), .share = NAN};
    if (tr_is_set(s, i)) tr_mode_of(s, i)->flag = TR_STUCK, rest[n++] = i;
  }
  if (e == 0) return 1;
  tr_maps_at(s, s->clock.t, TR_A(s, y));
  memset(TR_A(s, z) + k->active, 0, sizeof(double) * e);
  s->friction.kept = TR_KEEPS_NONE; /* the start may have ended with loads that are kept: they are no longer in place */
  if (!tr_solve_modes(s)) return 0;
  tr_solve_modes(s); /* shares of a group follow from the loads of the first solution */
  if (tr_worst_share(s, rest, n) > 1.0) tr_stick_by_kept(s, rest, n);
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_set(s, i)) continue;
    out[i].share = tr_ratio(s, i), out[i].capacity = tr_hold_of(s, i)->capacity;
    for (int m = 0; m < e; ++m) {
      int mine = m >= pair->eta0 && m < pair->eta0 + pair->neta;
      int leads = row[m] == TR_ROW_SHARE && lead[m].multiplier >= pair->eta0 && lead[m].multiplier < pair->eta0 + pair->neta;
      if (leads || (mine && (row[m] == TR_ROW_SHARE || row[m] == TR_ROW_KEPT))) out[i].shared = 1.0;
    }
  }
  return 1;
}
