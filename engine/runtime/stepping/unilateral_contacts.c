/* Joints that only push (theory, "Contact that begins and ends"): choice of the contacts that stay closed; events at which contacts
 * open, close and come to rest. */
#include "stepping/stepping.h"

#define TOUCHES 1e-11   /* relative to max(length, 1 m): largest gap of a contact that closes together with others */
#define STILL 1e-12     /* relative to the larger of speed unit and speed of approach: a gap with a smaller rate is at rest */
#define REST_GAP 1e-14  /* relative to the length scale: impacts end when the gap of the next flight stays below this value */
#define STEADY 1e-11    /* in units of length · rate²: a smaller acceleration of a gap counts as 0 */
#define LIFTS 20.0      /* relative to TOL_LIFT: a closed contact that pulls more requires a new decision */
/* relative to the period of a drive, load or rotation: longest step while a contact is open. No gap closes and opens again within
 * such a step. */
#define OPEN_PART 0.03125
/* relative to max(length, 1 m): a deeper penetration at the start of a step means that the closing of a contact was missed */
#define PENETRATED 1e-9
/* relative to the duration of the flight after an impact: longest next step, because the dense output of a long step misses a short
 * flight */
#define FLIGHT_STEP 2.0
#define LOCATED (100.0 * TOL_STOP) /* m: least depth at the end of a step that shows a landing inside the step */
#define CHOICES_MOST 60 /* largest number of changes of contacts in one decision */

/* A contact at an event. touches: whether its gap is 0. ends: whether its series of impacts ends. was: whether the contact was
 * closed before the event. touched: whether it was closed or unloaded before the event. rate: rate of the gap, m/s. approach: rate
 * of the gap before an impact; 0 without an impact. flight: duration of the next flight, s. */
typedef struct tr_met {
  int touches, ends, was, touched;
  double restitution, rate, approach, flight;
} tr_met;

static void tr_set_initial_contacts(tr_sim *s) {
  for (int c = 0; c < s->k->nunilateral; ++c) tr_set_contact(s, c, !tr_unilateral_of(s, c)->open), *tr_touch_of(s, c) = (tr_touch){0};
}

/* Close the contacts marked in `closed`, open the others, and evaluate the state `y`. Returns a status. */
static int tr_evaluate_with_contacts(tr_sim *s, const char *closed, const tr_mode *modes) {
  const tr_kernel *k = s->k;
  const double t = s->clock.t;
  double *y = TR_A(s, y);
  for (int c = 0; c < k->nunilateral; ++c) tr_set_contact(s, c, closed[c]), tr_touch_of(s, c)->unloaded = 0.0;
  tr_restore_modes(s, modes);
  tr_evaluate_maps_at(s, t, y);
  s->loops.rank = 0;
  tr_find_rank(s, tr_has_idle_rows(s, y));
  if (k->sets) tr_set_row_kinds(s); /* the pairs that have modes, and their modes, may differ from those of the last solution */
  if (k->neta && k->loop_friction && k->nkappa == 0 && s->loops.rank < tr_loop_rows(s)) return TR_FAIL_MODES;
  if (!tr_project(s, t, y)) return TR_FAIL_CLOSURE;
  if (!tr_rhs(s, t, y, TR_A(s, dy)) && !k->sets) return TR_FAIL_MULTIPLIERS;
  return k->sets ? tr_handle_event(s, t, y, -1, 0) : TR_OK;
}

/* Violation of contact c's condition, in tolerances. Requires that the gap is 0 and at rest. Also stores whether the contact is
 * unloaded. */
static double tr_contact_misfit(tr_sim *s, int c, int closed) {
  const double force = TOL_LIFT * tr_force_unit(s);
  if (closed) return -tr_normal_force(s, c) / force;
  if ((tr_touch_of(s, c)->unloaded = tr_is_contact_dependent(s, c))) return tr_load_of_open_contact(s, c) / force;
  return -tr_gap_acceleration(s, c, 1) / (STEADY * tr_speed_unit(s) * s->set.rate);
}

/* Evaluate with the contacts `closed`. *worst receives the contact of `rests` that violates its condition most; −1: no contact
 * violates its condition. Returns a status. */
static int tr_try_contacts(tr_sim *s, const char *closed, const char *rests, const tr_mode *modes, int *worst) {
  const int count = s->events.count, code = tr_evaluate_with_contacts(s, closed, modes);
  double most = 1.0;
  s->events.count = count, *worst = -1;
  for (int c = 0; c < s->k->nunilateral && code == TR_OK; ++c) {
    const double by = rests[c] ? tr_contact_misfit(s, c, closed[c]) : 0.0;
    if (by > most) most = by, *worst = c;
  }
  return code;
}

/* Try all sets of open contacts among those at rest at the state `y`, small sets first. Returns whether a set satisfies all
 * conditions. */
static int tr_try_all_contact_sets(tr_sim *s, const double *y, const char *rests, const tr_mode *modes) {
  const int n = s->k->nunilateral;
  char closed[n + 1];
  int m = 0, worst, all[n + 1];
  for (int c = 0; c < n; ++c)
    if (rests[c]) all[m++] = c;
  if (m > SETS_OF_MOST) return 0;
  for (int open = 0; open <= m; ++open)
    for (int set = 0; set < 1 << m; ++set) {
      int left = open;
      memset(closed, 0, n);
      for (int q = 0; q < m; ++q) closed[all[q]] = !(set >> q & 1), left -= set >> q & 1;
      if (left == 0) memcpy(TR_A(s, y), y, sizeof(double) * tr_state_width(s));
      if (left == 0 && tr_try_contacts(s, closed, rests, modes, &worst) == TR_OK && worst < 0) return 1;
    }
  return 0;
}

/* Largest rate of a gap at rest, m/s. */
static double tr_still_speed(const tr_sim *s, const tr_met *met) {
  double most = tr_speed_unit(s);
  for (int c = 0; c < s->k->nunilateral; ++c) most = fmax(most, fabs(met[c].approach));
  return STILL * most;
}

/* Decide which of the touching contacts at rest stay closed. In the solution, each contact either presses, or its parts separate.
 * Returns a status. */
static int tr_settle_contacts(tr_sim *s, const tr_met *met) {
  const int n = s->k->nunilateral;
  tr_mode modes[s->k->nsliders + 1];
  char closed[n + 1], rests[n + 1];
  const double still = tr_still_speed(s, met);
  double old[tr_state_width(s)];
  int code = TR_OK, worst = 0;
  tr_save_modes(s, modes), memcpy(old, TR_A(s, y), sizeof old);
  for (int c = 0; c < n; ++c) closed[c] = rests[c] = met[c].touches && (met[c].ends || fabs(met[c].rate) <= still);
  for (int it = 0; it < CHOICES_MOST && code == TR_OK; ++it) {
    if ((code = tr_try_contacts(s, closed, rests, modes, &worst)) == TR_OK && worst < 0) return TR_OK;
    if (code == TR_OK) closed[worst] = !closed[worst];
  }
  return tr_try_all_contact_sets(s, old, rests, modes) ? TR_OK : code == TR_OK ? TR_FAIL_MODES : code;
}

/* Whether a gap counts as closed. (After a missed landing, parts may penetrate by up to PENETRATED.) */
static int tr_is_gap_closed(const tr_sim *s, double gap) {
  const double unit = fmax(s->set.length, 1.0);
  return gap <= TOUCHES * unit && gap >= -PENETRATED * unit;
}

/* Set the rates of the gaps at the state `y`, and which contacts touch and approach. Returns whether any contact approaches. */
static int tr_meet(tr_sim *s, tr_met *met) {
  const int n = s->k->nunilateral;
  double gap[n + 1], rate[n + 1];
  int hits = 0;
  tr_set_time(s, s->clock.t);
  tr_evaluate_gaps(s, TR_A(s, y), gap, rate);
  for (int c = 0; c < n; ++c) {
    met[c].touches = !tr_is_contact_away(s, c) && (!tr_is_contact_open(s, c) || tr_is_gap_closed(s, gap[c]));
    met[c].rate = rate[c], met[c].approach = met[c].touches && rate[c] < -STILL * tr_speed_unit(s) ? rate[c] : 0.0;
    hits |= met[c].approach < 0.0;
  }
  return hits;
}

/* Mark the contacts whose next flight after an impact would stay below REST_GAP. These include contacts that the impact of another
 * contact opens, for example when a box rocks to rest. Returns 1 if any contact is newly marked. */
static int tr_mark_ends(tr_sim *s, tr_met *met, int impact) {
  int any = 0;
  for (int c = 0; c < s->k->nunilateral && impact; ++c) {
    const double back = -tr_gap_acceleration(s, c, 1), v = met[c].rate;
    if (met[c].ends || !met[c].touches || !tr_is_contact_open(s, c) || !(v > tr_still_speed(s, met) && v * v < 2.0 * back * REST_GAP * s->set.length)) continue;
    any = met[c].ends = 1, met[c].flight = 2.0 * v / back, tr_touch_of(s, c)->now = v;
  }
  return any;
}

/* Limit the next step by the flights that follow an impact. The limit still lets each contact fall by at least LOCATED within the
 * step. */
static void tr_limit_step_by_flights(tr_sim *s, const tr_met *met, int impact) {
  for (int c = 0; c < s->k->nunilateral && impact && s->set.hfixed <= 0.0; ++c) {
    const double back = -tr_gap_acceleration(s, c, 1), v = met[c].rate;
    if (!(met[c].touches && tr_is_contact_open(s, c) && v > 0.0 && back > 0.0)) continue;
    s->step.h = fmin(s->step.h, fmax(FLIGHT_STEP * 2.0 * v / back, sqrt(2.0 * LOCATED / back)));
  }
}

/* Log the events of the contacts. A contact whose series of impacts ends comes to rest later, after further flights. The durations
 * of these flights form a geometric series. */
static void tr_log_contacts(tr_sim *s, const tr_met *met) {
  for (int c = 0; c < s->k->nunilateral; ++c) {
    tr_touch *touch = tr_touch_of(s, c);
    const int index = tr_unilateral_of(s, c)->stop, open = tr_is_contact_open(s, c), hits = met[c].approach < 0.0;
    const double ratio = touch->now < touch->rebound ? touch->now / touch->rebound : met[c].restitution;
    s->stats.events += hits || met[c].was == open;
    if (hits) tr_log_event(s, s->clock.t, TR_EV_CONTACT_CLOSED, index, 0, 0, 0);
    if (met[c].ends && hits) tr_log_event(s, s->clock.t + met[c].flight / (1.0 - ratio), TR_EV_CONTACT_RESTS, index, 0, 0, 0);
    if (met[c].touched && open && !tr_is_contact_unloaded(s, c) && !hits) tr_log_event(s, s->clock.t, TR_EV_CONTACT_OPENED, index, 0, 0, 0);
    touch->rebound = hits && open ? met[c].rate : 0.0;
  }
}

/* Whether the mode of pair i may not fit its present rates. (A contact that was open has no friction mode yet, and an impact may
 * stop, start or turn any pair.) */
static int tr_has_other_rates(const tr_sim *s, const tr_met *met, int impact, int i) {
  int other = impact;
  for (int c = 0; c < s->k->nunilateral; ++c) other |= tr_unilateral_of(s, c)->pair == i && met[c].touches && tr_is_contact_open(s, c);
  return other && tr_pair_of(s, i)->kind == TR_KIND_SET;
}

/* Set modes by the present rates. After an impact, the modes of all pairs are set; otherwise, only those of the pairs of contacts
 * that touch and were open. */
static void tr_set_modes_by_rates(tr_sim *s, const tr_met *met, int impact) {
  tr_evaluate_maps_at(s, s->clock.t, TR_A(s, y));
  for (int i = 0; i < s->k->nsliders; ++i) {
    if (!tr_has_other_rates(s, met, impact, i)) continue;
    if (tr_is_at_rest(s, i)) tr_mode_of(s, i)->flag = TR_STUCK;
    else if (tr_mode_flag(tr_mode_of(s, i)) == TR_STUCK) tr_mode_of(s, i)->flag = TR_SLIPS;
    tr_freeze_direction(s, i);
  }
}

/* Like tr_decide_contacts. old, modes: state and modes at the start of the decision; on failure, the caller restores both. */
static int tr_decide_from(tr_sim *s, tr_met *met, const double *old, const tr_mode *modes) {
  const int n = s->k->nunilateral;
  double *y = TR_A(s, y), gap[n + 1], rate[n + 1], now[n + 1];
  int hits;
  do {
    memcpy(y, old, sizeof(double) * tr_state_width(s)), tr_restore_modes(s, modes);
    for (int c = 0; c < n; ++c) tr_set_contact(s, c, met[c].was), now[c] = met[c].ends ? 0.0 : met[c].restitution;
    hits = tr_meet(s, met);
    if (hits) {
      char at[n + 1];
      for (int c = 0; c < n; ++c) at[c] = met[c].touches;
      tr_set_modes_by_rates(s, met, 0); /* a contact that was open has no mode; as stuck, its impulse might pull */
      if (!tr_make_impact(s, s->clock.t, y, at, now)) return TR_FAIL_MODES;
      tr_evaluate_gaps(s, y, gap, rate);
      for (int c = 0; c < n; ++c) met[c].rate = rate[c];
    }
    tr_set_modes_by_rates(s, met, hits);
    const int code = tr_settle_contacts(s, met);
    if (code != TR_OK) return code;
  } while (tr_mark_ends(s, met, hits));
  return TR_OK;
}

static int tr_decide_contacts(tr_sim *s) {
  const int n = s->k->nunilateral;
  double *y = TR_A(s, y), old[tr_state_width(s)], depth[s->k->nstops + 1], e[s->k->nstops + 1];
  const double energy = tr_audit_energy(s);
  int hits = 0;
  tr_met met[n + 1];
  tr_mode modes[s->k->nsliders + 1];
  tr_save_modes(s, modes), memcpy(old, y, sizeof old);
  tr_set_time(s, s->clock.t);
  tr_stop_depths_and_pushes(s, y, depth, e);
  for (int c = 0; c < n; ++c) met[c] = (tr_met){.was = !tr_is_contact_open(s, c), .touched = !tr_is_contact_open(s, c) || tr_is_contact_unloaded(s, c), .restitution = e[tr_unilateral_of(s, c)->stop]}, tr_touch_of(s, c)->now = INFINITY;
  const int code = tr_decide_from(s, met, old, modes);
  s->step.have_k1 = s->step.have_jac = s->loops.known = 0, s->step.margin = NAN;
  s->friction.redecide = code != TR_OK;
  if (code != TR_OK) {
    memcpy(y, old, sizeof old), tr_restore_modes(s, modes);
    for (int c = 0; c < n; ++c) tr_set_contact(s, c, met[c].was), tr_touch_of(s, c)->unloaded = met[c].touched && !met[c].was;
    tr_evaluate_maps_at(s, s->clock.t, y);
    if (s->k->sets) tr_set_row_kinds(s);
    return code;
  }
  for (int c = 0; c < n; ++c) hits |= met[c].approach < 0.0;
  tr_limit_step_by_flights(s, met, hits);
  tr_log_contacts(s, met);
  tr_log_mode_changes(s, s->clock.t, modes, 0);
  tr_audit_allow_change(s, energy);
  return TR_OK;
}

/* TR_FAIL_PENETRATION if the gap of an open contact is below -most × max(length, 1 m), otherwise TR_OK. gap, rate: receive all gaps
 * and their rates. */
static int tr_check_penetration(tr_sim *s, double most, double *gap, double *rate) {
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
  double gap[s->k->nunilateral + 1], rate[s->k->nunilateral + 1];
  const int code = tr_check_penetration(s, TOUCHES, gap, rate);
  return code == TR_OK ? tr_decide_contacts(s) : code;
}

static int tr_pass_mouth(tr_sim *s, int stop) {
  const int enters = !tr_is_pressed(s, stop);
  *tr_stop_flag(s, stop) = enters ? TR_STOP_PRESSED : TR_STOP_OPEN;
  return enters ? tr_start_contacts(s) : tr_decide_contacts(s);
}

static int tr_check_missed_contacts(tr_sim *s, double *gap, double *rate) {
  return s->k->nunilateral ? tr_check_penetration(s, PENETRATED, gap, rate) : TR_OK;
}

static double tr_longest_open_step(const tr_sim *s) {
  double pace = s->friction.pace;
  int open = 0;
  for (int c = 0; c < s->k->nunilateral; ++c) open |= tr_is_contact_open(s, c) && !tr_is_contact_unloaded(s, c);
  for (int i = 0; i < s->k->nv && open; ++i)
    if (s->k->vkind[i] == TR_COORDINATE_ANGLE) pace = fmax(pace, fabs(TR_A(s, y)[s->k->nq + i]) / TURN);
  return open && pace > 0.0 ? OPEN_PART / pace : INFINITY;
}

static int tr_has_contact_to_decide(tr_sim *s, const double *gap, const double *rate) {
  int any = 0;
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (!tr_is_contact_open(s, c)) any |= tr_normal_force(s, c) < -LIFTS * TOL_LIFT * tr_force_unit(s);
    else if (!tr_is_contact_away(s, c) && !tr_is_contact_unloaded(s, c)) any |= gap[c] < 0.0 && rate[c] < -STILL * tr_speed_unit(s);
  return any;
}
