/* Modes of many pairs at rest, foreseen for all of them at once and then held against the exact equations (METHOD, "Many pairs"). */
#include "modes.h"

#define TURNS_MOST 40        /* steps of Newton's method on all directions of onset together, */
#define BRANCHES_MOST 12     /* in so many of which balls may change between sliding and turning without sliding */
#define ONSETS_FOUND 1e-14   /* of the friction: a step of round-off; */
#define ONSETS_NEARLY 1e-9   /* and where steps have ceased to shrink: derivatives by differences have half of the digits */

/* Whether pair i starts in a direction that is to be found. */
static inline int tr_seeks_direction(const tr_sim *s, int i) { return tr_is_set(s, i) && tr_slides(s, i) && tr_pair_of(s, i)->nrates > 1; }

/* Turn the direction of pair i to that of its acceleration at the frictions in place; `size`: of this, m/s². One too faint to have a
 * direction keeps the one it has. */
static void tr_turn_onset(tr_sim *s, int i, double *size) {
  const tr_pair *pair = tr_pair_of(s, i);
  tr_mode *m = tr_mode_of(s, i);
  const double *arm = TR_A(s, arm) + pair->eta0;
  double d[3];
  tr_pair_acceleration(s, i, d);
  *size = tr_unit(pair->nrates, d);
  if (*size <= tr_faint(s, i)) {
    *size = INFINITY;
    for (int j = 0; j < pair->nrates; ++j) d[j] = m->direction[j] * arm[j];
    tr_unit(pair->nrates, d);
  }
  for (int j = 0; j < pair->nrates; ++j) m->direction[j] = tr_onset_length(s) * d[j] / arm[j];
}

/* The laws at the frictions in place; balls that are to slide inside their cones, or to turn without sliding outside, change their branch. */
static void tr_law_on_branches(tr_sim *s, const int *rest, int n) {
  int changes = 0;
  tr_law(s, TR_A(s, z) + s->k->active);
  for (int q = 0; q < n; ++q) {
    tr_mode *m = tr_mode_of(s, rest[q]);
    const int flag = tr_sliding_of(s, rest[q])->cone < 0.0 ? TR_CONE : TR_SLIPS;
    if (!tr_seeks_direction(s, rest[q]) || !tr_pair_of(s, rest[q])->cone || flag == tr_flag(m)) continue;
    m->flag = flag, changes = 1;
  }
  if (changes) tr_law(s, TR_A(s, z) + s->k->active);
}

/* What the turning of directions with accelerations adds to the Jacobian J (e×e) of the laws; size: of the accelerations of the pairs `rest`. Along
 * the direction friction is taken as it is, not as its law has it (as in ``creep.c``: else steps go to and fro where friction all but stops a pair). */
static void tr_onset_slopes(tr_sim *s, const int *rest, int n, const double *size, double *J) {
  tr_form_all(s);
  const tr_kernel *k = s->k;
  const int e = k->neta;
  const double *Qe = TR_A(s, Q) + e, *arm = TR_A(s, arm), *eta = TR_A(s, z) + k->active, length = tr_onset_length(s);
  double x[k->nx], law[e], dn[k->ndn + 1];
  tr_sliding sliding[k->nsliders + 1];
  tr_mode *modes = (tr_mode *)(x + ((const double *)tr_mode_of(s, 0) - TR_A(s, x)));
  for (int part = 0; part < 3; ++part) {
    memcpy(x, TR_A(s, x), sizeof x);
    for (int q = 0; q < n; ++q) {
      const tr_pair *pair = tr_pair_of(s, rest[q]);
      double d[3];
      if (!tr_seeks_direction(s, rest[q]) || part >= pair->nrates) continue;
      for (int j = 0; j < pair->nrates; ++j) d[j] = modes[rest[q]].direction[j] / length * arm[pair->eta0 + j] + (j == part) * TURN_TRIED;
      tr_unit(pair->nrates, d);
      for (int j = 0; j < pair->nrates; ++j) modes[rest[q]].direction[j] = length * d[j] / arm[pair->eta0 + j];
    }
    k->laws(TR_A(s, NN), map_rates(k, TR_A(s, maps)), x, TR_A(s, c) + k->c_laws, law, dn, (double *)sliding);
    for (int q = 0; q < n; ++q) {
      const tr_pair *pair = tr_pair_of(s, rest[q]);
      double d[3];
      if (!tr_seeks_direction(s, rest[q]) || part >= pair->nrates) continue;
      for (int j = 0; j < pair->nrates; ++j) d[j] = tr_mode_of(s, rest[q])->direction[j] / length * arm[pair->eta0 + j];
      for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) {
        const double turned = (law[i] - TR_A(s, law)[i]) / TURN_TRIED, lag = (TR_A(s, law)[i] - eta[i]) * d[part];
        const double slope = (turned + lag) * arm[pair->eta0 + part] / size[q];
        for (int j = 0; j < e; ++j) J[i + j * e] -= slope * Qe[pair->eta0 + part + j * e];
      }
    }
  }
}

/* One step of Newton's method on the multipliers, directions of onset turning with the accelerations. Returns its size over theirs. branches:
 * whether balls may change theirs. */
static double tr_onsets_step(tr_sim *s, const int *rest, int n, int branches) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *r = TR_A(s, r), *J = TR_A(s, lu), size[n + 1], step = 0.0, most = 0.0;
  for (int q = 0; q < n; ++q)
    if (tr_seeks_direction(s, rest[q])) tr_turn_onset(s, rest[q], size + q);
  if (branches) tr_law_on_branches(s, rest, n); else tr_law(s, eta);
  tr_law_jacobian(s);
  for (int i = 0; i < e; ++i) r[i] = TR_A(s, law)[i] - eta[i];
  tr_onset_slopes(s, rest, n, size, J);
  if (s->friction.still) tr_still_rows(s, eta, r, J);
  if (!tr_lu(e, J, (int *)TR_A(s, perm) + s->k->active)) return INFINITY;
  tr_lu_solve(e, J, (int *)TR_A(s, perm) + s->k->active, r);
  s->stats.newton_iterations++;
  for (int i = 0; i < e; ++i) {
    eta[i] += r[i];
    step = fmax(step, fabs(r[i]) / TR_A(s, arm)[i]), most = fmax(most, fabs(eta[i]) / TR_A(s, arm)[i]);
  }
  return step < INFINITY ? step / fmax(most, NO_FORCE) : INFINITY;
}

/* The directions in which the pairs `rest` (n) of several components start to slide, all at once, and the multipliers, from those in place. 1 when
 * found. */
static int tr_onsets_together(tr_sim *s, const int *rest, int n) {
  int several = 0;
  double last = INFINITY, step = INFINITY;
  for (int q = 0; q < n; ++q) several += tr_seeks_direction(s, rest[q]);
  if (!several) return tr_solve_modes(s);
  tr_note_modes(s);
  tr_without_loops(s, 1);
  for (int it = 0; it < TURNS_MOST; ++it, last = step) {
    step = tr_onsets_step(s, rest, n, it < BRANCHES_MOST);
    if (!(step < INFINITY)) return 0;
    if (step <= ONSETS_FOUND || (step <= ONSETS_NEARLY && step >= NEWTON_SHRINKS * last)) return tr_solve_modes(s);
  }
  return 0;
}

/* Put in force what the creep has come to: a pair that moves starts that way, any other sticks. */
static void tr_put_foreseen(tr_sim *s, const tr_creeping *c) {
  const double *arm = TR_A(s, arm);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    tr_mode *m = tr_mode_of(s, c->pairs[q]);
    double acc = 0.0;
    for (int j = 0; j < 3; ++j) m->direction[j] = 0.0;
    for (int i = c->first[q]; i < c->first[q + 1]; ++i)
      acc += c->x[i] * c->x[i], m->direction[c->index[i] - pair->eta0] = c->x[i] / arm[c->index[i]];
    m->flag = sqrt(acc) > CREEP_MOVES * c->eps[q] ? TR_SLIPS : TR_STUCK;
    if (pair->nrates == 1) m->direction[0] = m->direction[0] < 0.0 ? -1.0 : 1.0;
  }
}

/* Foresee the modes of the pairs `rest` (n) at the state whose maps are in place, and put them in force with the frictions that belong to
 * them. */
static void tr_foresee(tr_sim *s, const int *rest, int n) {
  const int e = s->k->neta;
  double B[e * e], w0[e], w[e], x[e], u[e], cap[e], eps[n], *eta = TR_A(s, z) + s->k->active;
  int law[e], index[e], first[n + 1], lead[e];
  tr_creeping c = {.n = n, .pairs = rest, .index = index, .first = first, .lead = lead, .B = B, .w0 = w0, .w = w, .x = x, .u = u, .cap = cap, .eps = eps, .share = 1.0};
  tr_without_loops(s, 1);
  tr_creep_index(s, &c);
  tr_creep_freedoms(s, &c);
  for (int i = 0; i < e; ++i) law[i] = 1;
  for (int q = 0; q < n; ++q)
    for (int i = tr_pair_of(s, rest[q])->eta0; i < tr_pair_of(s, rest[q])->eta0 + tr_pair_of(s, rest[q])->neta; ++i)
      law[i] = 0, eta[i] = tr_is_prescribed(s, i) ? 0.0 : eta[i];
  tr_creep_to_rest(s, &c, law);
  tr_put_foreseen(s, &c);
}

/* From modes that are foreseen for all of many pairs at once: those few that the exact equations do not bear out are turned one by one. */
static int tr_settle_together(tr_sim *s, const int *rest, int n) {
  tr_foresee(s, rest, n);
  for (int it = 0; it < DECIDE_MAX && tr_onsets_together(s, rest, n); ++it) {
    const int worst = tr_worst_misfit(s, rest, n);
    if (worst < 0) return tr_holds(s, rest, n);
    if (!tr_slides(s, worst)) tr_let_slip(s, worst); else tr_let_stick(s, rest, n, worst);
  }
  return 0;
}
