/* The functions of an exported model as a plain C library (documented in ``mechanism.h``). The functions allocate no memory and
 * print nothing. The caller owns the struct with all data. The struct has the layout of an FMU's memory block. */

/* Does not compile if the bounds with which the struct's size was computed are too small. */
typedef char mechanism_has_room[sizeof(fmu_state) <= MECHANISM_SHELL && sizeof(fmu_input) <= MECHANISM_INPUT ? 1 : -1];

static fmu_instance library_instance(mechanism *m) {
  fmu_instance instance;
  memset(&instance, 0, sizeof instance);
  instance.state = (fmu_state *)m->memory;
  return instance;
}

int fmu_mechanism_init(mechanism *m) {
  fmu_state layout;
  memset(&layout, 0, sizeof layout);
  const size_t bytes = fmu_layout(&layout);
  if (bytes > sizeof m->memory) return MECHANISM_ERROR;
  fmu_state *s = (fmu_state *)m->memory;
  s->bytes = bytes;
  fmu_defaults(s);
  return MECHANISM_OK;
}

int fmu_mechanism_set(mechanism *m, int variable, double value) {
  fmu_instance instance = library_instance(m);
  const fmu_reference reference = (fmu_reference)variable;
  return (int)fmu_set(&instance, &reference, 1, &value);
}

double fmu_mechanism_get(mechanism *m, int variable) {
  fmu_instance instance = library_instance(m);
  const fmu_reference reference = (fmu_reference)variable;
  double value = NAN;
  return fmu_get(&instance, &reference, 1, &value) > FMU_WARNING ? NAN : value;
}

int fmu_mechanism_start(mechanism *m, double time) {
  fmu_instance instance = library_instance(m);
  if (instance.state->mode != FMU_INSTANTIATED) return MECHANISM_ERROR;
  fmu_status status = fmu_agree(&instance, 0, 0.0, time, 0, 0.0);
  if (status > FMU_WARNING) return (int)status;
  instance.state->mode = FMU_INITIALIZATION;
  status = fmu_begun(&instance);
  if (status > FMU_WARNING) instance.state->mode = FMU_INSTANTIATED;
  return (int)status;
}

int fmu_mechanism_step(mechanism *m, double length) {
  fmu_instance instance = library_instance(m);
  if (instance.state->mode != FMU_STEPPING) return MECHANISM_ERROR;
  fmu_adopt(instance.state);
  return (int)fmu_step(&instance, instance.state->time, length);
}

double fmu_mechanism_time(const mechanism *m) { return ((const fmu_state *)m->memory)->reached; }

const char *fmu_mechanism_why(const mechanism *m) {
  const fmu_state *s = (const fmu_state *)m->memory;
  return s->failed ? fmu_outcome_of(s->failed, s->why)->name : "";
}
