/* Separations: a contact's normal force passes through zero inside a step, and its normal turns to the other side. */
#include "events/events.h"

#define TURNED 2.0     /* rad: larger than any steady turn within a step */
#define ROUND_OFF 1e-9 /* × the largest contact force before or after: a smaller force is round-off without direction */
#define NEAR_ZERO 0.2  /* × the smaller of the two forces: largest distance from zero of a force that separates */
#define HALVINGS 3     /* halvings of the step; in an eighth of it, a force through zero is a straight line */
#define LINES_MOST 8   /* secants after the halvings; at first, each squares the error */
#define TINY 1e-300    /* N²: keeps a quotient finite without any force */

/* Angle between the normals of two contacts, rad; 0 if one of them is zero. */
static double tr_contact_turn(const tr_contact *p, const tr_contact *q) {
  const double *u = p->vector, *v = q->vector;
  double a = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), b = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(a > 0.0 && b > 0.0)) return 0.0;
  return acos(fmax(-1.0, fmin(1.0, (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) / (a * b))));
}

/* Place (0…1) where the straight line between two contact forces is closest to zero. *least: its length there over the smaller
 * end. */
static double tr_closest_to_zero(const tr_contact *p, const tr_contact *q, double *least) {
  double pp = 0.0, pd = 0.0, dd = 0.0, qq = 0.0;
  for (int i = 0; i < 3; ++i) {
    double d = q->vector[i] - p->vector[i];
    pp += p->vector[i] * p->vector[i], pd += p->vector[i] * d, dd += d * d, qq += q->vector[i] * q->vector[i];
  }
  double at = dd > 0.0 ? fmax(0.0, fmin(1.0, -pd / dd)) : 0.0, rest = fmax(0.0, pp + 2.0 * at * pd + at * at * dd);
  *least = sqrt(rest / fmax(fmin(pp, qq), TINY));
  return at;
}

/* Narrow the interval a…b in which contact i turns to its part before or after m, by the dense output. Returns 0 if the state
 * at m cannot be evaluated. */
static int tr_narrow_turn(tr_sim *s, int i, double m, double *a, double *b, tr_contact *lo, tr_contact *hi) {
  tr_contact mid[s->o->ncontacts];
  double *y = TR_A(s, yout);
  tr_evaluate_dense(s, m, y);
  if (s->k->nquat) tr_normalise_quaternions(s, y);
  if (!tr_rhs(s, s->step.t0 + m * s->step.size, y, TR_A(s, dy)) || !tr_current_contacts(s, y, mid)) return 0;
  if (tr_contact_turn(lo, mid + i) > tr_contact_turn(mid + i, hi)) *b = m, *hi = mid[i];
  else *a = m, *lo = mid[i];
  return 1;
}

/* Find where contact i passes zero inside the step: *theta, by halvings, then secants. Returns 0 if it does not. */
static int tr_find_separation(tr_sim *s, int i, const tr_contact *before, const tr_contact *after, double *theta) {
  tr_contact lo = before[i], hi = after[i];
  double a = 0.0, b = 1.0, least;
  for (int halves = 0; halves < HALVINGS; ++halves)
    if (!tr_narrow_turn(s, i, 0.5 * (a + b), &a, &b, &lo, &hi)) return 0;
  if (!(tr_contact_turn(&lo, &hi) > TURNED)) return 0;
  *theta = a + (b - a) * tr_closest_to_zero(&lo, &hi, &least);
  if (!(least < NEAR_ZERO)) return 0;
  for (int it = 0; it < LINES_MOST; ++it) {
    const double last = *theta;
    if (!(last > a && last < b) || !tr_narrow_turn(s, i, last, &a, &b, &lo, &hi)) break;
    *theta = a + (b - a) * tr_closest_to_zero(&lo, &hi, &least);
    if (fabs(*theta - last) <= s->set.rtol) break;
  }
  return 1;
}

static void tr_log_separations(tr_sim *s, const double *a) {
  int nc = s->o ? s->o->ncontacts : 0;
  tr_contact now[nc + 1], *before = (tr_contact *)TR_A(s, contacts);
  double theta, least;
  if (!nc || !tr_evaluate_contacts(s, TR_A(s, ynew), a, now)) return;
  double floor = 0.0;
  for (int i = 0; i < nc; ++i) floor = fmax(floor, ROUND_OFF * fmax(before[i].force, now[i].force));
  for (int m = 0; m < s->k->nsliders; ++m) {
    const tr_pair *pair = tr_pair_of(s, m);
    for (int i = pair->contact0; i < pair->contact0 + pair->ncontacts; ++i) {
      const tr_contact *p = before + i, *q = now + i;
      if (!(p->force > 0.0) || !(fmax(p->force, q->force) > floor) || !(tr_contact_turn(p, q) > TURNED)) continue;
      tr_closest_to_zero(p, q, &least);
      if (least > 2.0 * NEAR_ZERO) continue;
      if (!tr_ensure_dense(s)) return;
      if (!tr_find_separation(s, i, before, now, &theta)) continue;
      s->stats.events++;
      tr_log_event(s, s->step.t0 + theta * s->step.size, TR_EV_SEPARATION, m, before + pair->contact0, now + pair->contact0, pair->ncontacts);
      break;
    }
  }
  memcpy(before, now, sizeof(tr_contact) * nc);
}
