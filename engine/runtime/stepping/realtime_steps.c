/* Fixed steps for real time, with bounded evaluations, iterations and events (theory, "Bounded steps").
 *
 * A bounded step locates its events until it reaches a bound, or until friction has no solution. One impulse step then covers the
 * rest of the step, with any number of events. The modes of the impulse step are decided within the remaining iterations. If this
 * decision fails, relaxation sweeps over the pairs compute friction within the capacities. `bound.overrun` records which of these
 * methods was used. */
#include "stepping/stepping.h"

/* relative to the friction that stops a freedom without loops: friction applied to a freedom with prescribed motion */
#define FAR_MORE 1e3
#define WHOLE_SLACK 1e-9      /* relative to a step: round-off in the number of steps of a communication step */

/* Limit the work after this call to these numbers of evaluations and iterations. */
static void tr_limit_work(tr_sim *s, long evaluations, long iterations) {
  s->bound.evaluations = tr_counted_evaluations(s) + evaluations;
  s->bound.iterations = tr_counted_iterations(s) + iterations;
  s->ask.cancelled = 0;
}

/* Step to time t with located events. Returns TR_OK. If the step stops earlier, returns the reason; the run is then at the end of
 * the last completed part. */
static int tr_step_with_events(tr_sim *s, double t) {
  const int n = tr_state_width(s), nz = tr_z_length(s);
  double y[n], z[nz + 1];
  tr_mode modes[s->k->nsliders + 1];
  for (int events = 0; s->clock.t < t - tr_time_tolerance(t);) {
    long count = 0;
    memcpy(y, TR_A(s, y), sizeof y), tr_copy(nz, TR_A(s, z), z), tr_save_modes(s, modes);
    int code = tr_make_step(s, tr_step_limit(s, t));
    if (code == TR_OK && s->pending.kind == TR_STEP_TO_EVENT && ++events > s->set.events) code = TR_MORE;
    if (code == TR_OK) code = tr_complete_step(s, 0, 0, &count);
    else memcpy(TR_A(s, y), y, sizeof y), tr_copy(nz, z, TR_A(s, z)), tr_restore_modes(s, modes);
    if (code == TR_OK) continue;
    s->pending.kind = TR_NOTHING, s->pending.noted = 0;
    return code;
  }
  return TR_OK;
}

static void tr_end_bounded_step(tr_sim *s, double t) {
  s->step.t0 = s->clock.t, s->step.size = t - s->clock.t;
  s->stats.steps++, s->stats.of_method[s->step.method]++;
  tr_audit_impulses(s, t, TR_A(s, ynew));
  tr_move_run_to(s, t, TR_A(s, ynew));
  s->step.have_k1 = s->step.have_jac = s->step.have_dense = 0, s->step.h = s->set.hfixed;
  s->friction.capture = s->friction.cutting_pair = -1, s->friction.past_t[0] = NAN;
  tr_clear_stopping_marks(s);
}

/* Step to time t by impulses, with decided modes. Returns TR_OK, or a failure that leaves the state unchanged. */
static int tr_step_by_impulses(tr_sim *s, double t) {
  const double h = t - s->clock.t;
  tr_mode start[s->k->nsliders + 1];
  tr_save_modes(s, start);
  tr_copy(tr_z_length(s), TR_A(s, z), TR_A(s, zold)), tr_copy(tr_state_width(s), TR_A(s, y), TR_A(s, yold));
  s->step.watch = 0, s->step.failure = TR_OK;
  tr_reverse_kink_directions(s), tr_clear_line_directions(s), tr_clear_extremes(s);
  tr_moment_of(s)->inside = s->clock.t + 0.5 * h;
  s->moreau.frozen = 0, s->moreau.decides = INFINITY, s->moreau.keeps = 0;
  const int code = tr_moreau_substep(s, s->clock.t, TR_A(s, y), h, TR_A(s, ynew));
  if (code != TR_OK) {
    tr_restore_modes(s, start), tr_copy(tr_z_length(s), TR_A(s, zold), TR_A(s, z));
    return code;
  }
  double z[tr_z_length(s) + 1];
  tr_copy(tr_z_length(s), TR_A(s, z), z);
  tr_moreau_update_rest(s, t, TR_A(s, ynew), start);
  tr_copy(tr_z_length(s), z, TR_A(s, z));
  tr_log_mode_changes(s, t, start, 0);
  tr_end_bounded_step(s, t);
  return TR_OK;
}

/* Set the friction of pair i to the value that stops the pair by the end of the step. A pair with prescribed motion gets a far
 * larger friction, and a pair without a set-valued law the friction of its law. Requires tr_form_held_maps and tr_evaluate_laws. */
static void tr_apply_stopping_friction(tr_sim *s, int i, double *eta) {
  const tr_pair *pair = tr_pair_of(s, i);
  const int e = s->k->neta;
  const double *Qe = TR_A(s, Q) + e;
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) {
    const double acc = tr_held_acceleration(s, j, eta);
    if (!tr_is_set_valued(s, i)) eta[j] = TR_A(s, law)[j];
    else if (tr_is_prescribed(s, j)) eta[j] = -FAR_MORE * acc / map_Qe(s->k, TR_A(s, maps))[j + j * e];
    else eta[j] -= acc / Qe[j + j * e];
  }
}

/* One relaxation sweep: each pair gets its stopping friction. A pair whose stopping friction exceeds its capacity slips, and its
 * friction is the capacity. */
static void tr_sweep_pairs(tr_sim *s, double *eta) {
  tr_evaluate_laws(s, eta);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    tr_mode *m = tr_mode_of(s, i);
    tr_apply_stopping_friction(s, i, eta);
    if (!tr_is_set_valued(s, i)) continue;
    tr_evaluate_capacities(s);
    const double ratio = tr_friction_ratio(s, i), *lever = TR_A(s, lever) + pair->eta0;
    m->flag = ratio > 1.0 ? TR_SLIPS : TR_STUCK;
    for (int j = 0; j < pair->neta && ratio > 1.0; ++j) {
      double *y = eta + pair->eta0 + j;
      m->direction[j] = pair->nrates == 1 ? (*y < 0.0 ? -1.0 : 1.0) : *y / (lever[j] * lever[j]);
      *y /= ratio;
    }
  }
}

/* Find multipliers and modes of a step h by SWEEPS relaxation sweeps. Requires maps of the current state. */
static void tr_relax_friction(tr_sim *s, double h) {
  const int a = s->k->active, e = s->k->neta;
  double lam0[a + 1], *lam = TR_A(s, z), *eta = lam + a;
  if (a) tr_factor_loops(s);
  tr_eliminate_loops(s, lam0);
  if (e) {
    s->moreau.h = h;
    tr_form_held_maps(s, lam0);
    for (int i = 0; i < SWEEPS; ++i) tr_sweep_pairs(s, eta);
    s->moreau.h = 0.0;
  }
  memcpy(lam, lam0, sizeof(double) * a);
  tr_add_columns(a, e, TR_A(s, T), eta, -1.0, lam);
}

/* Step to time t by impulses with relaxed friction. Returns a status. */
static int tr_step_by_sweeps(tr_sim *s, double t) {
  const int nq = s->k->nq, n = tr_state_width(s);
  const double h = t - s->clock.t, *y = TR_A(s, y), *f = TR_A(s, dy);
  double *mid = TR_A(s, ytmp), *ynew = TR_A(s, ynew);
  tr_mode start[s->k->nsliders + 1];
  tr_save_modes(s, start);
  tr_copy(n, y, mid), tr_copy(n, y, TR_A(s, yold));
  tr_moment_of(s)->inside = s->clock.t + 0.5 * h;
  tr_advance_positions(s, mid, y + nq, 0.5 * h);
  tr_set_time(s, s->clock.t + 0.5 * h);
  tr_moreau_update_stops(s, s->clock.t + 0.5 * h, mid);
  tr_evaluate_maps(s, mid);
  if (s->k->active + s->k->neta) tr_relax_friction(s, h), tr_evaluate_stage2(s, mid, TR_A(s, z), TR_A(s, dy));
  tr_copy(n, mid, ynew);
  for (int i = nq; i < s->ny + s->nworks + TR_AUDIT_SUMS; ++i) ynew[i] = y[i] + h * f[i];
  tr_advance_positions(s, ynew, ynew + nq, 0.5 * h);
  if (!tr_is_finite(s->ny, ynew)) return TR_FAIL_NOT_FINITE;
  if (!tr_project(s, t, ynew)) return s->step.failure;
  tr_set_row_kinds(s);
  tr_log_mode_changes(s, t, start, 0);
  tr_end_bounded_step(s, t);
  return TR_OK;
}

/* Make one step to time t within the bounds of work. Returns a status. */
static int tr_make_bounded_step(tr_sim *s, double t) {
  const int impulses = tr_method_of(s)->kind == TR_IMPULSES;
  const long last = tr_counted_iterations(s) + s->set.iterations;
  const tr_asking ask = s->ask;
  const double every = s->clock.every, next = s->clock.row_next;
  s->clock.every = s->clock.row_next = INFINITY, s->ask.host = 0, s->step.h = s->set.hfixed;
  tr_limit_work(s, s->set.evaluations, s->set.iterations);
  s->bound.overrun = TR_OVERRUN_NONE;
  int code = impulses ? tr_step_by_impulses(s, t) : tr_step_with_events(s, t);
  if (code != TR_OK && !impulses && tr_counted_iterations(s) < last) {
    tr_limit_work(s, IMPULSE_EVALUATIONS, last - tr_counted_iterations(s));
    code = tr_step_by_impulses(s, t), s->bound.overrun = TR_OVERRUN_BY_IMPULSES;
  }
  if (code != TR_OK) code = tr_step_by_sweeps(s, t), s->bound.overrun = TR_OVERRUN_RELAXED;
  s->bound.evaluations = 0, s->ask = ask;
  s->clock.every = every, s->clock.row_next = next;
  s->stats.by_impulses += s->bound.overrun == TR_OVERRUN_BY_IMPULSES;
  s->stats.relaxed += s->bound.overrun == TR_OVERRUN_RELAXED;
  s->bound.index++;
  return code;
}

/* Compute the multipliers of a row at the state `y` by sweeps. yout receives the state of the row. Restores the modes. In the
 * statistics, each sweep counts as one solution. */
static void tr_relax_row(tr_sim *s) {
  tr_mode modes[s->k->nsliders + 1];
  double *y = TR_A(s, yout);
  tr_copy(tr_state_width(s), TR_A(s, y), y);
  tr_save_modes(s, modes);
  tr_evaluate_maps_at(s, s->clock.t, y);
  tr_relax_friction(s, s->step.size), s->stats.solutions += SWEEPS;
  tr_evaluate_stage2(s, y, TR_A(s, z), TR_A(s, dy));
  tr_restore_modes(s, modes), tr_set_row_kinds(s);
}

/* Write the row at the end of a bounded step. If the bounds do not suffice for its multipliers, sweeps compute them. Returns a
 * status. */
static int tr_write_bounded_row(tr_sim *s, double *row) {
  double *y = TR_A(s, yout);
  const tr_asking ask = s->ask;
  s->ask.host = 0;
  tr_limit_work(s, IMPULSE_EVALUATIONS, ROW_ITERATIONS);
  tr_copy(tr_state_width(s), TR_A(s, y), y);
  int code = tr_output_row(s, s->clock.t, y, row);
  s->bound.evaluations = 0, s->ask = ask;
  if (code == TR_OK || !s->k->neta) return code;
  tr_relax_row(s);
  return tr_output_row_of(s, s->clock.t, y, row, 1);
}

/* Update the statistics of the largest work per step. evaluations, iterations: counts before the step and its row. */
static void tr_record_work(tr_sim *s, long evaluations, long iterations) {
  evaluations = tr_counted_evaluations(s) - evaluations, iterations = tr_counted_iterations(s) - iterations;
  if (evaluations > s->stats.most_evaluations) s->stats.most_evaluations = evaluations;
  if (iterations > s->stats.most_iterations) s->stats.most_iterations = iterations;
}

int tr_reach_bounded(tr_sim *s, double t, double *row) {
  const double from = s->clock.t, steps = fmax(1.0, ceil((t - from) / s->set.hfixed - WHOLE_SLACK));
  int code = TR_OK, worst = TR_OVERRUN_NONE;
  if (s->clock.status >= TR_FAIL_NOT_FINITE) return s->clock.status;
  for (double i = 1.0; i <= steps && code == TR_OK; ++i) {
    const long evaluations = tr_counted_evaluations(s), iterations = tr_counted_iterations(s);
    if (s->events.count > s->events.capacity - 2 * (s->set.events + 1) * (tr_watched_count(s) + 1)) s->events.count = 0;
    code = tr_make_bounded_step(s, i == steps ? t : from + (t - from) * (i / steps));
    if (s->bound.overrun > worst) worst = s->bound.overrun;
    if (i == steps) s->bound.overrun = worst;
    if (i == steps && code == TR_OK) code = tr_write_bounded_row(s, row);
    tr_record_work(s, evaluations, iterations);
  }
  return code == TR_OK ? s->clock.status = TR_DONE : tr_end_run(s, code);
}

/* Like tr_advance, by bounded steps, with rows at the ends of steps. */
static int tr_advance_bounded(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count) {
  for (long step = 0; s->clock.t < target - tr_time_tolerance(target); ++step) {
    const long evaluations = tr_counted_evaluations(s), iterations = tr_counted_iterations(s);
    if (s->ask.cancelled) return s->clock.status = TR_CANCELLED;
    if (s->events.count > s->events.capacity - 2 * (s->set.events + 1) * (tr_watched_count(s) + 1)) return TR_EVENTS_FULL;
    if (*count >= capacity) return TR_ROWS_FULL;
    if (step >= max_steps) return TR_MORE;
    if (s->set.max_steps > 0 && s->bound.index >= s->set.max_steps) return s->clock.status = TR_FAIL_MAX_STEPS;
    int code = tr_make_bounded_step(s, fmin(target, s->clock.t_start + (s->bound.index + 1) * s->set.hfixed));
    if (code == TR_OK && s->clock.row_next <= s->clock.t + tr_row_time_tolerance(s->clock.t)) {
      code = tr_write_bounded_row(s, rows + s->clock.width * *count);
      *count += code == TR_OK;
      s->clock.row_index++, s->clock.row_next = s->clock.t_start + s->clock.row_index * s->clock.every;
    }
    tr_record_work(s, evaluations, iterations);
    if (code != TR_OK) return tr_end_run(s, code);
  }
  return s->clock.status = TR_DONE;
}
