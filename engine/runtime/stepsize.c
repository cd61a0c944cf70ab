/* Sizes of steps: the first one from the motion at its start, the next one from the errors of the last. Errors and sizes of vectors are
 * measured in the tolerance norm, 1 at the tolerance. */
#include "modes.h"

#define SAFETY 0.9       /* of the size that would just meet the tolerance: the estimate is one of leading order */
#define PI_NOW 0.8       /* weights of this and the last error: a third fewer rejections than 1 and 0 at the same accuracy */
#define PI_OLD 0.3
#define GROW_MOST 6.0    /* a step is longer than the one before by no more */
#define RETRY_MOST 0.9   /* a refused step is tried again with this part of its length at most */
#define TIME_ROUND_OFF 8e-16 /* of the time: a smaller step does not move it */
#define SHRINK_MOST 0.2  /* a step shrinks to no less of its size at once; to this where it could not be evaluated at all */
#define ERROR_LEAST 1e-12      /* an error below says no more of the next size than this one */
#define ERROR_LEAST_KEPT 1e-4  /* the same where two errors are compared: an accidental zero must not count twice */
#define FIRST_CHANGE 0.01      /* change that a first step is to make */
#define FIRST_MOST 100.0       /* of the first guess: the second may be longer by no more */
#define AT_REST 1e-5           /* states and slopes smaller than this say nothing of a time scale */
#define FIRST_BLIND 1e-6       /* s: the guess then */
#define FIRST_STRAIGHT 1e-3    /* of the first guess, where nothing bends the motion (by Hairer's recipe) */
#define STRAIGHT 1e-15         /* slopes and their change smaller than this bend nothing */
#define FIRST_RETREAT 1e-2     /* of the first guess, where the motion cannot be evaluated behind it */

/* First step size (Hairer, Nørsett, Wanner I, II.4): from the size of y, ẏ and ÿ. K[0] must be in place. */
static double tr_first_step(tr_sim *s, double span, int order) {
  int n = tr_width(s);
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

/* Step size factor for an error. */
static double tr_factor_of(double err, int order, double most) {
  return fmin(most, fmax(SHRINK_MOST, SAFETY * pow(fmax(err, ERROR_LEAST), -1.0 / order)));
}

/* The same after an accepted step, with the previous error taken into account (proportional–integral control: fewer rejections where
 * the difficulty of the motion comes and goes). */
static double tr_grow(tr_sim *s, double err, int order, double most) {
  double e = fmax(err, ERROR_LEAST_KEPT), old = s->step.err_old > 0.0 ? s->step.err_old : e;
  s->step.err_old = e;
  return fmin(most, fmax(SHRINK_MOST, SAFETY * pow(e, -PI_NOW / order) * pow(old, PI_OLD / order)));
}

/* The size of the next step, behind the one that waits. */
static void tr_size_next(tr_sim *s) {
  double next = s->pending.h * s->pending.grow;
  s->step.h = s->pending.cut && next < s->step.h ? (s->pending.grow < 1.0 ? next : s->step.h) : next;
}
