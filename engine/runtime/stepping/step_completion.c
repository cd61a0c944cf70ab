/* Completion of the pending step: rows inside it, then state and modes at its end. */
#include "stepping/stepping.h"

/* in units of 1 / rate scale: time between two evaluations that measure the stiffness of an engaged stop */
#define ENGAGED_PROBE 1e-6
#define TR_FOURS 8 /* upper bound of the number of SIMD lanes */
#define ROW_SLACK 1e-12 /* relative to max(time, 1 s): if a row is later than a step's end by less, the row belongs to this step */
#define SAME_EVENT_TIME 1e-12 /* relative to max(time, 1 s): consecutive events at a smaller distance in time are chatter */
#define HALVES_MOST 60        /* largest number of bisections on θ; they end at the round-off of θ */
#define THETA_ROUND_OFF 1e-15
#define RATE_PART 1e-3 /* relative to the step: interval before the event over which the deceleration is measured */
/* relative to the time to cross half of the proportional zone: size of the first step inside the zone. The step ends slightly
 * beyond the zone's other border. */
#define ZONE_PART 2.2

/* Whether SIMD lanes can compute the rows inside the pending step. Requires columns that depend only on the dense output,
 * multipliers and accelerations. */
static int tr_has_row_lanes(tr_sim *s) {
  const tr_outputs *o = s->o;
  if (!s->lane || !s->lane->columns || !o || !tr_has_lane(s) || s->step.parts || s->clock.row_index == 0) return 0;
  if (tr_method_of(s)->kind == TR_IMPULSES || o->wants & (TR_WANTS_AUDIT | TR_WANTS_CONTRACTION) || tr_is_limited_by_stability(s)) return 0;
  /* Undetermined reactions require a minimisation in each output row; lanes cannot minimise. */
  return !(o->wants & TR_WANTS_SOLUTION && o->nkappa && s->k->active < s->k->rows);
}

/* Largest time between a row and the end of a step at which both coincide, s. */
static double tr_row_time_tolerance(double t) { return ROW_SLACK * fmax(1.0, fabs(t)); }

/* Times of the next rows before t_end: at most `room` rows, and at most one for each lane. Returns their number. */
static int tr_row_times_ahead(const tr_sim *s, double t_end, long room, double *times) {
  const int width = s->lane->lanes->width;
  for (int i = 0; i < width; ++i) {
    times[i] = s->clock.t_start + (double)(s->clock.row_index + i) * s->clock.every;
    if (i >= room || times[i] >= t_end - tr_row_time_tolerance(t_end)) return i;
  }
  return width;
}

/* Write the next rows before t_end in lanes, even if there is only one. Returns the number of rows written; 0 if lanes cannot
 * compute them. */
static int tr_write_rows_in_lanes(tr_sim *s, double t_end, double *rows, long room) {
  double times[TR_FOURS], extra[TR_DOUBLES(tr_extra) + s->k->nsliders + 1];
  if (!tr_has_row_lanes(s)) return 0;
  const int width = s->lane->lanes->width, wide = s->clock.width, count = tr_row_times_ahead(s, t_end, room, times);
  if (!count || !tr_ensure_dense(s)) return 0;
  tr_request of[TR_FOURS], *each[TR_FOURS];
  tr_fill_extra(s, TR_A(s, ynew), (tr_extra *)extra);
  of[0] = tr_lane_request(s, TR_ASK_ROWS, times[0], TR_A(s, ynew));
  of[0].dense_rows = s->step.dense_rows, of[0].co = TR_A(s, co), of[0].extra = extra;
  of[0].solved = (s->o->wants & TR_WANTS_SOLUTION) != 0, of[0].columns = s->lane->columns;
  for (int i = 0; i < width; ++i) each[i] = of + (i < count ? i : 0);
  for (int i = 0; i < count; ++i) /* lanes read all other fields from the first request */
    of[i].t = times[i], of[i].theta = (times[i] - s->step.t0) / s->step.size, of[i].row = rows + i * wide + 1,
    of[i].projections = of[i].iterations = 0;
  s->lane->lanes->serve(TR_ASK_ROWS, each);
  int made = 0;
  for (; made < count && of[made].ok; ++made) {
    double *row = rows + made * wide;
    row[0] = times[made];
    if (!tr_is_finite(s->o->nout, row + 1)) break; /* the ordinary computation of this row reports the failure */
    tr_finish_columns(s, row + 1);
    s->stats.outputs++, s->stats.projections += of[made].projections;
    s->stats.rhs_evaluations += of[0].solved, s->stats.newton_iterations += of[made].iterations;
  }
  return made;
}

/* Count consecutive events at nearly the same time. */
static void tr_count_chatter(tr_sim *s, double t) {
  s->events.chatter = t - s->events.chatter_t < SAME_EVENT_TIME * fmax(1.0, fabs(t)) ? s->events.chatter + 1 : 0;
  s->events.chatter_t = t;
}

/* Copy the state at the end of the last step. Newton's method then starts from the multipliers of this state. */
static void tr_copy_end_state(tr_sim *s, double *out) {
  tr_copy(tr_state_width(s), TR_A(s, ynew), out);
  tr_copy(tr_z_length(s), TR_A(s, zend), TR_A(s, z));
  TR_MADE(s, TR_HAS_SOLUTION);
}

static int tr_write_event_row(tr_sim *s, double t, double *row) {
  double *y = TR_A(s, yout);
  tr_mode modes[s->k->nsliders + 1];
  tr_event_state(s, t, y);
  int there = tr_step_back_to_branch(s, y);
  tr_save_modes(s, modes);
  if (s->k->sets && tr_restore_directions_before(s, t, y)) there = 0;
  if (s->k->sets) tr_restore_shares_before(s, t, y);
  int code = tr_output_row_of(s, t, y, row, there);
  tr_restore_modes(s, modes);
  return code;
}

/* Divide the step up to t_end into −`every` equal parts (at least 1), and write a row at the end of each. The last row is at the
 * end of the step (`final`), or just before the event that cuts the step short. An event at the start of a step gets no row before
 * it, because the old modes had no duration. Returns TR_OK, TR_ROWS_FULL or a failure. */
static int tr_write_rows_of_step(tr_sim *s, double t_end, int final, double *rows, long capacity, long *count) {
  const double begin = s->step.t0, span = t_end - begin;
  const long parts = s->clock.every < -1.0 ? (long)-s->clock.every : 1;
  if (!final && span <= tr_time_tolerance(t_end)) return TR_OK;
  for (; s->clock.part < parts; ++s->clock.part, ++*count) {
    if (*count >= capacity) return TR_ROWS_FULL;
    const int last = s->clock.part == parts - 1, inside = !last || final;
    const double t = last ? t_end : begin + span * (s->clock.part + 1) / parts;
    double *row = rows + s->clock.width * *count, *y = TR_A(s, yout);
    if (!last && !tr_ensure_dense(s)) return TR_FAIL_MULTIPLIERS;
    if (last && final) tr_copy_end_state(s, y);
    if (!last) tr_state_in_step(s, (t - begin) / s->step.size, y);
    const int code = inside ? tr_output_row(s, t, y, row) : tr_write_event_row(s, t, row);
    if (code != TR_OK) return code;
  }
  s->clock.part = 0;
  return TR_OK;
}

/* Write rows up to t_end from the dense output. If `every` is at most 0, the times of the rows depend on the steps. Returns TR_OK,
 * TR_ROWS_FULL or a failure. */
static int tr_write_rows(tr_sim *s, double t_end, int final, double *rows, long capacity, long *count) {
  if (s->clock.width == 0) return TR_OK;
  int width = s->clock.width;
  if (s->clock.every <= 0.0) return tr_write_rows_of_step(s, t_end, final, rows, capacity, count);
  while (s->clock.row_next <= t_end + (final ? tr_row_time_tolerance(t_end) : 0.0)) {
    if (*count >= capacity) return TR_ROWS_FULL;
    const int made = tr_write_rows_in_lanes(s, t_end, rows + width * *count, capacity - *count);
    if (made) {
      *count += made, s->clock.row_index += made;
      s->clock.row_next = s->clock.t_start + s->clock.row_index * s->clock.every;
      continue;
    }
    double *y = TR_A(s, yout), theta = (s->clock.row_next - s->step.t0) / s->step.size, t = s->clock.row_next;
    if (final && fabs(t - (s->step.t0 + s->step.size)) <= tr_row_time_tolerance(t)) {
      tr_copy_end_state(s, y);
    } else {
      if (!tr_ensure_dense(s)) return TR_FAIL_MULTIPLIERS;
      tr_state_in_step(s, theta, y);
    }
    int code = tr_output_row(s, t, y, rows + width * *count);
    if (code != TR_OK) return code;
    ++*count;
    s->clock.row_index++;
    s->clock.row_next = s->clock.t_start + s->clock.row_index * s->clock.every;
  }
  return TR_OK;
}

static void tr_record_reversals(tr_sim *s, double theta_end) {
  double *y = TR_A(s, yout);
  for (int i = 0; i < s->k->nsliders; ++i) {
    tr_zone *zone = tr_zone_of(s, i);
    if (!zone->inside || zone->reversal == zone->reversal) continue;
    if (theta_end < 1.0 && !tr_ensure_dense(s)) return;
    if (theta_end < 1.0) tr_evaluate_dense(s, theta_end, y);
    tr_evaluate_maps_at(s, s->step.t0 + theta_end * s->step.size, theta_end < 1.0 ? y : TR_A(s, ynew));
    if (tr_speed_along_entry(s, i) >= 0.0) continue;
    if (!tr_ensure_dense(s)) return;
    double a = 0.0, b = theta_end;
    for (int it = 0; it < HALVES_MOST && b - a > THETA_ROUND_OFF; ++it) {
      double m = 0.5 * (a + b), t = s->step.t0 + m * s->step.size;
      tr_evaluate_dense(s, m, y);
      tr_evaluate_maps_at(s, t, y);
      if (tr_speed_along_entry(s, i) < 0.0) b = m; else a = m;
    }
    zone->reversal = s->step.t0 + b * s->step.size;
  }
}

static void tr_move_run_to(tr_sim *s, double t, const double *y) {
  int n = tr_state_width(s);
  if (y != TR_A(s, y)) tr_copy(n, y, TR_A(s, y));
  s->clock.t = t;
  s->step.margin = NAN, s->step.far_known = 0, s->loops.known = 0, s->step.parts = 0;
  if (tr_pass_breaks(s, t + tr_time_tolerance(t))) s->step.have_k1 = 0;
  tr_clear_extremes(s);
  tr_follow_angles(s, t, TR_A(s, y));
}

static void tr_complete_whole_step(tr_sim *s) {
  const int n = tr_state_width(s), end = tr_method_of(s)->end;
  s->events.chatter = 0;
  s->stats.of_method[s->step.method]++;
  tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
  if (tr_is_auto(s) && !s->step.explicit_for_now) tr_choose_method(s);
  else if (!tr_is_auto(s) && tr_method_of(s)->kind == TR_EXPLICIT && s->set.hfixed <= 0.0) s->stats.stiff += tr_is_step_stiff(s);
  tr_copy(n, TR_A(s, K) + end * n, TR_A(s, K));
  if (s->friction.held) tr_zero_held_rates(s, TR_A(s, ynew));
  tr_record_dead_centre(s);
  tr_move_run_to(s, s->pending.t, TR_A(s, ynew));
  tr_store_independence(s);
  s->step.margin = s->step.margin_end;
  tr_copy_violations(s, TR_AT_END, TR_AT_START);
  tr_set_next_step(s);
}

/* Complete an impulse step. Newton's method of the next step starts from this step's multipliers, not from those of rows. Rows
 * therefore do not influence the motion. */
static void tr_complete_impulse_step(tr_sim *s) {
  if (s->set.hfixed <= 0.0) tr_copy(tr_z_length(s), TR_A(s, zend), TR_A(s, z));
  tr_audit_impulses(s, s->pending.t, TR_A(s, ynew));
  tr_move_run_to(s, s->pending.t, TR_A(s, ynew));
  tr_set_next_step(s);
  s->step.have_k1 = 0;
}

/* Log separations between the start of the step and its event at the evaluated state (t, y). now: contacts at the event. If the
 * search has evaluated other states, evaluates y again. */
static void tr_log_separations_before_event(tr_sim *s, double t, const double *y, const tr_contact *now) {
  double kept[tr_solution_size(s)];
  tr_save_solution(s, kept);
  if (s->pending.captured || !tr_log_separations(s, s->pending.theta, now)) return;
  tr_restore_solution(s, kept);
  tr_rhs(s, t, y, TR_A(s, dy));
}

/* Complete a step that ends at the event of a set-valued pair. Returns a status. */
static int tr_complete_set_valued_event(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, event_y);
  const int which = s->pending.which;
  const tr_branch was = tr_evaluate_branch_before(s, which);
  if (!s->pending.captured) tr_copy(tr_z_length(s), TR_A(s, zbeyond), TR_A(s, zend));
  double before[tr_state_width(s)];
  tr_mode modes[s->k->nsliders];
  s->friction.capture = s->friction.cutting_pair = -1;
  tr_dense_state(s, s->pending.theta, ye);
  if (!tr_evaluate_before_event(s, te, ye)) return TR_FAIL_MULTIPLIERS;
  if (tr_is_refinement_needed(s, which)) tr_refine_event_time(s, which, &te, ye);
  tr_save_modes(s, modes), memcpy(before, ye, sizeof before);
  tr_set_crossing_margin(s, which);
  const int ball = !s->pending.captured && tr_is_moving_ball(s, which);
  tr_contact contacts[s->o ? s->o->ncontacts + 1 : 1];
  const tr_contact *known = !ball && tr_contacts_before_event(s, te, ye, contacts) ? contacts : 0;
  if (known) tr_log_separations_before_event(s, te, ye, known);
  if (!ball && !s->pending.captured && tr_is_sliding(s, which)) tr_mark_pairs_stopping_at_once(s, which);
  int code = ball ? tr_handle_cone_event(s, te, ye, which) : tr_handle_event(s, te, ye, which, known);
  tr_clear_stopping_marks(s);
  if (code != TR_OK) { /* y is the state before the event; from y, the run continues with an impact, or ends */
    tr_restore_modes(s, modes);
    tr_move_run_to(s, te, before);
    s->friction.failed = which;
    return code;
  }
  if (ball) tr_log_fold(s, which, te, ye, &was);
  s->stats.events++;
  s->moreau.burst_events += ball; /* branch changes of balls are not counted, because impulse steps do not avoid these events */
  tr_count_chatter(s, te);
  const double breaks = s->clock.last_break;
  tr_move_run_to(s, te, ye);
  if (s->step.margin_end == s->step.margin_end) tr_copy_violations(s, TR_NOW, TR_AT_START);
  memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_state_width(s));
  s->step.have_k1 = s->clock.last_break == breaks; /* at a break of a signal, the next step must evaluate ẏ again */
  s->step.have_jac = 0, s->step.margin = s->step.margin_end;
  s->step.h = s->set.hfixed > 0.0 ? s->set.hfixed : s->pending.h * fmin(s->pending.grow, 1.0);
  return TR_OK;
}

/* Longest step after a stop was engaged: 1 / ω of the fastest oscillation on this stop. A stiff method damps an oscillation that
 * its steps do not resolve, and its error estimate does not show the damping. Returns INFINITY for explicit methods. */
static double tr_longest_engaged_step(tr_sim *s, int which) {
  const int n = tr_state_width(s), nq = s->k->nq, nv = s->k->nv;
  const double h = ENGAGED_PROBE / s->set.rate, *y = TR_A(s, y);
  double first[nv + 1], fastest = 0.0, *next = TR_A(s, ytmp), *dy = TR_A(s, dy);
  if (which < s->k->nsliders || !tr_is_pressed(s, which - s->k->nsliders) || tr_is_hook(s, which - s->k->nsliders)) return INFINITY;
  if (tr_method_of(s)->kind != TR_IMPLICIT || s->set.hfixed > 0.0 || !tr_rhs(s, s->clock.t, y, dy)) return INFINITY;
  tr_copy(nv, dy + nq, first);
  for (int i = 0; i < n; ++i) next[i] = y[i] + h * dy[i];
  if (!tr_rhs(s, s->clock.t + h, next, dy)) return INFINITY;
  for (int i = 0; i < nv; ++i) {
    const double v = y[nq + i], change = dy[nq + i] - first[i];
    if (change * v < 0.0) fastest = fmax(fastest, -change / (v * h)); /* ω² */
  }
  return fastest > 0.0 ? 1.0 / sqrt(fastest) : INFINITY;
}

/* Complete a step that ends at an event of a joint that only pushes. At the event, a contact opens or closes, or a pin passes a
 * mouth of its slot. Returns a status. */
static int tr_complete_contact_event(tr_sim *s) {
  const double te = s->pending.t;
  double *ye = TR_A(s, event_y);
  tr_contact contacts[s->o ? s->o->ncontacts + 1 : 1];
  tr_dense_state(s, s->pending.theta, ye);
  tr_copy(tr_z_length(s), TR_A(s, zbeyond), TR_A(s, zend));
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, TR_A(s, dy))) return TR_FAIL_MULTIPLIERS;
  if (s->o && s->o->ncontacts && tr_current_contacts(s, ye, contacts)) {
    tr_log_separations_before_event(s, te, ye, contacts);
    memcpy(TR_A(s, contacts), contacts, sizeof(tr_contact) * s->o->ncontacts);
  }
  tr_count_chatter(s, te);
  tr_set_crossing_margin(s, s->pending.which);
  tr_move_run_to(s, te, ye);
  s->step.h = s->set.hfixed > 0.0 ? s->set.hfixed : s->pending.h * fmin(s->pending.grow, 1.0);
  const int stop = s->pending.which - s->k->nsliders;
  return tr_contact_of_mouth(s, stop) >= 0 ? tr_pass_mouth(s, stop) : tr_decide_contacts(s);
}

/* Complete a step that ends at an event: set the state, the new mode and the size of the next step. Returns a status. */
static int tr_complete_event(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, event_y), *yo = TR_A(s, yout), *dy = TR_A(s, dy);
  int i = s->pending.which, pair = i < s->k->nsliders;
  if (pair && tr_is_set_valued(s, i)) return tr_complete_set_valued_event(s);
  const int stop = i - s->k->nsliders;
  if (!pair && (tr_contact_of_stop(s, stop) >= 0 || tr_contact_of_mouth(s, stop) >= 0)) return tr_complete_contact_event(s);
  tr_dense_state(s, s->pending.theta, ye);
  const tr_branch was = tr_evaluate_branch_before(s, i);
  tr_copy(tr_z_length(s), TR_A(s, zbeyond), TR_A(s, zend));
  double rate = 0.0, kink = 1.0, dt = fmin(s->pending.theta, RATE_PART) * s->step.size;
  if (pair && tr_is_sliding(s, i) && dt > 0.0) { /* measure how fast the pair will cross the proportional zone */
    tr_dense_state(s, s->pending.theta - dt / s->step.size, yo);
    if (!tr_rhs(s, te - dt, yo, dy)) return TR_FAIL_MULTIPLIERS;
    rate = tr_sliding_of(s, i)->speed;
  }
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, dy)) return TR_FAIL_MULTIPLIERS;
  tr_contact contacts[s->o ? s->o->ncontacts + 1 : 1];
  if (s->o && s->o->ncontacts && tr_current_contacts(s, ye, contacts)) {
    tr_log_separations_before_event(s, te, ye, contacts);
    memcpy(TR_A(s, contacts), contacts, sizeof(tr_contact) * s->o->ncontacts);
  }
  if (pair) kink = tr_sliding_of(s, i)->border, rate = fabs(tr_sliding_of(s, i)->speed - rate) / dt;
  tr_count_chatter(s, te);
  int entering = pair && tr_is_sliding(s, i);
  if (pair && tr_is_auto(s)) tr_count_kink(s);
  tr_set_crossing_margin(s, i);
  tr_switch_mode(s, i, te, ye);
  if (entering) tr_log_fold(s, i, te, ye, &was);
  tr_move_run_to(s, te, ye);
  s->step.have_k1 = s->step.have_jac = 0;
  double h = s->pending.h * fmin(s->pending.grow, 1.0);
  if (entering) {
    s->step.h_slip = fmax(h, s->step.h_slip);
    s->step.h = rate > 0.0 ? fmin(h, ZONE_PART * kink / rate) : h;
  } else {
    s->step.h = s->step.h_slip > 0.0 ? s->step.h_slip : h;
    s->step.h_slip = 0.0;
  }
  s->step.h = fmin(s->step.h, tr_longest_engaged_step(s, i));
  return TR_OK;
}

/* Whether the case must wait for lanes, which compute the extra stages of the dense output for rows inside the pending step. */
static int tr_wait_for_rows(tr_sim *s) {
  const tr_method *m = tr_method_of(s);
  if (!s->lane || s->step.have_dense || m->kind != TR_EXPLICIT || !m->explicit->extra || s->pending.kind == TR_IMPULSE_STEP) return 0;
  const int inside = s->clock.width && s->clock.every > 0.0 && s->clock.row_next < s->pending.t - tr_row_time_tolerance(s->pending.t);
  return inside && tr_wait_for_dense(s);
}

static int tr_complete_step(tr_sim *s, double *rows, long capacity, long *count) {
  int pending = s->pending.kind, code;
  if (tr_wait_for_rows(s)) return TR_WAITS;
  if (s->k->nsliders && !s->pending.noted && pending != TR_IMPULSE_STEP)
    tr_record_reversals(s, pending == TR_WHOLE_STEP ? 1.0 : s->pending.theta);
  s->pending.noted = 1;
  double kept[tr_solution_size(s)];
  tr_save_solution(s, kept);
  code = tr_write_rows(s, s->pending.t, pending != TR_STEP_TO_EVENT, rows, capacity, count);
  tr_restore_solution(s, kept);
  if (code != TR_OK) return code;
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  if (pending == TR_IMPULSE_STEP) tr_complete_impulse_step(s);
  if (pending == TR_WHOLE_STEP) tr_complete_whole_step(s);
  code = pending == TR_STEP_TO_EVENT ? tr_complete_event(s) : TR_OK;
  tr_clear_margin(s);
  tr_choose_moreau(s);
  return code;
}
