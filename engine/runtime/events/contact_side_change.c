/* Separations: inside a step, the normal force of a two-sided contact passes through zero, and the contact moves to the other side.
 * (Contacts of joints that only push open and close: ``unilateral_event_location.c``.) */
#include "events/events.h"

#define TURNED 2.0     /* rad: larger than any steady turn of a normal within a step */
#define NEAR_ZERO 0.2  /* relative to the smaller end force: if the force has a larger minimum, it does not pass through zero */
/* Number of halvings of a quarter step. The result is an eighth of a step, in which a force that passes through zero is nearly
 * linear in time. */
#define HALVINGS 1
#define LINES_MOST 8   /* largest number of secant steps after the halvings; the first secant steps square the error */
#define NONE 2.0       /* stands for no separation inside the step, in place of a fraction of the step */
/* fraction of the step, relative to rtol: separations at a smaller distance are one event. Each separation is located within
 * rtol. */
#define TOGETHER 100.0
#define SMALL 0.2      /* relative to the largest force so far: a smaller contact force may pass through zero twice in a step */
/* decay factor per step of the stored largest force; after a time, a contact whose load stays small is not searched */
#define FADES 0.99
#define TINY 1e-300    /* N²: replaces a zero divisor */

/* Fraction (0…1) at which the linear interpolation between two contact forces has the smallest norm. *least receives this norm,
 * divided by the smaller norm of the end forces. */
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

/* Contacts at the fraction `at` of the step, from the dense output. Returns 0 if this state cannot be evaluated. */
static int tr_contacts_inside(tr_sim *s, double at, tr_contact *out) {
  double *y = TR_A(s, yout);
  tr_evaluate_dense(s, at, y);
  if (s->k->nquat) tr_normalise_quaternions(s, y);
  return tr_rhs(s, s->step.t0 + at * s->step.size, y, TR_A(s, dy)) && tr_current_contacts(s, y, out);
}

/* Divide the interval a…b at m, and narrow it to the part with the larger turn of contact i. lo and hi: contacts at a and b.
 * Returns 0 if the state at m cannot be evaluated. */
static int tr_narrow_turn(tr_sim *s, int i, double m, double *a, double *b, tr_contact *lo, tr_contact *hi) {
  tr_contact mid[s->o->ncontacts];
  const int known = tr_contacts_inside(s, m, mid);
  if (!known) return 0;
  if (tr_contact_turn(lo, mid + i, 0.0) > tr_contact_turn(mid + i, hi, 0.0)) *b = m, *hi = mid[i];
  else *a = m, *lo = mid[i];
  return 1;
}

/* Fraction in a…b at which the force of contact i passes through zero, or NONE if it does not. The search uses halvings, then
 * secants. lo, hi: contacts at a and b. */
static double tr_find_separation(tr_sim *s, int i, double a, double b, tr_contact lo, tr_contact hi) {
  double least;
  for (int halves = 0; halves < HALVINGS; ++halves)
    if (!tr_narrow_turn(s, i, 0.5 * (a + b), &a, &b, &lo, &hi)) return NONE;
  if (!(tr_contact_turn(&lo, &hi, 0.0) > TURNED)) return NONE;
  double theta = a + (b - a) * tr_closest_to_zero(&lo, &hi, &least);
  if (!(least < NEAR_ZERO)) return NONE;
  for (int it = 0; it < LINES_MOST; ++it) {
    const double last = theta;
    if (!(last > a && last < b) || !tr_narrow_turn(s, i, last, &a, &b, &lo, &hi)) break;
    theta = a + (b - a) * tr_closest_to_zero(&lo, &hi, &least);
    if (fabs(theta - last) <= s->set.rtol) break;
  }
  return theta;
}

/* Log the separations of pair m. at[i]: fraction of the step at which contact i separates, or NONE. before, now: contacts at both
 * ends of the step. Simultaneous separations are one event. */
static void tr_log_pair_separations(tr_sim *s, int m, const double *at, const tr_contact *before, const tr_contact *now) {
  const int n = tr_pair_of(s, m)->ncontacts;
  tr_contact was[s->o->ncontacts], is[s->o->ncontacts];
  for (double last = -1.0;;) {
    double first = NONE;
    for (int i = 0; i < n; ++i) first = at[i] > last ? fmin(first, at[i]) : first;
    if (first >= NONE) return;
    for (int i = 0; i < n; ++i) was[i] = at[i] <= last ? now[i] : before[i];
    last = first + TOGETHER * s->set.rtol;
    for (int i = 0; i < n; ++i) is[i] = at[i] > last && at[i] < NONE ? before[i] : now[i];
    s->stats.events++;
    tr_log_event(s, s->step.t0 + first * s->step.size, TR_EV_SEPARATION, m, was, is, n);
  }
}

/* Whether the normal of a contact turned between two states while its force passed close to zero. floor: smaller forces are
 * round-off. */
static int tr_is_turned(const tr_contact *before, const tr_contact *now, double floor) {
  double least;
  if (!(before->force > 0.0) || !(fmax(before->force, now->force) > floor) || !(tr_contact_turn(before, now, 0.0) > TURNED)) return 0;
  tr_closest_to_zero(before, now, &least);
  return least <= 2.0 * NEAR_ZERO;
}

/* Whether a contact with equal normals at both ends of the step may have turned twice inside the step. The force of such a contact
 * is small relative to `peak`, the contact's largest force so far (multiplied by FADES in each step). */
static int tr_may_turn_twice(const tr_contact *before, const tr_contact *now, double peak, double floor) {
  const double smaller = fmin(before->force, now->force);
  return smaller > floor && smaller < SMALL * peak && !(tr_contact_turn(before, now, 0.0) > TURNED);
}

/* Log the separations between the fractions a and b of the step. before, now: contacts at a and b. */
static void tr_log_separations_within(tr_sim *s, double a, double b, const tr_contact *before, const tr_contact *now, double floor) {
  for (int m = 0; m < s->k->nsliders; ++m) {
    const int first = tr_pair_of(s, m)->contact0, n = tr_pair_of(s, m)->ncontacts;
    double at[s->o->ncontacts];
    if (tr_unilateral_of_pair(s, m) >= 0) continue; /* contacts of joints that only push open instead */
    for (int i = 0; i < n; ++i) {
      const tr_contact *p = before + first + i, *q = now + first + i;
      at[i] = tr_is_turned(p, q, floor) ? tr_find_separation(s, first + i, a, b, *p, *q) : NONE;
    }
    tr_log_pair_separations(s, m, at, before + first, now + first);
  }
}

static int tr_log_separations(tr_sim *s, double end, const tr_contact *now) {
  const int nc = s->o->ncontacts;
  const tr_contact *before = (const tr_contact *)TR_A(s, contacts);
  tr_contact inside[3][nc];
  double floor = tr_faint_contact_force(s, before, now, nc), *peak = TR_A(s, contact_peaks);
  int once = 0, twice = 0;
  for (int i = 0; i < nc; ++i) {
    peak[i] = fmax(FADES * peak[i], fmax(before[i].force, now[i].force));
    once |= tr_is_turned(before + i, now + i, floor), twice |= tr_may_turn_twice(before + i, now + i, peak[i], floor);
  }
  if (!(once || twice) || !tr_ensure_dense(s)) return 0;
  if (!tr_contacts_inside(s, 0.5 * end, inside[1])) return 1;
  for (int i = 0; i < nc; ++i) once |= tr_is_turned(before + i, inside[1] + i, floor);
  if (!once || !tr_contacts_inside(s, 0.25 * end, inside[0]) || !tr_contacts_inside(s, 0.75 * end, inside[2])) return 1;
  const tr_contact *at[5] = {before, inside[0], inside[1], inside[2], now};
  for (int q = 0; q < 4; ++q) tr_log_separations_within(s, 0.25 * q * end, 0.25 * (q + 1) * end, at[q], at[q + 1], floor);
  return 1;
}

static void tr_log_step_separations(tr_sim *s, const double *a) {
  const int nc = s->o ? s->o->ncontacts : 0;
  tr_contact now[nc + 1];
  if (!nc || !tr_evaluate_contacts(s, TR_A(s, ynew), a, now)) return;
  double kept[tr_solution_size(s)];
  tr_save_solution(s, kept);
  if (tr_log_separations(s, 1.0, now)) tr_restore_solution(s, kept);
  memcpy(TR_A(s, contacts), now, sizeof(tr_contact) * nc);
}
