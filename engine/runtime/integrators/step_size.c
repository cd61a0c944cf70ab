/* Step sizes: the first follows from the motion at the start, the others from the last errors. Norms are relative to the
 * tolerance. */
#include "integrators/integrators.h"

/* size of the next step, relative to the step size whose estimated error equals the tolerance; below 1, because the estimate
 * neglects higher orders */
#define SAFETY 0.9
#define RETRY_MOST 0.9   /* largest factor on a refused step */
/* Exponents of the present and the last error. At equal accuracy, one third fewer steps are refused than with the exponents 1 and
 * 0. */
#define PI_NOW 0.8
#define PI_OLD 0.3
#define ERROR_LEAST 1e-12      /* smallest error that influences the step size */
#define ERROR_LEAST_KEPT 1e-4  /* smallest error stored for the next step size, because an error may be zero by accident */
#define FIRST_CHANGE 0.01      /* relative to the state: change over the first step */
#define FIRST_MOST 100.0       /* relative to the first guess: upper limit of the second guess */
#define AT_REST 1e-5           /* if norms of states or slopes are below this value, their ratio is no time scale */
#define FIRST_BLIND 1e-6       /* s: first guess if there is no time scale */
#define FIRST_STRAIGHT 1e-3    /* relative to the first guess: second guess if the motion is straight (Hairer's algorithm) */
#define STRAIGHT 1e-15         /* if slopes and second derivatives are smaller, the motion counts as straight */
#define FIRST_RETREAT 1e-2     /* relative to the first guess: step size if the motion cannot be evaluated at the first guess */

static double tr_first_step(tr_sim *s, double span, int order) {
  int n = tr_state_width(s);
  double *K = TR_A(s, K), *y = TR_A(s, y), *tmp = TR_A(s, ytmp);
  const double *unit = TR_A(s, scale);
  double d0 = 0.0, d1 = 0.0, d2 = 0.0;
  for (int i = 0; i < s->ny; ++i) {
    double w = s->set.rtol * (unit[i] + fabs(y[i]));
    d0 += y[i] * y[i] / (w * w);
    d1 += K[i] * K[i] / (w * w);
  }
  d0 = sqrt(d0 / s->ny), d1 = sqrt(d1 / s->ny);
  double h0 = d0 < AT_REST || d1 < AT_REST ? FIRST_BLIND : FIRST_CHANGE * d0 / d1;
  h0 = fmin(h0, span);
  for (int i = 0; i < n; ++i) tmp[i] = y[i] + h0 * K[i];
  double *f1 = TR_A(s, dy);
  if (!tr_rhs(s, s->clock.t + h0, tmp, f1)) return h0 * FIRST_RETREAT;
  for (int i = 0; i < s->ny; ++i) {
    double w = s->set.rtol * (unit[i] + fabs(y[i])), d = (f1[i] - K[i]) / w;
    d2 += d * d;
  }
  d2 = sqrt(d2 / s->ny) / h0;
  double big = fmax(d1, d2);
  double h1 = big <= STRAIGHT ? fmax(FIRST_BLIND, h0 * FIRST_STRAIGHT) : pow(FIRST_CHANGE / big, 1.0 / order);
  return fmin(fmin(FIRST_MOST * h0, h1), span);
}

static double tr_retry_factor(double err, int order) {
  return fmin(RETRY_MOST, fmax(SHRINK_MOST, SAFETY * pow(fmax(err, ERROR_LEAST), -1.0 / order)));
}

static double tr_next_step_factor(tr_sim *s, double err, int order, double most) {
  double e = fmax(err, ERROR_LEAST_KEPT), old = s->step.err_old > 0.0 ? s->step.err_old : e;
  s->step.err_old = e;
  return fmin(most, fmax(SHRINK_MOST, SAFETY * pow(e, -PI_NOW / order) * pow(old, PI_OLD / order)));
}

static void tr_set_next_step(tr_sim *s) {
  double next = s->pending.h * s->pending.grow;
  s->step.h = s->pending.cut && next < s->step.h ? (s->pending.grow < 1.0 ? next : s->step.h) : next;
}
