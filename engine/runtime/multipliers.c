/* Multipliers between stage 1 and stage 2: η from the complement equations η = law(N(η)) by Newton's method, or from what holds pairs at
 * rest; λ follows (``loops.c``). */
#include "loops.c"

#define PRESCRIBED 1e-9      /* response of a freedom through the loops over its own: below it, its motion is prescribed (as EXACT_PIVOT) */
#define RESPONSE_FLOOR 1e-4  /* of a freedom's response without the loops: round-off of it is then 1e-11 of the unit, below GROUP_PIVOT */
#define NEWTON_MAX 30
#define SINGULAR 1e-300      /* derivative of the one complement equation: what is less cannot be divided by */
#define NEWTON_EXACT 1e-15   /* of the largest friction: a step of round-off */
#define NEWTON_QUADRATIC 1e-7 /* of the largest friction: the next step would be its square, round-off, where steps also shrink by */
#define NEWTON_SHRINKS 0.1

#include "laws.c"
#include "impending.c"

/* Residual and Jacobian rows of pairs held at rest replace those of their law: q̈ = 0 (scaled to the own multiplier), η = 0 where the
 * motion is prescribed, or a share of the group's load: friction ratio equal to the leader's. */
static void tr_still_rows(tr_sim *s, const double *eta, double *r, double *J) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const int *row = tr_row_kinds(s);
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e;
  if (s->friction.shares) k->held(TR_A(s, NN), TR_A(s, share), TR_A(s, x), TR_A(s, c) + k->c_held, TR_A(s, hold), TR_A(s, dhold));
  if (s->friction.by_law) tr_impending_law(s);
  for (int m = 0, at = 0; m < k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    for (int i = pair->eta0; i < pair->eta0 + pair->neta; ++i) {
      if (row[i] == TR_ROW_STILL) {
        double acc = Q0[i], inv = 1.0 / Qe[i + i * e];
        for (int j = 0; j < e; ++j) acc += Qe[i + j * e] * eta[j], J[i + j * e] = Qe[i + j * e] * inv;
        r[i] = -acc * inv;
      } else if (row[i] == TR_ROW_FREE) {
        for (int j = 0; j < e; ++j) J[i + j * e] = i == j;
        r[i] = -eta[i];
      } else if (row[i] == TR_ROW_SHARE) {
        r[i] = tr_share_row(s, m, at, i, eta, J);
      } else if (row[i] == TR_ROW_KEPT) {
        r[i] = tr_kept_row(s, m, i, eta, J);
      }
    }
    at += k->element[pair->element].needs;
  }
}

static void tr_ease(const tr_sim *s, const double *eta, double *r, double *J);

/* How large a step is, and η after it, as forces at the surface: a torque is small in a small mechanism. */
static inline void tr_take_step(int e, const double *r, const double *per_lever, double *eta, double *step, double *size) {
  *step = *size = 0.0;
  for (int i = 0; i < e; ++i) {
    eta[i] += r[i];
    *step = fmax(*step, fabs(r[i]) * per_lever[i]);
    *size = fmax(*size, fabs(eta[i]) * per_lever[i]);
  }
}

/* Newton on η − law(N(η)) = 0 from the given η; 1 on convergence. The last step is taken after its size shows quadratic
 * convergence has made the next one negligible (the Jacobian is exact). */
static int tr_newton(tr_sim *s, double *eta) {
  const tr_kernel *k = s->k;
  int e = k->neta;
  const double *arm = TR_A(s, arm);
  double *r = TR_A(s, r), *J = TR_A(s, lu), last = INFINITY, per_lever[e + 1];
  const int three = e == 3 && !k->active; /* of loops the factors are looked at (tr_runs_away) */
  for (int i = 0; i < e; ++i) per_lever[i] = arm[i] > 0.0 ? 1.0 / arm[i] : 1.0;
  for (int it = 1; it <= NEWTON_MAX; ++it) {
    if (tr_gives_up(s, (double)e * e * (e + k->nn))) return 0;
    tr_law(s, eta);
    tr_law_jacobian(s);
    const double *law = TR_A(s, law);
    double size, step;
    for (int i = 0; i < e; ++i) r[i] = law[i] - eta[i];
    if (s->friction.eased > 0.0) tr_ease(s, eta, r, J);
    if (s->friction.still) tr_still_rows(s, eta, r, J);
    if (e == 1) {
      if (!(fabs(J[0]) > SINGULAR)) return 0;
      r[0] /= J[0];
    } else if (three) {
      if (!tr_solve_three(J, r)) return 0;
    } else {
      if (!tr_lu(e, J, (int *)TR_A(s, perm) + k->active)) return 0;
      tr_lu_solve(e, J, (int *)TR_A(s, perm) + k->active, r);
    }
    tr_take_step(e, r, per_lever, eta, &step, &size);
    s->stats.newton_iterations++;
    if (!(step < INFINITY)) return 0;
    if (step <= NEWTON_EXACT * size || (step <= NEWTON_QUADRATIC * size && step <= NEWTON_SHRINKS * last) || size == 0.0) {
      if (it > s->stats.newton_most) s->stats.newton_most = it;
      return 1;
    }
    last = step;
  }
  return 0;
}

#include "tilt.c"
#include "starts.c"

static void tr_note_modes(tr_sim *s);

/* η by Newton's method, with groups at rest that share their load in the sense in which it pulls. */
static int tr_newton_in_sense(tr_sim *s, double *eta) {
  if (!tr_newton(s, eta)) return 0;
  if (!s->friction.by_law || !tr_turn_impending(s, eta) || tr_newton(s, eta)) return 1;
  memset(eta, 0, sizeof(double) * s->k->neta);
  return tr_newton(s, eta);
}

/* η with balls of stuck groups sharing by their axes, where they do not by their law; 1 when found. */
static int tr_newton_otherwise(tr_sim *s, const double *warm) {
  double *eta = TR_A(s, z) + s->k->active;
  if (!s->friction.by_law) return 0;
  s->friction.by_law = 0;
  memcpy(eta, warm, sizeof(double) * s->k->neta);
  if (tr_newton(s, eta)) return 1;
  memset(eta, 0, sizeof(double) * s->k->neta);
  return tr_newton(s, eta);
}

/* Whether stiff contacts would run away from the root that Newton's iteration has just found: the determinant of its Jacobian, 1 where
 * nothing rubs, is negative there (METHOD, "Complement equations"). Asked of loops, where it changes its sign through infinity: elsewhere it
 * does so where the root ends (``fold.c``). Shares of what is held have no sense of their own. */
static int tr_runs_away(const tr_sim *s) {
  const int e = s->k->neta, r = tr_open_count(s);
  if (!s->k->active || s->friction.shares) return 0;
  const int sense = e == 1 ? (TR_A(s, lu)[0] < 0.0 ? -1 : 1) : tr_lu_sense(e, TR_A(s, lu), (const int *)TR_A(s, perm) + s->k->active);
  return sense * (r ? tr_lu_sense(r, TR_A(s, openF), (const int *)TR_A(s, openP)) : 1) < 0;
}

/* Contacts run away from the root that has been found and is in η: the one from the step's start in its place, or from
 * none, if that lasts and is on the branches that the modes say. */
static void tr_take_lasting(tr_sim *s, double *eta) {
  const int e = s->k->neta;
  double found[e];
  memcpy(found, eta, sizeof found);
  for (int start = 0; start < 2; ++start) {
    if (start) memset(eta, 0, sizeof found);
    else memcpy(eta, TR_A(s, zold) + s->k->active, sizeof found);
    if (tr_newton_in_sense(s, eta) && !tr_runs_away(s) && tr_fits_branches(s)) return;
  }
  memcpy(eta, found, sizeof found);
  tr_newton_in_sense(s, eta);
}

/* Whether the motion of multiplier i's freedom is prescribed by the loops: its response to its own friction through them vanishes. After
 * tr_held_maps. */
static inline int tr_is_prescribed(const tr_sim *s, int i) {
  const int at = i + i * s->k->neta;
  return !(fabs((TR_A(s, Q) + s->k->neta)[at]) > PRESCRIBED * fabs(map_Qe(s->k, TR_A(s, maps))[at]));
}

/* Whether the motion of a held freedom has become prescribed by the loops (a dead centre), or has ceased to be. After tr_held_maps. */
static int tr_kinds_changed(const tr_sim *s) {
  const tr_kernel *k = s->k;
  const int *row = tr_row_kinds(s);
  for (int i = 0; i < k->nsliders; ++i) {
    if (!tr_is_stuck(s, i) || i == s->friction.freed) continue;
    const tr_pair *pair = tr_pair_of(s, i);
    for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j)
      if (tr_is_prescribed(s, j) != (row[j] == TR_ROW_FREE)) return 1;
  }
  return 0;
}

/* By what the response of multiplier i's freedom to frictions is scaled when its rank is looked for: by its own response, but no finer
 * than round-off allows of what cancels in it, its response without the loops. */
static double tr_response_unit(const tr_sim *s, int i, double own) {
  double raw = fabs(map_Qe(s->k, TR_A(s, maps))[i + i * s->k->neta]);
  return 1.0 / sqrt(fmax(own, RESPONSE_FLOOR * raw));
}

/* z = [λ active | η] at the state whose maps are in place; warm-started. 0 when there is no reachable root. Only `deciding` changes how groups share. */
static int tr_multipliers(tr_sim *s, int deciding) {
  const tr_kernel *k = s->k;
  int a = k->active, e = k->neta;
  const double *maps = TR_A(s, maps);
  double *z = TR_A(s, z), *lam = z, *eta = z + a;
  if (a > 0) tr_factor(s);
  if (e == 0) {
    tr_solve_S(s, map_g0(k, maps), lam);
    for (int i = 0; i < a; ++i) lam[i] = -lam[i];
    return 1;
  }
  double lam0[a > 0 ? a : 1];
  tr_eliminate(s, lam0);
  if (s->friction.still) {
    tr_held_maps(s, lam0);
    if (tr_kinds_changed(s)) tr_note_modes(s);
  }
  double warm[e];
  memcpy(warm, eta, sizeof warm);
  if (!tr_newton_in_sense(s, eta) && (deciding || !tr_newton_by_its_tilt(s, warm))) {
    memset(eta, 0, sizeof(double) * e);
    if (!tr_newton_in_sense(s, eta) && !(deciding && tr_newton_otherwise(s, warm)) && !tr_newton_by_tilt(s, warm) &&
        !(s->friction.anywhere && tr_newton_anywhere(s, eta))) {
      memset(eta, 0, sizeof(double) * e);
      return 0;
    }
  } else if (tr_runs_away(s)) tr_take_lasting(s, eta);
  const double *T = TR_A(s, T);
  for (int i = 0; i < a; ++i) {
    lam[i] = lam0[i];
    for (int j = 0; j < e; ++j) lam[i] -= T[i + j * a] * eta[j];
  }
  if (tr_open_count(s)) {
    tr_law(s, eta);
    tr_add_columns(a, tr_open_count(s), TR_A(s, openV), TR_A(s, amounts), 1.0, lam);
  }
  return 1;
}
