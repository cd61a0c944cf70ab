/* Contacts watched while stepping: a normal force that passes through zero turns its normal to the other side (separation). */
#include "modes.h"

#define TURNED 2.0    /* rad: more than a step's steady turning */
#define ROUND_OFF 1e-9 /* of the largest contact force before or after: less carries nothing, and has no direction */
#define NEAR_ZERO 0.2 /* of the smaller force: how close to zero the force passes when it separates */

/* Contact forces of all pairs at the state just evaluated (a: accelerations of the rates): 4 numbers each. 0 when there are none. */
static int tr_contacts_at(tr_sim *s, const double *y, const double *a, double *out) {
  if (!s->o || !s->o->contacts) return 0;
  double zf[s->k->rows + s->k->neta + 1];
  tr_full_multipliers(s, y, zf, 0);
  s->o->contacts(TR_A(s, x), y, TR_A(s, co), zf, a, out);
  return 1;
}

static int tr_all_contacts(tr_sim *s, const double *y, double *out) { return tr_contacts_at(s, y, TR_A(s, dy) + s->k->nq, out); }

/* Angle between the normals of two contact records. */
static double tr_turn(const double *p, const double *q) {
  double a = sqrt(p[1] * p[1] + p[2] * p[2] + p[3] * p[3]), b = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(a > 0.0 && b > 0.0)) return 0.0;
  return acos(fmax(-1.0, fmin(1.0, (p[1] * q[1] + p[2] * q[2] + p[3] * q[3]) / (a * b))));
}

/* Where (0…1) the straight line between two contact forces comes closest to zero; its length there, of the smaller end, in *least. */
static double tr_closest(const double *p, const double *q, double *least) {
  double pp = 0.0, pd = 0.0, dd = 0.0, qq = 0.0;
  for (int i = 1; i < 4; ++i) {
    double d = q[i] - p[i];
    pp += p[i] * p[i], pd += p[i] * d, dd += d * d, qq += q[i] * q[i];
  }
  double at = dd > 0.0 ? fmax(0.0, fmin(1.0, -pd / dd)) : 0.0, rest = fmax(0.0, pp + 2.0 * at * pd + at * at * dd);
  *least = sqrt(rest / fmax(fmin(pp, qq), 1e-300));
  return at;
}

/* Narrow the interval in which contact i turns to an eighth, on the dense output; 1 when it still turns there through zero. */
static int tr_separates(tr_sim *s, int i, const double *before, const double *after, double *theta) {
  int nc = s->o->ncontacts;
  double lo[4], hi[4], mid[4 * nc], a = 0.0, b = 1.0, least, *y = TR_A(s, yout);
  memcpy(lo, before + 4 * i, sizeof lo), memcpy(hi, after + 4 * i, sizeof hi);
  for (int halves = 0; halves < 3; ++halves) {
    double m = 0.5 * (a + b);
    tr_dense_eval(s, m, y);
    if (s->k->nquat) tr_normalize(s, y);
    if (!tr_rhs(s, s->step_t0 + m * s->step_h, y, TR_A(s, dy)) || !tr_all_contacts(s, y, mid)) return 0;
    if (tr_turn(lo, mid + 4 * i) > tr_turn(mid + 4 * i, hi)) b = m, memcpy(hi, mid + 4 * i, sizeof hi);
    else a = m, memcpy(lo, mid + 4 * i, sizeof lo);
  }
  *theta = a + (b - a) * tr_closest(lo, hi, &least);
  return tr_turn(lo, hi) > TURNED && least < NEAR_ZERO;
}

/* After an accepted step without event, its end evaluated (a: accelerations there). */
static void tr_watch_contacts(tr_sim *s, const double *a) {
  int nc = s->o ? s->o->ncontacts : 0;
  double now[4 * nc + 4], *before = TR_A(s, con), theta, least;
  if (!nc || !(s->o->wants & 2) || !tr_contacts_at(s, TR_A(s, ynew), a, now)) return;
  double floor = 0.0;
  for (int i = 0; i < nc; ++i) floor = fmax(floor, ROUND_OFF * fmax(before[4 * i], now[4 * i]));
  for (int m = 0; m < s->k->nsliders; ++m) {
    const int *sl = tr_slider(s, m);
    for (int i = sl[6]; i < sl[6] + sl[7]; ++i) {
      const double *p = before + 4 * i, *q = now + 4 * i;
      if (!(p[0] > 0.0) || !(fmax(p[0], q[0]) > floor) || !(tr_turn(p, q) > TURNED)) continue;
      tr_closest(p, q, &least);
      if (least > 2.0 * NEAR_ZERO) continue;
      if (!s->have_dense) {
        if (!tr_prepare_dense(s)) return;
        s->have_dense = 1;
      }
      if (!tr_separates(s, i, before, now, &theta)) continue;
      s->stats.events++;
      tr_log(s, s->step_t0 + theta * s->step_h, TR_EV_SEPARATION, m, before + 4 * sl[6], now + 4 * sl[6], sl[7]);
      break;
    }
  }
  memcpy(before, now, sizeof(double) * 4 * nc);
}
