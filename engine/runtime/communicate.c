/* Runs driven from outside in steps of another's choosing (co-simulation): the accepted step may reach beyond the time asked for and
 * then waits; rows inside it come from its dense output. So the internal step sizes are those of one uninterrupted run, unless a
 * change from outside (inputs, parameters) cuts the waiting step short. */
#include "modes.h"

/* The state at t inside the waiting step, in the block's yout. */
static int tr_inside(tr_sim *s, double t) {
  if (!tr_have_dense(s)) return 0;
  tr_state_inside(s, (t - s->step.t0) / s->step.size, TR_A(s, yout));
  return 1;
}

/* The row of the event up to which the waiting step goes, as it was up to there. */
static void tr_row_before(tr_sim *s, double *row) {
  double kept[tr_solution_size(s)];
  tr_keep_solution(s, kept);
  if (tr_event_row(s, s->pending.t, row) != TR_OK) row[0] = NAN;
  tr_put_solution(s, kept);
}

/* Go on until the run covers t and write the row there; steps may reach up to `limit` ≥ t. TR_DONE, or TR_MORE when max_steps are
 * not enough, or a failure (which stays). each: no further than to the next event that is recorded, TR_EVENT then; before: room for
 * the row up to the event at which a step last ended (0: not wanted). */
static int tr_cover(tr_sim *s, double t, double limit, long max_steps, double *row, int each, double *before) {
  const double close = tr_same_time(t);
  if (s->clock.status >= TR_FAIL_NOT_FINITE) return s->clock.status;
  s->clock.every = s->clock.row_next = INFINITY;
  for (long step = 0;;) {
    if (each && s->events.count) return tr_row(s, row) == TR_OK ? TR_EVENT : TR_FAIL_MULTIPLIERS;
    if (s->pending.kind != TR_NOTHING && s->pending.t > t + close) {
      int code = tr_inside(s, t) ? tr_output(s, t, TR_A(s, yout), row) : TR_FAIL_MULTIPLIERS;
      return s->clock.status = code == TR_OK ? TR_DONE : code;
    }
    if (s->pending.kind != TR_NOTHING) {
      long count = 0;
      if (before && s->pending.kind == TR_STEP_TO_EVENT) tr_row_before(s, before);
      int code = tr_finish(s, 0, 0, &count);
      if (tr_goes_on(s, code)) continue;
      if (code != TR_OK) return tr_end(s, code);
      if (s->events.count > s->events.capacity - 2 * tr_watched(s) - 2) s->events.count = 0;
    }
    if (s->clock.t >= t - close) {
      int code = tr_row(s, row);
      return s->clock.status = code == TR_OK ? TR_DONE : code;
    }
    if (step++ >= max_steps) return TR_MORE;
    int code = tr_attempt(s, tr_limit_time(s, limit));
    if (code == TR_NEED_JACOBIAN) {
      s->clock.status = TR_OK;
      return code;
    }
    if (tr_goes_on(s, code)) continue;
    if (code != TR_OK) return tr_end(s, code);
  }
}

/* The same for hosts that do not stop at events. */
int tr_reach(tr_sim *s, double t, double limit, long max_steps, double *row) { return tr_cover(s, t, limit, max_steps, row, 0, 0); }

/* The same for hosts that do: TR_EVENT at the next event that is recorded, with the row just after it. */
int tr_reach_event(tr_sim *s, double t, double limit, long max_steps, double *row, double *before) {
  return tr_cover(s, t, limit, max_steps, row, 1, before);
}

/* When the next step ends that the run makes by itself, s: it waits then. `limit` where none can be made, which shows when the run goes on. */
double tr_next_end(tr_sim *s, double limit) {
  if (s->clock.status >= TR_FAIL_NOT_FINITE) return limit;
  if (s->pending.kind == TR_NOTHING && tr_attempt(s, tr_limit_time(s, limit)) != TR_OK) return limit;
  return s->pending.kind == TR_NOTHING ? limit : s->pending.t;
}

/* Whether pair i is in the proportional zone of its law; *turned: when its sliding turned round inside (not a number: it has not so far, or
 * in the waiting step). A reversal is recorded only when the zone is left. */
int tr_within_zone(const tr_sim *s, int i, double *turned) {
  *turned = tr_zone_of(s, i)->reversal;
  return tr_zone_of(s, i)->inside != 0;
}

/* Make t, inside the waiting step, the block's own time: what lies beyond it is forgotten. TR_OK or a failure. */
int tr_cut(tr_sim *s, double t) {
  if (s->pending.kind == TR_NOTHING) return TR_OK;
  double theta = (t - s->step.t0) / s->step.size;
  if (s->k->nsliders && !s->pending.noted) tr_note_reversals(s, theta);
  if (!tr_inside(s, t) || !tr_project(s, t, TR_A(s, yout))) return s->clock.status = TR_FAIL_CLOSURE;
  s->step.h = s->pending.h * fmin(s->pending.grow, 1.0);
  s->pending.kind = TR_NOTHING, s->pending.noted = 0;
  tr_shift(s, t, TR_A(s, yout));
  s->step.have_k1 = s->step.have_jac = s->step.have_dense = 0;
  return TR_OK;
}

/* Take the run up again at the block's (t, y) after a change from outside; `anew`: of parameters, so that the modes are decided
 * again. TR_OK or a failure. */
int tr_resume(tr_sim *s, int anew) {
  s->step.have_k1 = s->step.have_jac = s->step.have_dense = 0;
  if (!anew) return TR_OK;
  const double energy = tr_audit_now(s); /* the constants are still those of the old ones */
  tr_set_parameters(s);
  int code = s->set.evaluations > 0 ? TR_OK : tr_start_modes(s); /* a bounded step decides itself about what is at rest */
  tr_audit_excuse(s, energy);
  if (code != TR_OK) s->clock.status = code;
  return code;
}

/* Where an external input is kept (see tr_input_signal), and its value and derivatives at t. */
tr_input *tr_input_record(tr_sim *s, int input) { return (tr_input *)tr_table_of(s, input); }

void tr_input_value(const tr_input *record, double t, tr_signal *value) { tr_input_signal(record, t, value); }
