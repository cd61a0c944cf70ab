/* Contacts watched while stepping: a normal force that passes through zero turns its normal to the other side (separation). */
#include "modes.h"

#define TURNED 2.0     /* rad: more than a step's steady turning */
#define ROUND_OFF 1e-9 /* of the largest contact force before or after: less carries nothing, and has no direction */
#define NEAR_ZERO 0.2  /* of the smaller force: how close to zero the force passes when it separates */
#define HALVINGS 3     /* of the step: in an eighth of it a force through zero is a straight line */
#define LINES_MOST 8   /* straight lines after that: each leaves the square of what the last one did, at first */
#define TINY 1e-300    /* N²: keeps a quotient finite where there is no force at all */

/* Contact forces of all pairs at the state just evaluated (a: accelerations of the rates). 0 when there are none. */
static int tr_contacts_at(tr_sim *s, const double *y, const double *a, tr_contact *out) {
  if (!s->o || !s->o->contacts) return 0;
  double zf[s->k->rows + s->k->neta + 1];
  tr_full_multipliers(s, y, zf, 0);
  s->o->contacts(TR_A(s, x), y, TR_A(s, co), zf, a, (double *)out);
  return 1;
}

/* The same with the accelerations just evaluated. */
static int tr_all_contacts(tr_sim *s, const double *y, tr_contact *out) { return tr_contacts_at(s, y, TR_A(s, dy) + s->k->nq, out); }

/* Angle between the normals of two contacts; 0 where one has none. */
static double tr_turn_of(const tr_contact *p, const tr_contact *q) {
  const double *u = p->vector, *v = q->vector;
  double a = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), b = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(a > 0.0 && b > 0.0)) return 0.0;
  return acos(fmax(-1.0, fmin(1.0, (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) / (a * b))));
}

/* Where (0…1) the straight line between two contact forces comes closest to zero; its length there, of the smaller end, in *least. */
static double tr_closest(const tr_contact *p, const tr_contact *q, double *least) {
  double pp = 0.0, pd = 0.0, dd = 0.0, qq = 0.0;
  for (int i = 0; i < 3; ++i) {
    double d = q->vector[i] - p->vector[i];
    pp += p->vector[i] * p->vector[i], pd += p->vector[i] * d, dd += d * d, qq += q->vector[i] * q->vector[i];
  }
  double at = dd > 0.0 ? fmax(0.0, fmin(1.0, -pd / dd)) : 0.0, rest = fmax(0.0, pp + 2.0 * at * pd + at * at * dd);
  *least = sqrt(rest / fmax(fmin(pp, qq), TINY));
  return at;
}

/* Narrow the interval a…b in which contact i turns, on the dense output: to its part before or behind m. */
static int tr_narrow_turn(tr_sim *s, int i, double m, double *a, double *b, tr_contact *lo, tr_contact *hi) {
  tr_contact mid[s->o->ncontacts];
  double *y = TR_A(s, yout);
  tr_dense_eval(s, m, y);
  if (s->k->nquat) tr_normalize(s, y);
  if (!tr_rhs(s, s->step.t0 + m * s->step.size, y, TR_A(s, dy)) || !tr_all_contacts(s, y, mid)) return 0;
  if (tr_turn_of(lo, mid + i) > tr_turn_of(mid + i, hi)) *b = m, *hi = mid[i];
  else *a = m, *lo = mid[i];
  return 1;
}

/* Where in the step contact i turns through zero: halves first, then where the straight line through both ends does, until that stays. 0: it
 * does not. */
static int tr_separates(tr_sim *s, int i, const tr_contact *before, const tr_contact *after, double *theta) {
  tr_contact lo = before[i], hi = after[i];
  double a = 0.0, b = 1.0, least;
  for (int halves = 0; halves < HALVINGS; ++halves)
    if (!tr_narrow_turn(s, i, 0.5 * (a + b), &a, &b, &lo, &hi)) return 0;
  if (!(tr_turn_of(&lo, &hi) > TURNED)) return 0;
  *theta = a + (b - a) * tr_closest(&lo, &hi, &least);
  if (!(least < NEAR_ZERO)) return 0;
  for (int it = 0; it < LINES_MOST; ++it) {
    const double last = *theta;
    if (!(last > a && last < b) || !tr_narrow_turn(s, i, last, &a, &b, &lo, &hi)) break;
    *theta = a + (b - a) * tr_closest(&lo, &hi, &least);
    if (fabs(*theta - last) <= s->set.rtol) break;
  }
  return 1;
}

/* After an accepted step without event, its end evaluated (a: accelerations there). */
static void tr_watch_contacts(tr_sim *s, const double *a) {
  int nc = s->o ? s->o->ncontacts : 0;
  tr_contact now[nc + 1], *before = (tr_contact *)TR_A(s, con);
  double theta, least;
  if (!nc || !tr_contacts_at(s, TR_A(s, ynew), a, now)) return;
  double floor = 0.0;
  for (int i = 0; i < nc; ++i) floor = fmax(floor, ROUND_OFF * fmax(before[i].force, now[i].force));
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    for (int i = pair->contact0; i < pair->contact0 + pair->ncontacts; ++i) {
      const tr_contact *p = before + i, *q = now + i;
      if (!(p->force > 0.0) || !(fmax(p->force, q->force) > floor) || !(tr_turn_of(p, q) > TURNED)) continue;
      tr_closest(p, q, &least);
      if (least > 2.0 * NEAR_ZERO) continue;
      if (!tr_have_dense(s)) return;
      if (!tr_separates(s, i, before, now, &theta)) continue;
      s->stats.events++;
      tr_log(s, s->step.t0 + theta * s->step.size, TR_EV_SEPARATION, m, before + pair->contact0, now + pair->contact0, pair->ncontacts);
      break;
    }
  }
  memcpy(before, now, sizeof(tr_contact) * nc);
}
