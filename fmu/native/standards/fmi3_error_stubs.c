/* Functions of FMI 3.0 that this FMU does not support: each returns an error. */

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[], size_t nvalues) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3GetBinary: there is no variable of type Binary");
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[], const fmi3Binary values[], size_t nvalues) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3SetBinary: there is no variable of type Binary");
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3SetClock: its clocks are outputs, which tick by themselves");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t* count) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3GetNumberOfVariableDependencies: dependencies are those of the description, not element by element");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t elements[], fmi3ValueReference known[],
                                       size_t known_elements[], fmi3DependencyKind kinds[], size_t count) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3GetVariableDependencies: dependencies are those of the description, not element by element");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3EnterConfigurationMode: this FMU has no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3ExitConfigurationMode: this FMU has no structural parameters");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3GetIntervalDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3GetIntervalFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 shifts[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3GetShiftDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3GetShiftFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 intervals[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3SetIntervalDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3SetIntervalFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 shifts[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3SetShiftDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[]) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3SetShiftFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3EvaluateDiscreteStates: fmi3UpdateDiscreteStates does all there is to do");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clockReference, fmi3Float64 activationTime) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3ActivateModelPartition: this FMU is for co-simulation");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
  if (logger) logger(environment, fmi3Error, "logStatusError", "this FMU is for co-simulation");
  return NULL;
}
