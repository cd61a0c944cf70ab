/* Joints that only push: which contacts stay closed, and the events at which contacts open, close and come to rest (theory, "Contact
 * that begins and ends"). */
#include "stepping/stepping.h"

#define TOUCHES 1e-11   /* × max(length, 1 m): largest gap of contacts that close together */
#define STILL 1e-12     /* × the speed unit, or the speed of approach: a slower gap is at rest */
#define REST_GAP 1e-14  /* × the length: impacts end where the gap of the next flight stays below this */
#define STEADY 1e-11    /* × length · rate²: acceleration of a gap that counts as 0 */
#define LIFTS 20.0      /* × TOL_LIFT: a closed contact that pulls more is decided again */
#define OPEN_PART 0.03125 /* × the period of a drive, load or rotation: a gap closes and opens again in a larger part of it */
#define PENETRATED 1e-9   /* × max(length, 1 m): a deeper penetration at the start of a step is a contact that was missed */
#define CHOICES_MOST 60 /* largest number of changes in a decision */

/* A contact at an event. touches: whether its gap is 0. ends: whether its impacts come to their limit. was: whether it was closed.
 * touched: whether it was closed or unloaded. rate: rate of the gap, m/s. approach: this rate before an impact, 0 without. flight: duration of the next flight, s. */
typedef struct tr_met {
  int touches, ends, was, touched;
  double restitution, rate, approach, flight;
} tr_met;

static void tr_set_initial_contacts(tr_sim *s) {
  for (int c = 0; c < s->k->nunilateral; ++c) tr_set_contact(s, c, !tr_unilateral_of(s, c)->open), *tr_touch_of(s, c) = (tr_touch){0};
}

/* Put the contacts `closed` into force at the state `y`, and evaluate it. Returns a status. */
static int tr_evaluate_with_contacts(tr_sim *s, const char *closed, const tr_mode *modes) {
  const tr_kernel *k = s->k;
  const double t = s->clock.t;
  double *y = TR_A(s, y);
  for (int c = 0; c < k->nunilateral; ++c) tr_set_contact(s, c, closed[c]), tr_touch_of(s, c)->unloaded = 0.0;
  tr_restore_modes(s, modes);
  tr_evaluate_maps_at(s, t, y);
  s->loops.rank = 0;
  tr_find_rank(s, tr_has_idle_rows(s, y));
  if (k->sets) tr_set_row_kinds(s); /* modes, and the pairs that have any, may differ from those of the last solution */
  if (k->neta && k->loop_friction && k->nkappa == 0 && s->loops.rank < tr_loop_rows(s)) return TR_FAIL_MODES;
  if (!tr_project(s, t, y)) return TR_FAIL_CLOSURE;
  if (!tr_rhs(s, t, y, TR_A(s, dy)) && !k->sets) return TR_FAIL_MULTIPLIERS;
  return k->sets ? tr_handle_event(s, t, y, -1, 0) : TR_OK;
}

/* By how much contact c, whose gap is 0 and at rest, violates its condition, in tolerances. Sets whether it is unloaded. */
static double tr_contact_misfit(tr_sim *s, int c, int closed) {
  const double force = TOL_LIFT * tr_force_unit(s);
  if (closed) return -tr_normal_force(s, c) / force;
  if ((tr_touch_of(s, c)->unloaded = tr_is_contact_dependent(s, c))) return tr_load_of_open_contact(s, c) / force;
  return -tr_gap_acceleration(s, c, 1) / (STEADY * tr_speed_unit(s) * s->set.rate);
}

/* From the set `closed` on, change the contact with the largest misfit until none of the contacts `rests` has any. Returns a
 * status. */
static int tr_settle_contacts_from(tr_sim *s, char *closed, const char *rests, const tr_mode *modes) {
  const int n = s->k->nunilateral, count = s->events.count;
  for (int it = 0; it < CHOICES_MOST; ++it) {
    const int code = tr_evaluate_with_contacts(s, closed, modes);
    s->events.count = count;
    if (code != TR_OK) return code;
    double most = 1.0;
    int worst = -1;
    for (int c = 0; c < n; ++c) {
      const double by = rests[c] ? tr_contact_misfit(s, c, closed[c]) : 0.0;
      if (by > most) most = by, worst = c;
    }
    if (worst < 0) return TR_OK;
    closed[worst] = !closed[worst];
  }
  return TR_FAIL_MODES;
}

/* Decide which of the touching contacts at rest stay closed: each either presses, or its parts separate. The decision begins with all
 * of them closed. Friction of a set that pulls may have no solution; the decision then begins without one or two contacts. Returns a
 * status. */
static int tr_settle_contacts(tr_sim *s, const tr_met *met) {
  const int n = s->k->nunilateral, width = tr_state_width(s);
  tr_mode modes[s->k->nsliders + 1];
  char closed[n + 1], rests[n + 1];
  double still = tr_speed_unit(s), y[width];
  tr_save_modes(s, modes), tr_copy(width, TR_A(s, y), y);
  for (int c = 0; c < n; ++c) still = fmax(still, fabs(met[c].approach));
  for (int c = 0; c < n; ++c) closed[c] = rests[c] = met[c].touches && fabs(met[c].rate) <= STILL * still;
  const int first = tr_settle_contacts_from(s, closed, rests, modes);
  int code = first;
  for (int a = 0; a < n && code != TR_OK; ++a)
    for (int b = -1; b < a && code != TR_OK; ++b) {
      if (!rests[a] || (b >= 0 && !rests[b])) continue;
      memcpy(closed, rests, n), closed[a] = 0, tr_copy(width, y, TR_A(s, y));
      if (b >= 0) closed[b] = 0;
      code = tr_settle_contacts_from(s, closed, rests, modes);
    }
  return code == TR_OK ? TR_OK : first;
}

/* Set gaps' rates and which contacts touch and approach at the state `y`. Returns whether any approaches. */
static int tr_meet(tr_sim *s, tr_met *met) {
  const int n = s->k->nunilateral;
  double gap[n + 1], rate[n + 1];
  int hits = 0;
  tr_set_time(s, s->clock.t);
  tr_evaluate_gaps(s, TR_A(s, y), gap, rate);
  for (int c = 0; c < n; ++c) {
    met[c].touches = !tr_is_contact_away(s, c) && (!tr_is_contact_open(s, c) || fabs(gap[c]) <= TOUCHES * fmax(s->set.length, 1.0));
    met[c].rate = rate[c], met[c].approach = met[c].touches && rate[c] < -STILL * tr_speed_unit(s) ? rate[c] : 0.0;
    hits |= met[c].approach < 0.0;
  }
  return hits;
}

/* Mark the contacts whose next flight would stay below REST_GAP. Returns 1 if there are any new ones. */
static int tr_mark_ends(tr_sim *s, tr_met *met) {
  int any = 0;
  for (int c = 0; c < s->k->nunilateral; ++c) {
    const double back = -tr_gap_acceleration(s, c, 1), v = met[c].rate;
    if (met[c].ends || !(met[c].approach < 0.0) || !tr_is_contact_open(s, c) || !(v > 0.0 && v * v < 2.0 * back * REST_GAP * s->set.length)) continue;
    any = met[c].ends = 1, met[c].flight = 2.0 * v / back, tr_touch_of(s, c)->now = v;
  }
  return any;
}

/* Log what happened to the contacts. Impacts that come to their limit end after the next flights, whose durations form a geometric
 * series. */
static void tr_log_contacts(tr_sim *s, const tr_met *met) {
  for (int c = 0; c < s->k->nunilateral; ++c) {
    tr_touch *touch = tr_touch_of(s, c);
    const int index = tr_unilateral_of(s, c)->stop, open = tr_is_contact_open(s, c), hits = met[c].approach < 0.0;
    const double ratio = touch->now < touch->rebound ? touch->now / touch->rebound : met[c].restitution;
    s->stats.events += hits || met[c].was == open;
    if (hits) tr_log_event(s, s->clock.t, TR_EV_CONTACT_CLOSED, index, 0, 0, 0);
    if (met[c].ends) tr_log_event(s, s->clock.t + met[c].flight / (1.0 - ratio), TR_EV_CONTACT_RESTS, index, 0, 0, 0);
    if (met[c].touched && open && !tr_is_contact_unloaded(s, c) && !hits) tr_log_event(s, s->clock.t, TR_EV_CONTACT_OPENED, index, 0, 0, 0);
    touch->rebound = hits && open ? met[c].rate : 0.0;
  }
}

/* The friction of contacts that were open has no mode yet: set it by the present rates where they touch. */
static void tr_set_modes_of_open_contacts(tr_sim *s, const tr_met *met) {
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  for (int c = 0; c < s->k->nunilateral; ++c) {
    const int i = tr_unilateral_of(s, c)->pair;
    if (i < 0 || !met[c].touches || !tr_is_contact_open(s, c) || tr_pair_of(s, i)->kind != TR_KIND_SET) continue;
    tr_mode_of(s, i)->flag = tr_is_at_rest(s, i) ? TR_STUCK : TR_SLIPS;
    tr_freeze_direction(s, i);
  }
}

/* tr_decide_contacts, with the start of the decision in `old` (state) and `modes`. On failure, the caller restores both. */
static int tr_decide_from(tr_sim *s, tr_met *met, const double *old, const tr_mode *modes) {
  const int n = s->k->nunilateral;
  double *y = TR_A(s, y), gap[n + 1], rate[n + 1], now[n + 1];
  do {
    memcpy(y, old, sizeof(double) * tr_state_width(s)), tr_restore_modes(s, modes);
    for (int c = 0; c < n; ++c) tr_set_contact(s, c, met[c].was), now[c] = met[c].ends ? 0.0 : met[c].restitution;
    if (tr_meet(s, met)) {
      char at[n + 1];
      for (int c = 0; c < n; ++c) at[c] = met[c].touches;
      if (!tr_make_impact(s, s->clock.t, y, at, now)) return TR_FAIL_MODES;
      tr_evaluate_gaps(s, y, gap, rate);
      for (int c = 0; c < n; ++c) met[c].rate = rate[c];
    } else tr_set_modes_of_open_contacts(s, met);
    const int code = tr_settle_contacts(s, met);
    if (code != TR_OK) return code;
  } while (tr_mark_ends(s, met));
  return TR_OK;
}

static int tr_decide_contacts(tr_sim *s) {
  const int n = s->k->nunilateral;
  double *y = TR_A(s, y), old[tr_state_width(s)], depth[s->k->nstops + 1], e[s->k->nstops + 1];
  const double energy = tr_audit_energy(s);
  tr_met met[n + 1];
  tr_mode modes[s->k->nsliders + 1];
  tr_save_modes(s, modes), memcpy(old, y, sizeof old);
  tr_set_time(s, s->clock.t);
  tr_stop_depths_and_pushes(s, y, depth, e);
  for (int c = 0; c < n; ++c) met[c] = (tr_met){.was = !tr_is_contact_open(s, c), .touched = !tr_is_contact_open(s, c) || tr_is_contact_unloaded(s, c), .restitution = e[tr_unilateral_of(s, c)->stop]}, tr_touch_of(s, c)->now = INFINITY;
  const int code = tr_decide_from(s, met, old, modes);
  s->step.have_k1 = s->step.have_jac = s->loops.known = 0, s->step.margin = NAN;
  if (code != TR_OK) {
    memcpy(y, old, sizeof old), tr_restore_modes(s, modes);
    for (int c = 0; c < n; ++c) tr_set_contact(s, c, met[c].was), tr_touch_of(s, c)->unloaded = met[c].touched && !met[c].was;
    tr_evaluate_maps_at(s, s->clock.t, y);
    if (s->k->sets) tr_set_row_kinds(s);
    return code;
  }
  tr_log_contacts(s, met);
  tr_log_mode_changes(s, s->clock.t, modes, 0);
  tr_audit_allow_change(s, energy);
  return TR_OK;
}

static int tr_check_penetration(tr_sim *s, double most) {
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  tr_set_time(s, s->clock.t);
  tr_evaluate_gaps(s, TR_A(s, y), gap, rate);
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (gap[c] < -most * fmax(s->set.length, 1.0) && tr_is_contact_open(s, c) && !tr_is_contact_away(s, c)) {
      s->audit.fail_detail = tr_unilateral_of(s, c)->row, s->audit.fail_number = -gap[c];
      return TR_FAIL_PENETRATION;
    }
  return TR_OK;
}

/* Evaluate the maps and the rank of the loop rows with the present contacts. Returns whether the rows are redundant. */
static int tr_find_contact_rank(tr_sim *s) {
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  s->loops.rank = 0;
  tr_find_rank(s, tr_has_idle_rows(s, TR_A(s, y)));
  return s->loops.rank < tr_loop_rows(s);
}

static int tr_has_redundant_contacts(tr_sim *s) {
  const int n = s->k->nunilateral;
  char closed[n + 1];
  for (int c = 0; c < n; ++c) closed[c] = !tr_is_contact_open(s, c), tr_set_contact(s, c, 1);
  const int redundant = tr_find_contact_rank(s);
  for (int c = 0; c < n; ++c) tr_set_contact(s, c, closed[c]);
  tr_find_contact_rank(s);
  return redundant;
}

static int tr_start_contacts(tr_sim *s) {
  const int code = tr_check_penetration(s, TOUCHES);
  return code == TR_OK ? tr_decide_contacts(s) : code;
}

static int tr_pass_mouth(tr_sim *s, int stop) {
  *tr_stop_flag(s, stop) = tr_is_pressed(s, stop) ? TR_STOP_OPEN : TR_STOP_PRESSED;
  const int code = tr_is_pressed(s, stop) ? tr_check_penetration(s, TOUCHES) : TR_OK;
  return code == TR_OK ? tr_decide_contacts(s) : code;
}

static int tr_check_missed_contacts(tr_sim *s) {
  return s->k->nunilateral ? tr_check_penetration(s, PENETRATED) : TR_OK;
}

static double tr_longest_open_step(const tr_sim *s) {
  double pace = s->friction.pace;
  int open = 0;
  for (int c = 0; c < s->k->nunilateral; ++c) open |= tr_is_contact_open(s, c) && !tr_is_contact_unloaded(s, c);
  for (int i = 0; i < s->k->nv && open; ++i)
    if (s->k->vkind[i] == TR_COORDINATE_ANGLE) pace = fmax(pace, fabs(TR_A(s, y)[s->k->nq + i]) / TURN);
  return open && pace > 0.0 ? OPEN_PART / pace : INFINITY;
}

static int tr_has_contact_to_decide(const tr_sim *s) {
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (!tr_is_contact_open(s, c) && tr_normal_force(s, c) < -LIFTS * TOL_LIFT * tr_force_unit(s)) return 1;
  return 0;
}
