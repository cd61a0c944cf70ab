/* Quadrature of works, separate from the motion. Works never influence steps, so the motion does not depend on the requested
 * columns.
 *
 * Sums of the audit: along stiff steps, Simpson's rule integrates powers at both ends and, from the dense output, in the middle. If
 * Simpson's rule is not accurate enough, or if the step ends at an event, the sums are integrated like the works of columns.
 *
 * Works of columns are integrated along stiff steps, and along explicit steps whose works exceed the tolerance. Clenshaw–Curtis
 * rules use three, five or nine powers. Where these rules fail, the step is divided into parts. Example: the load of a contact
 * passes near zero, and its power has a corner. */
#include "integrators/integrators.h"

#define WORK_RULES 3
#define WORK_PART (1.0 / 1024.0) /* relative to a step: shortest part */
/* largest number of parts of a step, so that noise above the tolerance is not refined without end */
#define PARTS 1024
/* Let r be the difference between a rule and the next coarser rule, relative to the result. The error of the finer rule is about
 * r^(1 + SHARPER). The orders of the two rules are 5 and 7, or 7 and 11. */
#define SHARPER 0.4
#define DOUBTED 10.0              /* safety factor on the error estimate r^(1 + SHARPER); the product is at most r */
#define AUDIT_LOOSER 100.0        /* relative to the tolerance: allowed error of the audit's sums per step */

/* Works to integrate: index of the first work in the state, number of works, smallest unit (J), factor on the tolerance. */
typedef struct tr_work_selection {
  int first, count;
  double unit, looser;
} tr_work_selection;

static const double work_node[TR_WORK_NODES] = {0.0, 0.03806023374435663, 0.1464466094067262, 0.3086582838174551, 0.5,
                                             0.6913417161825448, 0.8535533905932737, 0.9619397662556434, 1.0};

/* Weights of the rules with two, three, five and nine nodes. */
static const double work_weight[1 + WORK_RULES][TR_WORK_NODES] = {
    {0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5},
    {1.0 / 6.0, 0.0, 0.0, 0.0, 2.0 / 3.0, 0.0, 0.0, 0.0, 1.0 / 6.0},
    {1.0 / 30.0, 0.0, 4.0 / 15.0, 0.0, 2.0 / 5.0, 0.0, 4.0 / 15.0, 0.0, 1.0 / 30.0},
    {1.0 / 126.0, 0.07310932460800909, 44.0 / 315.0, 0.1808589293602449, 62.0 / 315.0, 0.1808589293602449, 44.0 / 315.0, 0.07310932460800909,
     1.0 / 126.0}};

/* Powers of the selected works at θ of the last step (w->count values). Returns 0 if there is no solution. */
static int tr_evaluate_powers(tr_sim *s, const tr_method *m, const tr_work_selection *w, double theta, double *power) {
  const int n = tr_state_width(s);
  double *y = TR_A(s, ytmp), *dy = TR_A(s, dy);
  const double *K = TR_A(s, K), *known = theta == 0.0 ? K : theta == 1.0 ? K + m->end * n : dy;
  if (theta == 0.5 && m->kind == TR_IMPLICIT) known = K + TR_MIDDLE_ROW * n;
  if (known == dy) {
    tr_dense_state(s, theta, y);
    if (s->k->nquat) tr_normalise_quaternions(s, y);
    if (!tr_rhs(s, s->step.t0 + theta * s->step.size, y, dy)) return 0;
  }
  memcpy(power, known + w->first, sizeof(double) * w->count);
  return 1;
}

/* Difference between the indices of successive nodes of a rule. */
static inline int tr_node_step(int rule) { return (TR_WORK_NODES - 1) >> rule; }

/* Compute the works (w->count values) of a part of the step by the given rule (1 to WORK_RULES). Returns the squared error, in
 * units of the tolerance, estimated from the difference between this rule and the next coarser rule. */
static double tr_work_by_rule(tr_sim *s, int rule, double part, const tr_work_selection *w, const double *power, double *work) {
  const int q = w->count;
  double e[tr_state_width(s)];
  for (int i = 0; i < q; ++i) {
    double coarse = 0.0, most = 0.0;
    work[i] = 0.0;
    for (int j = 0; j < TR_WORK_NODES; j += tr_node_step(rule)) {
      const double p = power[i + j * q] * part * s->step.size;
      work[i] += work_weight[rule][j] * p, coarse += work_weight[rule - 1][j] * p, most = fmax(most, fabs(p));
    }
    const double off = fabs(work[i] - coarse);
    e[w->first + i] = most > 0.0 ? off * fmin(1.0, DOUBTED * pow(off / most, SHARPER)) : 0.0;
  }
  return tr_squared_work_error(s, e, TR_A(s, yold), TR_A(s, ynew), w->first, q, w->unit) / (w->looser * w->looser);
}

/* Compute the works (w->count values) from θ = a to a + part. power: powers at the nodes (TR_WORK_NODES × count); the caller
 * provides the powers of the first node. *rule receives the last rule used. Returns the squared error; NaN if there is no
 * solution. */
static double tr_work_of_part(tr_sim *s, const tr_method *m, const tr_work_selection *w, double a, double part, double *power, double *work, int *rule) {
  double err = INFINITY;
  for (*rule = 1; *rule <= WORK_RULES; ++*rule) {
    const int every = tr_node_step(*rule);
    for (int j = every; j < TR_WORK_NODES; j += *rule == 1 ? every : 2 * every)
      if (!tr_evaluate_powers(s, m, w, a + part * work_node[j], power + j * w->count)) return NAN;
    err = tr_work_by_rule(s, *rule, part, w, power, work);
    if (err <= 1.0 || *rule == WORK_RULES) break;
  }
  return err;
}

/* Add the works (w->count values) from θ = a to `end`, integrated in parts. Returns 0 if there is no solution. */
static int tr_work_in_parts(tr_sim *s, const tr_method *m, const tr_work_selection *w, double a, double end, double *work) {
  const int q = w->count;
  double some[q], power[TR_WORK_NODES * q];
  int rule;
  if (!tr_evaluate_powers(s, m, w, a, power)) return 0;
  for (double part = end - a, tried = 0.0; part > 0.0; tried += 1.0) {
    const double err = tr_work_of_part(s, m, w, a, part, power, some, &rule);
    if (err != err) return 0;
    if (err > 1.0 && part > WORK_PART && tried < PARTS) {
      part *= 0.5;
      continue;
    }
    for (int i = 0; i < q; ++i) work[i] += some[i];
    memcpy(power, power + (TR_WORK_NODES - 1) * q, sizeof(double) * q);
    a += part, part = fmin(2.0 * part, end - a);
  }
  return 1;
}

/* Fit the rows R of the dense output W = R₀ θ + R₁ θ (1−θ) + R₂ θ² (1−θ) + …. The fit matches the powers at the nodes of a rule up
 * to θ = end, and `work` at θ = end. */
static void tr_fit_work_rows(tr_sim *s, int rule, double end, const double *power, const double *work) {
  const int n = tr_state_width(s), q = s->nworks, every = tr_node_step(rule), count = 1 + (TR_WORK_NODES - 1) / every;
  double A[TR_WORK_NODES * TR_WORK_NODES], at_end[TR_WORK_NODES], b[TR_WORK_NODES], *R = TR_A(s, kstep);
  int perm[TR_WORK_NODES];
  for (int j = 0; j < count; ++j) {
    const double theta = end * work_node[j * every];
    double value = theta, slope = 1.0;
    for (int r = 0; r < count; ++r) {
      if (r) slope = r & 1 ? slope * (1.0 - theta) - value : slope * theta + value, value *= r & 1 ? 1.0 - theta : theta;
      A[j + r * count] = slope, at_end[r] = value;
    }
  }
  if (!tr_lu(count, A, perm)) return;
  for (int r = s->step.dense_rows; r < count; ++r) memset(R + r * n, 0, sizeof(double) * n);
  if (s->step.dense_rows < count) s->step.dense_rows = count;
  for (int i = 0; i < q; ++i) {
    double sum = 0.0;
    for (int j = 0; j < count; ++j) b[j] = s->step.size * power[i + j * every * q];
    tr_lu_solve(count, A, perm, b);
    for (int r = 0; r < count; ++r) sum += b[r] * at_end[r], R[r * n + s->ny + i] = b[r];
    for (int r = count; r < s->step.dense_rows; ++r) R[r * n + s->ny + i] = 0.0;
    R[s->ny + i] += (work[i] - sum) / end;
    TR_A(s, ynew)[s->ny + i] = TR_A(s, yold)[s->ny + i] + R[s->ny + i];
  }
}

/* Selection of the works that columns need. */
static tr_work_selection tr_column_works(const tr_sim *s) {
  return (tr_work_selection){s->ny, s->nworks, tr_work_unit(s, s->step.size, TR_A(s, yold), s->ny, s->nworks), 1.0};
}

/* Integrate the audit's sums over the pending stiff step: by Simpson's rule over a whole step, or if necessary more accurately. If
 * an event lies inside the step, the works up to the event are integrated anew, because the parabola of Simpson's rule is too
 * inaccurate. */
static void tr_integrate_audit_works(tr_sim *s, const tr_method *m) {
  const int n = tr_state_width(s), first = s->ny + s->nworks, q = TR_AUDIT_SUMS, trouble = s->step.failure;
  const double end = s->pending.theta, *K = TR_A(s, K), *yold = TR_A(s, yold);
  const tr_work_selection sums = {first, q, tr_work_unit(s, s->step.size, yold, first, q), AUDIT_LOOSER};
  double power[TR_WORK_NODES * q], work[q], kept[tr_solution_size(s)], at_end[n], *R = TR_A(s, kstep);
  tr_form_dense_works(s);
  if (s->set.hfixed > 0.0 || !(end > 0.0)) return;
  for (int i = 0; i < q; ++i) {
    power[i] = K[first + i], power[i + 4 * q] = K[TR_MIDDLE_ROW * n + first + i], power[i + 8 * q] = K[m->end * n + first + i];
  }
  if (end >= 1.0 && tr_work_by_rule(s, 1, 1.0, &sums, power, work) <= 1.0) return;
  tr_save_solution(s, kept);
  s->step.watch = 0; /* not restored, because `watch` is always 0 between steps */
  memset(work, 0, sizeof work);
  if (tr_ensure_dense(s) && tr_work_in_parts(s, m, &sums, 0.0, end, work)) {
    tr_evaluate_dense(s, end, at_end);
    for (int i = 0; i < q; ++i) {
      R[first + i] += (work[i] - (at_end[first + i] - yold[first + i])) / end;
      TR_A(s, ynew)[first + i] = yold[first + i] + R[first + i];
    }
  }
  s->step.failure = trouble;
  tr_restore_solution(s, kept);
}

static void tr_integrate_works(tr_sim *s, const tr_method *m) {
  const int q = s->nworks, trouble = s->step.failure;
  const double end = s->pending.theta;
  const tr_work_selection sums = tr_column_works(s);
  if (m->kind == TR_IMPLICIT) tr_integrate_audit_works(s, m);
  s->step.parts = 0;
  if (!q || s->set.hfixed > 0.0 || (m->kind != TR_IMPLICIT && !(s->step.works > 1.0)) || !(end > 0.0)) return;
  double power[TR_WORK_NODES * q + 1], work[q + 1], kept[tr_solution_size(s)];
  int rule;
  tr_save_solution(s, kept);
  s->step.watch = 0; /* not restored, because `watch` is always 0 between steps */
  if (tr_ensure_dense(s) && tr_evaluate_powers(s, m, &sums, 0.0, power)) {
    const double err = tr_work_of_part(s, m, &sums, 0.0, end, power, work, &rule);
    s->step.parts = err > 1.0, s->step.worked = 0.0;
    if (s->step.parts) memset(work, 0, sizeof work);
    if (err <= 1.0 || (s->step.parts && tr_work_in_parts(s, m, &sums, 0.0, end, work))) tr_fit_work_rows(s, rule, end, power, work);
  }
  s->step.failure = trouble;
  tr_restore_solution(s, kept);
}

static void tr_state_in_step(tr_sim *s, double theta, double *y) {
  const int q = s->nworks;
  const double *yold = TR_A(s, yold);
  double *work = TR_A(s, work);
  int parts = s->step.parts;
  if (parts) {
    if (theta < s->step.worked || s->step.worked == 0.0) memset(work, 0, sizeof(double) * q), s->step.worked = 0.0;
    const tr_work_selection sums = tr_column_works(s);
    parts = tr_work_in_parts(s, tr_method_of(s), &sums, s->step.worked, theta, work);
    s->step.worked = parts ? theta : 0.0;
  }
  const int stepped = tr_is_limited_by_stability(s);
  tr_dense_state(s, theta, y);
  if (stepped) tr_step_to_place(s, theta, y);
  for (int i = 0; i < q && parts; ++i) y[s->ny + i] = yold[s->ny + i] + work[i];
}
