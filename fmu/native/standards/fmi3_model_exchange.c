/* The FMI 3.0 functions that are only for model exchange. */

fmi3Instance fmu_fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger) {
  const fmu_host host = {.say = logger ? fmi3_say : NULL, .logger = (void (*)(void))logger, .environment = environment};
  fmu_instance *m = fmu_create(&host, name, fmu_refusal(FMU_EXCHANGE, token), logging);
  if (m) m->exchange = 1;
  return m;
}

fmi3Status fmu_fmi3EnterContinuousTimeMode(fmi3Instance c) { FMU_CALL(c, fmi3_strict(fmu_enter_continuous(m))); }

fmi3Status fmu_fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_state_prior, fmi3Boolean *event, fmi3Boolean *terminate) {
  FMU_ENTER(c);
  int due = 0, ends = 0;
  FMU_NEED(event && terminate, "fmi3CompletedIntegratorStep: an argument is NULL");
  const fmu_status status = fmu_completed(m, &due, &ends);
  *event = due != 0, *terminate = ends != 0;
  return fmi3_strict(status);
}

fmi3Status fmu_fmi3SetTime(fmi3Instance c, fmi3Float64 time) { FMU_CALL(c, fmu_set_time(m, time)); }
fmi3Status fmu_fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) { FMU_CALL(c, fmu_set_states(m, x, n)); }
fmi3Status fmu_fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) { FMU_CALL(c, fmu_get_rates(m, dx, n)); }
fmi3Status fmu_fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) { FMU_CALL(c, fmu_get_indicators(m, z, n)); }
fmi3Status fmu_fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { FMU_CALL(c, fmi3_strict(fmu_get_states(m, x, n))); }
fmi3Status fmu_fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { FMU_CALL(c, fmi3_strict(fmu_get_nominals(m, x, n))); }

/* Return one of the numbers of model exchange. call: name of the function. */
static fmi3Status fmi3_count(const fmu_instance *m, const char *call, int count, size_t *n) {
  FMU_NEED(n, "%s: the argument for the number is NULL", call);
  FMU_NEED(m->exchange, "%s: this instance is for co-simulation", call);
  *n = (size_t)count;
  return fmi3OK;
}

fmi3Status fmu_fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { FMU_CALL(c, fmi3_count(m, "fmi3GetNumberOfEventIndicators", fmu_indicators(), n)); }
fmi3Status fmu_fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) { FMU_CALL(c, fmi3_count(m, "fmi3GetNumberOfContinuousStates", fmu_states(), n)); }
