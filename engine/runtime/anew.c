/* Groups at rest share their load anew before one of them is let go: by the rule, and where that does not hold by loads that are kept. */
#include "spare.c"

#define SHARE_GAIN 1e-10   /* of the capacity: by so much a group must hold better when its load is shared anew */
#define KEPT_GAIN 1e-7     /* the same of loads that are kept: near its end such a group would share anew without end; and when it ends is known as well */

/* Whether any load is kept in the modes in force. */
static int tr_keeps(const tr_sim *s) {
  for (int i = 0; i < s->k->neta; ++i)
    if (tr_row_kinds(s)[i] == TR_ROW_KEPT) return 1;
  return 0;
}

/* Whether the pairs at rest still hold together when they share their load anew (as it grows, others come to carry the most of it):
 * by a margin, so that this is not tried without end. */
static int tr_hold_anew(tr_sim *s, const int *rest, int n) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  s->friction.sparing = 1;
  const int solved = tr_solve_modes(s) && tr_solve_modes(s); /* shares follow from the loads of the first solution */
  s->friction.sparing = 0;
  if (!solved) return 0;
  if (s->friction.kept == TR_KEEPS_PLACED) tr_spare(s, rest, n);
  for (int q = 0; q < n; ++q)
    if (!(tr_misfit(s, rest[q]) < -(tr_keeps(s) ? KEPT_GAIN : SHARE_GAIN))) return 0;
  return tr_holds(s, rest, n);
}

/* Whether those of the pairs `rest` (n) that stick in the modes in force hold by loads that are kept, where they do not by those shared by the
 * rule; left in place then. */
static int tr_stick_by_kept(tr_sim *s, const int *rest, int n) {
  double eta[s->k->neta + 1], *now = TR_A(s, z) + s->k->active;
  if (!s->friction.shares || s->friction.kept) return 0;
  memcpy(eta, now, sizeof(double) * s->k->neta);
  for (s->friction.kept = TR_KEEPS_CREEP; s->friction.kept <= TR_KEEPS_PLACED; ++s->friction.kept) {
    int ok = tr_solve_modes(s) && tr_solve_modes(s); /* the loads that are kept follow from those of the first solution */
    if (ok && s->friction.kept == TR_KEEPS_PLACED) tr_spare(s, rest, n);
    for (int q = 0; q < n && ok; ++q) ok = tr_misfit(s, rest[q]) <= (tr_is_stuck(s, rest[q]) ? -KEPT_GAIN : 0.0);
    if (ok && tr_holds(s, rest, n)) return 1;
    memcpy(now, eta, sizeof(double) * s->k->neta);
  }
  s->friction.kept = TR_KEEPS_NONE;
  tr_solve_modes(s);
  return 0;
}

/* Where the loads that pairs at rest share by the rule end, because their root has met another, while others hold all of them on, these are
 * kept: how loads are shared is a choice, and no reason to let go. 1 when the run can go on. */
static int tr_holds_otherwise(tr_sim *s) {
  const tr_kernel *k = s->k;
  const double *y = TR_A(s, y);
  int rest[k->nsliders + 1];
  tr_mode modes[k->nsliders + 1];
  if (!k->sets || !s->friction.shares || s->friction.kept || s->friction.failed >= 0) return 0;
  s->step.watch = 0;
  tr_maps_at(s, s->clock.t, y);
  tr_keep_modes(s, modes);
  const int n = tr_at_rest(s, -1, rest);
  for (s->friction.kept = TR_KEEPS_CREEP; n && s->friction.kept <= TR_KEEPS_PLACED; ++s->friction.kept) {
    memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_nz(s));
    if (!tr_hold_anew(s, rest, n) || !tr_rhs(s, s->clock.t, y, TR_A(s, dy))) continue;
    memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s)); /* decided again they would share by the rule again */
    s->step.have_k1 = 1, s->step.have_jac = 0, s->step.margin = NAN, s->step.h = s->set.hfixed;
    return 1;
  }
  s->friction.kept = TR_KEEPS_NONE;
  tr_put_modes(s, modes), tr_note_modes(s);
  return 0;
}
