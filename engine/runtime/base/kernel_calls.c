/* Calls of a kernel's two stages: stage 1 forms the maps, stage 2 evaluates ẏ. */
#include "base/base.h"

#define NO_IMPULSE 1e-250 /* N s, N m s: a smaller impulse is neglected; the inverse of this limit is finite */

static void tr_form_maps(tr_sim *s) {
  TR_NEED(s, TR_HAS_MAPS);
  if (s->step.mapped || !s->k->begin) return;
  s->step.mapped = TR_MAPS_RAW;
  s->k->stage1(TR_A(s, x), TR_A(s, yeval), TR_A(s, c), TR_A(s, w), TR_A(s, maps), TR_A(s, dyeval), TR_A(s, power));
  tr_apply_contacts(s);
}

static void tr_rates_by_impulses(tr_sim *s, const double *y, const double *dlam, const double *deta, const double *response, int again, double *dv) {
  const tr_kernel *k = s->k;
  int a = k->active, e = deta ? k->neta : 0, n = tr_state_width(s);
  double z[a + k->neta + 1], big = 0.0, *f = TR_A(s, dy), *base = TR_A(s, dy_unforced);
  for (int i = 0; i < a; ++i) big = fmax(big, fabs(dlam[i]));
  for (int i = 0; i < e; ++i) big = fmax(big, fabs(deta[i]));
  double up = big > NO_IMPULSE ? 1.0 / big : 0.0;
  memset(z, 0, sizeof z);
  tr_form_maps(s);
  if (!again) {
    k->stage2(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), z, f, TR_A(s, power));
    memcpy(base, f, sizeof(double) * n);
  }
  double size = 0.0;
  for (int i = 0; i < k->nv; ++i) size = fmax(size, fabs(base[k->nq + i]));
  /* z is scaled so that its effect is larger than the round-off of ẏ without impulses. 1/d² is the acceleration that a unit of a
   * row's multiplier causes along this row. */
  const double *d = TR_A(s, d);
  double gain = 0.0;
  for (int i = 0; i < a; ++i) gain = fmax(gain, fabs(dlam[i]) * up / (d[i] * d[i]));
  for (int i = 0; i < e; ++i) gain = fmax(gain, fabs(deta[i] * response[i]) * up);
  double f1 = gain > 0.0 ? up * fmax(1.0, size / gain) : up;
  for (int i = 0; i < a; ++i) z[i] = dlam[i] * f1;
  for (int i = 0; i < e; ++i) z[a + i] = deta[i] * f1;
  k->stage2(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), z, f, TR_A(s, power));
  for (int i = 0; i < k->nv; ++i) dv[i] = f1 > 0.0 ? (f[k->nq + i] - base[k->nq + i]) / f1 : 0.0;
}

static void tr_store_current_state(tr_sim *s, const double *y) {
  s->step.mapped_t = tr_moment_of(s)->t;
  if (y != TR_A(s, yeval)) memcpy(TR_A(s, yeval), y, sizeof(double) * s->ny);
}

static int tr_is_current_state(const tr_sim *s, double t, const double *y) {
  return s->k->begin && s->step.mapped_t == t && memcmp(TR_A(s, yeval), y, sizeof(double) * s->ny) == 0;
}

static void tr_begin_recursion(tr_sim *s, const double *y, double *dy) {
  s->k->begin(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), dy);
  s->step.mapped = TR_MAPS_NONE, s->step.recursive = 0;
  TR_NEW_STATE(s);
  tr_store_current_state(s, y);
#ifdef TR_DEBUG
  const int columns = 1 + s->k->active + s->k->neta;
  for (int i = 0; i < s->k->nn * columns; ++i) ((double *)map_N0(s->k, TR_A(s, maps)))[i] = NAN;
  for (int i = 0; i < s->k->neta * columns && s->k->sets; ++i) ((double *)map_Q0(s->k, TR_A(s, maps)))[i] = NAN;
  for (int i = 0; i < s->k->nn * (1 + s->k->neta); ++i) TR_A(s, Np)[i] = NAN;
  for (int i = 0; i < s->k->neta * (1 + s->k->neta) && s->k->sets; ++i) TR_A(s, Q)[i] = NAN;
#endif
}

static void tr_evaluate_maps(tr_sim *s, const double *y) {
  s->step.recursive = 0, s->step.mapped = s->k->begin ? TR_MAPS_NONE : TR_MAPS_RAW, s->stats.maps++;
  double *dy = s->k->active + s->k->neta ? TR_A(s, dyeval) : TR_A(s, dy);
  if (s->k->begin) tr_begin_recursion(s, y, TR_A(s, dyeval));
  else s->k->stage1(TR_A(s, x), y, TR_A(s, c), TR_A(s, w), TR_A(s, maps), dy, TR_A(s, power)), tr_apply_contacts(s);
  TR_NEW_STATE(s);
  if (dy == TR_A(s, dy)) tr_append_powers(s, dy);
}

static double tr_potential_energy(const tr_sim *s, const double *y) {
  double both[2] = {0.0, 0.0};
  if (s->k->nlatches) s->k->energy(TR_A(s, x), y, TR_A(s, c) + s->k->c_energy, both);
  return both[1];
}
