/* Steps of an explicit Runge–Kutta method, whichever it is, and the norm in which all methods measure their errors. */
#include "modes.h"
#include "asks.c"

/* A work is measured by itself, but not by less than these shares of the largest work and of the energy scale of the scene, nor finer
 * than its round-off. */
#define SMALL_WORK 1e-2
#define SMALL_ENERGY 1e-6
#define NOISE_ENERGY 1e-14 /* of the energy scale */
#define DIRECTION_ERROR 1e-3 /* rad: error that the direction of slow sliding may have */
#define DIRECTION_CUTS 0.01  /* of (error over tolerance)²: less would not keep steps from growing */
#define SLOWEST 1e-9         /* of the speed unit: slower sliding counts as that fast */
#define SECOND_WEIGHT 0.01   /* of the second of two error estimators beside the first (Hairer, Nørsett, Wanner I, II.10) */
#define HERMITE_ROWS 3       /* rows of a dense output that make the cubic through values and slopes at both ends */

/* Error of the direction of slow sliding of several components, which friction follows however slow it is: (|e across v|/(DIRECTION_ERROR |v|))²,
 * of the worst pair, which is named in *which. */
static double tr_direction_error(const tr_sim *s, const double *e, const double *ynew, int *which) {
  double worst = 0.0, least = SLOWEST * tr_speed_unit(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_set(s, i) || pair->nrates == 1 || pair->v0 < 0 || tr_is_stuck(s, i)) continue;
    double size = 0.0, error = 0.0, along = 0.0;
    for (int j = 0; j < pair->nrates; ++j) {
      double arm = TR_A(s, arm)[pair->eta0 + j], v = arm * ynew[s->k->nq + pair->v0 + j], d = arm * e[s->k->nq + pair->v0 + j];
      size += v * v, error += d * d, along += v * d;
    }
    if (size > 0.0) error = fmax(error - along * along / size, 0.0);
    error /= fmax(size, least * least);
    if (error > worst) worst = error, *which = i;
  }
  return worst / (DIRECTION_ERROR * DIRECTION_ERROR);
}

/* The least a work is measured by, J; most: the largest of them. */
static double tr_least_work(const tr_sim *s, double most) {
  return SMALL_WORK * most + (SMALL_ENERGY + NOISE_ENERGY / s->set.rtol) * s->set.energy;
}

/* The same of n works, from place `first` of the state on; a step's share of them counts, so that they are not 0 at the start. */
static double tr_work_unit(const tr_sim *s, double h, const double *y, int first, int n) {
  double most = 0.0;
  const double *power = TR_A(s, K);
  for (int i = first; i < first + n; ++i) most = fmax(most, fabs(y[i]) + fabs(h * power[i]));
  return tr_least_work(s, most);
}

/* Squared error `e` of a step between y and ynew relative to the tolerance, over the number of positions and velocities. Multipliers show in
 * the velocities as far as they move anything; the others (a driven joint's effort, the force in a damper) in the works. */
static double tr_size2(const tr_sim *s, const double *e, const double *y, const double *ynew) {
  const double *unit = TR_A(s, scale);
  double sum = 0.0;
  for (int i = 0; i < s->ny; ++i) {
    double q = e[i] / (unit[i] + fmax(fabs(y[i]), fabs(ynew[i])));
    sum += q * q;
  }
  return s->ny ? sum / (s->set.rtol * s->set.rtol * s->ny) : 0.0;
}

/* The same of n works, from place `first` of the state on, none of which is measured by less than `unit`. */
static double tr_works2(const tr_sim *s, const double *e, const double *y, const double *ynew, int first, int n, double unit) {
  double sum = 0.0;
  for (int i = first; i < first + n && s->set.energy > 0.0; ++i) {
    double q = e[i] / (unit + fmax(fabs(y[i]), fabs(ynew[i])));
    sum += q * q;
  }
  return sum / (s->set.rtol * s->set.rtol * (s->ny ? s->ny : n + 1));
}

/* The same with the error of the direction of slow sliding, where that is frozen over a step. The pair is noted whose direction cuts the
 * steps. */
static double tr_norm2(tr_sim *s, const double *e, const double *y, const double *ynew) {
  int which = -1;
  double sum = tr_size2(s, e, y, ynew), turns = s->k->sets ? tr_direction_error(s, e, ynew, &which) : 0.0;
  if (turns > sum && turns > DIRECTION_CUTS) s->friction.missed = which;
  return sum + turns;
}

/* Errors of the speeds of pairs whose rates are states, by the errors e of a trial step, `part` of which count (``margin.c``). */
static void tr_note_strays(tr_sim *s, const double *e, double part) {
  for (int i = 0; i < s->k->nsliders && s->k->sets; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double sum = 0.0;
    for (int j = 0; j < pair->nrates && pair->v0 >= 0; ++j) {
      const double d = TR_A(s, arm)[pair->eta0 + j] * e[s->k->nq + pair->v0 + j];
      sum += d * d;
    }
    TR_A(s, stray)[i] = pair->v0 < 0 || tr_is_stuck(s, i) ? 0.0 : part * sqrt(sum);
  }
}

/* A squared error from those that two estimators give: of a higher order than either. */
static double tr_of_both(double first, double second) {
  double den = first + SECOND_WEIGHT * second;
  return den > 0.0 ? first * first / den : (first == 0.0 ? 0.0 : NAN);
}

/* Squared error of n works, from place `first` of the state on, in the explicit step just made, from its estimators (second: 0 without). */
static double tr_works_of_step(const tr_sim *s, double h, const double *e, const double *second, int first, int n) {
  const double *y = TR_A(s, y), *ynew = TR_A(s, ynew), unit = tr_work_unit(s, h, y, first, n);
  const double error = tr_works2(s, e, y, ynew, first, n, unit);
  return second ? tr_of_both(error, tr_works2(s, second, y, ynew, first, n, unit)) : error;
}

/* Put x (e numbers) where Newton's iteration is to begin at stage i: where the polynomial through earlier stages leads. old: x at the stages
 * before, e each. */
TR_INLINE void tr_lead_on(int e, double *x, const tr_explicit *m, int i, const double *old) {
  const double *weight = m->lead + i * m->stages;
  for (int j = 0; j < e; ++j) x[j] = 0.0;
  for (int k = 0; k < i; ++k, old += e)
    for (int j = 0; j < e && weight[k] != 0.0; ++j) x[j] += weight[k] * old[j];
}

/* One trial step of size h from (t, y) with K[0] in place: ynew, and the error relative to the tolerance (NaN when a stage could
 * not be evaluated). With ends_in_error the end derivative is left in K[stages]. */
static double tr_step_explicit(tr_sim *s, const tr_explicit *m, double h) {
  int n = tr_width(s), nv = n / TR_LANES;
  double *K = TR_A(s, K), *y = TR_A(s, y), *tmp = TR_A(s, ytmp), *ynew = TR_A(s, ynew);
  const int e = tr_nz(s) - s->k->active;
  double *eta = TR_A(s, z) + s->k->active, old[e * m->stages + 1];
  const int made = tr_asks_step(s, m, h);
  for (int i = 1; i < m->stages && !made; ++i) {
    m->argument(i, nv, h, (tr_vec *)y, (tr_vec *)K, (tr_vec *)tmp);
    tr_copy(e, eta, old + (i - 1) * e);
    if (e) tr_lead_on(e, eta, m, i, old);
    if (!tr_rhs(s, s->clock.t + m->c[i] * h, tmp, K + i * n)) return NAN;
  }
  if (!made) m->solution(nv, h, (tr_vec *)y, (tr_vec *)K, (tr_vec *)ynew);
  if (!made && m->ends_in_error && !tr_rhs(s, s->clock.t + h, ynew, K + m->stages * n)) return NAN;
  if (s->set.hfixed > 0.0) return 0.0;
  double *other = TR_A(s, yout);
  if (!made) m->error[0](nv, h, (tr_vec *)K, (tr_vec *)tmp);
  if (!made && m->errors > 1) m->error[1](nv, h, (tr_vec *)K, (tr_vec *)other);
  const double *second = m->errors > 1 ? other : 0;
  s->step.works = sqrt(tr_works_of_step(s, h, tmp, second, s->ny, s->nworks));
  const double works = tr_works_of_step(s, h, tmp, second, s->ny + s->nworks, s->naudit), first = tr_norm2(s, tmp, y, ynew);
  const double motion = second ? tr_of_both(first, tr_norm2(s, second, y, ynew)) : first;
  tr_note_strays(s, tmp, motion < first ? sqrt(motion / first) : 1.0);
  return sqrt(motion + works);
}

/* Spectral radius estimate h|λ| from the last stage and the end (Hairer, Wanner II, IV.2). */
static double tr_stiffness(tr_sim *s, const tr_explicit *m, double h) {
  int n = tr_width(s), last = m->stages - 1;
  double *K = TR_A(s, K), *y = TR_A(s, y), *tmp = TR_A(s, ytmp), *ynew = TR_A(s, ynew);
  const double *unit = TR_A(s, scale);
  m->argument(last, n / TR_LANES, h, (tr_vec *)y, (tr_vec *)K, (tr_vec *)tmp);
  double num = 0.0, den = 0.0;
  for (int i = 0; i < s->ny; ++i) {
    double a = (K[m->stages * n + i] - K[last * n + i]) / unit[i], b = (ynew[i] - tmp[i]) / unit[i];
    num += a * a;
    den += b * b;
  }
  return den > 0.0 ? h * sqrt(num / den) : 0.0;
}

/* Put η where Newton's iteration is to begin at θ of the last step, between the multipliers at the step's ends: from elsewhere it might find
 * another root. */
static void tr_start_between(tr_sim *s, double theta) {
  const double *start = TR_A(s, zstart) + s->k->active, *end = TR_A(s, zend) + s->k->active;
  double *eta = TR_A(s, z) + s->k->active;
  for (int i = 0; i < tr_nz(s) - s->k->active; ++i) eta[i] = (1.0 - theta) * start[i] + theta * end[i];
}

/* Rows of the dense output into kstep, from the states at both ends of the step and K; extra stages are evaluated for it. Always 1
 * unless one of these cannot be. */
static int tr_dense_explicit(tr_sim *s, const tr_explicit *m) {
  int n = tr_width(s), nv = n / TR_LANES;
  double h = s->step.size, *K = TR_A(s, K), *yold = TR_A(s, yold), *y1 = TR_A(s, ynew), *R = TR_A(s, kstep), *tmp = TR_A(s, ytmp);
  int watch = s->step.watch;
  s->step.watch = 0;
  const int made = m->extra && tr_asks_dense(s, m, h);
  for (int i = 0; i < m->extra && !made; ++i) {
    tr_start_between(s, m->c[m->stages + 1 + i]);
    m->argument(m->stages + 1 + i, nv, h, (tr_vec *)yold, (tr_vec *)K, (tr_vec *)tmp);
    if (!tr_rhs(s, s->step.t0 + m->c[m->stages + 1 + i] * h, tmp, K + (m->stages + 1 + i) * n)) return 0;
  }
  s->step.watch = watch;
  const tr_vec *f0 = (tr_vec *)K, *f1 = f0 + m->stages * nv;
  tr_vec *rows = (tr_vec *)R;
  for (int i = 0; i < nv; ++i) {
    tr_vec dy = ((tr_vec *)y1)[i] - ((tr_vec *)yold)[i];
    rows[i] = dy;
    rows[nv + i] = h * f0[i] - dy;
    rows[2 * nv + i] = 2.0 * dy - h * (f1[i] + f0[i]);
  }
  for (int i = 0; i < m->dense; ++i) m->dense_row[i](nv, h, (tr_vec *)K, rows + (HERMITE_ROWS + i) * nv);
  s->step.dense_rows = HERMITE_ROWS + m->dense;
  return 1;
}

/* y(θ) = yold + θ(R0 + (1−θ)(R1 + θ(R2 + (1−θ)(…)))). */
static void tr_dense_eval(const tr_sim *s, double theta, double *out) {
  int n = tr_width(s), rows = s->step.dense_rows;
  const double *R = TR_A(s, kstep), *yold = TR_A(s, yold);
  const double factor[2] = {theta, 1.0 - theta};
  for (int i = 0; i < n; i += TR_LANES) {
    tr_vec a = TR_NOUGHT;
    for (int r = rows - 1; r >= 0; --r) a = (a + *(const tr_vec *)(R + r * n + i)) * factor[r & 1];
    *(tr_vec *)(out + i) = *(const tr_vec *)(yold + i) + a;
  }
}

/* Multipliers in place, and what else the next evaluation begins from (tr_solution_size): kept, and put back where something was looked at
 * beside the motion. */
static inline int tr_solution_size(const tr_sim *s) {
  return 2 + tr_nz(s) + (s->k->nmore ? s->k->active : 0);
}

/* Keep it. */
static void tr_keep_solution(const tr_sim *s, double *kept) {
  const int nz = tr_nz(s);
  kept[0] = s->loops.open, kept[1] = s->step.loaded;
  tr_copy(nz, TR_A(s, z), kept + 2), tr_copy(tr_open_count(s), TR_A(s, amounts), kept + 2 + nz);
}

/* Put it back. */
static void tr_put_solution(tr_sim *s, const double *kept) {
  const int nz = tr_nz(s);
  s->loops.open = (int)kept[0], s->step.loaded = (int)kept[1], s->step.along = 0;
  tr_copy(nz, kept + 2, TR_A(s, z)), tr_copy(tr_open_count(s), kept + 2 + nz, TR_A(s, amounts));
}

/* The state at θ of the last step, from its dense output, and η where Newton's iteration is to begin there. */
static void tr_dense_state(tr_sim *s, double theta, double *out) {
  tr_dense_eval(s, theta, out);
  tr_start_between(s, theta);
}

/* The multipliers in place are those at the end of the step just made. */
static void tr_note_end(tr_sim *s) { tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zend)); }
