/* Functions of FMI 3.0 that this FMU does not support. Each returns an error and logs the reason. */

static const char *const fmi3_no_binary = "this FMU has no variables of type Binary";
static const char *const fmi3_no_dependencies = "this FMU states dependencies only in modelDescription.xml (ModelStructure): read them there";
static const char *const fmi3_no_structure = "this FMU has no structural parameters: there is nothing to configure";
static const char *const fmi3_no_intervals = "the clocks of this FMU are triggered by events, so they have neither intervals nor shifts";

static fmu_status fmi3_refuse(const fmu_instance *m, const char *call, const char *why) { return fmu_log(m, FMU_ERROR, "%s: %s", call, why); }

fmi3Status fmu_fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[], size_t nvalues) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3GetBinary", fmi3_no_binary));
}

fmi3Status fmu_fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[], const fmi3Binary values[], size_t nvalues) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3SetBinary", fmi3_no_binary));
}

fmi3Status fmu_fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3SetClock", "the clocks of this FMU are outputs: read them with fmi3GetClock"));
}

fmi3Status fmu_fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *count) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3GetNumberOfVariableDependencies", fmi3_no_dependencies));
}

fmi3Status fmu_fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t elements[], fmi3ValueReference known[],
                                       size_t known_elements[], fmi3DependencyKind kinds[], size_t count) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3GetVariableDependencies", fmi3_no_dependencies));
}

fmi3Status fmu_fmi3EnterConfigurationMode(fmi3Instance c) { FMU_CALL(c, fmi3_refuse(m, "fmi3EnterConfigurationMode", fmi3_no_structure)); }

fmi3Status fmu_fmi3ExitConfigurationMode(fmi3Instance c) { FMU_CALL(c, fmi3_refuse(m, "fmi3ExitConfigurationMode", fmi3_no_structure)); }

fmi3Status fmu_fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3GetIntervalDecimal", fmi3_no_intervals));
}

fmi3Status fmu_fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3GetIntervalFraction", fmi3_no_intervals));
}

fmi3Status fmu_fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 shifts[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3GetShiftDecimal", fmi3_no_intervals));
}

fmi3Status fmu_fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3GetShiftFraction", fmi3_no_intervals));
}

fmi3Status fmu_fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 intervals[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3SetIntervalDecimal", fmi3_no_intervals));
}

fmi3Status fmu_fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3SetIntervalFraction", fmi3_no_intervals));
}

fmi3Status fmu_fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 shifts[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3SetShiftDecimal", fmi3_no_intervals));
}

fmi3Status fmu_fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[]) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3SetShiftFraction", fmi3_no_intervals));
}

fmi3Status fmu_fmi3EvaluateDiscreteStates(fmi3Instance c) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3EvaluateDiscreteStates", "call fmi3UpdateDiscreteStates instead, which also evaluates the discrete states"));
}

fmi3Status fmu_fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clockReference, fmi3Float64 activationTime) {
  FMU_CALL(c, fmi3_refuse(m, "fmi3ActivateModelPartition", "this FMU has no model partitions: it is not for scheduled execution"));
}

fmi3Instance fmu_fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
  if (logger) logger(environment, fmi3Error, "logStatusError", "fmi3InstantiateScheduledExecution: this FMU is not for scheduled execution");
  return NULL;
}
