/* Co-simulation: the host chooses communication points. An accepted step may extend beyond the requested time. The step then waits,
 * and rows inside it come from the dense output. Internal steps are therefore the same as in an uninterrupted run. Only a change of
 * inputs or parameters cuts the waiting step. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

/* Compute the state at t inside the waiting step, in yout. Returns 0 on failure. */
static int tr_evaluate_state_at(tr_sim *s, double t) {
  if (!tr_ensure_dense(s)) return 0;
  tr_state_in_step(s, (t - s->step.t0) / s->step.size, TR_A(s, yout));
  return 1;
}

/* Write the row just before the event at the end of the waiting step. On failure, the time in the row is NaN. */
static void tr_write_row_before(tr_sim *s, double *row) {
  double kept[tr_solution_size(s)];
  tr_save_solution(s, kept);
  if (tr_write_event_row(s, s->pending.t, row) != TR_OK) row[0] = NAN;
  tr_restore_solution(s, kept);
}

/* Run until t and write the row at t; null pointer: no row is requested. Steps may extend up to `limit` ≥ t. each: whether to end
 * at the next logged event, too, with TR_EVENT. `before` receives the row just before the last event that ended a step; null
 * pointer: not requested. Returns TR_DONE, TR_EVENT, TR_MORE after max_steps steps, TR_NEED_JACOBIAN, or a lasting failure. */
static int tr_reach_time(tr_sim *s, double t, double limit, long max_steps, double *row, int each, double *before) {
  const double close = tr_time_tolerance(t);
  if (s->clock.status >= TR_FAIL_NOT_FINITE) return s->clock.status;
  s->clock.every = s->clock.row_next = INFINITY;
  for (long step = 0;;) {
    if (each && s->events.count) return tr_row(s, row) == TR_OK ? TR_EVENT : TR_FAIL_MULTIPLIERS;
    if (s->pending.kind != TR_NOTHING && s->pending.t > t + close) {
      int code = !row ? TR_OK : tr_evaluate_state_at(s, t) ? tr_output_row(s, t, TR_A(s, yout), row) : TR_FAIL_MULTIPLIERS;
      return s->clock.status = code == TR_OK ? TR_DONE : code;
    }
    if (s->pending.kind != TR_NOTHING) {
      long count = 0;
      if (before && s->pending.kind == TR_STEP_TO_EVENT) tr_write_row_before(s, before);
      int code = tr_complete_step(s, 0, 0, &count);
      if (tr_continue_after_failure(s, code)) continue;
      if (code != TR_OK) return tr_end_run(s, code);
      if (s->events.count > s->events.capacity - 2 * tr_watched_count(s) - 2) s->events.count = 0;
    }
    if (s->clock.t >= t - close && !(each && s->events.count)) {
      int code = row ? tr_row(s, row) : TR_OK;
      return s->clock.status = code == TR_OK ? TR_DONE : code;
    }
    if (step++ >= max_steps) return TR_MORE;
    int code = tr_make_step(s, tr_step_limit(s, limit));
    if (code == TR_NEED_JACOBIAN) {
      s->clock.status = TR_OK;
      return code;
    }
    if (tr_continue_after_failure(s, code)) continue;
    if (code != TR_OK) return tr_end_run(s, code);
  }
}

int tr_reach(tr_sim *s, double t, double limit, long max_steps, double *row) { return tr_reach_time(s, t, limit, max_steps, row, 0, 0); }

int tr_reach_event(tr_sim *s, double t, double limit, long max_steps, double *row, double *before) {
  return tr_reach_time(s, t, limit, max_steps, row, 1, before);
}

double tr_next_end(tr_sim *s, double limit) {
  if (s->clock.status >= TR_FAIL_NOT_FINITE) return limit;
  if (s->pending.kind == TR_NOTHING && tr_make_step(s, tr_step_limit(s, limit)) != TR_OK) return limit;
  return s->pending.kind == TR_NOTHING ? limit : s->pending.t;
}

int tr_within_zone(const tr_sim *s, int i, double *turned) {
  *turned = tr_zone_of(s, i)->reversal;
  return tr_zone_of(s, i)->inside != 0;
}

int tr_cut(tr_sim *s, double t) {
  if (s->pending.kind == TR_NOTHING) return TR_OK;
  double theta = (t - s->step.t0) / s->step.size;
  if (s->k->nsliders && !s->pending.noted) tr_record_reversals(s, theta);
  if (!tr_evaluate_state_at(s, t) || !tr_project(s, t, TR_A(s, yout))) return s->clock.status = TR_FAIL_CLOSURE;
  s->step.h = s->pending.h * fmin(s->pending.grow, 1.0);
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  tr_move_run_to(s, t, TR_A(s, yout));
  s->step.have_k1 = s->step.have_jac = s->step.have_dense = 0;
  return TR_OK;
}

int tr_resume(tr_sim *s, int anew) {
  s->step.have_k1 = s->step.have_jac = s->step.have_dense = 0;
  if (!anew) return TR_OK;
  /* evaluated before the constants change, because this energy depends on the constants of the old parameters */
  const double energy = tr_audit_energy(s);
  tr_set_parameters(s);
  int code = s->set.evaluations > 0 ? TR_OK : tr_set_initial_modes(s); /* a bounded step decides about pairs at rest itself */
  tr_audit_allow_change(s, energy);
  if (code != TR_OK) s->clock.status = code;
  return code;
}

tr_input *tr_input_record(tr_sim *s, int input) { return (tr_input *)tr_table_of(s, input); }

void tr_input_value(const tr_input *record, double t, tr_signal *value) { tr_evaluate_input(record, t, t, value); }
