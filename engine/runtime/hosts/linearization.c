/* Exact derivatives of ẏ and of columns along a direction of inputs and state.
 *
 * Derivatives of multipliers follow from the implicit function theorem (``integrators/jacobian.c``). In redundant loops,
 * derivatives of the minimum-norm reactions (output/rows.c), and of friction that depends on them, are central differences
 * instead. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

/* Evaluate ẏ and all multipliers z at (t, y + h · direction). If z is a null pointer, the multipliers are not requested. Restores
 * the inputs. Returns 0 on failure. */
static int tr_multipliers_moved(tr_sim *s, int ninputs, const tr_signal *inputs, const double *dy, double h, double *z) {
  double y[s->ny + 4];
  tr_input kept[ninputs + 1];
  tr_signal now;
  memcpy(y, TR_A(s, y), sizeof(double) * s->ny);
  for (int i = 0; i < s->ny; ++i) y[i] += h * dy[i];
  for (int i = 0; i < ninputs; ++i) { /* replaces each input by its Taylor polynomial from time t on */
    tr_input *input = (tr_input *)tr_table_of(s, i);
    kept[i] = *input;
    tr_evaluate_input(input, s->clock.t, tr_moment_of(s)->inside, &now);
    input->t0 = s->clock.t, input->gap = input->gap_rate = 0.0;
    input->u[0] = now.value + h * inputs[i].value, input->u[1] = now.first + h * inputs[i].first;
    input->u[2] = now.second + h * inputs[i].second;
  }
  int ok = tr_rhs(s, s->clock.t, y, TR_A(s, dy));
  if (ok && z) tr_expand_multipliers(s, y, z, 1);
  for (int i = 0; i < ninputs; ++i) memcpy(tr_table_of(s, i), kept + i, sizeof *kept);
  return ok;
}

/* Step size along the direction for central differences. */
static double tr_difference_step(const tr_sim *s, int ninputs, const tr_signal *inputs, const double *dy) {
  double size = NO_DIRECTION;
  for (int i = 0; i < s->ny; ++i) size = fmax(size, fabs(dy[i]) / TR_A(s, scale)[i]);
  for (int i = 0; i < TR_DOUBLES(tr_signal) * ninputs; ++i) size = fmax(size, fabs(((const double *)inputs)[i]));
  return DIFFERENCE_STEP / size;
}

/* Derivative of all multipliers along the direction by central differences, for loops with open reactions. Returns 0 on failure. */
static int tr_open_derivative(tr_sim *s, int ninputs, const tr_signal *inputs, const double *dy, double *dz) {
  int n = s->k->rows + s->k->neta;
  double plus[n + 1], minus[n + 1], h = tr_difference_step(s, ninputs, inputs, dy);
  if (!tr_multipliers_moved(s, ninputs, inputs, dy, h, plus) || !tr_multipliers_moved(s, ninputs, inputs, dy, -h, minus)) return 0;
  for (int i = 0; i < n; ++i) dz[i] = (plus[i] - minus[i]) / (2.0 * h);
  return 1;
}

int tr_directional(tr_sim *s, const tr_linear *l, const tr_signal *inputs, const double *dy, double *rates, double *columns) {
  TR_SPOILT(s, TR_HAS_JACOBIAN);
  const tr_kernel *k = s->k;
  if (!s->j || !l || l->abi != TR_ABI) return 0;
  int ny = s->ny, a = k->active, e = k->neta, nz = a + e, ld = ny + nz, ni = TR_DOUBLES(tr_signal) * l->ninputs;
  double c[l->nc + 1], z[k->rows + e + 1], dz[k->rows + e + 1], f[ld + 1], seed[ni + ny + k->rows + e + k->nv + 1];
  double *J = TR_A(s, jac), *y = TR_A(s, y);
  const double *x = TR_A(s, x);
  s->step.watch = s->step.have_jac = 0;
  memset(dz, 0, sizeof dz), memset(seed, 0, sizeof seed);
  l->prepare(l->scene, TR_A(s, p), c);
  if (k->rows) { /* computed first, because the differences change the current state */
    if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return 0;
    if ((a < k->rows || tr_dependent_rows(s)) && !tr_open_derivative(s, l->ninputs, inputs, dy, dz)) return 0;
  }
  if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return 0;
  if (e) tr_evaluate_laws(s, TR_A(s, z) + a);
  memcpy(seed, inputs, sizeof(double) * ni);
  memcpy(seed + ni, dy, sizeof(double) * ny);
  memset(J, 0, sizeof(double) * ld * (ny + 1));
  l->rates(x, y, c, TR_A(s, z), seed, J);
  if (nz) {
    if (!tr_multiplier_derivatives(s, J, ld, 0, TR_A(s, jw))) return 0;
    memcpy(seed + ni + ny, TR_A(s, jw), sizeof(double) * nz);
    if (k->nkappa && tr_dependent_rows(s)) memcpy(seed + ni + ny, dz, sizeof(double) * nz); /* all rows are active here */
  }
  l->rates(x, y, c, TR_A(s, z), seed, f);
  memcpy(rates, f, sizeof(double) * ny);
  tr_expand_multipliers(s, y, z, 1);
  if (a == k->rows && !tr_dependent_rows(s)) /* no reactions are open */
    for (int i = 0; i < a; ++i) dz[k->active_rows[i]] = seed[ni + ny + i];
  memcpy(dz + k->rows, seed + ni + ny + a, sizeof(double) * e);
  memcpy(seed + ni + ny, dz, sizeof(double) * (k->rows + e));
  memcpy(seed + ni + ny + k->rows + e, f + k->nq, sizeof(double) * k->nv);
  l->columns(x, y, c, z, TR_A(s, dy) + k->nq, seed, columns);
  if (s->o) tr_finish_derivatives(s, y, z, columns);
  return 1;
}
