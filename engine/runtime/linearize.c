/* Exact derivatives of ẏ and of the columns along a direction of inputs and state.
 *
 * Multipliers follow by the implicit-function theorem, as in the stiff method. Only where loops are redundant, the share of the
 * reactions that the motion leaves open (chosen smallest, see output.c), and friction that depends on it, come from central differences
 * of that choice. */
#include "tr.h"

#define DIFFERENCE 1e-6    /* of the scales of the state: error of central differences 1e-12, round-off 1e-10 */
#define NO_DIRECTION 1e-12 /* of these scales: a direction of nothing */

/* ẏ, and all multipliers (z; 0: not asked for), at (t, y) moved by h along the direction; 0 when they cannot be found. */
static int tr_moved_multipliers(tr_sim *s, int ninputs, const tr_signal *inputs, const double *dy, double h, double *z) {
  double y[s->ny + 4];
  tr_input kept[ninputs + 1];
  tr_signal now;
  memcpy(y, TR_A(s, y), sizeof(double) * s->ny);
  for (int i = 0; i < s->ny; ++i) y[i] += h * dy[i];
  for (int i = 0; i < ninputs; ++i) { /* the signals from here on */
    tr_input *input = (tr_input *)tr_table_of(s, i);
    kept[i] = *input;
    tr_input_signal(input, s->clock.t, &now);
    input->t0 = s->clock.t, input->gap = input->gap_rate = 0.0;
    input->u[0] = now.value + h * inputs[i].value, input->u[1] = now.first + h * inputs[i].first;
    input->u[2] = now.second + h * inputs[i].second;
  }
  int ok = tr_rhs(s, s->clock.t, y, TR_A(s, dy));
  if (ok && z) tr_full_multipliers(s, y, z, 1);
  for (int i = 0; i < ninputs; ++i) memcpy(tr_table_of(s, i), kept + i, sizeof *kept);
  return ok;
}

/* How far to go along the direction for differences. */
static double tr_difference(const tr_sim *s, int ninputs, const tr_signal *inputs, const double *dy) {
  double size = NO_DIRECTION;
  for (int i = 0; i < s->ny; ++i) size = fmax(size, fabs(dy[i]) / TR_A(s, scale)[i]);
  for (int i = 0; i < TR_DOUBLES(tr_signal) * ninputs; ++i) size = fmax(size, fabs(((const double *)inputs)[i]));
  return DIFFERENCE / size;
}

/* dz, friction included, where redundant loops leave reactions open: along the direction, from differences. */
static int tr_open_derivative(tr_sim *s, int ninputs, const tr_signal *inputs, const double *dy, double *dz) {
  int n = s->k->rows + s->k->neta;
  double plus[n + 1], minus[n + 1], h = tr_difference(s, ninputs, inputs, dy);
  if (!tr_moved_multipliers(s, ninputs, inputs, dy, h, plus) || !tr_moved_multipliers(s, ninputs, inputs, dy, -h, minus)) return 0;
  for (int i = 0; i < n; ++i) dz[i] = (plus[i] - minus[i]) / (2.0 * h);
  return 1;
}

/* At the block's (t, y): rates (ny) = ∂ẏ·direction and columns (nout) = ∂columns·direction. inputs: a signal each; dy: ny. The block needs the Jacobian unit's arrays. 1 on success. */
int tr_directional(tr_sim *s, const tr_linear *l, const tr_signal *inputs, const double *dy, double *rates, double *columns) {
  const tr_kernel *k = s->k;
  if (!s->j || !l || l->abi != TR_ABI) return 0;
  int ny = s->ny, a = k->active, e = k->neta, nz = a + e, ld = ny + nz, ni = TR_DOUBLES(tr_signal) * l->ninputs;
  double c[l->nc + 1], z[k->rows + e + 1], dz[k->rows + e + 1], f[ld + 1], seed[ni + ny + k->rows + e + k->nv + 1];
  double *J = TR_A(s, jac), *y = TR_A(s, y);
  const double *x = TR_A(s, x);
  s->step.watch = s->step.have_jac = 0;
  memset(dz, 0, sizeof dz), memset(seed, 0, sizeof seed);
  l->prepare(l->scene, TR_A(s, p), c);
  if (k->rows) { /* first, because the differences move everything */
    if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return 0;
    if ((a < k->rows || s->loops.rank_now < a) && !tr_open_derivative(s, l->ninputs, inputs, dy, dz)) return 0;
  }
  if (!tr_rhs(s, s->clock.t, y, TR_A(s, dy))) return 0;
  if (e) tr_law(s, TR_A(s, z) + a);
  memcpy(seed, inputs, sizeof(double) * ni);
  memcpy(seed + ni, dy, sizeof(double) * ny);
  memset(J, 0, sizeof(double) * ld * (ny + 1));
  l->rates(x, y, c, TR_A(s, z), seed, J);
  if (nz) {
    if (!tr_multiplier_derivatives(s, J, ld, 0, TR_A(s, jw))) return 0;
    memcpy(seed + ni + ny, TR_A(s, jw), sizeof(double) * nz);
    if (k->nkappa && s->loops.rank_now < a) memcpy(seed + ni + ny, dz, sizeof(double) * nz); /* all rows are active: λ, then η */
  }
  l->rates(x, y, c, TR_A(s, z), seed, f);
  memcpy(rates, f, sizeof(double) * ny);
  tr_full_multipliers(s, y, z, 1);
  if (a == k->rows && s->loops.rank_now == a) /* nothing open */
    for (int i = 0; i < a; ++i) dz[k->active_rows[i]] = seed[ni + ny + i];
  memcpy(dz + k->rows, seed + ni + ny + a, sizeof(double) * e);
  memcpy(seed + ni + ny, dz, sizeof(double) * (k->rows + e));
  memcpy(seed + ni + ny + k->rows + e, f + k->nq, sizeof(double) * k->nv);
  l->columns(x, y, c, z, TR_A(s, dy) + k->nq, seed, columns);
  return 1;
}
