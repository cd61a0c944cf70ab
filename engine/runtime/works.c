/* Works that only the audit wants, along steps of the stiff method: it has no Jacobian of their powers. A power is known at both ends of a step
 * and is asked for in its middle, on the dense output; the parabola through the three is integrated (Simpson's rule). */
#include "modes.h"

#define MIDDLE 1 /* row of K in which powers of the middle lie: that of a stage, which the dense output has no other use for */

/* Powers in the middle of the trial step just made, whose ends are in yold and ynew. NaN where there is no answer. The multipliers stay what they
 * were. */
static void tr_works_middle(tr_sim *s, const tr_rosenbrock *m) {
  const tr_kernel *k = s->k;
  const int nz = k->active + k->neta, first = s->ny + k->nquad, watch = s->step.watch, trouble = s->step.trouble;
  double z[nz + 1], *y = TR_A(s, ytmp), *f = TR_A(s, dy), *middle = TR_A(s, K) + MIDDLE * tr_width(s);
  tr_copy(nz, TR_A(s, z), z);
  tr_dense_rosenbrock(s, m);
  tr_dense_eval(s, 0.5, y);
  if (k->nquat) tr_normalize(s, y);
  s->step.watch = 0;
  const int known = tr_rhs(s, s->step.t0 + 0.5 * s->step.size, y, f);
  s->step.watch = watch, s->step.trouble = trouble;
  for (int i = first; i < first + k->naudit; ++i) middle[i] = known ? f[i] : NAN;
  tr_copy(nz, z, TR_A(s, z));
}

/* Rows of the dense output (``tr_dense_rosenbrock``) of those works, once the step's end has been evaluated; its state takes them too. */
static void tr_works_dense(tr_sim *s) {
  const int n = tr_width(s), first = s->ny + s->k->nquad;
  const double h = s->step.size, *K = TR_A(s, K), *start = K, *middle = K + MIDDLE * n, *end = K + tr_method_of(s)->end * n;
  double *R = TR_A(s, kstep);
  for (int i = first; i < first + s->k->naudit; ++i) { /* power start + a θ + b θ² */
    const double b = 2.0 * (start[i] - 2.0 * middle[i] + end[i]), a = end[i] - start[i] - b;
    R[i] = h * (start[i] + a / 2.0 + b / 3.0);
    R[n + i] = -h * (a / 2.0 + b / 3.0);
    R[2 * n + i] = -h * b / 3.0;
    R[3 * n + i] = 0.0;
    TR_A(s, ynew)[i] = TR_A(s, yold)[i] + R[i];
  }
}
