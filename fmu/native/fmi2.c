/* The FMI 2.0 co-simulation functions. One translation unit; as long as the standard's list of functions. */
#include "instance.c"
#include "variables.c"
#include "derivatives.c"
#include "states.c"

#define LEAST_RTOL 1e-14 /* relative tolerances as everywhere: below, steps drown in round-off; above, they are no approximation */
#define MOST_RTOL 0.1

#if defined _WIN32
#define FMU_EXPORT __declspec(dllexport)
#else
#define FMU_EXPORT __attribute__((visibility("default")))
#endif
#define FMU_ENTER(c) \
  fmu_instance *m = c; \
  if (!m) return fmi2Error
#define FMU_NEED(condition, ...) \
  if (!(condition)) return fmu_log(m, fmi2Error, __VA_ARGS__)
#define FMU_ARRAYS(n, ...) FMU_NEED((n) == 0 || (__VA_ARGS__), "a NULL array was passed")
#define FMU_NONE(n, what) FMU_NEED((n) == 0, "there is no variable of type " what)

FMU_EXPORT const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
FMU_EXPORT const char *fmi2GetVersion(void) { return fmi2Version; }

FMU_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String category[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, category);
  FMU_NEED(fmu_choose_log(m, on != fmi2False, n, category), "fmi2SetDebugLogging: there is no such category");
  return fmi2OK;
}

FMU_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                         const fmi2CallbackFunctions *host, fmi2Boolean visible, fmi2Boolean logging) {
  (void)resources, (void)visible;
  if (!host) return NULL;
  fmu_instance probe = {.host = *host, .name = (char *)(name ? name : ""), .logging = FMU_EVERYTHING};
  const char *why = !name || !*name ? "the instance needs a name" : type != fmi2CoSimulation ? "this FMU is for co-simulation"
                  : !guid || strcmp(guid, MODEL->guid) ? "the GUID is not that of this FMU: the description is of another version" : NULL;
  if (why) {
    fmu_log(&probe, fmi2Error, "%s", why);
    return NULL;
  }
  fmu_state layout = {0};
  size_t bytes = fmu_layout(&layout);
  fmu_instance *m = fmu_allocate(host, sizeof *m);
  fmu_state *s = m ? fmu_allocate(host, bytes) : NULL;
  char *own = s ? fmu_allocate(host, strlen(name) + 1) : NULL;
  if (!own) {
    fmu_log(&probe, fmi2Error, "out of memory");
    fmu_free(host, s);
    fmu_free(host, m);
    return NULL;
  }
  strcpy(own, name);
  *m = (fmu_instance){.host = *host, .state = s, .name = own, .logging = logging ? FMU_EVERYTHING : 0};
  s->bytes = bytes;
  fmu_defaults(s);
  return m;
}

FMU_EXPORT void fmi2FreeInstance(fmi2Component c) {
  fmu_instance *m = c;
  if (!m) return;
  fmi2CallbackFunctions host = m->host;
  fmu_free(&host, m->state);
  fmu_free(&host, m->name);
  fmu_free(&host, m);
}

FMU_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                                          fmi2Boolean stop_defined, fmi2Real stop) {
  FMU_ENTER(c);
  fmu_state *s = m->state;
  FMU_NEED(s->mode == FMU_INSTANTIATED, "fmi2SetupExperiment comes first, before the initialization mode");
  FMU_NEED(isfinite(start), "the start time is not a finite number");
  FMU_NEED(!stop_defined || stop > start, "the stop time %g s is not after the start time %g s", stop, start);
  FMU_NEED(!tolerance_defined || tolerance > 0.0, "the tolerance %g is not positive", tolerance);
  s->start = s->time = s->reached = start;
  s->has_stop = stop_defined && isfinite(stop), s->stop = stop;
  s->has_tolerance = tolerance_defined != fmi2False, s->tolerance = fmin(fmax(tolerance, LEAST_RTOL), MOST_RTOL);
  s->ready = 0;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_INSTANTIATED, "fmi2EnterInitializationMode: reset first");
  m->state->mode = FMU_INITIALIZATION, m->state->ready = 0;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_INITIALIZATION, "fmi2ExitInitializationMode: not in the initialization mode");
  fmi2Status status = fmu_refresh(m);
  if (status > fmi2Warning) return status;
  const tr_settings *set = &FMU_SIM(m->state)->set;
  m->state->mode = FMU_STEPPING;
  fmu_tell(m, FMU_SAYS_PROGRESS, "the run begins at t = %.9g s: tolerance %g, %s", m->state->time, set->rtol, set->hfixed > 0.0 ? "fixed steps" : "error control");
  return status;
}

FMU_EXPORT fmi2Status fmi2Terminate(fmi2Component c) {
  FMU_ENTER(c);
  const tr_stats *said = &FMU_SIM(m->state)->stats;
  if (m->state->mode == FMU_STEPPING)
    fmu_tell(m, FMU_SAYS_PROGRESS, "the run ends at t = %.9g s: %ld steps, %ld rejected, %ld evaluations, %ld events", m->state->time, said->steps,
             said->rejected, said->rhs_evaluations, said->events);
  m->state->mode = FMU_TERMINATED;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2Reset(fmi2Component c) {
  FMU_ENTER(c);
  fmu_defaults(m->state);
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && value);
  return fmu_get(m, vr, n, value);
}

FMU_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && value);
  return fmu_set(m, vr, n, value);
}

FMU_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && value);
  return fmu_get_whole(m, vr, n, value);
}

FMU_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && value);
  return fmu_set_whole(m, vr, n, value);
}

#define FMU_NO_TYPE(Name, type) \
  FMU_EXPORT fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##Name value[]) { \
    FMU_ENTER(c); \
    (void)vr, (void)value; \
    FMU_NONE(n, type); \
    return fmi2OK; \
  } \
  FMU_EXPORT fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##Name value[]) { \
    FMU_ENTER(c); \
    (void)vr, (void)value; \
    FMU_NONE(n, type); \
    return fmi2OK; \
  }
FMU_NO_TYPE(Boolean, "Boolean")
FMU_NO_TYPE(String, "String")

FMU_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *out) {
  FMU_ENTER(c);
  FMU_NEED(out, "a NULL state was passed");
  if (!*out) *out = fmu_allocate(&m->host, m->state->bytes);
  FMU_NEED(*out, "out of memory");
  memcpy(*out, m->state, m->state->bytes);
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate in) {
  FMU_ENTER(c);
  FMU_NEED(in && fmu_is_state(in, m->state->bytes), "this is no state of this FMU");
  memcpy(m->state, in, m->state->bytes);
  fmu_adopt(m->state);
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *in) {
  FMU_ENTER(c);
  if (!in) return fmi2OK;
  fmu_free(&m->host, *in);
  *in = NULL;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate in, size_t *bytes) {
  FMU_ENTER(c);
  FMU_NEED(in && bytes, "a NULL argument was passed");
  *bytes = fmu_sealed_size(m);
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate in, fmi2Byte out[], size_t bytes) {
  FMU_ENTER(c);
  FMU_NEED(in && out && fmu_is_state(in, m->state->bytes), "this is no state of this FMU");
  FMU_NEED(bytes >= fmu_sealed_size(m), "%zu bytes are too few for a state of %zu", bytes, fmu_sealed_size(m));
  fmu_seal_state(in, out);
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte in[], size_t bytes, fmi2FMUstate *out) {
  FMU_ENTER(c);
  FMU_NEED(in && out, "a NULL argument was passed");
  fmu_state *s = fmu_allocate(&m->host, m->state->bytes);
  FMU_NEED(s, "out of memory");
  const char *wrong = fmu_unseal_state(s, m->state->bytes, in, bytes);
  if (wrong) {
    fmu_free(&m->host, s);
    return fmu_log(m, fmi2Error, "%s", wrong);
  }
  *out = s;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t nu,
                                                   const fmi2ValueReference known[], size_t nk, const fmi2Real seed[],
                                                   fmi2Real out[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(nu, unknown && out);
  FMU_ARRAYS(nk, known && seed);
  return fmu_directional(m, unknown, nu, known, nk, seed, out);
}

FMU_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                  const fmi2Integer order[], const fmi2Real value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && order && value);
  return fmu_set_derivatives(m, vr, n, order, value);
}

FMU_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                   const fmi2Integer order[], fmi2Real value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && order && value);
  return fmu_output_derivatives(m, vr, n, order, value);
}

FMU_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_state_prior) {
  FMU_ENTER(c);
  (void)no_state_prior;
  FMU_NEED(m->state->mode == FMU_STEPPING, "fmi2DoStep: the initialization is not complete, or the run was terminated");
  return m->state->stepped = fmu_step(m, t, h);
}

FMU_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
  FMU_ENTER(c);
  return fmu_log(m, fmi2Error, "fmi2CancelStep: steps do not run in the background");
}

FMU_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
  FMU_ENTER(c);
  FMU_NEED(value && kind == fmi2DoStepStatus, "fmi2GetStatus: no such status");
  *value = m->state->stepped;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
  FMU_ENTER(c);
  FMU_NEED(value && kind == fmi2LastSuccessfulTime, "fmi2GetRealStatus: no such status");
  *value = m->state->reached;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
  FMU_ENTER(c);
  (void)kind, (void)value;
  return fmu_log(m, fmi2Error, "fmi2GetIntegerStatus: no such status");
}

FMU_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
  FMU_ENTER(c);
  FMU_NEED(value && kind == fmi2Terminated, "fmi2GetBooleanStatus: no such status");
  *value = m->state->failed ? fmi2True : fmi2False;
  return fmi2OK;
}

FMU_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
  FMU_ENTER(c);
  FMU_NEED(value && kind == fmi2PendingStatus, "fmi2GetStringStatus: no such status");
  *value = "";
  return fmi2OK;
}
