/* Verification of solutions (theory, "Answers are checked"). The check compares modes and multipliers with the kernel's maps alone.
 * The check uses no residual, rank or eliminated map of the solver, and so detects errors of the solver. The check runs at every
 * decision and at the end of every accepted step. */
#include "checks/checks.h"

/* relative to the sum of absolute terms: allowed violation of an equation. The round-off of a solution is 1e-14. Near a singular
 * position of loops, a dropped pivot p leaves a violation of √p, which is at most 3e-5 (``constraints/loop_solve.c``). */
#define LOOP_OPENS 1e-4
#define FAINT_OPENING 1e-7 /* in units of length · rate² (rotations: rate²): violation of a loop row that is always allowed */
#define REST_MOVES 1e-4
#define LAW_MISSED 1e-6    /* relative to the terms of a law: allowed violation; half of the digits are lost near a ball's cone */
/* relative to the friction ratio: allowed excess of a held pair over its capacity; events release a pair at an excess of 1e-10 */
#define CONE_BROKEN 1e-7
/* relative to the kink speed (for a ball's cone: squared sine of the tilt): allowed distance from the assumed branch of a law */
#define BRANCH_MISSED 1e-6
#define CREEPS 1e-7        /* relative to the speed unit: allowed speed of a held pair, caused by loop closure and cut joints */
#define CREEPS_PART 10.0   /* relative to tolerance × the speed unit: allowed speed of a held pair, if larger than CREEPS */
/* relative to the sum of absolute terms: allowed acceleration of a starting pair against its direction */
#define START_BACKWARDS 1e-6
#define FRICTION_NOTHING 1e-12 /* relative to the load: a smaller friction counts as zero */
/* in units of min(energy, energy / length): if all pairs have less friction, their friction is round-off (a hanging pendulum) */
#define FRICTION_FAINT 1e-9
/* relative to the length scale, or rad: allowed depth of an open stop, and allowed gap of an engaged stop */
#define STOP_MISSED 1e-9

/* The solution, recomputed from the maps alone. */
typedef struct tr_recomputed {
  double *acc, *acc_size; /* (neta) accelerations and sums of their absolute terms; without maps, (active) loop residuals follow */
  double *N, *N_size;     /* (nn) reaction components and sums of their absolute terms */
  double *law, *dn;       /* η that the laws give at N, and ∂η/∂N */
  const double *Qe;       /* accelerations by unit friction without loops (neta × neta); null pointer without maps */
  tr_sliding *sliding;
  int sized;              /* whether N_size and dn are computed; required only if a law is not satisfied with the usual accuracy */
  double faint;           /* N: round-off of the largest friction; smaller friction violates no law */
} tr_recomputed;

static inline double tr_closure_speed(const tr_sim *s) { return fmax(CREEPS, CREEPS_PART * s->set.rtol) * tr_speed_unit(s); }

/* Whether the solver dropped loop row i at a singular position. No λ satisfies such a row, so its violation may have any size. The
 * dropped rows are the only information that the check takes from the solver. */
static int tr_is_row_dropped(const tr_sim *s, int i) {
  const int *perm = (const int *)TR_A(s, perm);
  if (s->loops.rank_now >= s->loops.rank) return 0;
  for (int q = s->loops.rank_now; q < tr_loop_rows(s); ++q)
    if (perm[q] == i) return 1;
  return 0;
}

/* Largest violation of loop row i that is always allowed. */
static inline double tr_row_tolerance(const tr_sim *s, int i) {
  return FAINT_OPENING * tr_row_unit(s, s->k->active_rows[i]) * s->set.rate * s->set.rate;
}

/* Whether the residuals of the loop equations, relative to g0, are as small as usual. */
static int tr_are_loops_closed(const tr_sim *s, const double *maps, const double *z) {
  const tr_kernel *k = s->k;
  const double *g0 = map_g0(k, maps);
  int a = k->active, closed = 1;
  double r[a + 1];
  memcpy(r, g0, sizeof(double) * a);
  tr_add_loop_product(s, z, r);
  tr_add_columns(a, k->neta, map_Se(k, maps), z + a, 1.0, r);
  for (int i = 0; i < a; ++i) closed &= fabs(r[i]) <= LOOP_OPENS * fabs(g0[i]) + tr_row_tolerance(s, i);
  return closed;
}

/* Like tr_are_loops_closed, for a recursive solution. The recursion drops no row. */
static int tr_are_rows_closed(const tr_sim *s, const tr_recomputed *it) {
  const double *gap = it->acc + s->k->neta, *first = it->acc_size + s->k->neta;
  int closed = 1;
  for (int i = 0; i < s->k->active; ++i) closed &= fabs(gap[i]) <= LOOP_OPENS * fabs(first[i]) + tr_row_tolerance(s, i);
  return closed;
}

/* Start sums of terms: out = first, size = |first|. */
static inline void tr_start_terms(int m, const double *first, double *out, double *size) {
  for (int i = 0; i < m; ++i) out[i] = first[i], size[i] = fabs(first[i]);
}

/* Add to sums of terms: out (m) += A x, and size (m) += |A| |x|, where A is m×n. */
static inline void tr_add_terms(int m, int n, const double *A, const double *x, double *out, double *size) {
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < m; ++i) {
      double part = A[i + (size_t)j * m] * x[j];
      out[i] += part, size[i] += fabs(part);
    }
}

/* Check the loop equations S λ + Se η + g0 = 0. */
static int tr_check_loops(tr_sim *s, const double *maps, const double *z) {
  const tr_kernel *k = s->k;
  int a = k->active;
  double r[a + 1], size[a + 1];
  if (tr_are_loops_closed(s, maps, z)) return 0;
  tr_start_terms(a, map_g0(k, maps), r, size);
  tr_add_terms(a, a, tr_whole_loop_matrix(s), z, r, size);
  tr_add_terms(a, k->neta, map_Se(k, maps), z + a, r, size);
  for (int i = 0; i < a; ++i)
    if (!(fabs(r[i]) <= LOOP_OPENS * size[i] + tr_row_tolerance(s, i)) && !tr_is_row_dropped(s, i)) return TR_BREAKS_LOOP;
  return 0;
}

/* Compute N_size and dn, unless this has been done. */
static void tr_add_law_sizes(tr_sim *s, tr_recomputed *it) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *z = TR_A(s, z);
  if (it->sized) return;
  tr_form_maps(s);
  tr_start_terms(k->nn, map_N0(k, maps), it->N, it->N_size);
  tr_add_terms(k->nn, k->active, map_Nl(k, maps), z, it->N, it->N_size);
  tr_add_terms(k->nn, k->neta, map_Ne(k, maps), z + k->active, it->N, it->N_size);
  k->laws(it->N, map_rates(k, maps), TR_A(s, x), TR_A(s, c) + k->c_laws, it->law, it->dn, (double *)it->sliding);
  it->sized = 1;
}

/* Check the friction of pair i against its law. Uses `dn` and N of the pair's element. */
static int tr_check_law(tr_sim *s, int i, tr_recomputed *it) {
  const tr_pair *pair = tr_pair_of(s, i);
  const tr_element *el = s->k->element + pair->element;
  const double *eta = TR_A(s, z) + s->k->active;
  double gap = 0.0, size = 0.0, force = 0.0, load = 0.0; /* load: scale of the friction if μ = 0 */
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e) {
    const double off = fabs(eta[e] - it->law[e]);
    gap = fmax(gap, off), force = fmax(force, off / TR_A(s, lever)[e]), size += fabs(it->law[e]);
  }
  for (int q = 0; q < el->needs; ++q) load = fmax(load, fabs(it->N[el->n0 + q]));
  if (gap <= LAW_MISSED * size || force <= fmax(FRICTION_NOTHING * load, it->faint)) return 0;
  tr_add_law_sizes(s, it);
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e)
    for (int q = 0; q < el->needs; ++q) size += fabs(it->dn[el->dn0 + e - el->eta0 + q * el->neta]) * it->N_size[el->n0 + q];
  return gap <= LAW_MISSED * size ? 0 : TR_BREAKS_LAW;
}

/* Check that the pair is on the branch of its mode. */
static int tr_check_branch(const tr_sim *s, int i, const tr_sliding *v) {
  const tr_pair *pair = tr_pair_of(s, i);
  int flag = tr_mode_flag(tr_mode_of(s, i));
  double over = pair->kind == TR_KIND_KINK ? fabs(v->speed) / v->border - 1.0 : pair->kind == TR_KIND_SET && pair->cone ? v->cone : 0.0;
  if (over == 0.0) return 0;
  int beyond = pair->kind == TR_KIND_KINK ? flag == TR_SATURATED : flag != TR_CONE;
  return (beyond ? -over : over) <= BRANCH_MISSED ? 0 : TR_BREAKS_BRANCH;
}

/* Check that sliding friction of pair i dissipates energy. The sliding direction is that of the rates; with `starts`, it is that of
 * the accelerations at the onset. */
static int tr_check_dissipation(const tr_sim *s, int i, const tr_recomputed *it, int starts) {
  const tr_pair *pair = tr_pair_of(s, i);
  const double *eta = TR_A(s, z) + s->k->active + pair->eta0, *lever = TR_A(s, lever) + pair->eta0;
  const double *v0 = starts ? it->acc + pair->eta0 : map_rates(s->k, TR_A(s, maps)) + pair->rate0;
  const tr_element *el = s->k->element + pair->element;
  double friction = 0.0, load = 0.0; /* load: a second scale for friction, which is round-off of the load if μ = 0 */
  double power = 0.0, size = 0.0, fast = 0.0, cancel = 0.0, slow = pair->nrates == 1 ? tr_rest_speed(tr_speed_unit(s)) : tr_crawl_speed(tr_speed_unit(s));
  for (int j = 0; j < pair->nrates; ++j) power += eta[j] * v0[j];
  if (power >= 0.0) return 0; /* the power needs no levers; the sums below do */
  power = 0.0;
  for (int j = 0; j < pair->nrates; ++j) {
    double v = v0[j] * lever[j], f = eta[j] / lever[j];
    power += f * v, size += fabs(f * v), fast += v * v, friction = fmax(friction, fabs(f));
    if (starts) cancel += it->acc_size[pair->eta0 + j] * lever[j], size += fabs(f) * it->acc_size[pair->eta0 + j] * lever[j];
  }
  for (int q = 0; q < el->needs; ++q) load = fmax(load, fabs(it->N[el->n0 + q]));
  if (friction <= fmax(FRICTION_NOTHING * load, it->faint)) return 0;
  if (sqrt(fast) <= (starts ? FAINT_RATIO * cancel : slow)) return 0;
  return power >= -(starts ? START_BACKWARDS : POWER_GIVEN) * size ? 0 : starts ? TR_BREAKS_START : TR_BREAKS_POWER;
}

/* Check that a held pair is at rest, and that its friction is within its capacity. In an impulse step, accelerations include the
 * rates at the step's end. Friction of round-off size may accelerate a light body; this is no violation. */
static int tr_check_held(const tr_sim *s, int i, const tr_recomputed *it, const tr_hold *hold) {
  const tr_pair *pair = tr_pair_of(s, i);
  int broken = 0;
  for (int e = pair->eta0; e < pair->eta0 + pair->neta; ++e) {
    if (tr_row_kinds(s)[e] == TR_ROW_FREE && tr_is_coming_to_rest(s, e, it->acc[e])) continue;
    double most = REST_MOVES * it->acc_size[e] + tr_acceleration_tolerance(s) * tr_speed_unit(s) * s->set.rate / TR_A(s, lever)[e];
    if (it->Qe) most += fabs(it->Qe[e + (size_t)e * s->k->neta]) * s->friction.faint * TR_A(s, lever)[e];
    if (!(fabs(it->acc[e]) <= most)) broken = TR_BREAKS_REST;
  }
  const double crawl = pair->v0 >= 0 && !s->k->rows ? tr_rest_speed(tr_speed_unit(s)) : tr_closure_speed(s);
  if (!(s->moreau.h > 0.0) && !(tr_pair_speed(s, i) <= crawl)) broken = TR_BREAKS_REST;
  double over = fmax(hold->size - hold->capacity, hold->beyond - CONE_BROKEN * hold->capacity);
  return over <= CONE_BROKEN * hold->capacity + s->friction.faint ? broken : broken | TR_BREAKS_CONE;
}

/* Check that exactly the engaged end stops are in contact at y. */
static int tr_check_stops(const tr_sim *s, const double *y) {
  const tr_kernel *k = s->k;
  double depth[k->nstops + 1];
  tr_stop_depths(s, y, depth);
  for (int i = 0; i < k->nstops; ++i)
    if (tr_contact_of_stop(s, i) < 0 && !((tr_is_pressed(s, i) ? -depth[i] : depth[i]) <= STOP_MISSED * fmax(1.0, s->set.length))) return TR_BREAKS_STOP;
  return 0;
}

static int tr_has_stuck_pair(const tr_sim *s) {
  int any = 0;
  for (int i = 0; i < s->k->nsliders; ++i) any |= tr_is_stuck(s, i);
  return any;
}

/* Check the friction of every pair. rest (n): pairs of the present decision, which start from rest. With a null pointer `rest`,
 * branches are checked, too. */
static int tr_check_pairs(tr_sim *s, tr_recomputed *it, const int *rest, int n) {
  const tr_kernel *k = s->k;
  tr_hold hold[k->nsliders + 1];
  int broken = 0;
  it->faint = ROUND_OFF_FRICTION * tr_largest_surface_friction(s);
  if (tr_has_stuck_pair(s)) k->held_alone(it->N, TR_A(s, z) + k->active, TR_A(s, x), TR_A(s, c) + k->c_held, (double *)hold);
  for (int i = 0; i < k->nsliders; ++i) {
    if (i == s->friction.freed) continue;
    if (tr_is_stuck(s, i)) {
      broken |= tr_check_held(s, i, it, hold + i);
      continue;
    }
    int starts = s->moreau.h > 0.0 || tr_contains(rest, n, i);
    broken |= tr_check_law(s, i, it);
    if (!rest) broken |= tr_check_branch(s, i, it->sliding + i);
    if (tr_is_set_valued(s, i)) broken |= tr_check_dissipation(s, i, it, starts);
  }
  return broken;
}

/* Like tr_recompute, for a recursive solution: the recursion runs with the frictions as applied forces. The terms of an
 * acceleration are: the acceleration without friction, and its change by friction. */
static void tr_recompute_recursive(const tr_sim *s, tr_recomputed *it, int accelerates) {
  const tr_kernel *k = s->k;
  const double *eta = TR_A(s, z) + k->active;
  double less[k->neta + k->active];
  it->sized = 0;
  if (accelerates || k->active) {
    memset(less, 0, sizeof less);
    k->answer(TR_A(s, c), TR_A(s, w), less, it->N, it->acc_size);
  }
  for (int i = 0; i < k->neta; ++i) less[i] = -eta[i];
  memcpy(less + k->neta, TR_A(s, z), sizeof(double) * k->active);
  k->answer(TR_A(s, c), TR_A(s, w), less, it->N, it->acc);
  k->laws_alone(it->N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, it->law, (double *)it->sliding);
  for (int i = 0; i < k->neta && accelerates; ++i) it->acc_size[i] = fabs(it->acc_size[i]) + fabs(it->acc[i] - it->acc_size[i]);
}

/* Recompute the solution from maps. accelerates: whether accelerations are needed, for pairs at rest or at the onset of sliding. */
static void tr_recompute(const tr_sim *s, tr_recomputed *it, int accelerates) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *z = TR_A(s, z), *eta = z + k->active;
  int a = k->active, e = k->neta, m = k->nn;
  memcpy(it->N, map_N0(k, maps), sizeof(double) * m);
  tr_add_columns(m, a, map_Nl(k, maps), z, 1.0, it->N);
  tr_add_columns(m, e, map_Ne(k, maps), eta, 1.0, it->N);
  k->laws_alone(it->N, map_rates(k, maps), TR_A(s, x), TR_A(s, c) + k->c_laws, it->law, (double *)it->sliding);
  if (!k->sets || !accelerates) return;
  tr_start_terms(e, map_Q0(k, maps), it->acc, it->acc_size);
  tr_add_terms(e, a, map_Ql(k, maps), z, it->acc, it->acc_size);
  tr_add_terms(e, e, map_Qe(k, maps), eta, it->acc, it->acc_size);
  if (s->moreau.h > 0.0) tr_add_start_rates(s, it->acc, it->acc_size);
}

/* Like tr_check_solution. brief: 1 returns a violation that the recursion finds, without a second check by maps. Kernels with a
 * recursion then store the accelerations of this check in end_acc, for the audit. */
static int tr_check_laws(tr_sim *s, const double *y, const int *rest, int n, int brief) {
  TR_NEED(s, TR_HAS_MAPS);
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *z = TR_A(s, z);
  int a = k->active, e = k->neta, m = k->nn, broken = k->nstops && !rest ? tr_check_stops(s, y) : 0;
  double own[2 * (e + a) + 1], *acc = brief && k->begin ? TR_A(s, end_acc) : own, N[2 * m + 1], law[e + 1], dn[k->ndn + 1];
  tr_sliding sliding[k->nsliders + 1];
  tr_recomputed it = {acc, acc + e + a, N, N + m, law, dn, 0, sliding, 0, 0.0};
  if (e && !s->step.mapped && !(s->moreau.h > 0.0)) {
    tr_recompute_recursive(s, &it, rest || tr_has_stuck_pair(s));
    const int suspected = tr_are_rows_closed(s, &it) ? tr_check_pairs(s, &it, rest, n) : TR_BREAKS_LOOP;
    if (!suspected || brief) return broken | suspected;
  }
  tr_form_maps(s);
  if (a && tr_check_loops(s, maps, z)) broken |= TR_BREAKS_LOOP;
  if (!e) return broken;
  tr_recompute(s, &it, rest || s->moreau.h > 0.0 || tr_has_stuck_pair(s));
  it.Qe = map_Qe(k, maps);
  return broken | tr_check_pairs(s, &it, rest, n);
}

static int tr_check_solution(tr_sim *s, const double *y, const int *rest, int n) { return tr_check_laws(s, y, rest, n, 0); }

static int tr_suspect_end(tr_sim *s, const double *y, int *sure) {
  *sure = s->step.mapped;
  return tr_check_laws(s, y, 0, 0, 1);
}

static int tr_confirm_end(tr_sim *s, double t, const double *y) {
  double kept[tr_solution_size(s)];
  tr_save_solution(s, kept);
  const int broken = tr_rhs(s, t, y, TR_A(s, dy)) ? tr_check_solution(s, y, 0, 0) : TR_BREAKS_LAW;
  tr_restore_solution(s, kept);
  return broken;
}

static int tr_find_other_end(tr_sim *s, int broken, double t, const double *y, double *slope) {
  const tr_kernel *k = s->k;
  const int asked = s->set.locate ? ~0 : TR_BREAKS_LOOP | TR_BREAKS_REST | TR_BREAKS_LAW;
  double *eta = TR_A(s, z) + k->active;
  if (!(broken & asked)) return 1;
  s->stats.refused++;
  for (int start = 0; start < 2; ++start) {
    if (start == 0) memcpy(eta, TR_A(s, zstart) + k->active, sizeof(double) * k->neta);
    else memset(eta, 0, sizeof(double) * k->neta);
    if (!tr_rhs(s, t, y, slope) || (tr_check_solution(s, y, 0, 0) & asked)) continue;
    tr_store_end_multipliers(s);
    return 1;
  }
  s->step.failure = TR_FAIL_MODES;
  return 0;
}

static int tr_is_valid_decision(tr_sim *s, const int *rest, int n) {
  int ok = !tr_check_solution(s, 0, rest, n);
  s->stats.refused += !ok;
  return ok;
}

/* Write to r the residuals of a recursive solution. A new pass over the bodies gives the loads. The residual of a freedom at rest
 * is its relative acceleration times its friction. */
static void tr_residual_recursive(const tr_sim *s, double *r) {
  const tr_kernel *k = s->k;
  const double *eta = TR_A(s, z) + k->active;
  double acc[2 * (k->neta + k->active)], N[k->nn], law[k->neta], slope[3];
  int at;
  tr_sliding sliding[k->nsliders + 1];
  tr_recomputed it = {.acc = acc, .acc_size = acc + k->neta + k->active, .N = N, .law = law, .sliding = sliding};
  tr_recompute_recursive(s, &it, s->friction.held);
  for (int i = 0; i < k->neta; ++i) {
    const int kind = tr_row_kind(s, i);
    r[i] = kind == TR_ROW_LAW ? law[i] - eta[i] : kind == TR_ROW_FREE ? -eta[i] : it.acc[i] / fmax(it.acc_size[i], NO_FORCE) * eta[i];
    if (kind == TR_ROW_STORED) r[i] = tr_stored_load(s, tr_pair_of_multiplier(s, i, &at), i, N, slope) - eta[i];
  }
}

static double tr_complement_residual(tr_sim *s) {
  const tr_kernel *k = s->k;
  double size = FRICTION_FAINT * fmin(s->set.energy, s->set.energy / s->set.length), err = 0.0, *r = TR_A(s, r);
  const double *eta = TR_A(s, z) + k->active;
  if (!k->neta) return 0.0;
  TR_NEED(s, TR_HAS_SOLUTION);
  if (s->step.recursive && !s->step.mapped) {
    tr_residual_recursive(s, r);
  } else {
    tr_evaluate_laws(s, eta);
    for (int i = 0; i < k->neta; ++i) r[i] = TR_A(s, law)[i] - eta[i];
    if (s->friction.held) tr_form_rest_rows(s, eta, r, TR_A(s, lu));
  }
  for (int i = 0; i < k->neta; ++i) size = fmax(size, fabs(eta[i])), err = fmax(err, fabs(r[i]));
  return size > 0.0 ? err / size : err;
}
