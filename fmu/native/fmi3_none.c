/* What FMI 3.0 has and this FMU does not: each says so. */

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, size_t valueSizes[],
                         fmi3Binary values[], size_t nValues) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)valueSizes, (void)values, (void)nValues;
  return fmu_log(m, FMU_ERROR, "fmi3GetBinary: there is no variable of type Binary");
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, const size_t valueSizes[],
                         const fmi3Binary values[], size_t nValues) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)valueSizes, (void)values, (void)nValues;
  return fmu_log(m, FMU_ERROR, "fmi3SetBinary: there is no variable of type Binary");
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, const fmi3Clock values[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)values;
  return fmu_log(m, FMU_ERROR, "fmi3SetClock: its clocks are outputs, which tick by themselves");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference valueReference, size_t* nDependencies) {
  FMU_ENTER(c);
  (void)valueReference, (void)nDependencies;
  return fmu_log(m, FMU_ERROR, "fmi3GetNumberOfVariableDependencies: dependencies are those of the description, not element by element");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
                                       fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
                                       fmi3DependencyKind dependencyKinds[], size_t nDependencies) {
  FMU_ENTER(c);
  (void)dependent, (void)elementIndicesOfDependent, (void)independents, (void)elementIndicesOfIndependents, (void)dependencyKinds, (void)nDependencies;
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

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
  return fmu_log(m, FMU_ERROR, "fmi3GetIntervalDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions, (void)qualifiers;
  return fmu_log(m, FMU_ERROR, "fmi3GetIntervalFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3Float64 shifts[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)shifts;
  return fmu_log(m, FMU_ERROR, "fmi3GetShiftDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3UInt64 counters[],
                                fmi3UInt64 resolutions[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
  return fmu_log(m, FMU_ERROR, "fmi3GetShiftFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                  const fmi3Float64 intervals[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)intervals;
  return fmu_log(m, FMU_ERROR, "fmi3SetIntervalDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                   const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
  return fmu_log(m, FMU_ERROR, "fmi3SetIntervalFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, const fmi3Float64 shifts[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)shifts;
  return fmu_log(m, FMU_ERROR, "fmi3SetShiftDecimal: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
  FMU_ENTER(c);
  (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
  return fmu_log(m, FMU_ERROR, "fmi3SetShiftFraction: its clocks are triggered: they have no intervals");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
  FMU_ENTER(c);
  return fmu_log(m, FMU_ERROR, "fmi3EvaluateDiscreteStates: fmi3UpdateDiscreteStates does all there is to do");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clockReference, fmi3Float64 activationTime) {
  FMU_ENTER(c);
  (void)clockReference, (void)activationTime;
  return fmu_log(m, FMU_ERROR, "fmi3ActivateModelPartition: this FMU is for co-simulation");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
  if (logger) logger(environment, fmi3Error, "logStatusError", "this FMU is for co-simulation");
  return NULL;
}
