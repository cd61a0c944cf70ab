/* Fold of friction: the root in use merges with another root, and both vanish. If there is a third root, the motion continues with
 * it. Forces jump, velocities are continuous, and a fold event is logged. */
#include "diagnosis/diagnosis.h"

/* in units of 1 / rate scale: length of the Euler step from the last state to the state where the search for roots begins */
#define FOLD_AHEAD 1e-7
#define FOLD_AGAIN 1e-5  /* in units of 1 / rate scale: a fold that follows the last one sooner counts as repeated */
#define FOLDS_MOST 3     /* number of repeated folds after which the run ends */
#define FOLD_SPEED 1e-4  /* relative to the fastest rate: largest change of a rate during the Euler step */
#define FOLD_ENDS 1e-4   /* if the contraction of a new root differs from 1 by less, this root ends within microseconds */
/* number of random starts of Newton's method; their scale is the friction under the loads without friction */
#define FOLD_STARTS 48
#define FOLD_BRANCHES 4  /* number of pairs whose branches are tried in all combinations */

/* Find a root of the complement equations in the modes in force: first with growing friction, then by tilts of balls, then from
 * random starts. Requires maps of the current state. Leaves η in z. */
static int tr_find_any_root(tr_sim *s) {
  double *eta = TR_A(s, z) + s->k->active, size[s->k->neta + 1];
  unsigned seed = 12345u;
  tr_prepare_equations(s);
  tr_estimate_frictions(s, size);
  if (tr_newton_by_growing_friction(s, eta) && tr_is_root(s, size, eta)) return 1;
  for (int i = 0; i < s->k->nsliders; ++i) {
    memset(eta, 0, sizeof(double) * s->k->neta);
    if (tr_is_sliding_ball(s, i) && tr_search_tilt(s, eta, i) && tr_is_root(s, size, eta)) return 1;
  }
  for (int start = 0; start < FOLD_STARTS; ++start) {
    tr_random_start(s, size, start, &seed, eta);
    if (tr_newton(s, eta) && tr_is_root(s, size, eta)) return 1;
  }
  return 0;
}

static int tr_find_root_on_branches(tr_sim *s) {
  int which[FOLD_BRANCHES], n = 0;
  for (int i = 0; i < s->k->nsliders && n < FOLD_BRANCHES; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (pair->kind == TR_KIND_KINK || (pair->cone && tr_is_set_valued(s, i) && tr_is_sliding(s, i))) which[n++] = i;
  }
  tr_mode modes[s->k->nsliders + 1];
  tr_save_modes(s, modes);
  for (int code = 0; code < 1 << n; ++code) {
    for (int q = 0; q < n; ++q) {
      int was = tr_mode_flag(modes + which[q]), ball = was == TR_CONE ? TR_SLIPS : TR_CONE;
      int kink = was == TR_SATURATED ? TR_PROPORTIONAL : TR_SATURATED, other = tr_is_set_valued(s, which[q]) ? ball : kink;
      tr_mode_of(s, which[q])->flag = code >> q & 1 ? other : was;
    }
    if (tr_find_any_root(s)) return 1;
  }
  tr_restore_modes(s, modes);
  return 0;
}

static int tr_find_most_changed(const tr_sim *s, const double *was, const double *is, double *most) {
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

/* Length, s, of the Euler step to the state where the search for roots begins. Rates hardly change in this step. */
static double tr_look_ahead_time(const tr_sim *s) {
  const double h = FOLD_AHEAD / s->set.rate, *v = TR_A(s, y) + s->k->nq, *change = TR_A(s, K) + s->k->nq;
  double fastest = s->set.rate, most = 0.0;
  for (int i = 0; i < s->k->nv; ++i) {
    fastest = fmax(fastest, fabs(v[i]) / tr_rate_unit(s, i));
    most = fmax(most, fabs(h * change[i]) / tr_rate_unit(s, i));
  }
  return h * fmin(1.0, FOLD_SPEED * fastest / most);
}

static int tr_pass_fold(tr_sim *s) {
  const tr_kernel *k = s->k;
  int n = tr_state_width(s), nc = s->o ? s->o->ncontacts : 0, nz = tr_z_length(s);
  double *y = TR_A(s, y), old[n], was[nz + 1], h;
  tr_contact before[nc + 1], after[nc + 1];
  tr_mode modes[k->nsliders + 1];
  if (!k->nsliders || !s->step.have_k1) return 0;
  tr_evaluate_maps(s, y);
  if (s->friction.failed >= 0 && !tr_is_moving_ball(s, s->friction.failed)) return 0;
  if (s->clock.t - s->friction.folded >= FOLD_AGAIN / s->set.rate) s->friction.folds = 0;
  if (s->friction.folds >= FOLDS_MOST) return 0;
  h = tr_look_ahead_time(s), s->step.watch = 0;
  tr_save_modes(s, modes), memcpy(old, y, sizeof old), memcpy(was, TR_A(s, zold), sizeof(double) * nz);
  memcpy(TR_A(s, z), was, sizeof(double) * nz);
  int contacts = tr_rhs(s, s->clock.t, y, TR_A(s, dy)) && tr_current_contacts(s, y, before);
  for (int i = 0; i < n; ++i) y[i] += h * TR_A(s, K)[i];
  if (tr_project(s, s->clock.t + h, y)) {
    tr_evaluate_maps(s, y);
    if (tr_find_root_on_branches(s) && tr_rhs(s, s->clock.t + h, y, TR_A(s, dy)) && tr_is_on_branches(s)) {
      double jump;
      /* A root that ends at once is not used. There are several such roots, and the random starts find one that depends on the cut
       * of a loop; the motion would be arbitrary. */
      const int ends = fabs(1.0 - tr_contraction(s)) <= FOLD_ENDS;
      const int pair = tr_find_most_changed(s, was + k->active, TR_A(s, z) + k->active, &jump), first = tr_pair_of(s, pair)->contact0;
      if (jump > FOLD_JUMP && ends) {
        tr_restore_modes(s, modes), memcpy(y, old, sizeof old);
        return 0;
      }
      contacts = contacts && tr_current_contacts(s, y, after);
      if (jump > FOLD_JUMP) {
        tr_log_event(s, s->clock.t, TR_EV_FOLD, pair, before + first, after + first, contacts ? tr_pair_of(s, pair)->ncontacts : 0);
        s->stats.events++;
      }
      s->clock.t += h, s->friction.folded = s->clock.t, s->friction.folds++;
      s->step.have_k1 = s->step.have_jac = 0;
      s->step.h = s->set.hfixed;
      return 1;
    }
  }
  tr_restore_modes(s, modes), memcpy(y, old, sizeof old);
  return 0;
}
