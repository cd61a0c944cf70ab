/* Works beside the motion. No step depends on those of columns, so that the motion is the same whatever columns are asked for.
 *
 * Of the audit, along steps of the stiff method, which has no Jacobian of powers: these are known at both ends of a step and asked for in its
 * middle, on the dense output; the parabola through the three is integrated (Simpson's rule). Where that may be off by what an audit would
 * notice they are integrated like those of columns.
 *
 * Of columns, along such steps and wherever what an explicit method makes of them is off by more than the tolerance: they are integrated on the
 * dense output by the rules of Clenshaw and Curtis with three powers, five or nine, in parts where these do not do (a contact's load that passes by zero has a
 * corner). */
#include "modes.h"

#define MIDDLE 1 /* row of K in which powers of the middle lie: that of a stage, which the dense output has no other use for */
#define WORK_NODES 9
#define WORK_RULES 3
#define WORK_PART (1.0 / 1024.0) /* of a step: in no shorter part is a corner worth looking for */
#define PARTS 1024                /* into so many at most: powers that are noise beyond the tolerance are not followed for ever */
#define SHARPER 0.4               /* where a rule with half of the powers errs by a share r of the work, one errs by r^1.4 (orders 5 and 7; 7 and 11) */
#define DOUBTED 10.0              /* times this, but by no more than r */
#define AUDIT_LOOSER 100.0        /* times the tolerance: by so much sums of the audit may be off in a step, some of which make what it notes */

/* Which works are integrated: from place `first` of the state on; the least they are measured by, J; times the tolerance by which they may be off. */
typedef struct tr_sums {
  int first, count;
  double unit, looser;
} tr_sums;

/* Powers in the middle of the trial step just made, whose ends are in yold and ynew. NaN where there is no answer. The multipliers stay what they
 * were. */
static void tr_works_middle(tr_sim *s, const tr_rosenbrock *m) {
  const int watch = s->step.watch, trouble = s->step.trouble;
  double kept[tr_solution_size(s)], *y = TR_A(s, ytmp), *f = TR_A(s, dy), *middle = TR_A(s, K) + MIDDLE * tr_width(s);
  tr_keep_solution(s, kept);
  tr_dense_rosenbrock(s, m);
  tr_dense_eval(s, 0.5, y);
  if (s->k->nquat) tr_normalize(s, y);
  s->step.watch = 0;
  const int known = tr_rhs(s, s->step.t0 + 0.5 * s->step.size, y, f);
  s->step.watch = watch, s->step.trouble = trouble;
  for (int i = s->ny; i < s->ny + s->nworks + s->naudit; ++i) middle[i] = known ? f[i] : NAN;
  tr_put_solution(s, kept);
}

/* Rows of the dense output (``tr_dense_rosenbrock``) of works, once the step's end has been evaluated; its state takes them too. */
static void tr_works_dense(tr_sim *s) {
  const int n = tr_width(s);
  const double h = s->step.size, *K = TR_A(s, K), *start = K, *middle = K + MIDDLE * n, *end = K + tr_method_of(s)->end * n;
  double *R = TR_A(s, kstep);
  for (int i = s->ny; i < s->ny + s->nworks + s->naudit; ++i) { /* power start + a θ + b θ² */
    const double b = 2.0 * (start[i] - 2.0 * middle[i] + end[i]), a = end[i] - start[i] - b;
    R[i] = h * (start[i] + a / 2.0 + b / 3.0);
    R[n + i] = -h * (a / 2.0 + b / 3.0);
    R[2 * n + i] = -h * b / 3.0;
    R[3 * n + i] = 0.0;
    TR_A(s, ynew)[i] = TR_A(s, yold)[i] + R[i];
  }
}

static const double work_node[WORK_NODES] = {0.0, 0.03806023374435663, 0.1464466094067262, 0.3086582838174551, 0.5,
                                             0.6913417161825448, 0.8535533905932737, 0.9619397662556434, 1.0};
/* Weights of the rules with two, three, five and nine of them. */
static const double work_weight[1 + WORK_RULES][WORK_NODES] = {
    {0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5},
    {1.0 / 6.0, 0.0, 0.0, 0.0, 2.0 / 3.0, 0.0, 0.0, 0.0, 1.0 / 6.0},
    {1.0 / 30.0, 0.0, 4.0 / 15.0, 0.0, 2.0 / 5.0, 0.0, 4.0 / 15.0, 0.0, 1.0 / 30.0},
    {1.0 / 126.0, 0.07310932460800909, 44.0 / 315.0, 0.1808589293602449, 62.0 / 315.0, 0.1808589293602449, 44.0 / 315.0, 0.07310932460800909,
     1.0 / 126.0}};

/* Powers (count) at θ of the step just made. 0 where there is no answer. */
static int tr_powers_at(tr_sim *s, const tr_method *m, const tr_sums *w, double theta, double *power) {
  const int n = tr_width(s);
  double *y = TR_A(s, ytmp), *dy = TR_A(s, dy);
  const double *K = TR_A(s, K), *known = theta == 0.0 ? K : theta == 1.0 ? K + m->end * n : dy;
  if (theta == 0.5 && m->kind == TR_IMPLICIT) known = K + MIDDLE * n;
  if (known == dy) {
    tr_dense_state(s, theta, y);
    if (s->k->nquat) tr_normalize(s, y);
    if (!tr_rhs(s, s->step.t0 + theta * s->step.size, y, dy)) return 0;
  }
  memcpy(power, known + w->first, sizeof(double) * w->count);
  return 1;
}

/* Which of the nodes a rule takes: every so manieth. */
static inline int tr_node_step(int rule) { return (WORK_NODES - 1) >> rule; }

/* Works (count) of a part of the step by a rule (1 to WORK_RULES), and the squared error, 1 at the tolerance, by the rule before. */
static double tr_work_by_rule(tr_sim *s, int rule, double part, const tr_sums *w, const double *power, double *work) {
  const int q = w->count;
  double e[tr_width(s)];
  for (int i = 0; i < q; ++i) {
    double coarse = 0.0, most = 0.0;
    work[i] = 0.0;
    for (int j = 0; j < WORK_NODES; j += tr_node_step(rule)) {
      const double p = power[i + j * q] * part * s->step.size;
      work[i] += work_weight[rule][j] * p, coarse += work_weight[rule - 1][j] * p, most = fmax(most, fabs(p));
    }
    const double off = fabs(work[i] - coarse);
    e[w->first + i] = most > 0.0 ? off * fmin(1.0, DOUBTED * pow(off / most, SHARPER)) : 0.0;
  }
  return tr_works2(s, e, TR_A(s, yold), TR_A(s, ynew), w->first, q, w->unit) / (w->looser * w->looser);
}

/* Works (count) of the part from θ = a to a + part, and the powers at its nodes (WORK_NODES × count), the first of which is in place.
 * Returns the squared error; not a number where there is no answer. rule: the last that was tried. */
static double tr_work_of_part(tr_sim *s, const tr_method *m, const tr_sums *w, double a, double part, double *power, double *work, int *rule) {
  double err = INFINITY;
  for (*rule = 1; *rule <= WORK_RULES; ++*rule) {
    const int every = tr_node_step(*rule);
    for (int j = every; j < WORK_NODES; j += *rule == 1 ? every : 2 * every)
      if (!tr_powers_at(s, m, w, a + part * work_node[j], power + j * w->count)) return NAN;
    err = tr_work_by_rule(s, *rule, part, w, power, work);
    if (err <= 1.0 || *rule == WORK_RULES) break;
  }
  return err;
}

/* Works (count) from θ = a to end, in parts, added. 0 where there is no answer. */
static int tr_work_in_parts(tr_sim *s, const tr_method *m, const tr_sums *w, double a, double end, double *work) {
  const int q = w->count;
  double some[q], power[WORK_NODES * q];
  int rule;
  if (!tr_powers_at(s, m, w, a, power)) return 0;
  for (double part = end - a, tried = 0.0; part > 0.0; tried += 1.0) {
    const double err = tr_work_of_part(s, m, w, a, part, power, some, &rule);
    if (err != err) return 0;
    if (err > 1.0 && part > WORK_PART && tried < PARTS) {
      part *= 0.5;
      continue;
    }
    for (int i = 0; i < q; ++i) work[i] += some[i];
    memcpy(power, power + (WORK_NODES - 1) * q, sizeof(double) * q);
    a += part, part = fmin(2.0 * part, end - a);
  }
  return 1;
}

/* Rows of the dense output, W = R₀ θ + R₁ θ (1−θ) + R₂ θ² (1−θ) + …, of works that have these powers at the nodes of a rule up to θ = end and
 * are `work` there. */
static void tr_work_rows(tr_sim *s, int rule, double end, const double *power, const double *work) {
  const int n = tr_width(s), q = s->nworks, every = tr_node_step(rule), count = 1 + (WORK_NODES - 1) / every;
  double A[WORK_NODES * WORK_NODES], at_end[WORK_NODES], b[WORK_NODES], *R = TR_A(s, kstep);
  int perm[WORK_NODES];
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

/* Works of columns as they are integrated. */
static tr_sums tr_columns_sums(const tr_sim *s) {
  return (tr_sums){s->ny, s->nworks, tr_work_unit(s, s->step.size, TR_A(s, yold), s->ny, s->nworks), 1.0};
}

/* Sums of the audit over the step of the stiff method that waits, up to where it ends: by Simpson's rule, and better where that may be off. */
static void tr_audit_sums(tr_sim *s, const tr_method *m) {
  const int n = tr_width(s), first = s->ny + s->nworks, q = s->naudit, trouble = s->step.trouble;
  const double end = s->pending.theta, *K = TR_A(s, K), *yold = TR_A(s, yold);
  const tr_sums sums = {first, q, tr_work_unit(s, s->step.size, yold, first, q), AUDIT_LOOSER};
  double power[WORK_NODES * q], work[q], kept[tr_solution_size(s)], at_end[n], *R = TR_A(s, kstep);
  tr_works_dense(s);
  if (s->set.hfixed > 0.0 || !(end > 0.0)) return;
  for (int i = 0; i < q; ++i) {
    power[i] = K[first + i], power[i + 4 * q] = K[MIDDLE * n + first + i], power[i + 8 * q] = K[m->end * n + first + i];
  }
  if (tr_work_by_rule(s, 1, 1.0, &sums, power, work) <= 1.0) return;
  tr_keep_solution(s, kept);
  s->step.watch = 0; /* as it is between steps */
  memset(work, 0, sizeof work);
  if (tr_have_dense(s) && tr_work_in_parts(s, m, &sums, 0.0, end, work)) {
    tr_dense_eval(s, end, at_end);
    for (int i = 0; i < q; ++i) {
      R[first + i] += (work[i] - (at_end[first + i] - yold[first + i])) / end;
      TR_A(s, ynew)[first + i] = yold[first + i] + R[first + i];
    }
  }
  s->step.trouble = trouble;
  tr_put_solution(s, kept);
}

/* Works of columns over the step that waits, up to where it ends, where the method's own are none or are off. */
static void tr_integrate_works(tr_sim *s, const tr_method *m) {
  const int q = s->nworks, trouble = s->step.trouble;
  const double end = s->pending.theta;
  const tr_sums sums = tr_columns_sums(s);
  if (m->kind == TR_IMPLICIT && s->naudit) tr_audit_sums(s, m);
  s->step.parts = 0;
  if (!q || s->set.hfixed > 0.0 || (m->kind != TR_IMPLICIT && !(s->step.works > 1.0)) || !(end > 0.0)) return;
  double power[WORK_NODES * q + 1], work[q + 1], kept[tr_solution_size(s)];
  int rule;
  tr_keep_solution(s, kept);
  s->step.watch = 0; /* as it is between steps */
  if (tr_have_dense(s) && tr_powers_at(s, m, &sums, 0.0, power)) {
    const double err = tr_work_of_part(s, m, &sums, 0.0, end, power, work, &rule);
    s->step.parts = err > 1.0, s->step.worked = 0.0;
    if (s->step.parts) memset(work, 0, sizeof work);
    if (err <= 1.0 || (s->step.parts && tr_work_in_parts(s, m, &sums, 0.0, end, work))) tr_work_rows(s, rule, end, power, work);
  }
  s->step.trouble = trouble;
  tr_put_solution(s, kept);
}

/* The state at θ of the step that waits, for a row: where works were integrated in parts the polynomial knows them at its end only. */
static void tr_state_inside(tr_sim *s, double theta, double *y) {
  const int q = s->nworks;
  const double *yold = TR_A(s, yold);
  double *work = TR_A(s, work);
  int parts = s->step.parts;
  if (parts) {
    if (theta < s->step.worked || s->step.worked == 0.0) memset(work, 0, sizeof(double) * q), s->step.worked = 0.0;
    const tr_sums sums = tr_columns_sums(s);
    parts = tr_work_in_parts(s, tr_method_of(s), &sums, s->step.worked, theta, work);
    s->step.worked = parts ? theta : 0.0;
  }
  tr_dense_state(s, theta, y);
  for (int i = 0; i < q && parts; ++i) y[s->ny + i] = yold[s->ny + i] + work[i];
}
