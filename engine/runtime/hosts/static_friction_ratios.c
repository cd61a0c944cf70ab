/* The static margin: for each frictional pair, the friction that it needs to stick, divided by its capacity. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

int tr_hold_all(tr_sim *s, tr_held *out) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const int *row = tr_row_kinds(s);
  const tr_leader *lead = tr_leaders(s);
  int rest[k->nsliders + 1], n = 0;
  for (int i = 0; i < k->nsliders; ++i) {
    out[i] = (tr_held){.slips = tr_is_sliding(s, i), .share = NAN};
    if (tr_is_set_valued(s, i)) tr_mode_of(s, i)->flag = TR_STUCK, rest[n++] = i;
  }
  if (e == 0) return 1;
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  memset(TR_A(s, z) + k->active, 0, sizeof(double) * e);
  s->friction.stored = TR_STORES_NONE; /* stored loads from the start may be outdated */
  if (!tr_solve_in_modes(s)) return 0;
  tr_solve_in_modes(s); /* solves again, because the shares of a group follow from the loads of the first call */
  if (tr_largest_share(s, rest, n) > 1.0) tr_stick_by_stored_loads(s, rest, n);
  for (int i = 0; i < k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_set_valued(s, i)) continue;
    out[i].share = tr_friction_ratio(s, i), out[i].capacity = tr_hold_of(s, i)->capacity;
    for (int m = 0; m < e; ++m) {
      int mine = m >= pair->eta0 && m < pair->eta0 + pair->neta;
      int leads = row[m] == TR_ROW_SHARE && lead[m].multiplier >= pair->eta0 && lead[m].multiplier < pair->eta0 + pair->neta;
      if (leads || (mine && (row[m] == TR_ROW_SHARE || row[m] == TR_ROW_STORED))) out[i].shared = 1.0;
    }
  }
  return 1;
}
