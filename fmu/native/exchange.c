/* Model exchange, in what both standards have in common: the importer's solver makes the steps; here are ẏ, what tells when a mode ends,
 * and what is decided then (``told.c`` and ``update.c`` of the runtime). References of states, their derivatives and the indicators follow all others. */

/* How many there are. */
static int fmu_states(void) {
  const tr_kernel *k = MODEL->kernel;
  return k->nq + k->nv + k->nb + (MODEL->columns->works ? k->npowers : 0);
}

static int fmu_indicators(void) { return 2 * MODEL->kernel->nsliders + MODEL->kernel->nstops + (MODEL->kernel->neta > 0); }

/* The first reference of a state; behind the states their derivatives and the indicators follow. */
static unsigned fmu_first_state(void) {
  return (unsigned)(fmu_count() + (MODEL->clocks ? 1 + 3 * MODEL->clocks->count + (MODEL->clocks->last >= 0) : 0));
}

/* Whether a reference is that of a state, a derivative or an indicator. */
static int fmu_is_exchanged(fmu_reference r) {
  const unsigned first = fmu_first_state();
  return MODEL->types & FMU_EXCHANGE && r >= first && r < first + (unsigned)(2 * fmu_states() + fmu_indicators());
}

/* Let what the host has set take effect at the present state: inputs, and at an event parameters, with which modes are decided anew. */
static fmu_status fmu_take_in(fmu_instance *m) {
  fmu_state *s = m->state;
  const int anew = (s->changed & FMU_NEW_PARAMETERS) != 0;
  if (!s->changed) return FMU_OK;
  const fmu_status together = fmu_together(m);
  if (together != FMU_OK) return together;
  if (anew) fmu_numbers(s);
  fmu_hand_inputs(m, s->time, 0);
  s->changed = 0, s->ready = s->known = 0;
  if (!anew) return FMU_OK;
  const int code = tr_resume(FMU_SIM(s), 1);
  if (code != TR_OK) return fmu_failed(m, code, FMU_ERROR);
  tr_arm_here(FMU_SIM(s));
  return FMU_OK;
}

/* Where the solver looks there may be no answer in the present modes; nearer to the last complete step there is. */
static fmu_status fmu_none_there(fmu_instance *m) {
  return fmu_log(m, FMU_DISCARD, "in the present modes there is no motion at the state given for t = %.12g s: a smaller step ends at the event before it", m->state->time);
}

/* Evaluate ẏ and the indicators, if they are not known; *rates: ẏ. */
static fmu_status fmu_rates(fmu_instance *m, const double **rates) {
  fmu_state *s = m->state;
  fmu_status status = s->mode < FMU_STEPPING ? fmu_refresh(m) : fmu_take_in(m);
  if (status > FMU_WARNING) return status;
  *rates = s->known ? tr_rates_known(FMU_SIM(s)) : tr_rates_in_modes(FMU_SIM(s));
  s->known = *rates != 0;
  return s->known ? FMU_OK : fmu_none_there(m);
}

/* The row of outputs at the present time and state. */
static fmu_status fmu_row_here(fmu_instance *m) {
  fmu_state *s = m->state;
  const fmu_status status = fmu_take_in(m);
  if (status > FMU_WARNING || s->ready) return status;
  s->known = 0;
  s->ready = tr_row_in_modes(FMU_SIM(s), FMU_A(s, row)) == TR_OK;
  return s->ready ? FMU_OK : fmu_none_there(m);
}

/* A state, derivative or indicator of an instance for co-simulation: in a copy of the run, which may have gone further. */
static fmu_status fmu_exchanged_inside(fmu_instance *m, int at, double *value) {
  const fmu_status status = fmu_refresh(m);
  if (status > FMU_WARNING) return status;
  fmu_state *copy = fmu_allocate(&m->host, m->state->bytes);
  if (!copy) return fmu_log(m, FMU_ERROR, "out of memory");
  memcpy(copy, m->state, m->state->bytes);
  fmu_adopt(copy);
  tr_sim *sim = FMU_SIM(copy);
  const int n = fmu_states();
  const double *rates = tr_cut(sim, copy->time) == TR_OK ? tr_arm_here(sim) : 0;
  if (rates) *value = at < n ? tr_array(sim, TR_ARRAY_STATE)[at] : at < 2 * n ? rates[at - n] : tr_told(sim)[at - 2 * n];
  fmu_free(&m->host, copy);
  return rates ? FMU_OK : fmu_none_there(m);
}

/* The number at the reference of a state, a derivative or an indicator. */
static fmu_status fmu_exchanged(fmu_instance *m, fmu_reference r, double *value) {
  const int at = (int)(r - fmu_first_state()), n = fmu_states();
  const double *rates = 0;
  if (!m->exchange) return fmu_exchanged_inside(m, at, value);
  const fmu_status status = fmu_rates(m, &rates);
  if (status > FMU_WARNING) return status;
  tr_sim *sim = FMU_SIM(m->state);
  *value = at < n ? tr_array(sim, TR_ARRAY_STATE)[at] : at < 2 * n ? rates[at - n] : tr_told(sim)[at - 2 * n];
  return FMU_OK;
}

/* Whether a call of model exchange may be made: in these modes (bits), with so many numbers. */
static fmu_status fmu_may_exchange(const fmu_instance *m, const char *call, int modes, size_t given, int wanted) {
  if (!m->exchange) return fmu_log(m, FMU_ERROR, "%s: this instance is for co-simulation", call);
  if (!(modes & 1 << m->state->mode)) return fmu_log(m, FMU_ERROR, "%s: not in this mode", call);
  if (given != (size_t)wanted) return fmu_log(m, FMU_ERROR, "%s: there are %d, not %zu", call, wanted, given);
  return FMU_OK;
}

#define FMU_AT_RUN (1 << FMU_EVENTS | 1 << FMU_CONTINUOUS)
#define FMU_AT_ALL (FMU_AT_RUN | 1 << FMU_INITIALIZATION | 1 << FMU_TERMINATED)

static fmu_status fmu_set_time(fmu_instance *m, double t) {
  fmu_state *s = m->state;
  const fmu_status status = fmu_may_exchange(m, "SetTime", FMU_AT_RUN, 0, 0);
  if (status != FMU_OK) return status;
  FMU_NEED(isfinite(t), "SetTime: the time is not a finite number");
  if (t == s->time) return FMU_OK;
  s->time = t, s->known = s->ready = 0;
  tr_place(FMU_SIM(s), t, 0);
  return FMU_OK;
}

static fmu_status fmu_set_states(fmu_instance *m, const double *x, size_t n) {
  fmu_state *s = m->state;
  const fmu_status status = fmu_may_exchange(m, "SetContinuousStates", FMU_AT_RUN, n, fmu_states());
  if (status != FMU_OK) return status;
  FMU_ARRAYS(n, x);
  for (size_t i = 0; i < n; ++i) FMU_NEED(isfinite(x[i]), "SetContinuousStates: state %zu is not a finite number", i + 1);
  if (!memcmp(x, tr_array(FMU_SIM(s), TR_ARRAY_STATE), sizeof(double) * n)) return FMU_OK;
  s->known = s->ready = 0;
  tr_place(FMU_SIM(s), s->time, x);
  return FMU_OK;
}

static fmu_status fmu_get_states(fmu_instance *m, double *x, size_t n) {
  fmu_status status = fmu_may_exchange(m, "GetContinuousStates", FMU_AT_ALL, n, fmu_states());
  if (status == FMU_OK && m->state->mode == FMU_INITIALIZATION) status = fmu_refresh(m);
  if (status > FMU_WARNING) return status;
  FMU_ARRAYS(n, x);
  memcpy(x, tr_array(FMU_SIM(m->state), TR_ARRAY_STATE), sizeof(double) * n);
  return FMU_OK;
}

static fmu_status fmu_get_rates(fmu_instance *m, double *dx, size_t n) {
  const double *rates = 0;
  fmu_status status = fmu_may_exchange(m, "GetDerivatives", FMU_AT_ALL, n, fmu_states());
  if (status == FMU_OK) status = fmu_rates(m, &rates);
  if (status > FMU_WARNING) return status;
  FMU_ARRAYS(n, dx);
  memcpy(dx, rates, sizeof(double) * n);
  return FMU_OK;
}

static fmu_status fmu_get_indicators(fmu_instance *m, double *z, size_t n) {
  const double *rates = 0;
  fmu_status status = fmu_may_exchange(m, "GetEventIndicators", FMU_AT_ALL, n, fmu_indicators());
  if (status == FMU_OK) status = fmu_rates(m, &rates);
  if (status > FMU_WARNING) return status;
  FMU_ARRAYS(n, z);
  memcpy(z, tr_told(FMU_SIM(m->state)), sizeof(double) * n);
  tr_follow(FMU_SIM(m->state));
  return FMU_OK;
}

/* Sizes that states are measured by: 1 of angles, the scene's length and rate of others, its energy of works. */
static fmu_status fmu_get_nominals(fmu_instance *m, double *x, size_t n) {
  fmu_status status = fmu_may_exchange(m, "GetNominalsOfContinuousStates", FMU_AT_ALL, n, fmu_states());
  if (status == FMU_OK && m->state->mode == FMU_INITIALIZATION) status = fmu_refresh(m);
  if (status > FMU_WARNING) return status;
  FMU_ARRAYS(n, x);
  for (size_t i = 0; i < n; ++i) x[i] = tr_nominal(FMU_SIM(m->state), (int)i);
  return FMU_OK;
}

/* The importer has completed a step at the present time and state. */
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

/* What an importer is told after an event. */
typedef struct fmu_said {
  int again, terminate, values, defined;
  double next;
} fmu_said;

/* The next time at which something changes by itself; INFINITY: never. */
static void fmu_says_next(fmu_said *said, double next) {
  said->defined = next < INFINITY;
  said->next = said->defined ? next : 0.0;
}

/* Handle what happens at the present time and state. Clocks tick until this is called again, for which an importer is asked. */
static fmu_status fmu_update(fmu_instance *m, fmu_said *said) {
  fmu_state *s = m->state;
  tr_sim *sim = FMU_SIM(s);
  *said = (fmu_said){.terminate = s->failed != 0};
  fmu_status status = fmu_may_exchange(m, "UpdateDiscreteStates", 1 << FMU_EVENTS, 0, 0);
  if (status != FMU_OK) return status;
  FMU_NEED(!s->failed, "the run has ended at t = %.6g s: go back to an earlier state, or reset", s->reached);
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
