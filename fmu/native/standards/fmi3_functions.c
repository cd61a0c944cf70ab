/* The FMI 3.0 functions, except those that are only for model exchange: instances, modes, steps, states, derivatives. */

/* The status for a function that must not return fmi3Discard. */
static fmu_status fmi3_strict(fmu_status status) { return status == FMU_DISCARD ? FMU_ERROR : status; }

const char *fmu_fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmu_fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String category[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, category);
  FMU_NEED(fmu_choose_log(m, on, n, category), "fmi3SetDebugLogging: there is no such category");
  return fmi3OK;
}

static void fmi3_say(const fmu_host *host, const char *name, fmu_status status, const char *category, char *text) {
  ((fmi3LogMessageCallback)host->logger)(host->environment, (fmi3Status)status, category, text);
}

fmi3Instance fmu_fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference between[], size_t nbetween,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback update) {
  const fmu_host host = {.say = logger ? fmi3_say : NULL, .logger = (void (*)(void))logger, .environment = environment};
  const char *why = fmu_refusal(FMU_COSIMULATION, token);
  for (size_t i = 0; i < nbetween && !why; ++i)
    if (!between || !fmi3_is_between(between[i])) why = "requiredIntermediateVariables: every variable must be a continuous input or output";
  fmu_instance *m = fmu_create(&host, name, why, logging);
  if (!m) return NULL;
  m->events = events, m->early = early, m->between = (void (*)(void))update;
  if (!(events && early) || fmu_can_look(m)) return m;
  fmu_log(m, FMU_ERROR, "out of memory");
  fmu_destroy(m);
  return NULL;
}

void fmu_fmi3FreeInstance(fmi3Instance c) { fmu_destroy(c); }

fmi3Status fmu_fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stop_defined, fmi3Float64 stop) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_INSTANTIATED, "fmi3EnterInitializationMode: the instance is already initialized: call fmi3Reset first");
  const fmu_status status = fmu_agree(m, tolerance_defined, tolerance, start, stop_defined, stop);
  if (status == FMU_OK) m->state->mode = FMU_INITIALIZATION;
  return status;
}

fmi3Status fmu_fmi3ExitInitializationMode(fmi3Instance c) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_INITIALIZATION, "fmi3ExitInitializationMode: the instance is not in initialization mode: call fmi3EnterInitializationMode first");
  const fmu_status status = fmu_begun(m);
  if (status <= FMU_WARNING && m->events) m->state->mode = FMU_EVENTS;
  return fmi3_strict(status);
}

fmi3Status fmu_fmi3EnterEventMode(fmi3Instance c) {
  FMU_ENTER(c);
  if (m->exchange) return fmu_enter_events(m);
  FMU_NEED(m->events, "fmi3EnterEventMode: the instance was created with eventModeUsed = false: create it with eventModeUsed = true");
  FMU_NEED(m->state->mode == FMU_STEPPING, "fmi3EnterEventMode: the instance is not in step mode");
  m->state->mode = FMU_EVENTS;
  return fmi3OK;
}

fmi3Status fmu_fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals, fmi3Boolean *values,
                                    fmi3Boolean *next_defined, fmi3Float64 *next) {
  FMU_ENTER(c);
  FMU_NEED(again && terminate && nominals && values && next_defined && next, "fmi3UpdateDiscreteStates: an argument is NULL");
  FMU_NEED(m->state->mode == FMU_EVENTS, "fmi3UpdateDiscreteStates: the instance is not in event mode: call fmi3EnterEventMode first");
  *again = *nominals = *values = *next_defined = fmi3False, *next = 0.0;
  fmu_said said = {0};
  const fmu_status status = m->exchange ? fmu_update(m, &said) : fmu_after_event(m);
  if (!m->exchange) fmu_says_next(&said, tr_break_after(FMU_SIM(m->state), m->state->time));
  *terminate = m->state->failed != 0;
  *again = said.again != 0, *values = said.values != 0, *next_defined = said.defined != 0, *next = said.next;
  return fmi3_strict(status);
}

fmi3Status fmu_fmi3EnterStepMode(fmi3Instance c) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_EVENTS && !m->exchange, "fmi3EnterStepMode: only a co-simulation instance in event mode can enter step mode");
  m->state->mode = FMU_STEPPING;
  return fmi3_strict(fmu_after_event(m));
}

fmi3Status fmu_fmi3Terminate(fmi3Instance c) { FMU_CALL(c, fmu_terminate(m)); }

fmi3Status fmu_fmi3Reset(fmi3Instance c) {
  FMU_ENTER(c);
  fmu_defaults(m->state);
  return fmi3OK;
}

/* Call the host's function for intermediate updates, in which the host can get outputs and set inputs. Returns whether the host
 * requests an early return. The time of the early return replaces a later *until. */
static int fmi3_ask(fmu_instance *m, int may_return, double *until) {
  fmi3Boolean asked = fmi3False;
  fmi3Float64 when = m->state->time;
  m->state->mode = FMU_BETWEEN;
  ((fmi3IntermediateUpdateCallback)m->between)(m->host.environment, m->state->time, fmi3True, fmi3True, fmi3True, may_return != 0, &asked, &when);
  m->state->mode = FMU_STEPPING;
  if (!asked || !may_return) return 0;
  *until = fmin(*until, fmax(when, m->state->time));
  return 1;
}

/* Step to `target`, or to the next event if the host handles events. If the host requests intermediate updates, an update follows
 * each internal step. */
static fmu_status fmi3_step(fmu_instance *m, double target, double h) {
  fmu_status worst = FMU_OK;
  for (double end = target;;) {
    fmu_status status = fmu_set_off(m);
    if (status > FMU_WARNING) return status;
    double next = end;
    if (m->between && !MODEL->bounded) next = fmin(end, tr_next_end(FMU_SIM(m->state), fmu_limit(m->state, end, h)));
    const int moved = m->state->moved;
    if (m->ahead && !MODEL->bounded) status = fmu_go_to_event(m, next, h);
    else status = fmu_arrived(m, fmu_reach(m, next, next < end ? end - m->state->time : h), next);
    if (status > FMU_WARNING) return status;
    fmu_state *s = m->state;
    worst = status > worst ? status : worst;
    s->midway = s->time < target;
    if (s->midway) s->moved = moved;
    if (m->ahead && s->midway && (s->time < next || s->ticking || s->event)) return worst;
    if (m->between) fmi3_ask(m, m->early && s->time < end, &end);
    if (!(s->time < end)) return worst;
  }
}

fmi3Status fmu_fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_state_prior, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *reached) {
  FMU_ENTER(c);
  FMU_NEED(event && terminate && early && reached, "fmi3DoStep: an argument is NULL");
  *event = *early = fmi3False, *terminate = m->state->failed != 0, *reached = m->state->reached;
  FMU_NEED(m->state->mode == FMU_STEPPING, "fmi3DoStep: the instance is not in step mode: complete the initialization, or leave event mode by fmi3EnterStepMode; after fmi3Terminate, call fmi3Reset");
  fmu_status status = fmu_may_step(m, t, h);
  if (status != FMU_OK) return status;
  if (m->state->event) fmu_after_event(m);
  m->state->stride = fmax(m->state->stride, h);
  status = fmi3_step(m, t + h, m->state->stride);
  *terminate = m->state->failed != 0, *reached = m->state->reached;
  *early = status <= FMU_WARNING && m->state->midway;
  *event = status <= FMU_WARNING && m->events && (m->state->ticking || m->state->event);
  return status;
}

fmi3Status fmu_fmi3GetFMUState(fmi3Instance c, fmi3FMUState *out) { FMU_CALL(c, fmu_keep(m, out)); }
fmi3Status fmu_fmi3SetFMUState(fmi3Instance c, fmi3FMUState in) { FMU_CALL(c, fmu_go_back(m, in)); }
fmi3Status fmu_fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *in) { FMU_CALL(c, fmu_forget(m, in)); }
fmi3Status fmu_fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState in, size_t *bytes) { FMU_CALL(c, fmu_bytes_of(m, in, bytes)); }
fmi3Status fmu_fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState in, fmi3Byte out[], size_t bytes) { FMU_CALL(c, fmu_write(m, in, out, bytes)); }
fmi3Status fmu_fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte in[], size_t bytes, fmi3FMUState *out) { FMU_CALL(c, fmu_read(m, in, bytes, out)); }

fmi3Status fmu_fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t nu, const fmi3ValueReference known[],
                                        size_t nk, const fmi3Float64 seed[], size_t nseed, fmi3Float64 out[], size_t nout) {
  FMU_ENTER(c);
  FMU_ARRAYS(nu, unknown && out);
  FMU_ARRAYS(nk, known && seed);
  FMU_NEED(fmi3_numbers(known, nk) == nseed && fmi3_numbers(unknown, nu) == nout, "fmi3GetDirectionalDerivative: nSeed must be the number of values of all knowns, and nSensitivity that of all unknowns");
  return fmi3_strict(fmu_directional(m, unknown, nu, known, nk, seed, out));
}

fmi3Status fmu_fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t nu, const fmi3ValueReference known[],
                                    size_t nk, const fmi3Float64 seed[], size_t nseed, fmi3Float64 out[], size_t nout) {
  FMU_ENTER(c);
  FMU_ARRAYS(nu, unknown && seed);
  FMU_ARRAYS(nk, known && out);
  FMU_NEED(fmi3_numbers(unknown, nu) == nseed && fmi3_numbers(known, nk) == nout, "fmi3GetAdjointDerivative: nSeed must be the number of values of all unknowns, and nSensitivity that of all knowns");
  return fmi3_strict(fmu_adjoint(m, unknown, nu, known, nk, seed, out));
}

fmi3Status fmu_fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 order[], fmi3Float64 value[],
                                    size_t nvalue) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && order && value);
  FMU_NEED(fmi3_numbers(vr, n) == nvalue, "fmi3GetOutputDerivatives: nValues must be the number of values of all outputs, %zu, not %zu", fmi3_numbers(vr, n), nvalue);
  FMU_NEED(!m->state->event, "fmi3GetOutputDerivatives: an event is pending, before and after which derivatives differ: call fmi3UpdateDiscreteStates first");
  return fmi3_strict(fmu_output_derivatives(m, vr, n, order, value));
}
