/* Directional derivatives for model exchange: derivatives of rates and columns along a change of states and inputs, in fixed modes.
 *
 * The functions of ``hosts/linearization.c`` compute the derivatives. Columns are defined for closed loops and unit quaternions, so
 * the direction is first projected onto these states. With loops, central differences give this projection. Derivatives of works,
 * and of columns that contain works, are central differences, too. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

#define ONTO 1e-5 /* relative to the scales: step of differences between projected states, which are accurate to 1e-10 */

/* Derivatives (nworks) of the powers along the direction. Returns 0 on failure. */
static int tr_power_slopes(tr_sim *s, int ninputs, const tr_signal *inputs, const double *dy, double *out) {
  const double h = tr_difference_step(s, ninputs, inputs, dy);
  const double *power = TR_A(s, dy) + s->ny;
  if (!tr_multipliers_moved(s, ninputs, inputs, dy, h, 0)) return 0;
  for (int i = 0; i < s->nworks; ++i) out[i] = power[i];
  if (!tr_multipliers_moved(s, ninputs, inputs, dy, -h, 0)) return 0;
  for (int i = 0; i < s->nworks; ++i) out[i] = (out[i] - power[i]) / (2.0 * h);
  return 1;
}

/* Move the state by h along the direction and project it. Returns 0 on failure. */
static int tr_move_onto_manifold(tr_sim *s, const double *dy, double h, double *y) {
  tr_copy(tr_state_width(s), TR_A(s, y), y);
  for (int i = 0; i < tr_states(s); ++i) y[i] += h * dy[i];
  return tr_project(s, s->clock.t, y);
}

/* Project the state and the direction dy. `onto` (tr_states values) receives the projected direction. Returns 0 on failure. */
static int tr_project_direction(tr_sim *s, const double *dy, double *onto) {
  const tr_kernel *k = s->k;
  const int n = tr_states(s);
  const double h = ONTO / DIFFERENCE_STEP * tr_difference_step(s, 0, 0, dy);
  double plus[tr_state_width(s)], minus[tr_state_width(s)], *y = TR_A(s, y);
  memcpy(onto, dy, sizeof(double) * n);
  if (k->active && s->set.project) {
    if (!tr_move_onto_manifold(s, dy, h, plus) || !tr_move_onto_manifold(s, dy, -h, minus) || !tr_project(s, s->clock.t, y)) return 0;
    for (int i = 0; i < s->ny; ++i) onto[i] = (plus[i] - minus[i]) / (2.0 * h);
    return 1;
  }
  for (int q = 0; q < k->nquat; ++q) {
    const double *e = y + k->quat[q];
    double *d = onto + k->quat[q], size = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]), along = 0.0;
    for (int i = 0; i < 4; ++i) along += e[i] * d[i] / (size * size);
    for (int i = 0; i < 4; ++i) d[i] = (d[i] - along * e[i]) / size;
  }
  tr_normalise_quaternions(s, y);
  return 1;
}

/* Derivatives of the columns that contain works, along a direction on the manifold. integral: 1 for each such column, otherwise 0.
 * Returns 0 on failure. */
static int tr_integral_slopes(tr_sim *s, const int *integral, const double *dy, double *columns) {
  const int nout = s->o->nout;
  double plus[nout + 1], minus[nout + 1], y[tr_state_width(s)], size = NO_DIRECTION, any = 0.0;
  for (int i = 0; i < nout; ++i) any += integral[i];
  if (any == 0.0) return 1;
  for (int i = 0; i < tr_states(s); ++i) size = fmax(size, fabs(dy[i]) / (i < s->ny ? TR_A(s, scale)[i] : s->set.energy));
  if (!tr_move_onto_manifold(s, dy, ONTO / size, y) || tr_output_row(s, s->clock.t, y, plus) != TR_OK) return 0;
  if (!tr_move_onto_manifold(s, dy, -ONTO / size, y) || tr_output_row(s, s->clock.t, y, minus) != TR_OK) return 0;
  for (int i = 0; i < nout; ++i)
    if (integral[i]) columns[i] = (plus[1 + i] - minus[1 + i]) / (2.0 * ONTO / size);
  return 1;
}

int tr_directional_in_modes(tr_sim *s, const tr_linear *l, const int *integral, const tr_signal *inputs, const double *dy, double *rates,
                            double *columns) {
  double onto[tr_state_width(s)], there[s->ny + 1];
  if (!l || !tr_rhs_in_modes(s) || !tr_directional(s, l, inputs, dy, rates, columns)) return 0;
  if (s->nworks && !tr_power_slopes(s, l->ninputs, inputs, dy, rates + s->ny)) return 0;
  if (!integral) return 1;
  if (!tr_project_direction(s, dy, onto)) return 0;
  if ((s->k->active || s->k->nquat) && !tr_directional(s, l, inputs, onto, there, columns)) return 0;
  return tr_integral_slopes(s, integral, onto, columns);
}
