/* Steps for real time: fixed ones, each of which takes no more evaluations, iterations and events than it may (METHOD, "Bounded steps").
 *
 * A step is made as any other, with its events located, up to where one of its bounds is reached or there is no answer. What is left of it is
 * then one step of impulses, in which any number of events may fall: decided anew with what is left of the iterations; else with the friction
 * to which a few sweeps over the pairs lead, within what each can hold. Which of these it was is told. */
#include "modes.h"

#define IMPULSE_EVALUATIONS 4 /* that a step of impulses, or a row, may take besides */
#define ROW_ITERATIONS 8      /* that a row may take besides: it has been solved for just before; one or two are usual */
#define SWEEPS 6              /* over all pairs: each costs what an iteration does */
#define FAR_MORE 1e3          /* than would stop the freedom if the loops were open */
#define WHOLE_SLACK 1e-9      /* of a step: how much longer than some of them a communication step may be */

/* The work at hand may take so many evaluations and iterations from here on. */
static void tr_bound_work(tr_sim *s, long evaluations, long iterations) {
  s->bound.evaluations = tr_evaluations(s) + evaluations;
  s->bound.iterations = tr_iterations(s) + iterations;
  s->ask.stop = 0;
}

/* Up to time t by steps whose events are located. TR_OK, or why the rest is left; the block's state is then where it ended. */
static int tr_step_exactly(tr_sim *s, double t) {
  const int n = tr_width(s), nz = tr_nz(s);
  double y[n], z[nz + 1];
  tr_mode modes[s->k->nsliders + 1];
  for (int events = 0; s->clock.t < t - tr_same_time(t);) {
    long count = 0;
    memcpy(y, TR_A(s, y), sizeof y), tr_copy(nz, TR_A(s, z), z), tr_keep_modes(s, modes);
    int code = tr_attempt(s, tr_limit_time(s, t));
    if (code == TR_OK && s->pending.kind == TR_STEP_TO_EVENT && ++events > s->set.events) code = TR_MORE;
    if (code == TR_OK) code = tr_finish(s, 0, 0, &count);
    else memcpy(TR_A(s, y), y, sizeof y), tr_copy(nz, z, TR_A(s, z)), tr_put_modes(s, modes);
    if (code == TR_OK) continue;
    s->pending.kind = TR_NOTHING, s->pending.noted = 0;
    return code;
  }
  return TR_OK;
}

/* Make (t, ynew), to which a step has led that knows nothing of what is inside it, the state the run is at. */
static void tr_end_bounded(tr_sim *s, double t) {
  s->step.t0 = s->clock.t, s->step.size = t - s->clock.t;
  s->stats.steps++, s->stats.of_method[s->step.method]++;
  tr_audit_impulses(s, t, TR_A(s, ynew));
  tr_shift(s, t, TR_A(s, ynew));
  s->step.have_k1 = s->step.have_jac = s->step.have_dense = 0, s->step.h = s->set.hfixed;
  s->friction.capture = s->friction.missed = -1, s->friction.past_t[0] = NAN;
  tr_forget_ends(s);
}

/* Up to time t by one step of impulses, its modes decided anew. TR_OK, or why there is none: then nothing has changed. */
static int tr_step_by_impulses(tr_sim *s, double t) {
  const double h = t - s->clock.t;
  tr_mode start[s->k->nsliders + 1];
  tr_keep_modes(s, start);
  tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zold)), tr_copy(tr_width(s), TR_A(s, y), TR_A(s, yold));
  s->step.watch = 0, s->step.trouble = TR_OK;
  tr_turn_directions(s), tr_leave_lines(s), tr_forget_extremes(s);
  tr_moment_of(s)->inside = s->clock.t + 0.5 * h;
  s->moreau.frozen = 0, s->moreau.decides = INFINITY, s->moreau.keeps = 0;
  const int code = tr_moreau_part(s, s->clock.t, TR_A(s, y), h, TR_A(s, ynew));
  if (code != TR_OK) {
    tr_put_modes(s, start), tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
    return code;
  }
  double z[tr_nz(s) + 1];
  tr_copy(tr_nz(s), TR_A(s, z), z);
  tr_moreau_rests(s, t, TR_A(s, ynew), start);
  tr_copy(tr_nz(s), z, TR_A(s, z));
  tr_log_switches(s, t, start, 0);
  tr_end_bounded(s, t);
  return TR_OK;
}

/* Pair i takes the friction that would stop it by the end of the step; where its motion is prescribed far more than could; one without rest what
 * its law says. After tr_held_maps and tr_law. */
static void tr_stopping_friction(tr_sim *s, int i, double *eta) {
  const tr_pair *pair = tr_pair_of(s, i);
  const int e = s->k->neta;
  const double *Q0 = TR_A(s, Q), *Qe = Q0 + e;
  for (int j = pair->eta0; j < pair->eta0 + pair->neta; ++j) {
    double acc = Q0[j];
    for (int q = 0; q < e; ++q) acc += Qe[j + q * e] * eta[q];
    if (!tr_is_set(s, i)) eta[j] = TR_A(s, law)[j];
    else if (tr_is_prescribed(s, j)) eta[j] = -FAR_MORE * acc / map_Qe(s->k, TR_A(s, maps))[j + j * e];
    else eta[j] -= acc / Qe[j + j * e];
  }
}

/* A sweep over all pairs: each takes that friction, as far as it can hold it under the loads in place, and slips the way it pulls where it
 * cannot. */
static void tr_sweep(tr_sim *s, double *eta) {
  tr_law(s, eta);
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    tr_mode *m = tr_mode_of(s, i);
    tr_stopping_friction(s, i, eta);
    if (!tr_is_set(s, i)) continue;
    tr_holding(s);
    const double ratio = tr_ratio(s, i), *arm = TR_A(s, arm) + pair->eta0;
    m->flag = ratio > 1.0 ? TR_SLIPS : TR_STUCK;
    for (int j = 0; j < pair->neta && ratio > 1.0; ++j) {
      double *y = eta + pair->eta0 + j;
      m->direction[j] = pair->nrates == 1 ? (*y < 0.0 ? -1.0 : 1.0) : *y / (arm[j] * arm[j]);
      *y /= ratio;
    }
  }
}

/* Multipliers over a step of length h by sweeps, at the state whose maps are in place; pairs are in the modes that follow. */
static void tr_relax(tr_sim *s, double h) {
  const int a = s->k->active, e = s->k->neta;
  double lam0[a + 1], *lam = TR_A(s, z), *eta = lam + a;
  if (a) tr_factor(s);
  tr_eliminate(s, lam0);
  if (e) {
    s->moreau.h = h;
    tr_held_maps(s, lam0);
    for (int i = 0; i < SWEEPS; ++i) tr_sweep(s, eta);
    s->moreau.h = 0.0;
  }
  for (int i = 0; i < a; ++i) {
    lam[i] = lam0[i];
    for (int j = 0; j < e; ++j) lam[i] -= TR_A(s, T)[i + j * a] * eta[j];
  }
}

/* Up to time t by one step of impulses whose friction sweeps find. TR_OK, or why the run cannot go on. */
static int tr_step_relaxed(tr_sim *s, double t) {
  const int nq = s->k->nq, n = tr_width(s);
  const double h = t - s->clock.t, *y = TR_A(s, y), *f = TR_A(s, dy);
  double *mid = TR_A(s, ytmp), *ynew = TR_A(s, ynew);
  tr_mode start[s->k->nsliders + 1];
  tr_keep_modes(s, start);
  tr_copy(n, y, mid), tr_copy(n, y, TR_A(s, yold));
  tr_moment_of(s)->inside = s->clock.t + 0.5 * h;
  tr_drift(s, mid, y + nq, 0.5 * h);
  tr_set_time(s, s->clock.t + 0.5 * h);
  tr_moreau_stops(s, s->clock.t + 0.5 * h, mid);
  tr_maps_of(s, mid);
  if (s->k->active + s->k->neta) tr_relax(s, h), tr_stage2(s, mid, TR_A(s, z), TR_A(s, dy));
  tr_copy(n, mid, ynew);
  for (int i = nq; i < s->ny + s->nworks + s->naudit; ++i) ynew[i] = y[i] + h * f[i];
  tr_drift(s, ynew, ynew + nq, 0.5 * h);
  if (!tr_finite(s->ny, ynew)) return TR_FAIL_NOT_FINITE;
  if (!tr_project(s, t, ynew)) return s->step.trouble;
  tr_note_modes(s);
  tr_log_switches(s, t, start, 0);
  tr_end_bounded(s, t);
  return TR_OK;
}

/* One step up to time t, within its bounds. TR_OK, or why the run cannot go on. */
static int tr_step_bounded(tr_sim *s, double t) {
  const int impulses = tr_method_of(s)->kind == TR_IMPULSES;
  const long last = tr_iterations(s) + s->set.iterations;
  const tr_asking ask = s->ask;
  const double every = s->clock.every, next = s->clock.row_next;
  s->clock.every = s->clock.row_next = INFINITY, s->ask.host = 0, s->step.h = s->set.hfixed;
  tr_bound_work(s, s->set.evaluations, s->set.iterations);
  s->bound.overrun = TR_OVERRUN_NONE;
  int code = impulses ? tr_step_by_impulses(s, t) : tr_step_exactly(s, t);
  if (code != TR_OK && !impulses && tr_iterations(s) < last) {
    tr_bound_work(s, IMPULSE_EVALUATIONS, last - tr_iterations(s));
    code = tr_step_by_impulses(s, t), s->bound.overrun = TR_OVERRUN_BY_IMPULSES;
  }
  if (code != TR_OK) code = tr_step_relaxed(s, t), s->bound.overrun = TR_OVERRUN_RELAXED;
  s->bound.evaluations = 0, s->ask = ask;
  s->clock.every = every, s->clock.row_next = next;
  s->stats.by_impulses += s->bound.overrun == TR_OVERRUN_BY_IMPULSES;
  s->stats.relaxed += s->bound.overrun == TR_OVERRUN_RELAXED;
  s->bound.index++;
  return code;
}

/* Multipliers of the state in yout by sweeps, for a row; pairs stay in their modes. Counted as iterations. */
static void tr_relax_row(tr_sim *s) {
  tr_mode modes[s->k->nsliders + 1];
  double *y = TR_A(s, yout);
  tr_copy(tr_width(s), TR_A(s, y), y);
  tr_keep_modes(s, modes);
  tr_maps_at(s, s->clock.t, y);
  tr_relax(s, s->step.size), s->stats.solutions += SWEEPS;
  tr_stage2(s, y, TR_A(s, z), TR_A(s, dy));
  tr_put_modes(s, modes), tr_note_modes(s);
}

/* The row at the end of a bounded step: where its multipliers are not found within bounds, with those that sweeps find. */
static int tr_row_bounded(tr_sim *s, double *row) {
  double *y = TR_A(s, yout);
  const tr_asking ask = s->ask;
  s->ask.host = 0;
  tr_bound_work(s, IMPULSE_EVALUATIONS, ROW_ITERATIONS);
  tr_copy(tr_width(s), TR_A(s, y), y);
  int code = tr_output(s, s->clock.t, y, row);
  s->bound.evaluations = 0, s->ask = ask;
  if (code == TR_OK || !s->k->neta) return code;
  tr_relax_row(s);
  return tr_output_of(s, s->clock.t, y, row, 1);
}

/* Note what the step from these counts on, its row included, has taken. */
static void tr_note_work(tr_sim *s, long evaluations, long iterations) {
  evaluations = tr_evaluations(s) - evaluations, iterations = tr_iterations(s) - iterations;
  if (evaluations > s->stats.most_evaluations) s->stats.most_evaluations = evaluations;
  if (iterations > s->stats.most_iterations) s->stats.most_iterations = iterations;
}

/* Go on to time t by bounded steps of equal length, none longer than the one that is set, and write the row there. TR_DONE, or why the run
 * cannot go on. */
int tr_reach_bounded(tr_sim *s, double t, double *row) {
  const double from = s->clock.t, steps = fmax(1.0, ceil((t - from) / s->set.hfixed - WHOLE_SLACK));
  int code = TR_OK, worst = TR_OVERRUN_NONE;
  if (s->clock.status >= TR_FAIL_NOT_FINITE) return s->clock.status;
  for (double i = 1.0; i <= steps && code == TR_OK; ++i) {
    const long evaluations = tr_evaluations(s), iterations = tr_iterations(s);
    if (s->events.count > s->events.capacity - 2 * (s->set.events + 1) * (tr_watched(s) + 1)) s->events.count = 0;
    code = tr_step_bounded(s, i == steps ? t : from + (t - from) * (i / steps));
    if (s->bound.overrun > worst) worst = s->bound.overrun;
    if (i == steps) s->bound.overrun = worst;
    if (i == steps && code == TR_OK) code = tr_row_bounded(s, row);
    tr_note_work(s, evaluations, iterations);
  }
  return code == TR_OK ? s->clock.status = TR_DONE : tr_end(s, code);
}

/* The same as ``tr_advance``; rows at the ends of steps, every so often. */
static int tr_advance_bounded(tr_sim *s, double target, long max_steps, double *rows, long capacity, long *count) {
  for (long step = 0; s->clock.t < target - tr_same_time(target); ++step) {
    const long evaluations = tr_evaluations(s), iterations = tr_iterations(s);
    if (s->ask.stop) return s->clock.status = TR_STOPPED;
    if (s->events.count > s->events.capacity - 2 * (s->set.events + 1) * (tr_watched(s) + 1)) return TR_EVENTS_FULL;
    if (*count >= capacity) return TR_ROWS_FULL;
    if (step >= max_steps) return TR_MORE;
    if (s->set.max_steps > 0 && s->bound.index >= s->set.max_steps) return s->clock.status = TR_FAIL_MAX_STEPS;
    int code = tr_step_bounded(s, fmin(target, s->clock.start + (s->bound.index + 1) * s->set.hfixed));
    if (code == TR_OK && s->clock.row_next <= s->clock.t + tr_row_slack(s->clock.t)) {
      code = tr_row_bounded(s, rows + s->clock.width * *count);
      *count += code == TR_OK;
      s->clock.row_index++, s->clock.row_next = s->clock.start + s->clock.row_index * s->clock.every;
    }
    tr_note_work(s, evaluations, iterations);
    if (code != TR_OK) return tr_end(s, code);
  }
  return s->clock.status = TR_DONE;
}
