/* Friction whose root has folded away: as the state moves on, the root of the complement equations that was followed meets another and
 * both vanish. Where one remains elsewhere the motion goes on with that: forces jump, velocities do not. An event, told in the table. */
#include "modes.h"

#define FOLD_AHEAD 1e-7  /* of 1/rate: so far beyond the last state roots are looked for; the way there is made by Euler's rule */
#define FOLD_AGAIN 1e-5  /* of 1/rate: folds that follow each other so soon, */
#define FOLDS_MOST 3     /* and are more than so many, are no way on */
#define FOLD_SPEED 1e-4  /* of the fastest rate: by no more any changes on the way there */
#define FOLD_JUMP 0.02   /* of a pair's friction, before and after: where it goes on as it was nothing has folded away, steps had failed otherwise */
#define FOLD_STARTS 48   /* of Newton's iteration, within multiples of the friction that the forces without it would cause */
#define FOLD_BRANCHES 4  /* pairs whose branches are tried in all combinations */

/* A root of the complement equations in the modes in force at the state whose maps are in place, along the path on which friction grows
 * from none, then from many starts; η holds it. */
static int tr_root_anywhere(tr_sim *s) {
  double *eta = TR_A(s, z) + s->k->active, size[s->k->neta + 1];
  unsigned seed = 12345u;
  tr_ready_equations(s);
  tr_start_sizes(s, size);
  if (tr_newton_by_parts(s, eta) && tr_is_root(s, size, eta)) return 1;
  for (int i = 0; i < s->k->nsliders; ++i) {
    memset(eta, 0, sizeof(double) * s->k->neta);
    if (tr_slides_on_cone(s, i) && tr_tilt_anywhere(s, eta, i) && tr_is_root(s, size, eta)) return 1;
  }
  for (int start = 0; start < FOLD_STARTS; ++start) {
    tr_chance(s, size, start, &seed, eta);
    if (tr_newton(s, eta) && tr_is_root(s, size, eta)) return 1;
  }
  return 0;
}

/* The same on the branches of pairs that have two, tried in all combinations, those in force first. */
static int tr_root_on_branches(tr_sim *s) {
  int which[FOLD_BRANCHES], n = 0;
  for (int i = 0; i < s->k->nsliders && n < FOLD_BRANCHES; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (pair->kind == TR_KIND_KINK || (pair->cone && tr_is_set(s, i) && tr_slides(s, i))) which[n++] = i;
  }
  tr_mode modes[s->k->nsliders + 1];
  tr_keep_modes(s, modes);
  for (int code = 0; code < 1 << n; ++code) {
    for (int q = 0; q < n; ++q) {
      int was = tr_flag(modes + which[q]), ball = was == TR_CONE ? TR_SLIPS : TR_CONE;
      int kink = was == TR_SATURATED ? TR_PROPORTIONAL : TR_SATURATED, other = tr_is_set(s, which[q]) ? ball : kink;
      tr_mode_of(s, which[q])->flag = code >> q & 1 ? other : was;
    }
    if (tr_root_anywhere(s)) return 1;
  }
  tr_put_modes(s, modes);
  return 0;
}

/* The pair whose friction has changed most between two sets of multipliers, by its part of all (`most`). */
static int tr_most_changed(const tr_sim *s, const double *was, const double *is, double *most) {
  int best = 0;
  *most = -1.0;
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double change = 0.0, size = 0.0;
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) change += fabs(is[j] - was[j]), size += fabs(is[j]) + fabs(was[j]);
    if (size > 0.0 && change / size > *most) *most = change / size, best = i;
  }
  return best;
}

/* How far ahead roots are looked for, s: so far that rates stay what they are, which a fold leaves as they were. */
static double tr_look_ahead(const tr_sim *s) {
  const double h = FOLD_AHEAD / s->set.rate, *v = TR_A(s, y) + s->k->nq, *change = TR_A(s, K) + s->k->nq;
  double fastest = s->set.rate, most = 0.0;
  for (int i = 0; i < s->k->nv; ++i) {
    fastest = fmax(fastest, fabs(v[i]) / tr_rate_unit(s, i));
    most = fmax(most, fabs(h * change[i]) / tr_rate_unit(s, i));
  }
  return h * fmin(1.0, FOLD_SPEED * fastest / most);
}

/* After a failure of friction at the block's state, other than at the event of a pair that then can do nothing: go on with a root that is
 * left an instant later. 1 when there is one. */
static int tr_passes_fold(tr_sim *s) {
  const tr_kernel *k = s->k;
  int n = tr_width(s), nc = s->o ? s->o->ncontacts : 0, nz = tr_nz(s);
  double *y = TR_A(s, y), old[n], was[nz + 1], h;
  tr_contact before[nc + 1], after[nc + 1];
  tr_mode modes[k->nsliders + 1];
  if (!k->nsliders || !s->step.have_k1) return 0;
  tr_maps_of(s, y);
  if (s->friction.failed >= 0 && !tr_moving_ball(s, s->friction.failed)) return 0;
  if (s->clock.t - s->friction.folded >= FOLD_AGAIN / s->set.rate) s->friction.folds = 0;
  if (s->friction.folds >= FOLDS_MOST) return 0;
  h = tr_look_ahead(s), s->step.watch = 0;
  tr_keep_modes(s, modes), memcpy(old, y, sizeof old), memcpy(was, TR_A(s, zold), sizeof(double) * nz);
  memcpy(TR_A(s, z), was, sizeof(double) * nz);
  int contacts = tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_all_contacts(s, y, before);
  for (int i = 0; i < n; ++i) y[i] += h * TR_A(s, K)[i];
  if (tr_project(s, s->clock.t + h, y)) {
    tr_maps_of(s, y);
    if (tr_root_on_branches(s) && tr_rhs(s, s->clock.t + h, y, TR_A(s, dy)) && tr_fits_branches(s)) {
      double jump;
      const int pair = tr_most_changed(s, was + k->active, TR_A(s, z) + k->active, &jump), first = tr_pair_of(s, pair)->contact0;
      contacts = contacts && tr_all_contacts(s, y, after);
      if (jump > FOLD_JUMP) {
        tr_log(s, s->clock.t, TR_EV_FOLD, pair, before + first, after + first, contacts ? tr_pair_of(s, pair)->ncontacts : 0);
        s->stats.events++;
      }
      s->clock.t += h, s->friction.folded = s->clock.t, s->friction.folds++;
      s->step.have_k1 = s->step.have_jac = 0;
      s->step.h = s->set.hfixed;
      return 1;
    }
  }
  tr_put_modes(s, modes), memcpy(y, old, sizeof old);
  return 0;
}
