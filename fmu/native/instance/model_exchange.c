/* Model exchange for FMI 2.0 and 3.0, in which the importer's solver makes the steps. The runtime evaluates state derivatives ẏ and
 * event indicators (``hosts/model_exchange.c``) and handles events (``hosts/model_exchange_events.c``). */

/* Check a call of model exchange. modes: bits of the allowed modes. given: number of values in the call. wanted: required number of
 * values. */
static fmu_status fmu_may_exchange(const fmu_instance *m, const char *call, int modes, size_t given, int wanted) {
  if (!m->exchange) return fmu_log(m, FMU_ERROR, "%s: this instance is for co-simulation: create one for model exchange", call);
  if (!(modes & 1 << m->state->mode)) return fmu_log(m, FMU_ERROR, "%s: this call is not allowed in the present mode of the instance", call);
  if (given != (size_t)wanted) return fmu_log(m, FMU_ERROR, "%s: the array must have %d values, not %zu", call, wanted, given);
  return FMU_OK;
}

#define FMU_AT_RUN (1 << FMU_EVENTS | 1 << FMU_CONTINUOUS)
#define FMU_AT_ALL (FMU_AT_RUN | 1 << FMU_INITIALIZATION | 1 << FMU_TERMINATED)

static fmu_status fmu_set_time(fmu_instance *m, double t) {
  fmu_state *s = m->state;
  const fmu_status status = fmu_may_exchange(m, "SetTime", FMU_AT_RUN, 0, 0);
  if (status != FMU_OK) return status;
  FMU_NEED(isfinite(t), "SetTime: the time %g s is not a finite number", t);
  if (t == s->time) return FMU_OK;
  s->time = t, s->known = s->ready = 0;
  tr_set_state(FMU_SIM(s), t, 0);
  return FMU_OK;
}

static fmu_status fmu_set_states(fmu_instance *m, const double *x, size_t n) {
  fmu_state *s = m->state;
  const fmu_status status = fmu_may_exchange(m, "SetContinuousStates", FMU_AT_RUN, n, fmu_states());
  if (status != FMU_OK) return status;
  FMU_ARRAYS(n, x);
  for (size_t i = 0; i < n; ++i) FMU_NEED(isfinite(x[i]), "SetContinuousStates: the value %g of state %zu is not a finite number", x[i], i + 1);
  if (!memcmp(x, tr_array(FMU_SIM(s), TR_ARRAY_STATE), sizeof(double) * n)) return FMU_OK;
  s->known = s->ready = 0;
  tr_set_state(FMU_SIM(s), s->time, x);
  return FMU_OK;
}

/* Check a call that gets one value for each state. Start the run first if the host has not started it. */
static fmu_status fmu_may_get(fmu_instance *m, const char *call, const double *x, size_t n) {
  fmu_status status = fmu_may_exchange(m, call, FMU_AT_ALL, n, fmu_states());
  if (status == FMU_OK && m->state->mode == FMU_INITIALIZATION) status = fmu_refresh(m);
  if (status > FMU_WARNING) return status;
  FMU_ARRAYS(n, x);
  return FMU_OK;
}

static fmu_status fmu_get_states(fmu_instance *m, double *x, size_t n) {
  const fmu_status status = fmu_may_get(m, "GetContinuousStates", x, n);
  if (status != FMU_OK) return status;
  memcpy(x, tr_array(FMU_SIM(m->state), TR_ARRAY_STATE), sizeof(double) * n);
  return FMU_OK;
}

/* Evaluate *rates (ẏ) and the event indicators for a call that gets n values. wanted: required number of values. */
static fmu_status fmu_evaluate(fmu_instance *m, const char *call, const double *out, size_t n, int wanted, const double **rates) {
  fmu_status status = fmu_may_exchange(m, call, FMU_AT_ALL, n, wanted);
  if (status == FMU_OK) status = fmu_rates(m, rates);
  if (status > FMU_WARNING) return status;
  FMU_ARRAYS(n, out);
  return FMU_OK;
}

static fmu_status fmu_get_rates(fmu_instance *m, double *dx, size_t n) {
  const double *rates = 0;
  const fmu_status status = fmu_evaluate(m, "GetDerivatives", dx, n, fmu_states(), &rates);
  if (status == FMU_OK) memcpy(dx, rates, sizeof(double) * n);
  return status;
}

static fmu_status fmu_get_indicators(fmu_instance *m, double *z, size_t n) {
  const double *rates = 0;
  const fmu_status status = fmu_evaluate(m, "GetEventIndicators", z, n, fmu_indicators(), &rates);
  if (status != FMU_OK) return status;
  memcpy(z, tr_indicators(FMU_SIM(m->state)), sizeof(double) * n);
  tr_follow(FMU_SIM(m->state));
  return FMU_OK;
}

/* The nominal values of the states, relative to their scale. The scale is 1 for angles, the scene's energy for works, and a product
 * of the scene's length and rate for other states. */
static fmu_status fmu_get_nominals(fmu_instance *m, double *x, size_t n) {
  const fmu_status status = fmu_may_get(m, "GetNominalsOfContinuousStates", x, n);
  if (status != FMU_OK) return status;
  for (size_t i = 0; i < n; ++i) x[i] = tr_nominal(FMU_SIM(m->state), (int)i);
  return FMU_OK;
}

/* The importer has completed a step to the present time and state. */
static fmu_status fmu_completed(fmu_instance *m, int *event, int *terminate) {
  fmu_state *s = m->state;
  const fmu_status may = fmu_may_exchange(m, "CompletedIntegratorStep", 1 << FMU_CONTINUOUS, 0, 0), status = may == FMU_OK ? fmu_take_in(m) : may;
  if (status > FMU_WARNING) return status;
  s->known = 0, s->reached = s->time;
  *event = tr_completed(FMU_SIM(s)), *terminate = s->failed != 0;
  fmu_tell_progress(m);
  return FMU_OK;
}

static fmu_status fmu_enter_events(fmu_instance *m) {
  const fmu_status status = fmu_may_exchange(m, "EnterEventMode", 1 << FMU_CONTINUOUS, 0, 0);
  if (status == FMU_OK) m->state->mode = FMU_EVENTS;
  return status;
}

static fmu_status fmu_enter_continuous(fmu_instance *m) {
  fmu_status status = fmu_may_exchange(m, "EnterContinuousTimeMode", 1 << FMU_EVENTS, 0, 0);
  if (status == FMU_OK) status = fmu_take_in(m);
  if (status == FMU_OK) m->state->mode = FMU_CONTINUOUS;
  return status;
}

/* Write the information that the importer gets after an event. */
typedef struct fmu_said {
  int again, terminate, values, defined;
  double next;
} fmu_said;

/* Set the time of the next time event. The time is INFINITY if there is none. */
static void fmu_says_next(fmu_said *said, double next) {
  said->defined = next < INFINITY;
  said->next = said->defined ? next : 0.0;
}

/* Handle the events at the present time and state. If a clock ticks, the importer is asked for another call, and the clock stays
 * active until that call. */
static fmu_status fmu_update(fmu_instance *m, fmu_said *said) {
  fmu_state *s = m->state;
  tr_sim *sim = FMU_SIM(s);
  *said = (fmu_said){.terminate = s->failed != 0};
  fmu_status status = fmu_may_exchange(m, "UpdateDiscreteStates", 1 << FMU_EVENTS, 0, 0);
  if (status != FMU_OK) return status;
  FMU_NEED(!s->failed, "UpdateDiscreteStates: the run ended at t = %.6g s: restore an earlier state, or reset the instance", s->reached);
  fmu_handled(s);
  const int jumped = s->changed != 0;
  status = fmu_take_in(m);
  if (status > FMU_WARNING) return status;
  s->known = s->ready = 0, s->reached = s->time;
  const int code = tr_update(sim, jumped, &said->values);
  if (code != TR_OK) {
    said->terminate = 1;
    return fmu_failed(m, code, FMU_ERROR);
  }
  fmu_tell_events(m);
  said->again = s->ticking;
  fmu_says_next(said, tr_next_break(sim));
  return FMU_OK;
}
