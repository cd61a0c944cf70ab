/* The FMI 2.0 functions that are only for model exchange. */

fmi2Status fmu_fmi2EnterEventMode(fmi2Component c) { FMU_CALL(c, fmu_enter_events(m)); }

fmi2Status fmu_fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
  FMU_ENTER(c);
  FMU_NEED(info, "fmi2NewDiscreteStates: the argument is NULL");
  fmu_said said;
  const fmu_status status = fmu_update(m, &said);
  *info = (fmi2EventInfo){.newDiscreteStatesNeeded = said.again, .terminateSimulation = said.terminate, .valuesOfContinuousStatesChanged = said.values,
                          .nextEventTimeDefined = said.defined, .nextEventTime = said.next};
  return status;
}

fmi2Status fmu_fmi2EnterContinuousTimeMode(fmi2Component c) { FMU_CALL(c, fmu_enter_continuous(m)); }

fmi2Status fmu_fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_state_prior, fmi2Boolean *event, fmi2Boolean *terminate) {
  FMU_ENTER(c);
  FMU_NEED(event && terminate, "fmi2CompletedIntegratorStep: an argument is NULL");
  *event = *terminate = fmi2False;
  return fmu_completed(m, event, terminate);
}

fmi2Status fmu_fmi2SetTime(fmi2Component c, fmi2Real time) { FMU_CALL(c, fmu_set_time(m, time)); }
fmi2Status fmu_fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) { FMU_CALL(c, fmu_set_states(m, x, n)); }
fmi2Status fmu_fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) { FMU_CALL(c, fmu_get_rates(m, dx, n)); }
fmi2Status fmu_fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { FMU_CALL(c, fmu_get_indicators(m, z, n)); }
fmi2Status fmu_fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { FMU_CALL(c, fmu_get_states(m, x, n)); }
fmi2Status fmu_fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { FMU_CALL(c, fmu_get_nominals(m, x, n)); }
