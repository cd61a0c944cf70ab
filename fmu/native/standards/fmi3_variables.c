/* Access to variables in FMI 3.0. Variables have the value references of FMI 2.0; an array has the reference of its first value.
 * Further references belong to the time, to each clock with the time and the number of its ticks, and to the joint of the last
 * event. */

#define FMI3_NONE (-1)

/* The type of the variable at a reference; FMI3_NONE if there is no variable. */
static int fmi3_type(fmi3ValueReference r) {
  const unsigned all = (unsigned)fmu_count(), clocks = (unsigned)MODEL->clocks->count;
  if (r < all) return MODEL->width[r] ? MODEL->type[r] : FMI3_NONE;
  if (fmu_is_exchanged(r)) return FMU_FLOAT64;
  r -= all;
  if (r == 0) return FMU_FLOAT64;
  r -= 1;
  return r < clocks ? FMU_CLOCK : r < 2 * clocks ? FMU_FLOAT64 : r < 3 * clocks ? FMU_UINT64 : r == 3 * clocks && MODEL->clocks->last >= 0 ? FMU_STRING : FMI3_NONE;
}

/* Total number of values of the n variables. */
static size_t fmi3_numbers(const fmi3ValueReference vr[], size_t n) {
  size_t all = 0;
  for (size_t i = 0; i < n; ++i) all += vr[i] < (unsigned)fmu_count() ? (size_t)MODEL->width[vr[i]] : 1;
  return all;
}

/* Whether a host can access a variable between communication points. Only continuous inputs and outputs allow this. */
static int fmi3_is_between(fmi3ValueReference r) {
  if (r >= (unsigned)(MODEL->outputs + fmu_all_inputs()) || fmi3_type(r) != FMU_FLOAT64) return 0;
  return (int)r >= MODEL->outputs || MODEL->slope[r] != -2;
}

/* Check the type of n variables and the number of values in the call. */
static fmu_status fmi3_are(const fmu_instance *m, const fmi3ValueReference vr[], size_t n, int type, const char *name, size_t nvalues) {
  for (size_t i = 0; i < n; ++i)
    if (fmi3_type(vr[i]) != type) return fmu_log(m, FMU_ERROR, "value reference %u: there is no variable of type %s with this reference", vr[i], name);
  if (fmi3_numbers(vr, n) != nvalues)
    return fmu_log(m, FMU_ERROR, "nValues must be the number of values of all variables, %zu, not %zu", fmi3_numbers(vr, n), nvalues);
  return FMU_OK;
}

/* The value of a variable that FMI 2.0 lacks. */
static double fmi3_own_number(const fmu_state *s, fmi3ValueReference r) {
  const unsigned clocks = (unsigned)MODEL->clocks->count;
  r -= (unsigned)fmu_count();
  if (r == 0) return s->time;
  r -= 1 + clocks;
  return r < clocks ? FMU_TICKS(s)[r].time : FMU_TICKS(s)[r - clocks].count;
}

#define FMI3_GET(Name, kind) \
  fmi3Status fmu_fmi3Get##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##Name value[], size_t nvalues) { \
    FMU_ENTER(c); \
    FMU_ARRAYS(n, vr && value); \
    fmu_status status = fmi3_are(m, vr, n, kind, #Name, nvalues); \
    for (size_t i = 0; i < n && status <= FMU_WARNING; ++i) { \
      const int own = vr[i] >= (unsigned)fmu_count(), first = (int)vr[i]; \
      if (!own) status = fmu_fresh(m, vr[i]); \
      if (own && fmu_is_exchanged(vr[i])) { \
        double number = 0.0; \
        status = fmu_exchanged(m, vr[i], &number); \
        *value++ = (fmi3##Name)number; \
      } \
      else if (own) *value++ = (fmi3##Name)fmi3_own_number(m->state, vr[i]); \
      else for (int k = 0; k < MODEL->width[first]; ++k) *value++ = (fmi3##Name)fmu_value(m->state, first + k); \
    } \
    return status; \
  }

FMI3_GET(Float64, FMU_FLOAT64)
FMI3_GET(Int32, FMU_INT32)
FMI3_GET(Int64, FMU_INT64)
FMI3_GET(UInt64, FMU_UINT64)
FMI3_GET(Boolean, FMU_BOOLEAN)

fmi3Status fmu_fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[], size_t nvalues) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && value);
  const fmu_status status = fmi3_are(m, vr, n, FMU_FLOAT64, "Float64", nvalues);
  return status == FMU_OK ? fmu_set(m, vr, n, value) : status;
}

/* Define a function that sets integers. The function does not treat arrays, because no settable integer is an array. Outputs cannot
 * be set. */
#define FMI3_SET(Name, kind) \
  fmi3Status fmu_fmi3Set##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##Name value[], size_t nvalues) { \
    FMU_ENTER(c); \
    FMU_ARRAYS(n, vr && value); \
    fmu_status status = fmi3_are(m, vr, n, kind, #Name, nvalues); \
    for (size_t i = 0; i < n && status == FMU_OK; ++i) { \
      FMU_NEED(vr[i] >= (unsigned)MODEL->outputs, "value reference %u: an output cannot be set", vr[i]); \
      const double x = (double)value[i]; \
      status = fmu_set(m, vr + i, 1, &x); \
    } \
    return status; \
  }

FMI3_SET(Int32, FMU_INT32)
FMI3_SET(Int64, FMU_INT64)
FMI3_SET(UInt64, FMU_UINT64)
FMI3_SET(Boolean, FMU_BOOLEAN)

#define FMI3_NO_ACCESS(call, Name, array) \
  fmi3Status fmu_fmi3##call##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, array value[], size_t nvalues) { \
    FMU_ENTER(c); \
    (void)vr, (void)value, (void)nvalues; \
    FMU_NONE(n, #Name); \
    return fmi3OK; \
  }
#define FMI3_NO_TYPE(Name) FMI3_NO_ACCESS(Get, Name, fmi3##Name) FMI3_NO_ACCESS(Set, Name, const fmi3##Name)

FMI3_NO_TYPE(Float32)
FMI3_NO_TYPE(Int8)
FMI3_NO_TYPE(UInt8)
FMI3_NO_TYPE(Int16)
FMI3_NO_TYPE(UInt16)
FMI3_NO_TYPE(UInt32)

fmi3Status fmu_fmi3GetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3String value[], size_t nvalues) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && value);
  fmu_status status = fmi3_are(m, vr, n, FMU_STRING, "String", nvalues);
  if (n && status == FMU_OK) status = fmu_fresh(m, (unsigned)MODEL->clocks->last);
  for (size_t i = 0; i < n && status <= FMU_WARNING; ++i) value[i] = fmu_joint(fmu_value(m->state, MODEL->clocks->last));
  return status;
}

fmi3Status fmu_fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3String value[], size_t nvalues) {
  FMU_ENTER(c);
  FMU_NEED(n == 0, "fmi3SetString: this FMU has no String variable that can be set");
  return fmi3OK;
}

/* A clock stays active until the host reads the clock or has handled the event. */
fmi3Status fmu_fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock value[]) {
  FMU_ENTER(c);
  FMU_ARRAYS(n, vr && value);
  FMU_NEED(m->state->mode == FMU_EVENTS, "fmi3GetClock: the instance is not in event mode: call fmi3EnterEventMode first");
  const fmu_status status = fmi3_are(m, vr, n, FMU_CLOCK, "Clock", n);
  for (size_t i = 0; i < n && status == FMU_OK; ++i) {
    fmu_tick *tick = FMU_TICKS(m->state) + (vr[i] - (unsigned)fmu_count() - 1);
    value[i] = tick->active != 0.0, tick->active = 0.0;
  }
  return status;
}
