/* The FMI 3.0 functions that are only for model exchange. */

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger) {
  const fmu_host host = {.say = logger ? fmi3_say : NULL, .logger = (void (*)(void))logger, .environment = environment};
  fmu_instance *m = fmu_create(&host, name, fmu_refusal(FMU_EXCHANGE, token), logging);
  if (m) m->exchange = 1;
  return m;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
  FMU_ENTER(c);
  FMI3_STRICT(fmu_enter_continuous(m));
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_state_prior, fmi3Boolean *event, fmi3Boolean *terminate) {
  FMU_ENTER(c);
  int due = 0, ends = 0;
  FMU_NEED(event && terminate, "fmi3CompletedIntegratorStep: a NULL argument was passed");
  const fmu_status status = fmu_completed(m, &due, &ends);
  *event = due != 0, *terminate = ends != 0;
  return status == FMU_DISCARD ? FMU_ERROR : status;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) { FMU_CALL(c, fmu_set_time(m, time)); }
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) { FMU_CALL(c, fmu_set_states(m, x, n)); }
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) { FMU_CALL(c, fmu_get_rates(m, dx, n)); }
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) { FMU_CALL(c, fmu_get_indicators(m, z, n)); }

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
  FMU_ENTER(c);
  FMI3_STRICT(fmu_get_states(m, x, n));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
  FMU_ENTER(c);
  FMI3_STRICT(fmu_get_nominals(m, x, n));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
  FMU_ENTER(c);
  FMU_NEED(n, "fmi3GetNumberOfEventIndicators: a NULL argument was passed");
  FMU_NEED(m->exchange, "fmi3GetNumberOfEventIndicators: this instance is for co-simulation");
  *n = (size_t)fmu_indicators();
  return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
  FMU_ENTER(c);
  FMU_NEED(n, "fmi3GetNumberOfContinuousStates: a NULL argument was passed");
  FMU_NEED(m->exchange, "fmi3GetNumberOfContinuousStates: this instance is for co-simulation");
  *n = (size_t)fmu_states();
  return fmi3OK;
}
