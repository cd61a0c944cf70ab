/* Computation of the row of outputs at the present time, and communication steps. */

/* Compute the row of outputs that the last step has left out. */
static fmu_status fmu_deferred_row(fmu_instance *m) {
  fmu_state *s = m->state;
  const int code = tr_reach(FMU_SIM(s), s->time, s->time, (long)MANY_STEPS, FMU_A(s, row));
  s->deferred = FMU_COSTLY;
  return code == TR_DONE ? FMU_OK : fmu_failed(m, code, FMU_DISCARD);
}

/* Compute the row of outputs again, with all present parameters and inputs. */
static fmu_status fmu_refresh(fmu_instance *m) {
  fmu_state *s = m->state;
  if (s->ready && !s->changed) return s->deferred & FMU_ROW ? fmu_deferred_row(m) : FMU_OK;
  if (s->mode == FMU_INSTANTIATED || s->mode == FMU_INITIALIZATION) return fmu_begin(m);
  if (m->exchange && !s->failed) return fmu_row_here(m);
  if (s->failed) return FMU_OK; /* the outputs stay at the run's last row */
  fmu_status status = fmu_take_over(m);
  if (status != FMU_OK) return status;
  int code = tr_row(FMU_SIM(s), FMU_A(s, row));
  if (code != TR_OK) return fmu_failed(m, code, FMU_DISCARD);
  s->ready = 1, s->deferred = FMU_COSTLY;
  return FMU_OK;
}

static int fmu_near(double a, double b, double scale) { return fabs(a - b) <= SAME_POINT * fmax(fabs(scale), fmax(fabs(a), fabs(b))); }

/* Check a communication step from time t to t + h. Logs the reason if the step is not allowed. */
static fmu_status fmu_may_step(fmu_instance *m, double t, double h) {
  fmu_state *s = m->state;
  double target = t + h;
  if (s->failed) {
    const char *name = fmu_outcome_of(s->failed, s->why)->name;
    return fmu_log(m, FMU_DISCARD, "the run ended at t = %.6g s (%s): restore an earlier state, or reset the instance", s->reached, name);
  }
  if (!(h > 0.0) || !isfinite(h) || !isfinite(t))
    return fmu_log(m, FMU_DISCARD, "the communication step from t = %g s has the length %g s: both must be finite, and the length positive", t, h);
  if (!fmu_near(t, s->time, h))
    return fmu_log(m, FMU_ERROR, "the communication step must begin at t = %.17g s, where the last step ended, not at t = %.17g s", s->time, t);
  if (s->has_stop && target > s->stop && !fmu_near(target, s->stop, h))
    return fmu_log(m, FMU_ERROR, "the communication step would end after the stop time %.17g s: make a shorter step", s->stop);
  if (!(target > s->time)) return fmu_log(m, FMU_DISCARD, "the communication step of %g s is below the round-off of t = %.17g s: make a longer step", h, s->time);
  return FMU_OK;
}

/* Apply changes of the host before a step. */
static fmu_status fmu_set_off(fmu_instance *m) {
  fmu_state *s = m->state;
  if (!s->midway && fmu_input_stopped(s)) s->changed |= FMU_NEW_INPUTS;
  return fmu_take_over(m);
}

/* The latest end of the internal steps towards `target`. Normally this time is beyond `target`. After a change by the host, this
 * time is `target`, because another change is likely and would discard all work beyond `target`. */
static double fmu_limit(const fmu_state *s, double target, double h) { return s->moved ? target : target + LOOKAHEAD_STEPS * h; }

/* Largest number of internal steps in a communication step. */
static long fmu_most_steps(const fmu_state *s) {
  const double most = fmu_setting_of(s, FMU_MAX_STEPS, 0.0);
  return most >= 1.0 && most < MANY_STEPS ? (long)most : (long)MANY_STEPS;
}

/* Update the state and the log after a step to `target`. status: status that the runtime returned for the step. */
static fmu_status fmu_arrived(fmu_instance *m, int status, double target) {
  fmu_state *s = m->state;
  const double reach = fmu_limit(s, target, target - s->time);
  s->moved = 0, s->event = 0;
  if (status == TR_DONE) {
    s->point = s->midway ? s->point : s->time;
    s->time = s->reached = target, s->ready = 1;
    fmu_second_follows(m, reach);
    fmu_tell_events(m);
    fmu_tell_progress(m);
    return fmu_audit(m);
  }
  s->reached = fmax(s->time, tr_time(FMU_SIM(s)));
  s->time = s->reached, FMU_SIM(s)->set.brief = 0; /* a failed run cannot be copied, so its last row contains all outputs */
  s->ready = tr_row(FMU_SIM(s), FMU_A(s, row)) == TR_OK, s->deferred = FMU_COSTLY;
  if (status == TR_MORE)
    return fmu_log(m, FMU_DISCARD, "the communication step stopped at t = %.17g s after solver.max_steps = %ld internal steps: increase solver.max_steps", s->reached, fmu_most_steps(s));
  return fmu_failed(m, status, FMU_DISCARD);
}

/* Advance by h to `target`, by internal steps or by one bounded step. The row of outputs at `target` is computed later, when the
 * host reads an output. With bounded steps or error estimates, the row is computed at once. Returns the status of the runtime. */
static int fmu_reach(fmu_instance *m, double target, double h) {
  static const char *const said[] = {0, "one step of impulses", "one step of impulses whose friction a few sweeps found"};
  fmu_state *s = m->state;
  tr_sim *sim = FMU_SIM(s);
  const int deferred = !MODEL->bounded && s->certified <= 0;
  s->deferred = deferred ? FMU_ROW | FMU_COSTLY : FMU_COSTLY;
  if (!MODEL->bounded) return tr_reach(sim, target, fmu_limit(s, target, h), fmu_most_steps(s), deferred ? 0 : FMU_A(s, row));
  const int status = tr_reach_bounded(sim, target, FMU_A(s, row)), how = sim->bound.overrun;
  if (how) fmu_tell(m, (int)FMU_WARNING, "the step to t = %.9g s is over its bounds: its rest was %s (realtime.overrun = %d)", target, said[how], how);
  return status;
}

/* Do the communication step from time t to t + h. */
static fmu_status fmu_step(fmu_instance *m, double t, double h) {
  fmu_status status = fmu_may_step(m, t, h);
  if (status == FMU_OK) status = fmu_set_off(m);
  if (status != FMU_OK) return status;
  const double target = t + h;
  return fmu_arrived(m, fmu_reach(m, target, h), target);
}
