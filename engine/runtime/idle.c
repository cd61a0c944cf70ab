/* Pairs at rest that are said to slip and go nowhere, because others that hold keep them where they are. Their friction would be that of
 * sliding, in a direction of round-off. */
#include "modes.h"

/* Whether pair i slips without an acceleration, at the solution in place. */
static int tr_slips_in_place(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  double acc[3], worst = 0.0;
  if (!tr_slides(s, i)) return 0;
  tr_pair_acceleration(s, i, acc);
  for (int j = 0; j < pair->nrates; ++j) worst = fmax(worst, fabs(acc[j]));
  return worst <= (pair->nrates > 1 ? tr_faint(s, i) : TOL_RESOLVE * tr_speed_unit(s) * s->set.rate);
}

/* Of an answer in force, found for the pairs `rest`: let those that slip in place stick where that is an answer as well. One that is let go,
 * its friction past its limit, cannot. 1. */
static int tr_hold_idle(tr_sim *s, const int *rest, int n) {
  const int e = s->k->neta;
  double eta[e + 1], *now = TR_A(s, z) + s->k->active;
  tr_mode modes[s->k->nsliders + 1];
  int idle = 0;
  for (int q = 0; q < n; ++q) idle += tr_slips_in_place(s, rest[q]);
  if (!idle || idle == n) return 1;
  tr_keep_modes(s, modes), memcpy(eta, now, sizeof(double) * e);
  for (int q = 0; q < n; ++q)
    if (tr_slips_in_place(s, rest[q])) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  if (tr_solve_modes(s) && tr_worst_misfit(s, rest, n) < 0 && tr_holds(s, rest, n)) return 1;
  tr_put_modes(s, modes), memcpy(now, eta, sizeof(double) * e);
  return tr_solve_modes(s);
}
