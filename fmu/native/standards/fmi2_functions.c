/* The FMI 2.0 functions, except those that are only for model exchange. */

const char *fmu_fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmu_fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmu_fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String category[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, category);
  FMU_NEED(fmu_choose_log(m, on != fmi2False, n, category), "fmi2SetDebugLogging: there is no such category");
  return fmi2OK;
}

/* Pass a message to the host. "%" is replaced by a space, because the host would interpret "%" as a format. */
static void fmi2_say(const fmu_host *host, const char *name, fmu_status status, const char *category, char *text) {
  for (char *c = text; *c; ++c)
    if (*c == '%') *c = ' ';
  ((fmi2CallbackLogger)host->logger)(host->environment, name, (fmi2Status)status, category, text);
}

fmi2Component fmu_fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                         const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
  if (!functions) return NULL;
  const fmu_host host = {.say = functions->logger ? fmi2_say : NULL,
                         .logger = (void (*)(void))functions->logger, .environment = functions->componentEnvironment};
  const int exchange = type == fmi2ModelExchange;
  fmu_instance *m = fmu_create(&host, name, fmu_refusal(exchange ? FMU_EXCHANGE : FMU_COSIMULATION, guid), logging);
  if (m) m->exchange = exchange;
  return m;
}

void fmu_fmi2FreeInstance(fmi2Component c) { fmu_destroy(c); }

fmi2Status fmu_fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                                          fmi2Boolean stop_defined, fmi2Real stop) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_INSTANTIATED, "fmi2SetupExperiment: call it before fmi2EnterInitializationMode; after a run, call fmi2Reset first");
  return fmu_agree(m, tolerance_defined, tolerance, start, stop_defined, stop);
}

fmi2Status fmu_fmi2EnterInitializationMode(fmi2Component c) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_INSTANTIATED, "fmi2EnterInitializationMode: the instance is already initialized: call fmi2Reset first");
  m->state->mode = FMU_INITIALIZATION, m->state->ready = 0;
  return fmi2OK;
}

fmi2Status fmu_fmi2ExitInitializationMode(fmi2Component c) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_INITIALIZATION, "fmi2ExitInitializationMode: the instance is not in initialization mode: call fmi2EnterInitializationMode first");
  return fmu_begun(m);
}

fmi2Status fmu_fmi2Terminate(fmi2Component c) { FMU_CALL(c, fmu_terminate(m)); }

fmi2Status fmu_fmi2Reset(fmi2Component c) {
  FMU_ENTER(c);
  fmu_defaults(m->state);
  return fmi2OK;
}

/* Define the functions that get and set n variables of a type. */
#define FMI2_VARIABLES(Name, work_get, work_set) \
  fmi2Status fmu_fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##Name value[]) { \
    FMU_ENTER(c); \
    FMU_ARRAYS(n, vr && value); \
    return work_get(m, vr, n, value); \
  } \
  fmi2Status fmu_fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##Name value[]) { \
    FMU_ENTER(c); \
    FMU_ARRAYS(n, vr && value); \
    return work_set(m, vr, n, value); \
  }

/* Define a function for variables of a type that does not occur in this FMU. */
#define FMI2_NO_TYPE(call, Name, array) \
  fmi2Status fmu_##call(fmi2Component c, const fmi2ValueReference vr[], size_t n, array value[]) { \
    FMU_ENTER(c); \
    (void)vr, (void)value; \
    FMU_NONE(n, Name); \
    return fmi2OK; \
  }

FMI2_VARIABLES(Real, fmu_get, fmu_set)
FMI2_VARIABLES(Integer, fmu_get_whole, fmu_set_whole)
FMI2_NO_TYPE(fmi2GetBoolean, "Boolean", fmi2Boolean)
FMI2_NO_TYPE(fmi2SetBoolean, "Boolean", const fmi2Boolean)
FMI2_NO_TYPE(fmi2GetString, "String", fmi2String)
FMI2_NO_TYPE(fmi2SetString, "String", const fmi2String)

fmi2Status fmu_fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *out) { FMU_CALL(c, fmu_keep(m, out)); }
fmi2Status fmu_fmi2SetFMUstate(fmi2Component c, fmi2FMUstate in) { FMU_CALL(c, fmu_go_back(m, in)); }
fmi2Status fmu_fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *in) { FMU_CALL(c, fmu_forget(m, in)); }
fmi2Status fmu_fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate in, size_t *bytes) { FMU_CALL(c, fmu_bytes_of(m, in, bytes)); }

fmi2Status fmu_fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate in, fmi2Byte out[], size_t bytes) {
  FMU_CALL(c, fmu_write(m, in, out, bytes));
}

fmi2Status fmu_fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte in[], size_t bytes, fmi2FMUstate *out) {
  FMU_CALL(c, fmu_read(m, in, bytes, out));
}

fmi2Status fmu_fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t nu,
                                                   const fmi2ValueReference known[], size_t nk, const fmi2Real seed[],
                                                   fmi2Real out[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(nu, unknown && out);
  FMU_ARRAYS(nk, known && seed);
  return fmu_directional(m, unknown, nu, known, nk, seed, out);
}

fmi2Status fmu_fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                  const fmi2Integer order[], const fmi2Real value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && order && value);
  return fmu_set_derivatives(m, vr, n, order, value);
}

fmi2Status fmu_fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                   const fmi2Integer order[], fmi2Real value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && order && value);
  return fmu_output_derivatives(m, vr, n, order, value);
}

fmi2Status fmu_fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_state_prior) {
  FMU_ENTER(c);
  FMU_NEED(m->state->mode == FMU_STEPPING, "fmi2DoStep: the instance is not in step mode: complete the initialization first; after fmi2Terminate, call fmi2Reset");
  return m->state->stepped = fmu_step(m, t, h);
}

fmi2Status fmu_fmi2CancelStep(fmi2Component c) { FMU_CALL(c, fmu_log(m, FMU_ERROR, "fmi2CancelStep: there is no step to cancel, because fmi2DoStep returns only after its step")); }

/* Define fmi2Get…Status for one type of value. This FMU has one kind of status for each type. */
#define FMI2_STATUS(Name, type, known, answer) \
  fmi2Status fmu_fmi2##Name(fmi2Component c, const fmi2StatusKind kind, type *value) { \
    FMU_ENTER(c); \
    FMU_NEED(value && kind == known, "fmi2" #Name ": the only status of this type is " #known ", and its value must not be NULL"); \
    *value = answer; \
    return fmi2OK; \
  }

FMI2_STATUS(GetStatus, fmi2Status, fmi2DoStepStatus, m->state->stepped)
FMI2_STATUS(GetRealStatus, fmi2Real, fmi2LastSuccessfulTime, m->state->reached)
FMI2_STATUS(GetBooleanStatus, fmi2Boolean, fmi2Terminated, m->state->failed ? fmi2True : fmi2False)
FMI2_STATUS(GetStringStatus, fmi2String, fmi2PendingStatus, "")

fmi2Status fmu_fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
  FMU_CALL(c, fmu_log(m, FMU_ERROR, "fmi2GetIntegerStatus: this FMU has no status of type Integer"));
}
