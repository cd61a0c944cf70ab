/* Groups at rest share their load anew before one of them is let go: by the rule, and where that does not hold by loads that are kept. */
#include "modes.h"

#define SHARE_GAIN 1e-10   /* of the capacity: by so much a group must hold better when its load is shared anew */
#define KEPT_GAIN 1e-3     /* the same of loads that are kept: near its end such a group would share anew without end */

/* Whether the pairs at rest still hold together when they share their load anew (as it grows, others come to carry the most of it):
 * by a margin, so that this is not tried without end. */
static int tr_hold_anew(tr_sim *s, const int *rest, int n) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  if (!tr_solve_modes(s) || !tr_solve_modes(s)) return 0; /* shares follow from the loads of the first solution */
  for (int q = 0; q < n; ++q)
    if (!(tr_misfit(s, rest[q]) < -(s->friction.kept ? KEPT_GAIN : SHARE_GAIN))) return 0;
  return tr_holds(s, rest, n);
}

/* Whether those of the pairs `rest` (n) that stick in the modes in force hold by loads that are kept, where they do not by those shared by the
 * rule; left in place then. */
static int tr_stick_by_kept(tr_sim *s, const int *rest, int n) {
  double eta[s->k->neta + 1];
  if (!s->friction.shares || s->friction.kept) return 0;
  memcpy(eta, TR_A(s, z) + s->k->active, sizeof(double) * s->k->neta);
  s->friction.kept = 1;
  int ok = tr_solve_modes(s) && tr_solve_modes(s); /* the loads that are kept follow from those of the first solution */
  for (int q = 0; q < n && ok; ++q) ok = tr_misfit(s, rest[q]) <= (tr_is_stuck(s, rest[q]) ? -KEPT_GAIN : 0.0);
  if (ok && tr_holds(s, rest, n)) return 1;
  s->friction.kept = 0;
  memcpy(TR_A(s, z) + s->k->active, eta, sizeof(double) * s->k->neta);
  tr_solve_modes(s);
  return 0;
}
