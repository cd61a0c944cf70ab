/* Method auto: choice between the stiff method and an explicit method. */
#include "integrators/integrators.h"

/* when the number of steps that end at a kink, minus the number of other steps, reaches this value, auto switches to the stiff
 * method */
#define KINKS_MAX 12
/* after this number of steps limited by stability, auto switches to the stiff method (Hairer, Wanner II, IV.2) */
#define STIFF_STEPS 15
#define FORGIVEN_STEPS 6  /* after this number of consecutive steps not limited by stability, the count for STIFF_STEPS restarts */
#define CALM 2.0          /* largest h |λ| at which an explicit step of size h counts as stable */
#define CALM_STEPS 8      /* after this number of consecutive stable steps, auto switches back to the explicit method */
#define POWER_STEPS 8     /* number of power iterations for |λ|; an error of |λ| by a factor of two is harmless */

/* h |λ|max of the Jacobian, by power iteration. Vectors are measured in units of the tolerance. */
static double tr_estimate_spectral_radius(tr_sim *s, double h) {
  TR_NEED(s, TR_HAS_JACOBIAN);
  int ny = s->ny, ld = tr_jacobian_rows(s);
  const double *J = TR_A(s, jac), *unit = TR_A(s, scale);
  double v[ny], u[ny], size = 0.0; /* v: start vector, with components in all directions */
  for (int i = 0; i < ny; ++i) v[i] = unit[i] * (1.0 + 0.37 * (i % 3));
  for (int it = 0; it < POWER_STEPS; ++it) {
    memset(u, 0, sizeof u);
    for (int q = 0; q < ny; ++q)
      for (int i = 0; i < ny; ++i) u[i] += J[i + (size_t)q * ld] * v[q];
    double a = 0.0, b = 0.0;
    for (int i = 0; i < ny; ++i) a += u[i] * u[i] / (unit[i] * unit[i]), b += v[i] * v[i] / (unit[i] * unit[i]);
    if (!(b > 0.0) || !(a > 0.0)) return 0.0;
    size = sqrt(a / b);
    double inv = 1.0 / sqrt(a);
    for (int i = 0; i < ny; ++i) v[i] = u[i] * inv;
  }
  return size * h;
}

static void tr_count_kink(tr_sim *s) {
  if (++s->step.kink_count < KINKS_MAX || s->step.method == TR_AUTO_STIFF) return;
  s->step.method = TR_AUTO_STIFF;
  s->step.kink_count = s->step.stiff_count = s->step.have_jac = 0;
}

static int tr_is_step_stiff(tr_sim *s) {
  return s->step.stiffness > tr_method_of(s)->explicit->stiff_at;
}

static void tr_choose_method(tr_sim *s) {
  if (s->step.kink_count > 0) s->step.kink_count--;
  if (tr_method_of(s)->kind == TR_IMPLICIT) {
    int calm = tr_estimate_spectral_radius(s, s->pending.h) < CALM;
    s->step.stiff_count = calm ? s->step.stiff_count + 1 : 0;
    if (s->step.stiff_count >= CALM_STEPS) {
      s->step.method = tr_auto_explicit_method(s);
      s->step.stiff_count = 0, s->step.nonstiff_count = 0;
    }
    return;
  }
  if (tr_is_step_stiff(s)) {
    s->step.nonstiff_count = 0;
    if (++s->step.stiff_count >= STIFF_STEPS) {
      s->step.method = TR_AUTO_STIFF;
      s->step.stiff_count = 0, s->step.have_jac = 0;
    }
  } else if (++s->step.nonstiff_count >= FORGIVEN_STEPS) {
    s->step.stiff_count = 0;
  }
}
