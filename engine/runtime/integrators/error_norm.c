/* Error norm of all methods: a combination of the errors of positions and velocities, of works, and of directions of slow
 * sliding. */
#include "integrators/integrators.h"

/* The error of a work is divided by the work itself. The divisor is at least SMALL_WORK × the largest work, plus SMALL_ENERGY × the
 * scene's energy scale, plus round-off. */
#define SMALL_WORK 1e-2
#define SMALL_ENERGY 1e-6
#define NOISE_ENERGY 1e-14 /* relative to the energy scale / rtol: round-off in the divisor of works */
#define DIRECTION_ERROR 1e-3 /* rad: tolerated error of the direction of slow sliding */
#define DIRECTION_CUTS 0.01  /* squared direction error, in tolerances; a smaller error does not limit steps */
#define SLOWEST 1e-9         /* relative to the speed unit: slower sliding counts as sliding at this speed */
#define SECOND_WEIGHT 0.01   /* weight of the second error estimator (Hairer, Nørsett, Wanner I, II.10) */

/* Squared error of the directions of slow sliding. Directions count separately, because friction depends on the direction at any
 * speed. The result is (|e⊥|/(DIRECTION_ERROR |v|))² of the worst pair, where e⊥ is the error perpendicular to the velocity v.
 * *which receives the pair. */
static double tr_direction_error(const tr_sim *s, const double *e, const double *ynew, int *which) {
  double worst = 0.0, least = SLOWEST * tr_speed_unit(s);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    if (!tr_is_set_valued(s, i) || pair->nrates == 1 || pair->v0 < 0 || tr_is_stuck(s, i)) continue;
    double size = 0.0, error = 0.0, along = 0.0;
    for (int j = 0; j < pair->nrates; ++j) {
      double lever = TR_A(s, lever)[pair->eta0 + j], v = lever * ynew[s->k->nq + pair->v0 + j], d = lever * e[s->k->nq + pair->v0 + j];
      size += v * v, error += d * d, along += v * d;
    }
    if (size > 0.0) error = fmax(error - along * along / size, 0.0);
    error /= fmax(size, least * least);
    if (error > worst) worst = error, *which = i;
  }
  return worst / (DIRECTION_ERROR * DIRECTION_ERROR);
}

static double tr_smallest_work_unit(const tr_sim *s, double most) {
  return SMALL_WORK * most + (SMALL_ENERGY + NOISE_ENERGY / s->set.rtol) * s->set.energy;
}

/* Smallest scale by which errors of the n works from index `first` of the state are divided, J. The works of this step count in the
 * scale, so it is positive at the start of a run. */
static double tr_work_unit(const tr_sim *s, double h, const double *y, int first, int n) {
  double most = 0.0;
  const double *power = TR_A(s, K);
  for (int i = first; i < first + n; ++i) most = fmax(most, fabs(y[i]) + fabs(h * power[i]));
  return tr_smallest_work_unit(s, most);
}

static double tr_squared_motion_error(const tr_sim *s, const double *e, const double *y, const double *ynew) {
  const double *unit = TR_A(s, scale);
  double sum = 0.0;
  for (int i = 0; i < s->ny; ++i) {
    double q = e[i] / (unit[i] + fmax(fabs(y[i]), fabs(ynew[i])));
    sum += q * q;
  }
  return s->ny ? sum / (s->set.rtol * s->set.rtol * s->ny) : 0.0;
}

static double tr_squared_work_error(const tr_sim *s, const double *e, const double *y, const double *ynew, int first, int n, double unit) {
  double sum = 0.0;
  for (int i = first; i < first + n && s->set.energy > 0.0; ++i) {
    double q = e[i] / (unit + fmax(fabs(y[i]), fabs(ynew[i])));
    sum += q * q;
  }
  return sum / (s->set.rtol * s->set.rtol * (s->ny ? s->ny : n + 1));
}

/* tr_squared_motion_error plus the squared error of slow sliding directions, which are frozen over a step. Stores the pair whose
 * direction limits the steps. */
static double tr_squared_error(tr_sim *s, const double *e, const double *y, const double *ynew) {
  int which = -1;
  double sum = tr_squared_motion_error(s, e, y, ynew), turns = s->k->sets ? tr_direction_error(s, e, ynew, &which) : 0.0;
  if (turns > sum && turns > DIRECTION_CUTS) s->friction.cutting_pair = which;
  return sum + turns;
}

/* Store the errors e of a trial step, multiplied by `part`, as speed errors of pairs (``events/event_outcome_margin.c``). Only
 * pairs whose rates are states have speed errors. */
static void tr_store_speed_errors(tr_sim *s, const double *e, double part) {
  for (int i = 0; i < s->k->nsliders && s->k->sets; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    double sum = 0.0;
    for (int j = 0; j < pair->nrates && pair->v0 >= 0; ++j) {
      const double d = TR_A(s, lever)[pair->eta0 + j] * e[s->k->nq + pair->v0 + j];
      sum += d * d;
    }
    TR_A(s, speed_errors)[i] = pair->v0 < 0 || tr_is_stuck(s, i) ? 0.0 : part * sqrt(sum);
  }
}

/* Squared error from the squared errors of two estimators. The order of the result is higher than the order of either estimator. */
static double tr_combine_estimators(double first, double second) {
  double den = first + SECOND_WEIGHT * second;
  return den > 0.0 ? first * first / den : (first == 0.0 ? 0.0 : NAN);
}
