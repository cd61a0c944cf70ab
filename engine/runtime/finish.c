/* Completing the step that waits: the output rows inside it, then the state and the modes at its end, from which the next one starts. */
#include "modes.h"

#define ROW_SLACK 1e-12       /* of the time, at least of 1 s: a row this far beyond the end of a step is a row at its end */
#define SAME_EVENT_TIME 1e-12 /* of the time, at least of 1 s: events closer to each other than that chatter */
#define HALVES_MOST 60        /* bisections on θ: they reach its round-off */
#define THETA_ROUND_OFF 1e-15
#define RATE_PART 1e-3 /* of the step: over so much of it the slowing at its end is measured */
#define ZONE_PART 2.2  /* of the time to the kink: a first step inside the proportional zone ends a little beyond its other side */

/* How far apart the time of a row and the end of a step may be for the row to be at that end. */
static double tr_row_slack(double t) { return ROW_SLACK * fmax(1.0, fabs(t)); }

#include "fours.c"

/* Count events that follow each other at (nearly) the same time. */
static void tr_note_chatter(tr_sim *s, double t) {
  s->events.chatter = t - s->events.chatter_t < SAME_EVENT_TIME * fmax(1.0, fabs(t)) ? s->events.chatter + 1 : 0;
  s->events.chatter_t = t;
}

/* The state at the end of the step just made; the multipliers there are put where Newton's iteration begins. */
static void tr_end_state(tr_sim *s, double *out) {
  tr_copy(tr_width(s), TR_A(s, ynew), out);
  tr_copy(tr_nz(s), TR_A(s, zend), TR_A(s, z));
}

/* The row of an event that cuts the step short, as it was up to there. */
static int tr_event_row(tr_sim *s, double t, double *row) {
  double *y = TR_A(s, yout);
  tr_mode modes[s->k->nsliders + 1];
  tr_event_state(s, t, y);
  int there = tr_back_on_branch(s, y);
  tr_keep_modes(s, modes);
  if (s->k->sets && tr_keep_directions(s, t, y)) there = 0;
  if (s->k->sets) tr_keep_shares(s, t, y);
  int code = tr_output_of(s, t, y, row, there);
  tr_put_modes(s, modes);
  return code;
}

/* Rows whose time lies in (…, t_end] of the step whose dense output is available, and the step's end itself when `every` is 0: the
 * end of the whole step, or where an event cuts it short (as it was up to there; not where that comes at once: modes that held for no time
 * are no state of the mechanism). */
static int tr_rows(tr_sim *s, double t_end, int final, double *rows, long capacity, long *count) {
  if (s->clock.width == 0) return TR_OK;
  int width = s->clock.width;
  if (s->clock.every <= 0.0) {
    if (!final && t_end - s->step.t0 <= tr_same_time(t_end)) return TR_OK;
    if (*count >= capacity) return TR_ROWS_FULL;
    double *row = rows + width * *count;
    if (final) tr_end_state(s, TR_A(s, yout));
    int code = final ? tr_output(s, t_end, TR_A(s, yout), row) : tr_event_row(s, t_end, row);
    if (code != TR_OK) return code;
    ++*count;
    return TR_OK;
  }
  while (s->clock.row_next <= t_end + (final ? tr_row_slack(t_end) : 0.0)) {
    if (*count >= capacity) return TR_ROWS_FULL;
    const int made = tr_rows_at_once(s, t_end, rows + width * *count, capacity - *count);
    if (made) {
      *count += made, s->clock.row_index += made;
      s->clock.row_next = s->clock.start + s->clock.row_index * s->clock.every;
      continue;
    }
    double *y = TR_A(s, yout), theta = (s->clock.row_next - s->step.t0) / s->step.size, t = s->clock.row_next;
    if (final && fabs(t - (s->step.t0 + s->step.size)) <= tr_row_slack(t)) {
      tr_end_state(s, y);
    } else {
      if (!tr_have_dense(s)) return TR_FAIL_MULTIPLIERS;
      tr_state_inside(s, theta, y);
    }
    int code = tr_output(s, t, y, rows + width * *count);
    if (code != TR_OK) return code;
    ++*count;
    s->clock.row_index++;
    s->clock.row_next = s->clock.start + s->clock.row_index * s->clock.every;
  }
  return TR_OK;
}

/* While a slider passes through its proportional zone, note when its velocity along the old direction vanishes. */
static void tr_note_reversals(tr_sim *s, double theta_end) {
  double *y = TR_A(s, yout);
  for (int i = 0; i < s->k->nsliders; ++i) {
    tr_zone *zone = tr_zone_of(s, i);
    if (!zone->inside || zone->reversal == zone->reversal) continue;
    if (theta_end < 1.0 && !tr_have_dense(s)) return;
    if (theta_end < 1.0) tr_dense_eval(s, theta_end, y);
    tr_maps_at(s, s->step.t0 + theta_end * s->step.size, theta_end < 1.0 ? y : TR_A(s, ynew));
    if (tr_along(s, i) >= 0.0) continue;
    if (!tr_have_dense(s)) return;
    double a = 0.0, b = theta_end;
    for (int it = 0; it < HALVES_MOST && b - a > THETA_ROUND_OFF; ++it) {
      double m = 0.5 * (a + b), t = s->step.t0 + m * s->step.size;
      tr_dense_eval(s, m, y);
      tr_maps_at(s, t, y);
      if (tr_along(s, i) < 0.0) b = m; else a = m;
    }
    zone->reversal = s->step.t0 + b * s->step.size;
  }
}

/* Make (t, y) the state the run is at. */
static void tr_shift(tr_sim *s, double t, const double *y) {
  int n = tr_width(s);
  if (y != TR_A(s, y)) tr_copy(n, y, TR_A(s, y));
  s->clock.t = t;
  s->step.margin = NAN, s->step.far_known = 0, s->loops.known = 0, s->step.parts = 0;
  while (s->clock.next_break < s->clock.nbreaks && TR_A(s, breaks)[s->clock.next_break] <= t + tr_same_time(t)) {
    s->clock.next_break++;
    s->step.have_k1 = 0;
  }
  tr_forget_extremes(s);
}

/* Complete a whole step: it becomes the start of the next. */
static void tr_finish_whole(tr_sim *s) {
  const int n = tr_width(s), end = tr_method_of(s)->end;
  s->events.chatter = 0;
  s->stats.of_method[s->step.method]++;
  tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
  if (tr_chooses(s) && !s->step.aside) tr_choose(s);
  tr_copy(n, TR_A(s, K) + end * n, TR_A(s, K));
  if (s->friction.still) tr_keep_still(s, TR_A(s, ynew));
  tr_shift(s, s->pending.t, TR_A(s, ynew));
  tr_follow_loops(s);
  s->step.margin = s->step.margin_end;
  tr_note_far(s, TR_AT_END, TR_AT_START);
  tr_size_next(s);
}

/* Complete a step of impulses; the next one starts from its own multipliers, whatever rows were written. */
static void tr_finish_impulses(tr_sim *s) {
  if (s->set.hfixed <= 0.0) tr_copy(tr_nz(s), TR_A(s, zend), TR_A(s, z));
  tr_audit_impulses(s, s->pending.t, TR_A(s, ynew));
  tr_shift(s, s->pending.t, TR_A(s, ynew));
  tr_size_next(s);
  s->step.have_k1 = 0;
}

/* Complete a step that ends where a pair with a set-valued law changes its mode. */
static int tr_finish_set(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, cand);
  const int which = s->pending.which;
  const tr_branch was = tr_branch_before(s, which);
  if (!s->pending.captured) tr_copy(tr_nz(s), TR_A(s, zbeyond), TR_A(s, zend));
  double before[tr_width(s)];
  tr_mode modes[s->k->nsliders];
  s->friction.capture = s->friction.missed = -1;
  tr_dense_state(s, s->pending.theta, ye);
  if (!tr_evaluate_before(s, te, ye)) return TR_FAIL_MULTIPLIERS;
  if (tr_needs_sharpening(s, which)) tr_sharpen(s, which, &te, ye);
  tr_keep_modes(s, modes), memcpy(before, ye, sizeof before);
  tr_crosses(s, which);
  const int ball = !s->pending.captured && tr_moving_ball(s, which);
  tr_contact contacts[s->o ? s->o->ncontacts + 1 : 1];
  const tr_contact *known = !ball && tr_contacts_before(s, te, ye, contacts) ? contacts : 0;
  if (!ball && !s->pending.captured && tr_slides(s, which)) tr_note_same(s, which);
  int code = ball ? tr_meets_cone(s, te, ye, which) : tr_settle(s, te, ye, which, known);
  tr_forget_ends(s);
  if (code != TR_OK) { /* this is where it ends, or goes on by an impact: as it was before anything was brought to rest */
    tr_put_modes(s, modes);
    tr_shift(s, te, before);
    s->friction.failed = which;
    return code;
  }
  if (ball) tr_log_fold(s, which, te, ye, &was);
  s->stats.events++;
  s->moreau.burst_events += ball; /* a ball's branches are no events that accumulate: in steps of impulses it has the same two */
  tr_note_chatter(s, te);
  tr_shift(s, te, ye);
  if (s->step.margin_end == s->step.margin_end) tr_note_far(s, TR_NOW, TR_AT_START);
  memcpy(TR_A(s, K), TR_A(s, dy), sizeof(double) * tr_width(s));
  s->step.have_k1 = 1, s->step.have_jac = 0, s->step.margin = s->step.margin_end;
  s->step.h = s->set.hfixed > 0.0 ? s->set.hfixed : s->pending.h * fmin(s->pending.grow, 1.0);
  return TR_OK;
}

/* Complete a step that ends at an event: the state there, the new mode, and a fitting next step. */
static int tr_finish_event(tr_sim *s) {
  double te = s->pending.t, *ye = TR_A(s, cand), *yo = TR_A(s, yout), *dy = TR_A(s, dy);
  int i = s->pending.which, pair = i < s->k->nsliders;
  if (pair && tr_is_set(s, i)) return tr_finish_set(s);
  tr_dense_state(s, s->pending.theta, ye);
  const tr_branch was = tr_branch_before(s, i);
  tr_copy(tr_nz(s), TR_A(s, zbeyond), TR_A(s, zend));
  double rate = 0.0, kink = 1.0, dt = fmin(s->pending.theta, RATE_PART) * s->step.size;
  if (pair && tr_slides(s, i) && dt > 0.0) { /* how fast the proportional zone will be crossed */
    tr_dense_state(s, s->pending.theta - dt / s->step.size, yo);
    if (!tr_rhs(s, te - dt, yo, dy)) return TR_FAIL_MULTIPLIERS;
    rate = tr_sliding_of(s, i)->speed;
  }
  if (!tr_project(s, te, ye) || !tr_rhs(s, te, ye, dy)) return TR_FAIL_MULTIPLIERS;
  if (pair) kink = tr_sliding_of(s, i)->border, rate = fabs(tr_sliding_of(s, i)->speed - rate) / dt;
  tr_note_chatter(s, te);
  int entering = pair && tr_slides(s, i);
  if (pair && tr_chooses(s)) tr_kink_passed(s);
  tr_crosses(s, i);
  tr_switch(s, i, te, ye);
  if (entering) tr_log_fold(s, i, te, ye, &was);
  tr_shift(s, te, ye);
  s->step.have_k1 = s->step.have_jac = 0;
  double h = s->pending.h * fmin(s->pending.grow, 1.0);
  if (entering) {
    s->step.h_slip = fmax(h, s->step.h_slip);
    s->step.h = rate > 0.0 ? fmin(h, ZONE_PART * kink / rate) : h;
  } else {
    s->step.h = s->step.h_slip > 0.0 ? s->step.h_slip : h;
    s->step.h_slip = 0.0;
  }
  return TR_OK;
}

/* Rows, then completion, of what is pending. May return TR_ROWS_FULL and be called again. */
static int tr_finish(tr_sim *s, double *rows, long capacity, long *count) {
  int pending = s->pending.kind, code;
  if (s->k->nsliders && !s->pending.noted && pending != TR_IMPULSE_STEP)
    tr_note_reversals(s, pending == TR_WHOLE_STEP ? 1.0 : s->pending.theta);
  s->pending.noted = 1;
  double kept[tr_solution_size(s)];
  tr_keep_solution(s, kept);
  code = tr_rows(s, s->pending.t, pending != TR_STEP_TO_EVENT, rows, capacity, count);
  tr_put_solution(s, kept);
  if (code != TR_OK) return code;
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  if (pending == TR_IMPULSE_STEP) tr_finish_impulses(s);
  if (pending == TR_WHOLE_STEP) tr_finish_whole(s);
  code = pending == TR_STEP_TO_EVENT ? tr_finish_event(s) : TR_OK;
  tr_is_clear(s);
  tr_hand_over(s);
  return code;
}
