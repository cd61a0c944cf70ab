/* Event records: the margin of an event, and the angle by which it turns each contact normal. */
#include "events/events.h"

/* relative to the largest contact force or friction: a smaller contact force is round-off, and has no meaningful direction */
#define ROUND_OFF 1e-9

/* Contact force, N, below which the n contacts before and after an event carry only round-off. Friction counts in this limit, too,
 * because friction of a constant torque has no contact. */
static double tr_faint_contact_force(const tr_sim *s, const tr_contact *before, const tr_contact *after, int n) {
  double floor = tr_unloaded_force(s);
  for (int i = 0; i < n; ++i) floor = fmax(floor, ROUND_OFF * fmax(before[i].force, after[i].force));
  return fmax(floor, ROUND_OFF * tr_largest_surface_friction(s));
}

/* Angle between the normals of two contacts, rad. Returns 0 if one force is at most `floor`, because its direction is then
 * round-off. */
static double tr_contact_turn(const tr_contact *p, const tr_contact *q, double floor) {
  const double *u = p->vector, *v = q->vector;
  double a = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), b = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(a > 0.0 && b > 0.0 && p->force > floor && q->force > floor)) return 0.0;
  return acos(fmax(-1.0, fmin(1.0, (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) / (a * b))));
}

/* Polar angle of a contact's normal in its plane, rad. */
static double tr_contact_angle(const tr_contact *p) { return atan2(p->vector[1], p->vector[0]); }

static void tr_log_event(tr_sim *s, double t, int kind, int index, const tr_contact *before, const tr_contact *after, int n) {
  if (s->events.count >= s->events.capacity) return;
  tr_event *e = (tr_event *)TR_A(s, ev) + s->events.count++;
  tr_last *last = &s->events.last;
  memset(e, 0, sizeof *e);
  memset(last, 0, sizeof *last);
  e->time = t, e->kind = kind, e->index = index, e->contacts = n;
  e->margin = tr_method_of(s)->kind == TR_IMPULSES ? NAN : s->events.margin;
  e->marginal = last->marginal = e->margin == e->margin && s->events.unsure;
  const int stop = TR_IS_OF_STOP(kind);
  last->time = t, last->kind = kind, last->element = stop ? 0.0 : 1.0 + tr_pair_of(s, index)->element;
  const double floor = tr_faint_contact_force(s, before, after, n);
  for (int i = 0; i < n && i < TR_EVENT_CONTACTS; ++i) {
    tr_turn *turned = e->turned + i;
    *turned = (tr_turn){tr_contact_angle(before + i), tr_contact_angle(after + i), tr_contact_turn(before + i, after + i, floor)};
    if (last->contact == 0.0 || turned->turn > last->turn)
      last->contact = 1.0 + i, last->before = turned->before, last->after = turned->after, last->turn = turned->turn;
  }
}
