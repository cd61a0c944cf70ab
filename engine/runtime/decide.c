/* Deciding the modes of all pairs at rest together, and bringing them to rest before. */
#include "modes.h"

#define SHARE_GAIN 1e-10 /* of the capacity */

/* Turn a stuck pair into one that slips the way its friction pulls (or, where its motion is prescribed, the way it accelerates). */
static void tr_let_slip(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active + pair->eta0, *arm = TR_A(s, arm) + pair->eta0;
  tr_mode *m = tr_mode_of(s, i);
  int prescribed = tr_row_kinds(s)[pair->eta0] == TR_ROW_FREE;
  m->flag = TR_SLIPS;
  for (int j = 0; j < 3; ++j) m->direction[j] = 0.0;
  if (pair->nrates == 1)
    m->direction[0] = (prescribed ? tr_freedom_acceleration(s, pair->eta0) : eta[0]) < 0.0 ? -1.0 : 1.0;
  else
    for (int j = 0; j < pair->nrates; ++j) m->direction[j] = prescribed ? tr_freedom_acceleration(s, pair->eta0 + j) : eta[j] / (arm[j] * arm[j]);
}

/* How far pair i (at rest) is from satisfying its mode, after tr_solve_modes; > 0: it does not. */
static double tr_misfit(tr_sim *s, int i) {
  const tr_pair *pair = tr_pair_of(s, i);
  const int *row = tr_row_kinds(s);
  const tr_mode *m = tr_mode_of(s, i);
  double acc[3], unit = tr_speed_unit(s) * s->set.rate, along = 0.0, worst = -1.0;
  if (tr_flag(m) != TR_STUCK) {
    tr_pair_acceleration(s, i, acc);
    for (int j = 0; j < pair->nrates; ++j) along += acc[j] * m->direction[j] * TR_A(s, arm)[pair->eta0 + j];
    if (pair->nrates == 1) return -along / (unit * TR_A(s, arm)[pair->eta0]) - TOL_RESOLVE;
    for (int j = 0; j < pair->nrates; ++j) worst = fmax(worst, fabs(acc[j]));
    return worst <= tr_faint(s, i) || along > 0.0 ? -1.0 : 1.0;
  }
  for (int j = 0; j < pair->neta; ++j)
    if (row[pair->eta0 + j] == TR_ROW_FREE)
      worst = fmax(worst, fabs(tr_freedom_acceleration(s, pair->eta0 + j)) * TR_A(s, arm)[pair->eta0 + j] / unit - TOL_RESOLVE);
  return fmax(worst, tr_ratio(s, i) - 1.0 - TOL_RESOLVE);
}

/* Multipliers in the modes in force, with the onset directions of pairs of several components that start to slide. */
static int tr_solve_onsets(tr_sim *s, const int *rest, int n) {
  int several = 0;
  for (int q = 0; q < n; ++q) several += tr_slides(s, rest[q]) && tr_pair_of(s, rest[q])->nrates > 1;
  for (int sweep = 0; several && sweep < (several > 1 ? 20 : 1); ++sweep)
    for (int q = 0; q < n; ++q)
      if (tr_slides(s, rest[q]) && tr_pair_of(s, rest[q])->nrates > 1 && !tr_onset(s, rest[q])) return 0;
  return tr_solve_modes(s);
}

/* From the modes in force: turn the worst misfit until there is none. */
static int tr_settle_from(tr_sim *s, const int *rest, int n) {
  for (int it = 0; it < DECIDE_MAX; ++it) {
    if (!tr_solve_onsets(s, rest, n)) return 0;
    int worst = -1;
    double most = 0.0;
    for (int q = 0; q < n; ++q) {
      double v = tr_misfit(s, rest[q]);
      if (!(v <= most)) most = v, worst = rest[q];
    }
    if (worst < 0) return 1;
    if (!tr_slides(s, worst)) tr_let_slip(s, worst); else tr_mode_of(s, worst)->flag = TR_STUCK;
  }
  return 0;
}

#define DIFFERENT 1e-6 /* of length · rate²: accelerations by which two answers differ */

/* All combinations of the pairs at rest. Returns how many satisfy everything and accelerate differently; the first of them is left in
 * force. */
static int tr_enumerate(tr_sim *s, const int *rest, int n) {
  int total = 1, found = 0, first = -1;
  double known[s->k->neta + 1], guess[3 * n + 1];
  for (int q = 0; q < n; ++q) total *= 3, memcpy(guess + 3 * q, tr_mode_of(s, rest[q])->direction, sizeof(double) * 3);
  for (int pass = 0; pass < 2; ++pass)
    for (int code = 0; code < total; ++code) {
      if (pass == 1 && code != first) continue;
      int ok = 1;
      for (int q = 0, c = code; q < n; ++q, c /= 3) {
        tr_mode *m = tr_mode_of(s, rest[q]);
        m->flag = c % 3 ? TR_SLIPS : TR_STUCK;
        if (tr_pair_of(s, rest[q])->nrates == 1) m->direction[0] = c % 3 == 2 ? -1.0 : 1.0;
        else if (c % 3 == 2) ok = 0;
        else memcpy(m->direction, guess + 3 * q, sizeof(double) * 3);
      }
      memset(TR_A(s, z) + s->k->active, 0, sizeof(double) * s->k->neta);
      if (!ok || !tr_solve_onsets(s, rest, n)) continue;
      for (int q = 0; q < n && ok; ++q) ok = tr_misfit(s, rest[q]) <= 0.0;
      if (!ok) continue;
      if (pass == 1) return found;
      double gap = 0.0;
      for (int i = 0; i < s->k->neta; ++i) {
        double acc = tr_freedom_acceleration(s, i);
        if (found) gap = fmax(gap, fabs(acc - known[i]) * TR_A(s, arm)[i]);
        else known[i] = acc;
      }
      if (found == 0) first = code;
      if (found == 0 || gap > DIFFERENT * tr_speed_unit(s) * s->set.rate) ++found;
    }
  return found;
}

/* Whether the pairs at rest still hold together when they share their load anew (as it grows, others come to carry the most of it):
 * by a margin, so that this is not tried without end. */
static int tr_hold_anew(tr_sim *s, const int *rest, int n) {
  for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  if (!tr_solve_modes(s) || !tr_solve_modes(s)) return 0; /* shares follow from the loads of the first solution */
  for (int q = 0; q < n; ++q)
    if (!(tr_misfit(s, rest[q]) < -SHARE_GAIN)) return 0;
  return 1;
}

/* Modes of the pairs at rest at the state whose maps are in place. ``released``: the pair that has just been let go (its mode says
 * how it slips), or −1. 1 when found, 2 when all hold on and only share their load anew. */
static int tr_decide(tr_sim *s, const int *rest, int n, int released) {
  double *eta = TR_A(s, z) + s->k->active, old[s->k->neta + 1];
  memcpy(old, eta, sizeof(double) * s->k->neta);
  if (released >= 0 && s->friction.shares) {
    if (tr_hold_anew(s, rest, n)) return 2;
    tr_mode_of(s, released)->flag = TR_SLIPS;
    memcpy(eta, old, sizeof(double) * s->k->neta);
  }
  for (int q = 0; q < n; ++q)
    if (rest[q] != released) tr_mode_of(s, rest[q])->flag = TR_STUCK;
  if (tr_settle_from(s, rest, n)) return 1;
  if (released >= 0) {
    memcpy(eta, old, sizeof(double) * s->k->neta);
    for (int q = 0; q < n; ++q) tr_mode_of(s, rest[q])->flag = TR_STUCK;
    if (tr_settle_from(s, rest, n)) return 1;
  }
  memcpy(eta, old, sizeof(double) * s->k->neta);
  for (int q = 0; q < n; ++q) tr_let_slip(s, rest[q]);
  if (tr_settle_from(s, rest, n)) return 1;
  return n <= 6 && tr_enumerate(s, rest, n) > 0;
}

/* Note when other modes of one or two pairs would have done as well: then the motion is not determined by the law. */
static void tr_note_answers(tr_sim *s, double t, const int *rest, int n) {
  const tr_kernel *k = s->k;
  tr_mode modes[k->nsliders + 1];
  double z[k->active + k->neta + 1];
  if (n > 2 || s->audit.open_t >= 0.0) return;
  for (int q = 0; q < n; ++q)
    if (tr_pair_of(s, rest[q])->nrates > 1) return;
  tr_keep_modes(s, modes);
  memcpy(z, TR_A(s, z), sizeof(double) * (k->active + k->neta));
  if (tr_enumerate(s, rest, n) > 1) s->audit.open_t = t, s->audit.open_pair = rest[0];
  tr_put_modes(s, modes);
  memcpy(TR_A(s, z), z, sizeof(double) * (k->active + k->neta));
  tr_note_modes(s);
}

/* Pairs that are stuck, or as good as at rest, and those in `also` (−1: none). Maps in place. */
static int tr_at_rest(tr_sim *s, int also, int *rest) {
  int n = 0;
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_set(s, i) && (tr_is_stuck(s, i) || i == also || tr_pair_speed(s, i) <= REST_SPEED * tr_speed_unit(s))) rest[n++] = i;
  return n;
}

/* Take what is left of their rates from the pairs at rest: by impulses of their own friction, then exactly. Maps in place. */
static void tr_bring_to_rest(tr_sim *s, double *y, const int *rest, int n) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta, c[e + 1], count = 0;
  const double *rates = map_rates(k, TR_A(s, maps));
  double biggest = 0.0;
  for (int q = 0; q < n; ++q) {
    const tr_pair *pair = tr_pair_of(s, rest[q]);
    for (int j = 0; j < pair->nrates; ++j) biggest = fmax(biggest, fabs(rates[pair->rate0 + j]));
  }
  if (biggest > (k->rows ? 0.0 : REST_SPEED * s->set.rate)) {
    double lam0[a + 1];
    if (a) tr_factor(s);
    tr_eliminate(s, lam0);
    tr_held_maps(s, lam0);
    const double *Qe = TR_A(s, Q) + e, *raw = map_Qe(k, TR_A(s, maps)), *T = TR_A(s, T);
    double v[e + 1];
    for (int q = 0; q < n; ++q) {
      const tr_pair *pair = tr_pair_of(s, rest[q]);
      for (int j = 0; j < pair->nrates; ++j)
        if (fabs(Qe[pair->eta0 + j + (pair->eta0 + j) * e]) > PRESCRIBED * fabs(raw[pair->eta0 + j + (pair->eta0 + j) * e])) v[count] = -rates[pair->rate0 + j], c[count++] = pair->eta0 + j;
    }
    if (count) {
      double A[count * count], L[count * count], d[count], x[count], deta[e + 1], dlam[a + 1], response[e + 1], dv[k->nv + 1];
      int perm[count];
      for (int i = 0; i < count; ++i) {
        for (int j = 0; j < count; ++j) A[i + j * count] = -0.5 * (Qe[c[i] + c[j] * e] + Qe[c[j] + c[i] * e]);
        d[i] = 1.0 / sqrt(A[i + i * count]), v[i] = -v[i];
      }
      int rank = tr_cholesky(count, A, d, L, perm, 0, 1e-9, 1e-9);
      tr_cholesky_solve(count, rank, L, perm, d, v, x);
      memset(deta, 0, sizeof deta);
      for (int i = 0; i < count; ++i) deta[c[i]] = x[i];
      for (int i = 0; i < a; ++i) {
        dlam[i] = 0.0;
        for (int j = 0; j < e; ++j) dlam[i] -= T[i + j * a] * deta[j];
      }
      for (int i = 0; i < e; ++i) response[i] = raw[i + i * e];
      tr_impulse(s, y, dlam, deta, response, dv);
      for (int i = 0; i < k->nv; ++i) y[k->nq + i] += dv[i];
      for (int q = 0; q < n && k->nquad; ++q) { /* their work: the friction of element m is the m-th integral */
        const tr_pair *pair = tr_pair_of(s, rest[q]);
        for (int j = 0; j < pair->nrates; ++j) y[s->ny + pair->element] -= 0.5 * deta[pair->eta0 + j] * rates[pair->rate0 + j];
      }
    }
  }
  for (int q = 0; q < n; ++q) {
    const tr_pair *pair = tr_pair_of(s, rest[q]);
    for (int j = 0; j < pair->nrates && pair->v0 >= 0; ++j) y[k->nq + pair->v0 + j] = 0.0;
  }
}

/* Rates of stuck tree joints stay exactly zero. */
static void tr_keep_still(const tr_sim *s, double *v) {
  for (int i = 0; i < s->k->nsliders; ++i)
    if (tr_is_stuck(s, i) && tr_pair_of(s, i)->v0 >= 0)
      for (int j = 0; j < tr_pair_of(s, i)->nrates; ++j) v[s->k->nq + tr_pair_of(s, i)->v0 + j] = 0.0;
}
