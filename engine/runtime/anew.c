/* Groups at rest share their load anew before one of them is let go: by the rule, and where that does not hold by loads that are kept. */
#include "modes.h"

#define SHARE_GAIN 1e-10   /* of the capacity: by so much a group must hold better when its load is shared anew */
#define KEPT_GAIN 1e-3     /* the same of loads that are kept: near its end such a group would share anew without end */
#define MOVED_FIRST 0.1    /* of what a pair can hold: by so much a load that is kept is moved first where the worst of a group is sought to be less, */
#define MOVED_LEAST 1e-3   /* and last (as KEPT_GAIN) */
#define MOVES_MOST 200     /* such loads tried */
#define SHARE_ENOUGH 0.9   /* of what a pair can hold: no less is sought, for what pairs hold grows with what they press each other with, */
#define PRESSED_MOST 10.0  /* and no load may grow by more than this */

/* The largest share of what they can hold that the pairs `rest` carry; after tr_holding. */
static double tr_worst_share(const tr_sim *s, const int *rest, int n) {
  double worst = 0.0;
  for (int q = 0; q < n; ++q) worst = fmax(worst, tr_ratio(s, rest[q]));
  return worst;
}

/* The largest friction in place, N. */
static double tr_most_friction(const tr_sim *s) {
  double most = 0.0;
  for (int i = 0; i < s->k->neta; ++i) most = fmax(most, fabs(TR_A(s, z)[s->k->active + i]) / TR_A(s, arm)[i]);
  return most;
}

/* The same once the load kept for multiplier i has been moved by `by`; without a bound where there is no root, or frictions above `most`. */
static double tr_share_moved(tr_sim *s, const int *rest, int n, int i, double by, double most) {
  double *eta = TR_A(s, z) + s->k->active;
  TR_A(s, share)[i] += by;
  if (!tr_newton(s, eta) || !(tr_most_friction(s) <= most)) return INFINITY;
  tr_law(s, eta);
  tr_holding(s);
  return tr_worst_share(s, rest, n);
}

/* Move the loads that are kept, one after the other and by less and less, towards where the worst share of the pairs `rest` is least, until
 * it is enough. What pairs can hold hangs on their loads, which all change with one: that is why the equations are solved for every one that is tried. After
 * tr_solve_modes. */
static void tr_spare(tr_sim *s, const int *rest, int n) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *kept = TR_A(s, share), best = tr_worst_share(s, rest, n), old[e], was[e];
  const double most = PRESSED_MOST * tr_most_friction(s);
  int at, tried = 0;
  for (double part = MOVED_FIRST; part >= MOVED_LEAST && tried < MOVES_MOST; part *= 0.5)
    for (int i = 0; i < e && best > SHARE_ENOUGH; ++i) {
      if (tr_row_kinds(s)[i] != TR_ROW_KEPT) continue;
      const double first = part * tr_hold_of(s, tr_owner(s, i, &at))->capacity * TR_A(s, arm)[i];
      double by = first;
      for (int failed = 0; failed < 2 && best > SHARE_ENOUGH && tried < MOVES_MOST; ++tried) {
        tr_copy(e, eta, old), tr_copy(e, kept, was);
        const double worst = tr_share_moved(s, rest, n, i, by, most);
        if (worst < best) best = worst, by *= 2.0;
        else tr_copy(e, old, eta), tr_copy(e, was, kept), by = -first, ++failed;
      }
    }
  tr_multipliers(s);
  tr_law(s, eta);
  tr_holding(s);
}

/* Whether the pairs at rest still hold together when they share their load anew (as it grows, others come to carry the most of it):
 * by a margin, so that this is not tried without end. */
static int tr_hold_anew(tr_sim *s, const int *rest, int n) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  if (!tr_solve_modes(s) || !tr_solve_modes(s)) return 0; /* shares follow from the loads of the first solution */
  if (s->friction.kept == TR_KEEPS_PLACED) tr_spare(s, rest, n);
  for (int q = 0; q < n; ++q)
    if (!(tr_misfit(s, rest[q]) < -(s->friction.kept ? KEPT_GAIN : SHARE_GAIN))) return 0;
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
