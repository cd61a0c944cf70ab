/* Modes of many pairs at rest. The modes of all pairs are predicted at once, then checked against the exact equations (theory,
 * "Many pairs"). */
#include "modes/modes.h"

#define TURNS_MOST 40        /* largest number of Newton iterations on all onset directions together */
#define BRANCHES_MOST 12     /* number of first iterations, in which balls may change between sliding and spinning */
#define ONSETS_FOUND 1e-14   /* relative to the friction: step of a converged iteration; a smaller step is round-off */
/* relative to the friction: if steps stop shrinking, the iteration has also converged at this step. This limit is larger than
 * ONSETS_FOUND, because difference quotients lose half of the digits. */
#define ONSETS_NEARLY 1e-9

/* Whether pair i slides in an unknown direction. */
static inline int tr_is_direction_unknown(const tr_sim *s, int i) { return tr_is_set_valued(s, i) && tr_is_sliding(s, i) && tr_pair_of(s, i)->nrates > 1; }

/* Set the direction of pair i to the direction of its acceleration at the present multipliers. *size receives the acceleration,
 * m/s². If this acceleration is round-off, the direction stays unchanged, and *size receives INFINITY. */
static void tr_turn_onset_direction(tr_sim *s, int i, double *size) {
  const tr_pair *pair = tr_pair_of(s, i);
  tr_mode *m = tr_mode_of(s, i);
  const double *lever = TR_A(s, lever) + pair->eta0;
  double d[3];
  tr_pair_acceleration(s, i, d);
  *size = tr_make_unit(pair->nrates, d);
  if (*size <= tr_faint_acceleration(s, i)) {
    *size = INFINITY;
    for (int j = 0; j < pair->nrates; ++j) d[j] = m->direction[j] * lever[j];
    tr_make_unit(pair->nrates, d);
  }
  for (int j = 0; j < pair->nrates; ++j) m->direction[j] = tr_onset_length(s) * d[j] / lever[j];
}

/* Evaluate the laws at the present multipliers. A ball outside the range of its branch changes between sliding and spinning. */
static void tr_evaluate_laws_on_branches(tr_sim *s, const int *rest, int n) {
  int changes = 0;
  tr_evaluate_laws(s, TR_A(s, z) + s->k->active);
  for (int q = 0; q < n; ++q) {
    tr_mode *m = tr_mode_of(s, rest[q]);
    const int flag = tr_sliding_of(s, rest[q])->cone < 0.0 ? TR_CONE : TR_SLIPS;
    if (!tr_is_direction_unknown(s, rest[q]) || !tr_pair_of(s, rest[q])->cone || flag == tr_mode_flag(m)) continue;
    m->flag = flag, changes = 1;
  }
  if (changes) tr_evaluate_laws(s, TR_A(s, z) + s->k->active);
}

/* Add to the Jacobian J (e×e) of the laws the effect of directions that turn with accelerations, by differences. size: acceleration
 * of each pair in `rest`. The friction along the direction is the present multiplier. With the friction of the law instead, the
 * iteration would oscillate where friction nearly stops a pair. */
static void tr_onset_slopes(tr_sim *s, const int *rest, int n, const double *size, double *J) {
  tr_form_all_maps(s);
  const tr_kernel *k = s->k;
  const int e = k->neta;
  const double *Qe = TR_A(s, Q) + e, *lever = TR_A(s, lever), *eta = TR_A(s, z) + k->active, length = tr_onset_length(s);
  double x[k->nx], law[e], dn[k->ndn + 1];
  tr_sliding sliding[k->nsliders + 1];
  tr_mode *modes = (tr_mode *)(x + ((const double *)tr_mode_of(s, 0) - TR_A(s, x)));
  for (int part = 0; part < 3; ++part) {
    memcpy(x, TR_A(s, x), sizeof x);
    for (int q = 0; q < n; ++q) {
      const tr_pair *pair = tr_pair_of(s, rest[q]);
      double d[3];
      if (!tr_is_direction_unknown(s, rest[q]) || part >= pair->nrates) continue;
      for (int j = 0; j < pair->nrates; ++j) d[j] = modes[rest[q]].direction[j] / length * lever[pair->eta0 + j] + (j == part) * TURN_TRIED;
      tr_make_unit(pair->nrates, d);
      for (int j = 0; j < pair->nrates; ++j) modes[rest[q]].direction[j] = length * d[j] / lever[pair->eta0 + j];
    }
    k->laws(TR_A(s, NN), map_rates(k, TR_A(s, maps)), x, TR_A(s, c) + k->c_laws, law, dn, (double *)sliding);
    for (int q = 0; q < n; ++q) {
      const tr_pair *pair = tr_pair_of(s, rest[q]);
      double d[3];
      if (!tr_is_direction_unknown(s, rest[q]) || part >= pair->nrates) continue;
      for (int j = 0; j < pair->nrates; ++j) d[j] = tr_mode_of(s, rest[q])->direction[j] / length * lever[pair->eta0 + j];
      for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) {
        const double turned = (law[i] - TR_A(s, law)[i]) / TURN_TRIED, lag = (TR_A(s, law)[i] - eta[i]) * d[part];
        const double slope = (turned + lag) * lever[pair->eta0 + part] / size[q];
        for (int j = 0; j < e; ++j) J[i + j * e] -= slope * Qe[pair->eta0 + part + j * e];
      }
    }
  }
}

/* One Newton step on multipliers and onset directions. branches: whether balls may change between sliding and spinning. Returns the
 * norm of the step relative to the multipliers; INFINITY on failure. */
static double tr_onsets_newton_step(tr_sim *s, const int *rest, int n, int branches) {
  const int e = s->k->neta;
  double *eta = TR_A(s, z) + s->k->active, *r = TR_A(s, r), *J = TR_A(s, lu), size[n + 1], step = 0.0, most = 0.0;
  for (int q = 0; q < n; ++q)
    if (tr_is_direction_unknown(s, rest[q])) tr_turn_onset_direction(s, rest[q], size + q);
  if (branches) tr_evaluate_laws_on_branches(s, rest, n); else tr_evaluate_laws(s, eta);
  tr_form_law_jacobian(s);
  for (int i = 0; i < e; ++i) r[i] = TR_A(s, law)[i] - eta[i];
  tr_onset_slopes(s, rest, n, size, J);
  if (s->friction.held) tr_form_rest_rows(s, eta, r, J);
  if (!tr_lu(e, J, (int *)TR_A(s, perm) + s->k->active)) return INFINITY;
  tr_lu_solve(e, J, (int *)TR_A(s, perm) + s->k->active, r);
  s->stats.newton_iterations++;
  for (int i = 0; i < e; ++i) {
    eta[i] += r[i];
    step = fmax(step, fabs(r[i]) / TR_A(s, lever)[i]), most = fmax(most, fabs(eta[i]) / TR_A(s, lever)[i]);
  }
  return step < INFINITY ? step / fmax(most, NO_FORCE) : INFINITY;
}

/* Find the multipliers and the onset directions of all pairs in `rest`, starting from the present values. Returns 1 on success. */
static int tr_find_all_onsets(tr_sim *s, const int *rest, int n) {
  int several = 0;
  double last = INFINITY, step = INFINITY;
  for (int q = 0; q < n; ++q) several += tr_is_direction_unknown(s, rest[q]);
  if (!several) return tr_solve_in_modes(s);
  tr_set_row_kinds(s);
  tr_form_maps_without_loops(s, 1);
  for (int it = 0; it < TURNS_MOST; ++it, last = step) {
    step = tr_onsets_newton_step(s, rest, n, it < BRANCHES_MOST);
    if (!(step < INFINITY)) return 0;
    if (step <= ONSETS_FOUND || (step <= ONSETS_NEARLY && step >= NEWTON_SHRINKS * last)) return tr_solve_in_modes(s);
  }
  return 0;
}

/* Apply the result of the creep minimisation: a pair that moves slips in its direction of motion; every other pair sticks. */
static void tr_set_predicted_modes(tr_sim *s, const tr_creep_problem *c) {
  const double *lever = TR_A(s, lever);
  for (int q = 0; q < c->n; ++q) {
    const tr_pair *pair = tr_pair_of(s, c->pairs[q]);
    tr_mode *m = tr_mode_of(s, c->pairs[q]);
    double acc = 0.0;
    for (int j = 0; j < 3; ++j) m->direction[j] = 0.0;
    for (int i = c->first[q]; i < c->first[q + 1]; ++i)
      acc += c->x[i] * c->x[i], m->direction[c->index[i] - pair->eta0] = c->x[i] / lever[c->index[i]];
    m->flag = sqrt(acc) > CREEP_MOVES * c->eps[q] ? TR_SLIPS : TR_STUCK;
    if (pair->nrates == 1) m->direction[0] = m->direction[0] < 0.0 ? -1.0 : 1.0;
  }
}

/* Predict the modes of the n pairs `rest` by a creep minimisation. Apply these modes and their frictions. Requires maps of the
 * current state. */
static void tr_predict_modes(tr_sim *s, const int *rest, int n) {
  const int e = s->k->neta;
  double B[e * e], w0[e], w[e], x[e], u[e], cap[e], eps[n], *eta = TR_A(s, z) + s->k->active;
  int law[e], index[e], first[n + 1], lead[e];
  tr_creep_problem c = {.n = n, .pairs = rest, .index = index, .first = first, .lead = lead, .B = B, .w0 = w0, .w = w, .x = x, .u = u, .cap = cap, .eps = eps, .share = 1.0};
  tr_form_maps_without_loops(s, 1);
  tr_creep_collect_multipliers(s, &c);
  tr_creep_factor_responses(s, &c);
  for (int i = 0; i < e; ++i) law[i] = 1;
  for (int q = 0; q < n; ++q)
    for (int i = tr_pair_of(s, rest[q])->eta0; i < tr_pair_of(s, rest[q])->eta0 + tr_pair_of(s, rest[q])->neta; ++i)
      law[i] = 0, eta[i] = tr_is_prescribed(s, i) ? 0.0 : eta[i];
  tr_creep_minimise(s, &c, law);
  tr_set_predicted_modes(s, &c);
}

static int tr_decide_by_prediction(tr_sim *s, const int *rest, int n) {
  tr_predict_modes(s, rest, n);
  for (int it = 0; it < DECISION_STEPS && tr_find_all_onsets(s, rest, n); ++it) {
    const int worst = tr_find_worst_misfit(s, rest, n);
    if (worst < 0) return tr_is_valid_decision(s, rest, n);
    if (!tr_is_sliding(s, worst)) tr_let_slip(s, worst); else tr_let_stick(s, rest, n, worst);
  }
  return 0;
}
